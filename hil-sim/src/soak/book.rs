//! What the base may be doing, by what it was told and what it answered.

use super::line::{Answer, Motion, Said, Sent};
use vehicle_controller::params::{Id, Params};
use vehicle_controller::supervisor::{Fault, Reaction};

/// What was replaced may still be seen for so long after the answer, ms: an answer can be quicker than the look at what the tick made of the line.
const GRACE_MS: u64 = 5;

/// A line takes no longer than this, ms.
const UNDER_WAY_MS: u64 = 100;

/// A motion that may be in force.
#[derive(Clone, Copy, Debug)]
struct Entry {
    tag: u16,
    motion: Motion,
    /// It was accepted.
    accepted: bool,
    /// From when on it is not in force any more, ms.
    until: u64,
}

/// An axis, by what it was told.
#[derive(Clone, Debug)]
struct Axis {
    entries: Vec<Entry>,
    /// Rates of a stop that may be in force.
    stop_rates: Vec<f64>,
    /// Those of the stop that may be under way: another rate is for the next one.
    stopping: Vec<f64>,
    /// v and a of a command that leaves them out, if they are known.
    last: [Option<f64>; 2],
    given: [bool; 2],
    /// Every command was answered since v and a were given.
    is_certain: bool,
}

/// What an axis may do.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Allowed {
    /// How fast its reference may get.
    pub speed: f64,
    /// How quickly it may get faster.
    pub faster: f64,
    /// How quickly it may get slower.
    pub slower: f64,
}

/// What the base may be doing.
#[derive(Clone, Debug)]
pub struct Book {
    axes: [Axis; 2],
    /// The fault that is latched.
    pub latched: Option<Fault>,
    /// When an emergency stop was last asked for, ms, unless what it latched was cleared since.
    pub estop: Option<u64>,
    /// Motor power is off, or goes off.
    pub disabled: bool,
}

impl Axis {
    fn new(speed: f64, acceleration: f64, stop_rate: f64) -> Self {
        Self {
            entries: Vec::new(),
            stop_rates: vec![stop_rate],
            stopping: Vec::new(),
            last: [Some(speed), Some(acceleration)],
            given: [false; 2],
            is_certain: true,
        }
    }

    /// What went before ends soon.
    fn retire(&mut self, now: u64) {
        for entry in self.entries.iter_mut().filter(|entry| entry.accepted) {
            entry.until = entry.until.min(now + GRACE_MS);
        }
    }

    /// It stops, at whatever rate may be in force now.
    fn stop(&mut self) {
        self.stopping.clone_from(&self.stop_rates);
    }

    /// The highest rate at which it may be stopped, or may be stopping.
    fn highest_stop_rate(&self) -> f64 {
        let rates = self.stop_rates.iter().chain(&self.stopping);
        rates.copied().fold(0.0, f64::max)
    }
}

impl Book {
    /// A base of these parameters, at rest.
    pub fn new(params: &Params) -> Self {
        let get = |id| f64::from(params.get(id));
        let degrees = |id| get(id).to_radians();
        Self {
            axes: [
                Axis::new(get(Id::MoveSpeed), get(Id::MoveAccel), get(Id::StopAccel)),
                Axis::new(
                    degrees(Id::TurnSpeed),
                    degrees(Id::TurnAccel),
                    degrees(Id::StopTurnAccel),
                ),
            ],
            latched: None,
            estop: None,
            disabled: false,
        }
    }

    /// v and a of a command of an axis that leaves them out; None if that is not known.
    pub fn last(&self, axis: usize) -> Option<[f64; 2]> {
        let axis = &self.axes[axis];
        if !axis.is_certain {
            return None;
        }
        Some([axis.last[0]?, axis.last[1]?])
    }

    /// The lowest rate at which an axis may stop.
    pub fn stop_rate(&self, axis: usize) -> f64 {
        let rates = &self.axes[axis].stop_rates;
        rates.iter().copied().fold(f64::INFINITY, f64::min)
    }

    /// The rates at which an axis may be coming to rest by itself.
    pub fn resting_rates(&self, axis: usize) -> impl Iterator<Item = f64> {
        let entries = self.axes[axis].entries.iter();
        entries
            .filter(|entry| entry.motion.speed == 0.0)
            .map(|entry| entry.motion.acceleration)
    }

