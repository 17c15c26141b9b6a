//! The protocol as a client speaks it: which lines may be under way, in what order they go, and whose reply is whose. It reads no clock and writes to no
//! port.
//!
//! Each line has a tag and a check. Three may be unanswered; the protocol's fourth place is kept for Stop, which goes past all that waits. What waits and could
//! move the base is forgotten then. What tells the base to do something goes before what is measured or asked, though not for ever, in the order in which it
//! was said, and the last of it counts. Nothing survives the loss of the line.

pub mod check;
mod stops;

use check::Checked;
use std::collections::VecDeque;
use stops::Stops;

/// A reply that has not come after this, s, will not come: two lines of 255 bytes ahead of it take 45 ms.
pub const DEADLINE: f64 = 0.5;
/// Beyond what two such lines take, s: an answer to a Stop that takes longer is not waited for. A USB adapter may hold it for 16 ms.
const MARGIN: f64 = 0.02;
/// A line of the protocol at its longest, with its end.
const LONGEST: f64 = 257.0;
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

    /// Does it mean something else behind the other one than before it? Without power or with a fault nothing moves, and a goal is a place of the map as it
    /// is by then.
    fn needs(self, other: Self) -> bool {
        match other {
            Self::Enable | Self::ClearFault => self.moves(),
            Self::Reset => self == Self::GoTo,
            _ => false,
        }
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
    ask: Ask,
    /// Of a Stop, which may speak for several: none.
    number: Option<u64>,
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
    stops: Stops,
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
        let byte_time = 10.0 / f64::from(baud.max(1));
        Self {
            next_tag: first_tag % TAGS,
            next_number: 0,
            next_line: 0,
            waiting: VecDeque::new(),
            passed: 0,
            under_way: Vec::new(),
            stops: Stops::new(2.0 * LONGEST * byte_time + MARGIN),
            byte_time,
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
        let place = self.place_of_predecessor(ask);
        if let Some(place) = place {
            let old = std::mem::replace(&mut self.waiting[place], new.clone());
            self.end(old.ask, old.number, Outcome::NotSent);
        }
        self.forget(|old| ask.outdates(old.ask) && old.number != number);
        if place.is_some() {
            return number;
        }
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

    /// Where one waits that such a new one replaces, and whose turn it takes: who comes often would otherwise always be last. Not if it would come before
    /// what it should come behind.
    fn place_of_predecessor(&self, ask: Ask) -> Option<usize> {
        let mut waiting = self.waiting.iter().enumerate();
        let (place, _) = waiting.find(|(_, old)| old.ask == ask && ask.outdates(ask))?;
        (!waiting.any(|(_, later)| ask.needs(later.ask))).then_some(place)
    }

    /// Stops the base before anything else is said, and again until it answers. Whatever waits and could move it is forgotten.
    pub fn stop(&mut self) -> u64 {
        let number = self.number();
        self.forget(|old| old.ask.moves());
        self.stops.add(number, self.last_move());
        number
    }

    /// Forgets what waits and is such.
    fn forget(&mut self, is_such: impl Fn(&Waiting) -> bool) {
        let (gone, left) = std::mem::take(&mut self.waiting)
            .into_iter()
            .partition::<VecDeque<_>, _>(&is_such);
        self.waiting = left;
        for old in gone {
            self.end(old.ask, old.number, Outcome::NotSent);
        }
    }

    /// A Stop is on its way, or waits to be.
    pub fn is_stopping(&self) -> bool {
        !self.stops.is_empty()
    }

    /// Such a question waits, or is under way.
    pub fn has(&self, ask: Ask) -> bool {
        self.waiting.iter().any(|waiting| waiting.ask == ask) || self.has_under_way(ask)
    }

    /// The number of the last line under way that could set the base in motion.
    fn last_move(&self) -> Option<u64> {
        let moves = self.under_way.iter().filter(|line| line.ask.moves());
        moves.map(|line| line.line).max()
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
            if let Some(number) = line.number {
                self.end(line.ask, number, Outcome::Lost);
            }
        }
        for number in self.stops.lost() {
            self.end(Ask::Stop, number, Outcome::Lost);
        }
    }

    /// The next line to be sent now, with its end, if any may be.
    pub fn next(&mut self, now: f64) -> Option<Vec<u8>> {
        let last_move = self.last_move();
        let due = self.stops.due(last_move).is_some_and(|due| now >= due);
        // A new one goes at once. That it is said again is worth no `busy`.
        if due && (self.stops.has_new() || self.under_way.len() <= UNDER_WAY) {
            let line = self.send(Ask::Stop, None, "Stop", now);
            self.stops.say(self.next_line, now, last_move);
            return Some(line);
        }
        if self.stops.has_failed() {
            return None;
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
        Some(self.send(ask, Some(number), &text, now))
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

    fn send(&mut self, ask: Ask, number: Option<u64>, text: &str, now: f64) -> Vec<u8> {
        let mut tag = self.next_tag;
        while self.under_way.iter().any(|line| line.tag == tag) {
            tag = (tag + 1) % TAGS;
        }
        self.next_tag = (tag + 1) % TAGS;
        self.next_line += 1;
        self.under_way.push(UnderWay {
            line: self.next_line,
            tag,
            ask,
            number,
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
        let (ask, agreed) = (line.ask, refusal.is_none());
        let answer = |ask, number, outcome: &Outcome| Answer {
            ask,
            number,
            outcome: outcome.clone(),
        };
        let outcome = refusal.map_or_else(
            || Outcome::Reply(reply.to_owned()),
            |refusal| Outcome::Refused(refusal.to_owned()),
        );
        let (stops, how) = match ask {
            Ask::Stop if agreed => (self.stops.answered(line.line), &outcome),
            Ask::Stop => {
                // It never refuses one that it has understood.
                self.stops.failed(line.line);
                (Vec::new(), &outcome)
            }
            _ if ask.moves() && agreed => (self.stops.overtaken(line.line), &Outcome::Unanswered),
            _ => (Vec::new(), &outcome),
        };
        let stops = stops.into_iter().map(|stop| answer(Ask::Stop, stop, how));
        let own = line.number.map(|number| answer(ask, number, &outcome));
        Heard::Answers(stops.chain(own).collect())
    }

    /// What has ended without a reply. A Stop does not, it is sent again.
    pub fn ended(&mut self, now: f64) -> Vec<Answer> {
        let mut at = 0;
        while let Some(line) = self.under_way.get(at) {
            if line.deadline > now {
                at += 1;
                continue;
            }
            self.unanswered += 1;
            let line = self.under_way.remove(at);
            match line.number {
                Some(number) => self.end(line.ask, number, Outcome::Unanswered),
                None => self.stops.failed(line.line),
            }
        }
        std::mem::take(&mut self.ended)
    }

    /// When a deadline passes next.
    pub fn next_deadline(&self) -> Option<f64> {
        self.under_way
            .iter()
            .map(|line| line.deadline)
            .chain(self.stops.due(self.last_move()))
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
