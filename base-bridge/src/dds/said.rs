//! When a message was said, whatever its way here took. A network that was away for a while, or a process that was held up, delivers all at once what was
//! said meanwhile; it is not said now.
//!
//! DDS puts its writer's clock on each message. That clock is another computer's, and may show anything, but a message that has taken longer than others of
//! the same writer did has been on its way for so long. It is held against what was known before it: writers pause, and a message behind a pause must not
//! be what tells how the clocks drift.

use crate::time::from_stamp;
use ros2_client::{Gid, MessageInfo};
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

/// Nobody has so many drivers. Beyond them it is begun anew.
const WRITERS: usize = 100;
/// Two clocks do not drift apart faster: one that is set right slowly.
const DRIFT: f64 = 5e-4;
/// Later by this than it can be, s, the way was long, or the writer's clock was set back.
const LATE: f64 = 0.1;
/// Who has been late in such a way that the lateness stays the same for so long, s, …
const SET_BACK_FOR: f64 = 2.0;
/// … to so much, s, …
const SAME: f64 = 0.1;
/// … never silent for so long, s, has set its clock back. What was held back comes faster than it was said.
const PAUSE: f64 = 0.3;

/// The clocks of those who write to a topic.
#[derive(Default)]
pub struct Said {
    writers: BTreeMap<Gid, Writer>,
}

/// How late a message was: s by clocks that may differ by anything, and when it came.
#[derive(Clone, Copy)]
struct Late {
    by: f64,
    at: f64,
}

struct Writer {
    /// Its first time stamp, ns.
    first: i64,
    /// Its last one.
    last: i64,
    /// Its clock stands still between two messages: it says nothing.
    is_coarse: bool,
    /// The least late.
    least: Late,
    /// The first of those that have been too late since, and the last.
    run: Option<(Late, Late)>,
}

impl Said {
    /// When this one was said, at the latest, in the bridge's seconds; it has come at `arrival`.
    pub fn note(&mut self, info: &MessageInfo, arrival: f64) -> f64 {
        let Some(stamp) = info.source_timestamp() else {
            return arrival;
        };
        self.at(info.publisher_gid(), stamp.to_nanos(), arrival)
    }

    fn at(&mut self, gid: Gid, stamp: i64, arrival: f64) -> f64 {
        if self.writers.len() >= WRITERS && !self.writers.contains_key(&gid) {
            self.writers.clear();
        }
        let lateness = match self.writers.entry(gid) {
            Entry::Occupied(mut known) => known.get_mut().lateness(stamp, arrival),
            Entry::Vacant(new) => {
                new.insert(Writer::new(stamp, arrival));
                0.0
            }
        };
        arrival - lateness
    }
}

impl Writer {
    fn new(stamp: i64, arrival: f64) -> Self {
        Self {
            first: stamp,
            last: stamp,
            is_coarse: false,
            least: Late {
                by: arrival,
                at: arrival,
            },
            run: None,
        }
    }

    /// How much later this one is than it had to be, s.
    fn lateness(&mut self, stamp: i64, arrival: f64) -> f64 {
        self.is_coarse |= stamp == self.last;
        if self.is_coarse {
            return 0.0;
        }
        let late = Late {
            by: arrival - from_stamp(self.first, stamp),
            at: arrival,
        };
        let went_back = stamp < self.last;
        self.last = stamp;
        let least = self.least.by + DRIFT * (arrival - self.least.at);
        if went_back || late.by <= least || self.was_set_back(late, least) {
            self.least = late;
            self.run = None;
            return 0.0;
        }
        late.by - least
    }

