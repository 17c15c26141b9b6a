//! How fast simulated time passes, as measured.

use std::collections::VecDeque;
use std::time::Duration;

/// It is measured over so long.
const WINDOW: Duration = Duration::from_secs(1);
/// From sample to sample, at least.
const STEP: Duration = Duration::from_millis(20);

/// Holds simulated time against the clock.
#[derive(Debug, Default)]
pub struct PaceMeter {
    /// The clock's time and simulated seconds.
    samples: VecDeque<(Duration, f64)>,
}

impl PaceMeter {
    /// Simulated time is so many seconds, and the clock's is this.
    pub fn note(&mut self, clock: Duration, simulated: f64) {
        if self
            .samples
            .back()
            .is_some_and(|last| clock < last.0 + STEP)
        {
            return;
        }
        self.samples.push_back((clock, simulated));
        // The oldest one that is kept is a window back or more.
        while self.samples.len() > 2 && self.samples[1].0 + WINDOW <= clock {
            self.samples.pop_front();
        }
    }

    /// Simulated seconds in a second of the clock, over the last one; none before there are two samples.
    pub fn rate(&self) -> Option<f64> {
        let (from, to) = (self.samples.front()?, self.samples.back()?);
        let took = to.0.saturating_sub(from.0).as_secs_f64();
        (took > 0.0).then(|| (to.1 - from.1) / took)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const fn ms(milliseconds: u64) -> Duration {
        Duration::from_millis(milliseconds)
    }

    #[test]
    fn the_rate_is_that_of_the_last_second() {
        let mut meter = PaceMeter::default();
        meter.note(ms(0), 0.0);
        assert_eq!(meter.rate(), None);
        for step in 1..=100 {
            meter.note(ms(20 * step), 0.04 * step as f64);
        }
        assert!((meter.rate().unwrap() - 2.0).abs() < 1e-9);
        // It stands still from here on: a second later nothing else is known.
        for step in 101..=126 {
            meter.note(ms(20 * step), 4.0);
        }
        let half = meter.rate().unwrap();
        assert!((half - 0.96).abs() < 0.05, "{half}");
        for step in 127..=151 {
            meter.note(ms(20 * step), 4.0);
        }
        assert_eq!(meter.rate(), Some(0.0));
    }

    #[test]
    fn it_keeps_no_more_than_a_second() {
        let mut meter = PaceMeter::default();
        for step in 0..100_000 {
            meter.note(ms(step), 0.0);
        }
        assert!(meter.samples.len() <= 52, "{}", meter.samples.len());
    }
}
