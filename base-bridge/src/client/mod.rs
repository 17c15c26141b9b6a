//! The protocol as a client speaks it: which lines may be under way, in what order they go, and whose reply is whose. It reads no clock and writes to no
//! port.
//!
//! Each line has a tag and a check. Three may be unanswered; the protocol's fourth place is kept for Stop, which goes past all that waits. What waits and could
//! move the base is forgotten then. Nothing at all survives the loss of the line but the wish to stop.

pub mod check;

use check::Checked;
use std::collections::VecDeque;

/// A reply that has not come after this, s, will not come: two lines of 255 bytes ahead of it take 45 ms.
pub const DEADLINE: f64 = 0.5;
/// Lines that may be unanswered, but for a Stop.
const UNDER_WAY: usize = 3;
/// Lines that may wait. More than one of each kind does not happen, but for what others ask for.
const WAITING: usize = 32;
/// Tags are short, for they travel with each line, and come back long after their line's deadline.
const TAGS: u16 = 1000;

/// What a line is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Ask {
    /// Stop.
    Stop,
    /// A speed of the translation.
    Move,
    /// A speed of the rotation.
    Turn,
    /// A posture to go to.
    GoTo,
    /// A fix.
    Observe,
    /// A new pose.
    Reset,
    /// Clears a fault.
    ClearFault,
    /// Motor power on or off.
    Enable,
    /// What it is.
    Version,
    /// A parameter.
    Params,
    /// Its state.
    Status,
    /// Telemetry.
    Stream,
    /// Its estimate, with the covariance.
    Estimate,
}

impl Ask {
    /// Could this set a base in motion?
    pub fn moves(self) -> bool {
        matches!(self, Self::Move | Self::Turn | Self::GoTo)
    }

    /// Could this make the estimate leap?
    pub fn corrects(self) -> bool {
        matches!(self, Self::Observe | Self::Reset)
    }

    /// Is the newest of these all that matters, so that one that waits is replaced by it?
    fn replaces(self) -> bool {
        matches!(
            self,
            Self::Move | Self::Turn | Self::GoTo | Self::Status | Self::Estimate
        )
    }
}

/// How a question ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// The reply, without tag and check.
    Reply(String),
    /// What follows `ERR`: code and text.
    Refused(String),
    /// No reply in time.
    Unanswered,
    /// It has not been sent: a Stop came first, or a newer one of its kind, or there were too many.
    NotSent,
    /// The line was lost, before its answer came.
    Lost,
}

/// The end of a question.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Answer {
    /// What for.
    pub ask: Ask,
    /// Which, by the number that was given to it.
    pub number: u64,
    /// How it ended.
    pub outcome: Outcome,
}

/// What a line from the base is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Heard {
    /// The end of questions.
    Answers(Vec<Answer>),
    /// An event, without its `! `.
    Event(String),
    /// Telemetry, without its `~ `.
    Row(String),
    /// A line whose check is wrong or missing.
    Damaged,
    /// A reply to nobody: it came too late, or to garbage.
    Stray,
}

/// Something to be sent.
#[derive(Clone, Debug)]
struct Waiting {
    ask: Ask,
    number: u64,
    text: String,
    /// When what it tells was measured: its age follows it.
    measured: Option<f64>,
}

#[derive(Clone, Debug)]
struct UnderWay {
    tag: u16,
    ask: Ask,
    numbers: Vec<u64>,
    deadline: f64,
}

/// A client.
#[derive(Clone, Debug)]
pub struct Client {
    next_tag: u16,
    next_number: u64,
    waiting: VecDeque<Waiting>,
    under_way: Vec<UnderWay>,
    /// Those who want it to stop; empty if nobody does.
    stops: Vec<u64>,
    /// Seconds that a byte takes on the line: a fix is older when its line has arrived.
    byte_time: f64,
    unanswered: u64,
    /// The base puts checks on all its lines.
    checks: bool,
    /// Answers that no line brings.
    ended: Vec<Answer>,
}