    /// The finite motions that may be under way, and their axes.
    pub fn finite(&self) -> impl Iterator<Item = (usize, Motion)> {
        self.axes.iter().enumerate().flat_map(|(axis, known)| {
            let entries = known.entries.iter();
            entries
                .filter(|entry| !entry.motion.endless && entry.motion.speed > 0.0)
                .map(move |entry| (axis, entry.motion))
        })
    }

    /// What an axis may do now.
    pub fn allowed(&self, axis: usize) -> Allowed {
        let axis = &self.axes[axis];
        let mut allowed = Allowed {
            slower: axis.highest_stop_rate(),
            ..Allowed::default()
        };
        for Entry { motion, .. } in &axis.entries {
            allowed.slower = allowed.slower.max(motion.acceleration);
            if motion.speed > 0.0 {
                allowed.speed = allowed.speed.max(motion.speed);
                allowed.faster = allowed.faster.max(motion.acceleration);
            }
        }
        allowed
    }

    /// Forgets what has ended; true if something has.
    pub fn expire(&mut self, now: u64) -> bool {
        let mut changed = false;
        for axis in &mut self.axes {
            let before = axis.entries.len();
            axis.entries.retain(|entry| now < entry.until);
            changed |= axis.entries.len() != before;
        }
        changed
    }

    /// A line is on its way.
    pub fn note_sent(&mut self, sent: &Sent) {
        match sent.said {
            Said::Motion(axis, motion) if !sent.while_latched => {
                self.axes[axis].entries.push(Entry {
                    tag: sent.tag,
                    motion,
                    accepted: false,
                    until: u64::MAX,
                });
            }
            Said::EStop => self.estop = Some(sent.at),
            Said::StopRate(axis, rate) => self.axes[axis].stop_rates.push(rate),
            _ => {}
        }
    }

    /// Nobody knows what became of these lines.
    pub fn note_lost(&mut self, lost: &[Sent]) {
        for axis in &mut self.axes {
            axis.is_certain &= lost.is_empty();
        }
    }

    /// A line was answered.
    pub fn note_answer(&mut self, now: u64, answer: &Answer) {
        let sent = &answer.sent;
        let accepted = answer.refusal.is_none();
        match sent.said {
            Said::Motion(axis, motion) if accepted => self.accept(now, axis, sent.tag, motion),
            Said::Motion(axis, _) => self.axes[axis].entries.retain(|e| e.tag != sent.tag),
            Said::Stop | Said::Disable if accepted => {
                self.disabled |= sent.said == Said::Disable;
                for axis in &mut self.axes {
                    axis.stop();
                    axis.retire(now);
                }
            }
            Said::Enable if accepted => self.disabled = false,
            Said::StopRate(axis, rate) if accepted => self.axes[axis].stop_rates = vec![rate],
            Said::Default(axis, which, value) if accepted => {
                let axis = &mut self.axes[axis];
                if !axis.given[which] {
                    axis.last[which] = Some(value);
                }
            }
            _ => {}
        }
    }

    fn accept(&mut self, now: u64, axis: usize, tag: u16, motion: Motion) {
        let goes_on = match self.latched {
            None => true,
            // A fault came before it; one with an end goes on when it is only that nobody is there.
            Some(fault) => fault == Fault::Link && !motion.endless,
        };
        let axis = &mut self.axes[axis];
        axis.last = [Some(motion.speed), Some(motion.acceleration)];
        for (given, gives) in axis.given.iter_mut().zip(motion.gives) {
            *given |= gives;
        }
        axis.is_certain |= motion.gives == [true; 2];
        for entry in &mut axis.entries {
            entry.accepted |= entry.tag == tag;
            // Lines are carried out in order: what was sent before this one is over, answered or not.
            if entry.tag != tag && tag.wrapping_sub(entry.tag) < u16::MAX / 2 {
                entry.until = entry.until.min(now + GRACE_MS);
            }
        }
        if !goes_on {
            axis.entries.retain(|entry| entry.tag != tag);
        }
    }

    /// A fault was latched.
    pub fn note_fault(&mut self, fault: Fault) {
        self.latched = Some(fault);
        for axis in &mut self.axes {
            axis.stop();
            axis.entries.retain(|entry| {
                fault == Fault::Link && !entry.motion.endless
                    || fault.reaction() == Reaction::Stop && entry.motion.speed == 0.0
            });
        }
    }

    /// It was cleared.
    pub fn note_cleared(&mut self, now: u64) {
        self.latched = None;
        self.estop = self.estop.filter(|at| at + UNDER_WAY_MS > now);
    }
}
