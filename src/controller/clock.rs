//! From the clock's instants to elapsed time and cycles of the reference.

use crate::time::{Duration, Instant};

/// The most cycles that are made up for after a gap; after a longer one the reference goes on from where it was.
const MAX_STEPS: u32 = 20;

/// Counts nominal periods. The reference advances by whole ones, whatever the ticks' jitter: a tick that is 30 % late is still one step, and a
/// missed one makes the next two.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clock {
    period: i32,
    last: Option<u32>,
    /// When the last step was due.
    nominal: u32,
}

/// What has passed since the last tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Elapsed {
    /// Time by the clock, s; 0 at the first tick, and when the clock did not advance.
    pub seconds: f32,
    /// Nominal periods.
    pub steps: u32,
}

impl Clock {
    /// A clock whose ticks come every `period`, between zero and a minute.
    #[must_use]
    pub fn new(period: Duration) -> Self {
        Self {
            period: period.ticks() as i32,
            last: None,
            nominal: 0,
        }
    }

    /// Notes a tick.
    pub fn tick(&mut self, now: Instant) -> Elapsed {
        // The low 32 bits, which the target computes with: two ticks are not half an hour apart.
        let now = now.ticks() as u32;
        let Some(last) = self.last.replace(now) else {
            self.nominal = now;
            return Elapsed {
                seconds: 0.0,
                steps: 1,
            };
        };
        let mut late = now.wrapping_sub(self.nominal).cast_signed();
        let mut steps = 0;
        while late > self.period / 2 && steps < MAX_STEPS {
            late -= self.period;
            steps += 1;
        }
        if steps == MAX_STEPS || late < -(MAX_STEPS as i32) * self.period {
            // The clock has leapt, one way or the other: it is right from now on.
            late = 0;
        }
        self.nominal = now.wrapping_sub(late.cast_unsigned());
        // It may have gone back, too.
        let elapsed = now.wrapping_sub(last).cast_signed();
        let seconds = if elapsed > 0 {
            elapsed as f32 * 1e-6
        } else {
            0.0
        };
        Elapsed { seconds, steps }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn steps(ticks: &[u64]) -> Vec<u32> {
        let mut clock = Clock::new(Duration::millis(1));
        clock.tick(Instant::from_ticks(0));
        ticks
            .iter()
            .map(|t| clock.tick(Instant::from_ticks(*t)).steps)
            .collect()
    }

    extern crate std;
    use std::vec::Vec;

    #[test]
    fn jitter_is_one_step_each() {
        assert_eq!(steps(&[1300, 2000, 2700, 4000]), [1, 1, 1, 1]);
    }

    #[test]
    fn a_missed_tick_is_two_steps_and_a_double_one_none() {
        assert_eq!(steps(&[1000, 3000, 3000, 4000]), [1, 2, 0, 1]);
    }

    #[test]
    fn a_clock_that_goes_back_or_leaps_does_no_harm() {
        assert_eq!(
            steps(&[
                1000, 500, 2000, 10_000_000, 10_001_000, 5_000_000, 5_001_000
            ]),
            [1, 0, 1, 20, 1, 0, 1]
        );
    }
}
