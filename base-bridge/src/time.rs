//! The host's time. Everything inside the bridge counts seconds since it started, by a clock that nobody sets; only what is published has the date.

use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// Where the bridge's seconds begin.
#[derive(Clone, Copy, Debug)]
pub struct Epoch {
    start: Instant,
}

impl Epoch {
    /// Now.
    pub fn begin() -> Self {
        Self {
            start: Instant::now(),
        }
    }

    /// Seconds since then.
    pub fn now(&self) -> f64 {
        self.start.elapsed().as_secs_f64()
    }

    /// What the wall clock shows when the bridge's own time is 0, in nanoseconds since 1970. It moves when somebody sets the wall clock, so it is asked
    /// for again and again.
    pub fn wall_offset(&self) -> i64 {
        // Whatever keeps this thread between the two makes the difference smaller.
        let reading = |_| now() - self.start.elapsed().as_nanos() as i64;
        (0..3).map(reading).max().unwrap_or(0)
    }
}

/// What the wall clock shows, in nanoseconds since 1970.
pub fn now() -> i64 {
    let wall = SystemTime::now().duration_since(UNIX_EPOCH);
    // A wall clock before 1970 is not set; nothing depends on it but what others see.
    wall.unwrap_or(Duration::ZERO).as_nanos() as i64
}

/// Nanoseconds since 1970 of an instant in the bridge's own seconds.
pub fn stamp(wall_offset: i64, time: f64) -> i64 {
    wall_offset + (time * 1e9) as i64
}

/// The instant in the bridge's own seconds of nanoseconds since 1970.
pub fn from_stamp(wall_offset: i64, stamp: i64) -> f64 {
    // Of two dates the difference is exact before it becomes a fraction.
    (stamp.saturating_sub(wall_offset)) as f64 * 1e-9
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stamp_comes_back_to_a_nanosecond_or_two() {
        let offset = 1_790_000_000_123_456_789;
        for time in [0.0, 1.25, 86_400.000_123] {
            let back = from_stamp(offset, stamp(offset, time));
            assert!((back - time).abs() < 3e-9, "{time} {back}");
        }
    }

    #[test]
    fn the_wall_is_the_systems() {
        let epoch = Epoch::begin();
        let wall = SystemTime::now().duration_since(UNIX_EPOCH).unwrap();
        let told = stamp(epoch.wall_offset(), epoch.now());
        assert!((told - wall.as_nanos() as i64).abs() < 1_000_000_000);
    }
}
