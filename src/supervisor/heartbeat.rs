//! The heartbeat of whoever is to be alive besides the tick.

/// Tells a task that is busy from one that hangs. The tick asks it whether to feed the watchdog.
#[derive(Clone, Copy, Debug)]
pub struct Heartbeat {
    deadline: u32,
    silent: u32,
}

impl Heartbeat {
    /// The task may be silent for `deadline` ticks.
    #[must_use]
    pub const fn new(deadline: u32) -> Self {
        Self {
            deadline,
            silent: 0,
        }
    }

    /// Notes a tick, and whether the task has shown a sign of life since the last one. True as long as it is not overdue.
    pub fn beat(&mut self, alive: bool) -> bool {
        self.silent = if alive {
            0
        } else {
            self.silent.saturating_add(1)
        };
        self.silent <= self.deadline
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn overdue_after_the_deadline_and_not_before() {
        let mut heartbeat = Heartbeat::new(3);
        for _ in 0..3 {
            assert!(heartbeat.beat(false));
        }
        assert!(!heartbeat.beat(false));
        assert!(heartbeat.beat(true));
        assert!(heartbeat.beat(false));
    }
}