    fn was_set_back(&mut self, late: Late, least: f64) -> bool {
        if late.by - least < LATE {
            self.run = None;
            return false;
        }
        let run = self
            .run
            .filter(|(begin, last)| late.at - last.at < PAUSE && (late.by - begin.by).abs() < SAME);
        let begin = run.map_or(late, |(begin, _)| begin);
        self.run = Some((begin, late));
        late.at - begin.at > SET_BACK_FOR
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: i64 = 1_000_000_000;

    /// Somebody's clock, a year ahead.
    fn stamp(time: f64) -> i64 {
        1_800_000_000 * SECOND + (time * 1e9) as i64
    }

    /// One who has spoken at 20 Hz for ten seconds.
    fn heard() -> Said {
        let mut said = Said::default();
        for tick in 0..200 {
            let time = f64::from(tick) * 0.05;
            let at = said.at(Gid::ZERO, stamp(time), time + 0.003);
            assert!((at - time - 0.003).abs() < 1e-3, "{at} {time}");
        }
        said
    }

    #[test]
    fn what_was_held_up_was_said_before() {
        let mut said = heard();
        // The network is away from 10 s to 15 s.
        for tick in 200..300 {
            let time = f64::from(tick) * 0.05;
            let at = said.at(Gid::ZERO, stamp(time), 15.0 + 1e-4 * f64::from(tick));
            assert!((at - time).abs() < 0.02, "{at} {time}");
        }
        let at = said.at(Gid::ZERO, stamp(15.05), 15.053);
        assert!((at - 15.053).abs() < 1e-3, "{at}");
    }

    #[test]
    fn what_comes_late_behind_a_pause_was_said_before() {
        for (pause, held) in [(10.0, 0.45), (100.0, 0.45), (600.0, 2.9), (3600.0, 10.0)] {
            let mut said = heard();
            let begin = 10.0 + pause;
            for tick in 0..10 {
                let time = begin + f64::from(tick) * 0.05;
                let at = said.at(
                    Gid::ZERO,
                    stamp(time),
                    begin + held + 1e-4 * f64::from(tick),
                );
                // What the clocks may have drifted apart meanwhile cannot be told from the way.
                assert!(
                    (at - time).abs() < 0.005 + DRIFT * (pause + held),
                    "{at} {time}"
                );
            }
        }
    }

    #[test]
    fn what_was_held_up_comes_in_two_parts() {
        let mut said = heard();
        for (arrival, first) in [(13.0, 200), (14.3, 220), (16.5, 240)] {
            for tick in 0..20 {
                let time = f64::from(first + tick) * 0.05;
                let at = said.at(Gid::ZERO, stamp(time), arrival + 1e-4 * f64::from(tick));
                assert!((at - time).abs() < 0.02, "{at} {time}");
            }
        }
    }

    #[test]
    fn a_clock_without_fractions_says_nothing() {
        let mut said = Said::default();
        let mut late = 0;
        for tick in 0..400 {
            let time = 0.3 + f64::from(tick) * 0.05;
            let at = said.at(Gid::ZERO, stamp(time.floor()), time + 0.003);
            late += u32::from(time - at > 0.1);
        }
        assert_eq!(late, 0);
    }

    #[test]
    fn a_clock_that_is_set_while_nobody_speaks_is_followed() {
        let mut said = heard();
        let mut late = 0;
        for tick in 0..200 {
            let time = 15.0 + f64::from(tick) * 0.05;
            let at = said.at(Gid::ZERO, stamp(time - 3.0), time + 0.003);
            late += u32::from(time - at > 0.1);
        }
        // It might have been on its way for so long, until it has stayed the same for two seconds.
        assert!((40..45).contains(&late), "{late}");
    }

    #[test]
    fn a_clock_that_is_set_is_followed() {
        for leap in [-3600.0, -1.0, 3600.0] {
            let mut said = heard();
            let mut late = 0;
            for tick in 200..300 {
                let time = f64::from(tick) * 0.05;
                let at = said.at(Gid::ZERO, stamp(time + leap), time + 0.003);
                late += u32::from(time - at > 0.1);
            }
            assert_eq!(late, 0, "{leap}");
        }
    }

    #[test]
    fn they_are_not_remembered_without_end() {
        let mut said = Said::default();
        assert_eq!(said.at(Gid::ZERO, stamp(0.0), 5.0), 5.0);
        for other in 0..1000_u32 {
            let mut bytes = [0; 16];
            bytes[..4].copy_from_slice(&other.to_be_bytes());
            said.at(Gid::from(bytes), stamp(0.0), 5.0);
        }
        assert!(said.writers.len() <= WRITERS);
    }
}
