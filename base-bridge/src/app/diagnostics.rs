//! How base and bridge are.

use super::bridge::{Bridge, Link};
use crate::time::stamp;
use ros_messages::base::{Level, Report, Status};
use std::borrow::Cow;
use std::collections::BTreeMap;

/// A tick that takes more than this share of its period is worth a look.
const MUCH: f64 = 0.8;
/// Lines that go wrong in the time between two looks, and are worth one.
const FEW: u64 = 1;

/// What a base says behind `ERR`.
const CODES: &str = "syntax range too-long bad-byte checksum busy fault gate disabled moving unknown full not-psd storage standing contradiction";
/// For what else comes there: noise, or a newer base.
const OTHER: &str = "other";

/// What is counted.
#[derive(Clone, Debug, Default)]
pub(super) struct Counters {
    /// How often the line was opened.
    pub(super) opened: u64,
    /// How often it was lost.
    pub(super) lost: u64,
    /// Why, the last time; empty while it is there.
    pub(super) why: String,
    pub(super) bytes_in: u64,
    pub(super) bytes_out: u64,
    /// Lines that are none, or whose check is wrong.
    pub(super) damaged: u64,
    /// Replies to nobody.
    pub(super) strays: u64,
    /// What the base has refused, by code.
    base_refused: BTreeMap<&'static str, u64>,
    /// At the last look: when, bytes in and out, and lines gone wrong.
    last: (f64, u64, u64, u64),
}

impl Counters {
    /// Lines that have gone wrong.
    fn wrong(&self, unanswered: u64) -> u64 {
        self.damaged + self.strays + unanswered
    }

    /// The base has refused a line; the code is the first word of why.
    pub(super) fn refused(&mut self, why: &str) {
        let word = why.split(' ').next().unwrap_or_default();
        let code = CODES.split(' ').find(|code| *code == word);
        *self.base_refused.entry(code.unwrap_or(OTHER)).or_insert(0) += 1;
    }

    /// The base is known: what went wrong before, while it started or somebody else was answered, is worth no look.
    pub(super) fn begin(&mut self, unanswered: u64) {
        self.last.3 = self.wrong(unanswered);
    }
}

impl Bridge {
    /// Publishes all of it.
    pub(super) fn publish_diagnostics(&mut self, now: f64) {
        let statuses = vec![
            self.base_status(),
            self.link_status(now),
            self.tick_status(),
            self.clock_status(),
            self.command_status(),
        ];
        self.reports.push(Report::Diagnostics {
            stamp: stamp(self.epoch.wall_offset(), now),
            hardware: self.door.clone(),
            statuses,
        });
    }

    fn base_status(&self) -> Status {
        let known = self.up_since().is_some();
        let fault = self.told.as_ref().and_then(|told| told.fault.clone());
        let (level, message) = match (known, &fault) {
            (false, _) => (Level::Error, "not connected".to_owned()),
            (true, Some(fault)) => (Level::Error, format!("fault: {fault}")),
            (true, None) if self.loose_deadman().is_some() => {
                (Level::Warn, "no deadman to speak of".to_owned())
            }
            (true, None) => (Level::Ok, "no fault".to_owned()),
        };
        let mut values = vec![
            ("fault", fault.unwrap_or_else(|| "none".to_owned())),
            ("firmware", self.version.clone()),
        ];
        if let Some(deadman) = self.base.get("deadman") {
            values.push(("deadman_s", deadman.to_string()));
        }
        if let Some(status) = &self.status {
            let names = ["move_state", "turn_state", "motors"];
            let words = status.split_ascii_whitespace().map(str::to_owned);
            values.extend(names.into_iter().zip(words));
        }
        status("controller", level, message, values)
    }

