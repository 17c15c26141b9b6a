//! When a message was said, whatever its way here took. A network that was away for a while, or a process that was held up, delivers all at once what was
//! said meanwhile; it is not said now.
//!
//! DDS puts its writer's clock on each message. That clock is another computer's, and may show anything, but a message that has taken longer than others of
//! the same writer did has been on its way for so long. It is the same question as that of a base's clock.

use crate::clock::Clock;
use crate::time::from_stamp;
use ros2_client::{Gid, MessageInfo};
use std::collections::BTreeMap;

/// Nobody has so many drivers. Beyond them it is begun anew.
const WRITERS: usize = 100;

/// The clocks of those who write to a topic.
#[derive(Default)]
pub struct Said {
    writers: BTreeMap<Gid, Writer>,
}

struct Writer {
    /// Its first time stamp, ns.
    first: i64,
    clock: Clock,
}

impl Said {
    /// When this one was said, at the latest, in the bridge's seconds; it has come at `arrival`.
    pub fn note(&mut self, info: &MessageInfo, arrival: f64) -> f64 {
        let Some(stamp) = info.source_timestamp() else {
            return arrival;
        };
        self.at(info.publisher_gid(), stamp.to_nanos(), arrival)
    }

    fn at(&mut self, writer: Gid, stamp: i64, arrival: f64) -> f64 {
        if self.writers.len() >= WRITERS && !self.writers.contains_key(&writer) {
            self.writers.clear();
        }
        let writer = self.writers.entry(writer).or_insert_with(|| Writer {
            first: stamp,
            clock: Clock::default(),
        });
        let said = writer.clock.note(from_stamp(writer.first, stamp), arrival);
        said.min(arrival)
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