impl Client {
    /// One whose first tag is this, so that replies to a client before it are not taken for its own.
    pub fn new(first_tag: u16, baud: u32) -> Self {
        Self {
            next_tag: first_tag % TAGS,
            next_number: 0,
            waiting: VecDeque::new(),
            under_way: Vec::new(),
            stops: Vec::new(),
            byte_time: 10.0 / f64::from(baud.max(1)),
            unanswered: 0,
            checks: false,
            ended: Vec::new(),
        }
    }

    /// From now on, a line without a check is a damaged one.
    pub fn expect_checks(&mut self, checks: bool) {
        self.checks = checks;
    }

    /// Asks for something. Its answer comes with the number that is returned.
    pub fn ask(&mut self, ask: Ask, text: impl Into<String>) -> u64 {
        self.wait(ask, text.into(), None)
    }

    /// The same, for a line that ends with the age of what was measured at `measured`.
    pub fn ask_aged(&mut self, ask: Ask, text: impl Into<String>, measured: f64) -> u64 {
        self.wait(ask, text.into(), Some(measured))
    }

    fn wait(&mut self, ask: Ask, text: String, measured: Option<f64>) -> u64 {
        let number = self.number();
        let new = Waiting {
            ask,
            number,
            text,
            measured,
        };
        let old = self.waiting.iter().position(|old| old.ask == ask);
        if let Some(at) = old.filter(|_| ask.replaces()) {
            // It keeps its place in the queue.
            let old = std::mem::replace(&mut self.waiting[at], new);
            self.end(old.ask, old.number, Outcome::NotSent);
        } else if self.waiting.len() < WAITING {
            self.waiting.push_back(new);
        } else {
            self.end(ask, number, Outcome::NotSent);
        }
        number
    }

    /// Stops the base before anything else is said, and again until it answers. Whatever waits and could move it is forgotten.
    pub fn stop(&mut self) -> u64 {
        let number = self.number();
        self.stops.push(number);
        let waiting = std::mem::take(&mut self.waiting);
        for old in waiting {
            if old.ask.moves() {
                self.end(old.ask, old.number, Outcome::NotSent);
            } else {
                self.waiting.push_back(old);
            }
        }
        number
    }

    /// A Stop is on its way, or waits to be.
    pub fn is_stopping(&self) -> bool {
        !self.stops.is_empty() || self.has_under_way(Ask::Stop)
    }

    /// Such a question waits, or is under way.
    pub fn has(&self, ask: Ask) -> bool {
        self.waiting.iter().any(|waiting| waiting.ask == ask) || self.has_under_way(ask)
    }

    fn has_under_way(&self, ask: Ask) -> bool {
        self.under_way.iter().any(|line| line.ask == ask)
    }

    /// The line is lost, and with it all that waits and all that is under way.
    pub fn lost(&mut self) {
        for old in std::mem::take(&mut self.waiting) {
            self.end(old.ask, old.number, Outcome::Lost);
        }
        for line in std::mem::take(&mut self.under_way) {
            for number in line.numbers {
                self.end(line.ask, number, Outcome::Lost);
            }
        }
        for number in std::mem::take(&mut self.stops) {
            self.end(Ask::Stop, number, Outcome::Lost);
        }
    }

    /// The next line to be sent now, with its end, if any may be.
    pub fn next(&mut self, now: f64) -> Option<Vec<u8>> {
        if !self.stops.is_empty() && !self.has_under_way(Ask::Stop) {
            let numbers = std::mem::take(&mut self.stops);
            return Some(self.send(Ask::Stop, numbers, "Stop", now));
        }
        let others = self.under_way.iter().filter(|line| line.ask != Ask::Stop);
        if others.count() >= UNDER_WAY {
            return None;
        }
        let Waiting {
            ask,
            number,
            mut text,
            measured,
        } = self.waiting.pop_front()?;
        if let Some(measured) = measured {
            // The age when the line has arrived: with blank, age, tag, check and end it is some 20 bytes longer.
            let sending = (text.len() + 20) as f64 * self.byte_time;
            let age = (now - measured + sending).max(0.0);
            text = format!("{text} {age:.4}");
        }
        Some(self.send(ask, vec![number], &text, now))
    }

