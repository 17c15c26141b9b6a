//! The base's clock, as the host sees it.
//!
//! A telemetry line carries the base's time b of the measurement and arrives at the host's time h: h − b = o + ρ b + late, where o and ρ are the offset and
//! the drift of the two clocks and late ≥ 0 is what the line waited for: another line on the wire, a USB frame, the scheduler. A line may be late by
//! anything, but none is early. So the truth is the highest line that no point lies below: the lower envelope, not the average. Of the envelope's edges
//! (a lower convex hull) the one over the middle of the time remembered has the drift.
//!
//! What every line takes cannot be told from an offset. The bytes of the line itself are taken off by the caller, who knows how many there were.

use std::collections::VecDeque;

/// Of each second only the earliest line counts, s.
const BUCKET: f64 = 1.0;
/// So many are remembered: the drift of a crystal changes with its temperature, over minutes.
const BUCKETS: usize = 100;
/// Above this a drift is a mistake: crystals are within 100 ppm, resonators within 5000.
const MAX_DRIFT: f64 = 5e-3;
/// What the earliest lines of two seconds may differ by (telemetry's t has milliseconds), s, over the drift that is expected of two crystals (100 ppm): the
/// span that the drift is half believed at, s.
const HALF_BELIEVED: f64 = 1e-3 / 1e-4;
/// Earlier by this than can be, s: the base's clock has leapt ahead.
const LEAP_AHEAD: f64 = 0.05;
/// Later by this, s, …
const LEAP_BACK: f64 = 0.25;
/// … for so long, s: its clock has been set back while nobody listened.
const LEAP_BACK_FOR: f64 = 1.0;
/// Stamps go up by this at least, s.
const STEP: f64 = 1e-6;

/// Estimates offset and drift.
#[derive(Clone, Debug, Default)]
pub struct Clock {
    /// (base time, earliest arrival − base time) of each second.
    earliest: VecDeque<(f64, f64)>,
    /// The bucket that the last entry is of.
    bucket: i64,
    /// Offset at base time 0, and drift.
    fit: Option<(f64, f64)>,
    last_base: f64,
    /// Since when all lines have come too late, in the host's time.
    late_since: Option<f64>,
    /// Nobody has listened for a while: a line that comes too late now has not waited, the clock was set back.
    resumed: bool,
    last_stamp: Option<f64>,
    resets: u64,
}

impl Clock {
    /// Takes note of a line: the base's time in it, and when it arrived. Returns the host's time of the measurement.
    pub fn note(&mut self, base: f64, arrival: f64) -> f64 {
        let late = arrival - base;
        if let Some((offset, drift)) = self.fit {
            let beyond = late - (offset + drift * base);
            if beyond > LEAP_BACK {
                self.late_since.get_or_insert(arrival);
            } else {
                self.late_since = None;
            }
            let set_back = self
                .late_since
                .is_some_and(|since| self.resumed || arrival - since > LEAP_BACK_FOR);
            if base < self.last_base || beyond < -LEAP_AHEAD || set_back {
                self.reset();
            }
        }
        self.resumed = false;
        self.last_base = base;
        let bucket = (base / BUCKET).floor() as i64;
        match self.earliest.back_mut() {
            Some(last) if self.bucket == bucket => {
                if late < last.1 {
                    *last = (base, late);
                }
            }
            _ => {
                self.bucket = bucket;
                self.earliest.push_back((base, late));
                if self.earliest.len() > BUCKETS {
                    self.earliest.pop_front();
                }
            }
        }
        self.fit = Some(fit(self.earliest.make_contiguous()));
        self.stamp(base, arrival)
    }

    /// The base is listened to again, and has just answered.
    pub fn resume(&mut self) {
        self.resumed = true;
        self.late_since = None;
    }

    /// The base has started anew, and so has its clock.
    pub fn reset(&mut self) {
        *self = Self {
            last_stamp: self.last_stamp,
            resets: self.resets + 1,
            ..Self::default()
        };
    }

    /// Offset of the base's clock from the host's now, s: host = base + offset. None before the first line.
    pub fn offset(&self) -> Option<f64> {
        let (offset, drift) = self.fit?;
        Some(offset + drift * self.last_base)
    }

    /// What the host's clock gains on the base's, s in a second.
    pub fn drift(&self) -> f64 {
        self.fit.map_or(0.0, |(_, drift)| drift)
    }

    /// How often it began anew.
    pub fn resets(&self) -> u64 {
        self.resets
    }

    /// The host's time at the base's. Never later than the line arrived, and later than the stamp before: who takes differences must not divide by zero.
    fn stamp(&mut self, base: f64, arrival: f64) -> f64 {
        let (offset, drift) = self.fit.unwrap_or((arrival - base, 0.0));
        let stamp = (base + offset + drift * base).min(arrival);
        let stamp = self.last_stamp.map_or(stamp, |last| stamp.max(last + STEP));
        self.last_stamp = Some(stamp);
        stamp
    }
}