    fn link_status(&mut self, now: f64) -> Status {
        let dropped = self.told.as_ref().map_or(0, |told| told.dropped);
        let unanswered = self.client.unanswered();
        let counters = &mut self.counters;
        let wrong = counters.wrong(unanswered);
        let (at, bytes_in, bytes_out, was_wrong) = counters.last;
        counters.last = (now, counters.bytes_in, counters.bytes_out, wrong);
        let seconds = (now - at).max(1e-3);
        let rate = |bytes: u64| format!("{:.0}", bytes as f64 / seconds);
        let (level, message) = match self.link {
            Link::Down => (Level::Error, format!("lost: {}", counters.why)),
            Link::Greeting(..) => (Level::Warn, "greeting".to_owned()),
            Link::Up(..) if wrong - was_wrong >= FEW => {
                (Level::Warn, "lines have gone wrong".to_owned())
            }
            Link::Up(..) => (Level::Ok, "connected".to_owned()),
        };
        let values = vec![
            ("port", self.door.clone()),
            ("bytes_in_per_s", rate(counters.bytes_in - bytes_in)),
            ("bytes_out_per_s", rate(counters.bytes_out - bytes_out)),
            ("damaged", counters.damaged.to_string()),
            ("strays", counters.strays.to_string()),
            ("unanswered", unanswered.to_string()),
            ("dropped", dropped.to_string()),
            ("opened", counters.opened.to_string()),
            ("lost", counters.lost.to_string()),
        ];
        status("link", level, message, values)
    }

    fn tick_status(&self) -> Status {
        let load = self.told.as_ref().and_then(|told| told.tick_load);
        let (level, message) = match load {
            _ if self.up_since().is_none() => (Level::Warn, "not connected"),
            Some(load) if load > MUCH => (Level::Warn, "little time left in a tick"),
            Some(_) => (Level::Ok, "in time"),
            None => (Level::Ok, "not measured"),
        };
        let values = load.map(|load| ("tick_load", format!("{load:.3}")));
        status(
            "tick",
            level,
            message.to_owned(),
            values.into_iter().collect(),
        )
    }

    fn clock_status(&self) -> Status {
        let mut values = vec![
            ("drift_ppm", format!("{:.1}", self.clock.drift() * 1e6)),
            ("restarts", self.clock.resets().to_string()),
            ("estimate_leaps", self.frames.leaps().to_string()),
        ];
        if let Some(offset) = self.clock.offset() {
            values.push(("offset_s", format!("{offset:.4}")));
        }
        let (level, message) = match self.up_since() {
            Some(_) => (Level::Ok, "follows"),
            None => (Level::Warn, "not connected"),
        };
        status("clock", level, message.to_owned(), values)
    }

    fn command_status(&self) -> Status {
        let mut values = vec![
            ("cmd_vel_limited".to_owned(), self.velocity.limited()),
            ("cmd_vel_timeouts".to_owned(), self.velocity.timeouts()),
        ];
        let refused = self.refused.iter();
        values.extend(
            refused
                .map(|((topic, why), &count)| (format!("refused {topic} {}", why.name()), count)),
        );
        let by_base = self.counters.base_refused.iter();
        values
            .extend(by_base.map(|(code, &count)| (format!("refused by the base: {code}"), count)));
        let values = values
            .into_iter()
            .map(|(name, count)| (name, count.to_string()))
            .collect();
        status("commands", Level::Ok, String::new(), values)
    }
}

fn status(
    name: &str,
    level: Level,
    message: String,
    values: Vec<(impl Into<Cow<'static, str>>, String)>,
) -> Status {
    Status {
        level,
        name: name.to_owned(),
        message,
        values: values
            .into_iter()
            .map(|(key, value)| (key.into(), value))
            .collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_no_key() {
        let mut counters = Counters::default();
        for why in ["range max_speed 0 to 1", "range", "not-psd", "", "rangex"] {
            counters.refused(why);
        }
        for number in 0..100 {
            counters.refused(&format!("x{number} y"));
        }
        let counted: Vec<_> = counters.base_refused.into_iter().collect();
        assert_eq!(counted, [("not-psd", 1), ("other", 102), ("range", 2)]);
    }
}