    fn send(&mut self, ask: Ask, numbers: Vec<u64>, text: &str, now: f64) -> Vec<u8> {
        let mut tag = self.next_tag;
        while self.under_way.iter().any(|line| line.tag == tag) {
            tag = (tag + 1) % TAGS;
        }
        self.next_tag = (tag + 1) % TAGS;
        self.under_way.push(UnderWay {
            tag,
            ask,
            numbers,
            deadline: now + DEADLINE,
        });
        let mut line = check::with(&format!("@{tag} {text}")).into_bytes();
        line.push(b'\n');
        line
    }

    /// Takes a line that has come, without its end.
    pub fn hear(&mut self, line: &str) -> Heard {
        let (text, checked) = match check::of(line) {
            Checked::Wrong => return Heard::Damaged,
            Checked::None(text) => (text, false),
            Checked::Right(text) => (text, true),
        };
        let unsolicited = text.starts_with(['!', '~']);
        if unsolicited && self.checks && !checked {
            return Heard::Damaged;
        }
        if let Some(event) = text.strip_prefix("! ") {
            return Heard::Event(event.to_owned());
        }
        if let Some(row) = text.strip_prefix("~ ") {
            return Heard::Row(row.to_owned());
        }
        let tagged = text.strip_prefix('@').and_then(|rest| rest.split_once(' '));
        let Some((tag, reply)) = tagged else {
            return Heard::Stray;
        };
        let refusal = reply.strip_prefix("ERR ");
        // Our lines have checks, and so have their replies. Only a line that was damaged on its way may be refused without.
        if !checked && refusal.is_none() {
            return Heard::Damaged;
        }
        let line = self
            .under_way
            .iter()
            .position(|line| tag.parse() == Ok(line.tag));
        let Some(line) = line.map(|at| self.under_way.remove(at)) else {
            return Heard::Stray;
        };
        if line.ask == Ask::Stop && refusal.is_some() {
            // It never refuses one that it has understood.
            self.stops.extend(line.numbers);
            return Heard::Answers(Vec::new());
        }
        let outcome = refusal.map_or_else(
            || Outcome::Reply(reply.to_owned()),
            |refusal| Outcome::Refused(refusal.to_owned()),
        );
        let answer = |number| Answer {
            ask: line.ask,
            number,
            outcome: outcome.clone(),
        };
        Heard::Answers(line.numbers.into_iter().map(answer).collect())
    }

    /// What has ended without a reply. A Stop does not: it is sent again.
    pub fn ended(&mut self, now: f64) -> Vec<Answer> {
        let mut at = 0;
        while let Some(line) = self.under_way.get(at) {
            if line.deadline > now {
                at += 1;
                continue;
            }
            self.unanswered += 1;
            let line = self.under_way.remove(at);
            if line.ask == Ask::Stop {
                self.stops.extend(line.numbers);
                continue;
            }
            for number in line.numbers {
                self.end(line.ask, number, Outcome::Unanswered);
            }
        }
        std::mem::take(&mut self.ended)
    }

    /// When a deadline passes next.
    pub fn next_deadline(&self) -> Option<f64> {
        self.under_way
            .iter()
            .map(|line| line.deadline)
            .reduce(f64::min)
    }

    /// Lines that have not been answered in time.
    pub fn unanswered(&self) -> u64 {
        self.unanswered
    }

    fn number(&mut self) -> u64 {
        self.next_number += 1;
        self.next_number
    }

    fn end(&mut self, ask: Ask, number: u64, outcome: Outcome) {
        self.ended.push(Answer {
            ask,
            number,
            outcome,
        });
    }
}

#[cfg(test)]
mod tests;