/// The highest line below all points: offset at 0 and slope.
fn fit(points: &[(f64, f64)]) -> (f64, f64) {
    let (Some(first), Some(last)) = (points.first(), points.last()) else {
        return (0.0, 0.0);
    };
    let middle = f64::midpoint(first.0, last.0);
    let mut hull: Vec<(f64, f64)> = Vec::new();
    for point in points {
        // The last corner goes if it lies above the line from the one before it to the new point.
        while let [.., a, b] = hull[..] {
            if (b.1 - a.1) * (point.0 - a.0) < (point.1 - a.1) * (b.0 - a.0) {
                break;
            }
            hull.pop();
        }
        hull.push(*point);
    }
    let edge = hull.windows(2).find(|edge| edge[1].0 >= middle);
    let slope = edge.map_or(0.0, |edge| {
        (edge[1].1 - edge[0].1) / (edge[1].0 - edge[0].0)
    });
    let span = last.0 - first.0;
    // The prior of no drift, against what the span can tell.
    let believed = span * span / (span * span + HALF_BELIEVED * HALF_BELIEVED);
    let slope = (slope * believed).clamp(-MAX_DRIFT, MAX_DRIFT);
    let offset = points
        .iter()
        .map(|(base, late)| late - slope * base)
        .fold(f64::INFINITY, f64::min);
    (offset, slope)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// Lines at 50 Hz over a link that delays each by `least` to `least + jitter`, evenly, and one in a hundred by 60 ms more. Returns the errors of the
    /// stamps against the truth, s, one for each line.
    fn errors(clock: &mut Clock, seed: u64, seconds: f64, drift: f64, jitter: f64) -> Vec<f64> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let (mut errors, mut last_arrival) = (Vec::new(), 0.0_f64);
        let host_at_boot = clock.last_stamp.map_or(12.5, |stamp| stamp + 3.0);
        for line in 0..(seconds * 50.0) as u64 {
            let true_base = line as f64 * 0.02 + 0.0034;
            let measured = host_at_boot + true_base * (1.0 + drift);
            let hold_up = if random.random_bool(0.01) { 0.06 } else { 0.0 };
            let arrival = measured + random.random_range(0.0..jitter) + hold_up;
            // Lines do not overtake each other.
            last_arrival = last_arrival.max(arrival);
            let told = (true_base * 1e3).round() * 1e-3;
            errors.push(clock.note(told, last_arrival) - measured);
        }
        errors
    }

    /// Largest error behind the first `from` lines.
    fn worst(errors: &[f64], from: usize) -> f64 {
        errors[from..]
            .iter()
            .fold(0.0, |worst, e| e.abs().max(worst))
    }

    #[test]
    fn jitter_of_5_ms_and_crystals_apart_are_seen_through() {
        for seed in 0..20 {
            for drift in [-1e-4, 0.0, 1e-4] {
                let mut clock = Clock::default();
                let errors = errors(&mut clock, seed, 120.0, drift, 5e-3);
                // The t of a line is rounded to 1 ms: half of that, and what is left of the jitter.
                let settled = worst(&errors, 30 * 50);
                assert!(settled < 1.5e-3, "seed {seed} drift {drift}: {settled}");
                // At once it is as good as the link, but for the lines that are held up.
                let begun = worst(&errors, 50);
                assert!(begun < 6e-3, "seed {seed} drift {drift}: {begun}");
                let told = clock.drift();
                assert!((told - drift).abs() < 2e-5, "seed {seed} {drift}: {told}");
            }
        }
    }

    #[test]
    fn stamps_go_up_and_are_never_of_the_future() {
        let mut clock = Clock::default();
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let (mut last, mut arrival) = (f64::NEG_INFINITY, 0.0_f64);
        for line in 0..5000 {
            let base = f64::from(line) * 0.02;
            arrival = arrival.max(7.0 + base + random.random_range(0.0..0.03));
            let stamp = clock.note(base, arrival);
            assert!(stamp > last, "{stamp} after {last}");
            assert!(stamp <= arrival + 1e-5, "{stamp} of {arrival}");
            last = stamp;
        }
    }

    #[test]
    fn a_base_that_starts_anew_is_noticed() {
        let mut clock = Clock::default();
        errors(&mut clock, 1, 60.0, 5e-5, 5e-3);
        let errors = errors(&mut clock, 2, 60.0, 5e-5, 5e-3);
        assert_eq!(clock.resets(), 1);
        assert!(worst(&errors, 50) < 6e-3, "{}", worst(&errors, 50));
    }

    #[test]
    fn so_is_one_that_did_while_nobody_listened() {
        // It was on for 10 s, unplugged for a minute in which it started anew, and its clock shows more now than it did.
        let mut clock = Clock::default();
        for line in 0..500 {
            let base = f64::from(line) * 0.02;
            clock.note(base, 100.0 + base);
        }
        let mut error = f64::INFINITY;
        for line in 0..200 {
            let base = 30.0 + f64::from(line) * 0.02;
            error = clock.note(base, 140.0 + base) - (140.0 + base);
        }
        assert!(error.abs() < 1e-3, "{error}");
        assert_eq!(clock.resets(), 1);
    }

    #[test]
    fn and_at_once_where_it_has_just_answered() {
        let mut clock = Clock::default();
        for (base, arrival) in [(0.5, 10.5), (0.75, 10.75)] {
            clock.note(base, arrival);
        }
        clock.resume();
        // Started anew at 10.8.
        clock.note(1.7, 12.5);
        assert_eq!(clock.resets(), 1);
        clock.resume();
        clock.note(2.7, 13.6);
        assert_eq!(clock.resets(), 1);
    }

    #[test]
    fn a_clock_that_leaps_ahead_is_followed_at_once() {
        let mut clock = Clock::default();
        clock.note(1.0, 11.0);
        clock.note(1.02, 11.02);
        let stamp = clock.note(3.0, 11.04);
        assert!((stamp - 11.04).abs() < 1e-4, "{stamp}");
    }
}
