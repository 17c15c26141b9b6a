//! The protocol as a client speaks it: which lines may be under way, in what order they go, and whose reply is whose. It reads no clock and writes to no
//! port.
//!
//! Each line has a tag and a check. Three may be unanswered; the protocol's fourth place is kept for Stop, which goes past all that waits. What waits and could
//! move the base is forgotten then. What tells the base to do something goes before what is measured or asked, though not for ever, in the order in which it
//! was said, and the last of it counts. Nothing survives the loss of the line.

pub mod check;

use check::Checked;
use std::collections::VecDeque;

/// A reply that has not come after this, s, will not come: two lines of 255 bytes ahead of it take 45 ms.
pub const DEADLINE: f64 = 0.5;
/// Lines that may be unanswered, but for a Stop.
const UNDER_WAY: usize = 3;
/// Lines that may wait. More than one of each kind does not happen, but for what others ask for.
const WAITING: usize = 32;
/// Commands that may pass what is measured or asked, in a row: on a line that carries no more than them, it would never go.
const PASSED: u32 = 3;
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

    /// Does it tell the base to do something? It goes before what measures or asks, and keeps its order.
    fn commands(self) -> bool {
        self.moves() || matches!(self, Self::Reset | Self::ClearFault | Self::Enable)
    }

    /// Is one of these that waits of no use any more, now that this one is said?
    fn outdates(self, old: Self) -> bool {
        match self {
            Self::Move => matches!(old, Self::Move | Self::GoTo),
            Self::Turn => matches!(old, Self::Turn | Self::GoTo),
            Self::GoTo => old.moves(),
            Self::Stop | Self::Version | Self::Params | Self::Stream => false,
            // Many a command that waits would keep the next one waiting.
            _ => self == old,
        }
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
    /// It has not been sent: a Stop came first, or a newer one that replaces it, or there were too many.
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
    /// Its number among all lines that were sent.
    line: u64,
    /// Of a Stop: the base was told to move behind it, …
    followed: bool,
    /// … and has agreed: what it does now was asked for later.
    overtaken: bool,
    ask: Ask,
    numbers: Vec<u64>,
    deadline: f64,
}

/// A client.
#[derive(Clone, Debug)]
pub struct Client {
    next_tag: u16,
    next_number: u64,
    next_line: u64,
    /// Commands first.
    waiting: VecDeque<Waiting>,
    /// Commands that have just passed what else waits.
    passed: u32,
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
            next_line: 0,
            waiting: VecDeque::new(),
            passed: 0,
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
        self.forget(|old| ask.outdates(old));
        // Of what is told, no more than one of each waits; only what is asked can be too much.
        if self.waiting.len() >= WAITING && !ask.commands() {
            self.end(ask, number, Outcome::NotSent);
        } else if ask.commands() {
            let others = self.waiting.iter().position(|old| !old.ask.commands());
            self.waiting
                .insert(others.unwrap_or(self.waiting.len()), new);
        } else {
            self.waiting.push_back(new);
        }
        number
    }

    /// Stops the base before anything else is said, and again until it answers. Whatever waits and could move it is forgotten.
    pub fn stop(&mut self) -> u64 {
        let number = self.number();
        self.forget(Ask::moves);
        // One that is on its way says as much as a second, unless the base was told to move behind it.
        let says_it = |line: &&mut UnderWay| line.ask == Ask::Stop && !line.followed;
        match self.under_way.iter_mut().find(says_it) {
            Some(line) => line.numbers.push(number),
            None => self.stops.push(number),
        }
        number
    }

    /// Forgets what waits and is such.
    fn forget(&mut self, is_such: impl Fn(Ask) -> bool) {
        let (gone, left) = std::mem::take(&mut self.waiting)
            .into_iter()
            .partition::<VecDeque<_>, _>(|old| is_such(old.ask));
        self.waiting = left;
        for old in gone {
            self.end(old.ask, old.number, Outcome::NotSent);
        }
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
        if !self.stops.is_empty() {
            let numbers = std::mem::take(&mut self.stops);
            return Some(self.send(Ask::Stop, numbers, "Stop", now));
        }
        // One place is a Stop's; a second one takes another's.
        let stops = self.under_way.iter().filter(|line| line.ask == Ask::Stop);
        let stops = stops.count();
        if self.under_way.len() - stops.min(1) >= UNDER_WAY {
            return None;
        }
        let Waiting {
            ask,
            number,
            mut text,
            measured,
        } = self.take()?;
        if let Some(measured) = measured {
            // The age when the line has arrived: with blank, age, tag, check and end it is some 20 bytes longer.
            let sending = (text.len() + 20) as f64 * self.byte_time;
            let age = (now - measured + sending).max(0.0);
            text = format!("{text} {age:.4}");
        }
        Some(self.send(ask, vec![number], &text, now))
    }

    /// What is to be sent first of what waits.
    fn take(&mut self) -> Option<Waiting> {
        let other = self.waiting.iter().position(|old| !old.ask.commands());
        match other {
            Some(1..) if self.passed < PASSED => {
                self.passed += 1;
                self.waiting.pop_front()
            }
            Some(at) => {
                self.passed = 0;
                self.waiting.remove(at)
            }
            None => self.waiting.pop_front(),
        }
    }

    fn send(&mut self, ask: Ask, numbers: Vec<u64>, text: &str, now: f64) -> Vec<u8> {
        let mut tag = self.next_tag;
        while self.under_way.iter().any(|line| line.tag == tag) {
            tag = (tag + 1) % TAGS;
        }
        self.next_tag = (tag + 1) % TAGS;
        if ask.moves() {
            let stops = self.under_way.iter_mut();
            for stop in stops.filter(|line| line.ask == Ask::Stop) {
                stop.followed = true;
            }
        }
        self.next_line += 1;
        self.under_way.push(UnderWay {
            line: self.next_line,
            followed: false,
            overtaken: false,
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
        if line.ask.moves() && refusal.is_none() {
            let before = |stop: &&mut UnderWay| stop.ask == Ask::Stop && stop.line < line.line;
            for stop in self.under_way.iter_mut().filter(before) {
                stop.overtaken = true;
            }
        }
        if line.ask == Ask::Stop && refusal.is_some() && !line.overtaken {
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

    /// What has ended without a reply. A Stop does not, it is sent again, unless the base has since agreed to move.
    pub fn ended(&mut self, now: f64) -> Vec<Answer> {
        let mut at = 0;
        while let Some(line) = self.under_way.get(at) {
            if line.deadline > now {
                at += 1;
                continue;
            }
            self.unanswered += 1;
            let line = self.under_way.remove(at);
            if line.ask == Ask::Stop && !line.overtaken {
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
