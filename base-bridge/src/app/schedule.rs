//! What comes round at a rate.

/// A rate.
#[derive(Clone, Debug)]
pub struct Rate {
    period: Option<f64>,
    next: f64,
}

impl Rate {
    /// So many times a second; 0: never.
    pub fn new(hertz: f64) -> Self {
        Self {
            period: (hertz > 0.0).then(|| 1.0 / hertz),
            next: 0.0,
        }
    }

    /// True when it is due, once. What was missed is left out. `slack` s too early is in time: of rows at the same rate each second one would be left out.
    pub fn is_due(&mut self, now: f64, slack: f64) -> bool {
        let Some(period) = self.period else {
            return false;
        };
        let due = now + slack >= self.next;
        if due {
            self.next = (self.next + period).max(now + period / 2.0);
        }
        due
    }

    /// When it is due next.
    pub fn next(&self) -> f64 {
        if self.period.is_some() {
            self.next
        } else {
            f64::INFINITY
        }
    }

    /// At once.
    pub fn hurry(&mut self) {
        self.next = 0.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_comes_round_as_often_as_it_should() {
        for (hertz, expected) in [(50.0, 500), (10.0, 100), (3.0, 30), (0.0, 0)] {
            let mut rate = Rate::new(hertz);
            let due = (0..500)
                .filter(|row| {
                    let jitter = if row % 3 == 0 { 0.004 } else { 0.0 };
                    rate.is_due(f64::from(*row) * 0.02 + jitter, 0.01)
                })
                .count();
            assert!((due as i32 - expected).abs() <= 2, "{hertz}: {due}");
        }
    }
}
