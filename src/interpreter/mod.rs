//! Top layer: the serial protocol. Bytes in, bytes out, no I/O inside [C §3].
//!
//! [`Interpreter::receive`] takes bytes as they come, [`Interpreter::poll`] carries commands out on an [`Interface`] and writes replies, events and
//! telemetry into a buffer, [`Interpreter::transmit`] takes them out of it. A reply, an event or a telemetry line is written whole or not yet.

pub mod command;
mod crc;
mod error;
mod execute;
mod keyword;
mod line;
mod listing;
mod map;
pub mod number;
mod path;
mod reply;
mod serial;
mod storage;
mod telemetry;
mod text;

pub use error::Error;
pub use text::MAX_LINE;

use crate::controller::{AxisCommand, Event, Interface, Procedure, Snapshot};
use crate::map::Atlas;
use crate::params::{Blueprint, Fallback, Id, Params, radians};
use crate::supervisor::Fault;
use crate::time::Duration;
use crate::trajectory::{Notice, Pilot};
use crate::vehicle::differential;
use command::Command;
use crc::Letters;
use heapless::Deque;
use keyword::Keyword;
use line::Reader;
use listing::Listing;
use map::Charts;
use number::Sink;
use storage::{Errand, Stage, Storage};
use telemetry::Stream;
use text::Text;

/// Version of the protocol.
pub const PROTOCOL_VERSION: u32 = 1;

/// The desk that the interpreter works on: of a differential drive, if no other vehicle is named.
pub type Desk<C = differential::Config> = Interface<C>;

/// So many lines may wait for their replies.
const MAX_UNANSWERED: usize = 4;
/// So many further ones with tags are remembered, to be answered in their turn. Beyond that [`Interpreter::can_receive`] is false.
const MAX_LATE: usize = 32;
/// The output buffer: room for four of the longest lines.
const OUTPUT: usize = 1028;

/// What came around a command.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Address {
    tag: Option<u16>,
    has_check: bool,
}

/// A line that waits for its reply.
#[derive(Clone, Copy, Debug)]
struct Waiting {
    address: Address,
    letters: Letters,
    command: Result<Command, Error>,
}

/// A line that came when four were waiting.
#[derive(Clone, Copy, Debug)]
enum Late {
    /// So many that are answered `busy`, alike but for their number.
    Busy(Address, u32),
    /// It stops the base, and is never too late for that: Stop or EStop.
    Stops(Address, Keyword),
}

/// What a base says of itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Identity {
    /// What it runs on, for Version.
    pub target: &'static str,
    /// Why it started, for the boot event.
    pub reset_cause: &'static str,
    /// The nominal period of its tick.
    pub period: Duration,
}

/// What is to be told unasked.
#[derive(Clone, Copy, Debug)]
enum Told {
    /// Of the control loop.
    Event(Event),
    /// Of a path.
    Notice(Notice),
    /// The map does not know any more where the base is.
    Lost,
}

/// The command interpreter.
#[allow(
    clippy::struct_excessive_bools,
    reason = "they are independent of each other"
)]
#[derive(Clone, Debug)]
pub struct Interpreter {
    identity: Identity,
    params: Params,
    defaults: Params,
    reader: Reader,
    waiting: Deque<Waiting, MAX_UNANSWERED>,
    late: Deque<Late, MAX_LATE>,
    /// The case that checks have had since they are required: in the other one they would hide a flipped bit in a letter.
    letters: Letters,
    /// An EStop has come, and is obeyed before anything else.
    emergency: bool,
    /// A Stop has come, and nothing has been done for it since anything moved. It is obeyed in its turn, and at once if that may take long.
    halt: bool,
    /// One of the lines that came so late that they were forgotten was a Stop.
    forgotten: bool,
    storage: Storage,
    charts: Charts,
    pilot: Pilot,
    events: Deque<Told, 16>,
    output: Deque<u8, OUTPUT>,
    stream: Stream,
    /// A list under way.
    listing: Option<Listing>,
    boot_told: bool,
    last_move: AxisCommand,
    last_turn: AxisCommand,
    /// v and a of the last move and turn are the parameters' until a command gives others.
    given: [[bool; 2]; 2],
}

impl Interpreter {
    /// An interpreter for a base with the given parameters, which are also what ResetParams returns to.
    #[must_use]
    pub fn new(identity: Identity, params: Params) -> Self {
        Self::begin(identity, &params, &params, Storage::default())
    }

    fn begin(identity: Identity, defaults: &Params, params: &Params, storage: Storage) -> Self {
        let [last_move, last_turn] = motion_defaults(params);
        Self {
            identity,
            params: *params,
            defaults: *defaults,
            reader: Reader::default(),
            waiting: Deque::new(),
            late: Deque::new(),
            letters: Letters::default(),
            emergency: false,
            halt: false,
            forgotten: false,
            storage,
            charts: Charts::default(),
            pilot: Pilot::default(),
            events: Deque::new(),
            output: Deque::new(),
            stream: Stream::default(),
            listing: None,
            boot_told: false,
            last_move,
            last_turn,
            given: [[false; 2]; 2],
        }
    }

    /// The parameters in force.
    #[must_use]
    pub fn params(&self) -> &Params {
        &self.params
    }

    /// False while so many tagged lines wait that a further one would not be answered. What stops the base is obeyed all the same.
    #[must_use]
    pub fn can_receive(&self) -> bool {
        !self.late.is_full()
    }

    /// Takes in a byte.
    pub fn receive(&mut self, byte: u8) {
        if !self.reader.push(byte) {
            return;
        }
        let frame = self.reader.frame();
        let address = Address {
            tag: frame.tag,
            has_check: frame.has_check,
        };
        let command = frame.body.and_then(command::parse);
        let stops = match command {
            Ok(Command::Plain(keyword @ (Keyword::Stop | Keyword::EStop))) => Some(keyword),
            _ => None,
        };
        if stops == Some(Keyword::EStop) {
            self.emergency = true;
            // It is obeyed before them, and they do not undo it.
            for waiting in &mut self.waiting {
                if waiting.command.as_ref().is_ok_and(Command::may_move) {
                    waiting.command = Err(Error::Fault(Fault::Estop));
                }
            }
        }
        self.halt |= stops == Some(Keyword::Stop);
        let unanswered = self.waiting.len() + usize::from(self.charts.is_asking());
        if self.late.is_empty() && unanswered < MAX_UNANSWERED {
            // There is room: fewer than four wait, and none is late.
            let _ = self.waiting.push_back(Waiting {
                address,
                letters: frame.letters,
                command,
            });
        } else {
            self.remember(address, stops);
        }
        self.reader.clear();
    }

    /// Remembers how to answer a line that came too late. Untagged ones are counted; of tagged ones beyond the 32nd, nothing is known any more.
    fn remember(&mut self, address: Address, stops: Option<Keyword>) {
        match (self.late.back_mut(), stops) {
            (Some(Late::Busy(last, count)), None) if *last == address => {
                *count = count.saturating_add(1);
            }
            (_, None) => drop(self.late.push_back(Late::Busy(address, 1))),
            (_, Some(keyword)) => {
                let kept = self.late.push_back(Late::Stops(address, keyword));
                self.forgotten |= kept.is_err() && keyword == Keyword::Stop;
            }
        }
    }

    /// Takes in an event of the control loop. When nobody takes the output and the queue is full, a fault displaces the oldest event; any other event
    /// is lost.
    ///
    /// What a path or a chase is made of is not told: its moves and turns are nobody's but its own.
    pub fn notify(&mut self, event: Event) {
        let is_own = match event {
            Event::MoveDone(_) => self.pilot.is_own(Procedure::Move),
            Event::TurnDone(_) => self.pilot.is_own(Procedure::Turn),
            _ => false,
        };
        if is_own {
            return;
        }
        if self.events.is_full() && matches!(event, Event::Fault(..)) {
            self.events.pop_front();
        }
        let _ = self.events.push_back(Told::Event(event));
    }

    /// Takes out a byte to send.
    pub fn transmit(&mut self) -> Option<u8> {
        self.output.pop_front()
    }

    /// Does what can be done now: tells events, carries commands out, sends telemetry. Call it after each update of the desk, and whenever bytes
    /// came in or went out.
    pub fn poll<C: Blueprint>(&mut self, desk: &mut Desk<C>, atlas: &mut Atlas) {
        self.chart(desk, atlas);
        // Its reply waits for its turn; the motors do not.
        if core::mem::take(&mut self.emergency) {
            desk.emergency_stop();
        }
        if !self.boot_told && self.has_room() {
            self.boot_told = true;
            self.tell_boot();
        }
        while self.has_room()
            && let Some(fallback) = self.storage.fallbacks.take()
        {
            self.tell_fallback(fallback);
        }
        // What it tells came before the lines that wait, and is told before their replies.
        self.drive(desk, true);
        while self.has_room()
            && let Some(told) = self.events.pop_front()
        {
            self.tell_event(told);
        }
        while self.has_room() && self.answer_next(desk, atlas) {}
        self.drive(desk, false);
        // What a Stop has to wait for may take long, or never end if nobody reads.
        let waits = self.storage.errand.is_some()
            || self.charts.is_busy()
            || self.listing.is_some()
            || !self.has_room();
        let is_done = self.waiting.is_empty() && self.late.is_empty();
        if self.halt && (waits || is_done) {
            self.halt = desk.stop().is_err();
        }
        self.forgotten &= self.halt || !is_done;
        if self.stream.is_due(desk.snapshot().time) {
            self.tell(desk.snapshot());
        }
    }

    /// Notes the share of its period (0 to 1, or more if it was late) that a tick took, where that can be measured: the telemetry field `tick_load` tells the
    /// largest since its last line.
    pub fn note_tick_load(&mut self, share: f32) {
        self.stream.note_tick_load(share);
    }

    // Each line is written in a function of its own, so that the deepest stack has room for one of them only.

    #[inline(never)]
    fn tell_boot(&mut self) {
        let mut text = Text::default();
        text.str("! boot").word(self.identity.reset_cause);
        self.send(&mut text);
    }

    #[inline(never)]
    fn tell_fallback(&mut self, fallback: Fallback) {
        let mut text = Text::default();
        reply::fallback(&mut text, fallback);
        self.send(&mut text);
    }

    #[inline(never)]
    fn tell_event(&mut self, told: Told) {
        let mut text = Text::default();
        match told {
            Told::Event(event) => reply::event(&mut text, event),
            Told::Notice(notice) => path::notice(&mut text, notice),
            Told::Lost => drop(text.str("! map lost")),
        }
        self.send(&mut text);
    }

    /// Answers one line, or goes on with a list; false if there is nothing to do or the desk is not ready.
    fn answer_next<C: Blueprint>(&mut self, desk: &mut Desk<C>, atlas: &mut Atlas) -> bool {
        if let Some(listing) = self.listing {
            self.list(listing);
            return true;
        }
        if let Some(errand) = self.storage.errand {
            return self.answer_errand(&errand);
        }
        if self.charts.is_busy() {
            self.answer_map(desk, atlas);
            return false;
        }
        let corrects = |waiting: &Waiting| {
            matches!(
                waiting.command,
                Ok(Command::CorrectPos(..)
                    | Command::Observe(..)
                    | Command::Calibrate(_)
                    | Command::SetParam(..)
                    | Command::Plain(Keyword::ResetParams))
            )
        };
        let ready = desk.takes_corrections() || !self.waiting.front().is_some_and(corrects);
        if !desk.is_idle() || !ready {
            return false;
        }
        if !self.waiting.is_empty() {
            self.answer_waiting(desk, atlas);
            return true;
        }
        if let Some(late) = self.late.pop_front() {
            self.answer_late(desk, late);
            return true;
        }
        false
    }

    /// False if the errand is not done.
    #[inline(never)]
    fn answer_errand(&mut self, errand: &Errand) -> bool {
        let Stage::Done(result) = errand.stage else {
            return false;
        };
        self.storage.errand = None;
        let mut text = begin(errand.address);
        match result {
            Ok(()) => drop(text.str("OK")),
            Err(error) => error.write(&mut text),
        }
        self.send_with(&mut text, errand.check);
        true
    }

    #[inline(never)]
    fn answer_waiting<C: Blueprint>(&mut self, desk: &mut Desk<C>, atlas: &mut Atlas) {
        let Some(Waiting {
            address,
            letters,
            command,
        }) = self.waiting.pop_front()
        else {
            return;
        };
        // Judged now, not on arrival: the line before may have changed what is required.
        let check = self.wants_check(address);
        let mut text = begin(address);
        self.note_gains(desk);
        let done = match &command {
            Err(error @ (Error::TooLong | Error::BadByte)) => Err(*error),
            command if !self.is_checked(address, letters) && !stops(command) => {
                Err(Error::Checksum)
            }
            Err(error) => Err(*error),
            Ok(command) => self.execute(desk, atlas, command, &mut text),
        };
        self.note_gains(desk);
        if done.is_ok() {
            self.note_letters(letters);
            // What takes longer is one when it is answered.
            if !self.charts.is_asking() {
                desk.sign_of_life();
            }
            // A Stop that was obeyed before its turn was obeyed before this.
            let moves = command.as_ref().is_ok_and(Command::may_move);
            self.halt |= moves && self.stop_waits();
        }
        if let Some(errand) = &mut self.storage.errand {
            (errand.address, errand.check) = (address, check);
            return;
        }
        if self.charts.asks(address, check) {
            return;
        }
        if let Err(error) = done {
            text = begin(address);
            error.write(&mut text);
        }
        self.send_with(&mut text, check);
    }

    /// True if a Stop has come whose turn has not.
    fn stop_waits(&self) -> bool {
        let is_stop =
            |waiting: &Waiting| matches!(waiting.command, Ok(Command::Plain(Keyword::Stop)));
        let is_late = |late: &Late| matches!(late, Late::Stops(_, Keyword::Stop));
        self.forgotten || self.waiting.iter().any(is_stop) || self.late.iter().any(is_late)
    }

    #[inline(never)]
    fn answer_late<C: Blueprint>(&mut self, desk: &mut Desk<C>, late: Late) {
        let (Late::Busy(address, _) | Late::Stops(address, _)) = late;
        let mut text = begin(address);
        match late {
            Late::Busy(_, count) => {
                if count > 1 {
                    // There is room: it was just taken out.
                    let _ = self.late.push_front(Late::Busy(address, count - 1));
                }
                Error::Busy.write(&mut text);
            }
            Late::Stops(_, keyword) => match self.execute_plain(desk, keyword, &mut text) {
                Ok(()) => desk.sign_of_life(),
                Err(error) => error.write(&mut text),
            },
        }
        self.send_with(&mut text, self.wants_check(address));
    }

    /// A line that came with a check is answered with one, and every line while checks are required.
    fn wants_check(&self, address: Address) -> bool {
        address.has_check || self.params.is_on(Id::RequireCrc)
    }

    /// Whether a line has the check that may be required, with letters of the right case.
    fn is_checked(&self, address: Address, letters: Letters) -> bool {
        let good = address.has_check && self.letters.with(letters).is_some();
        good || !self.params.is_on(Id::RequireCrc)
    }

    /// A line was obeyed: if checks are required now, the case of its letters is the one that counts from here.
    fn note_letters(&mut self, letters: Letters) {
        self.letters = if self.params.is_on(Id::RequireCrc) {
            self.letters.with(letters).unwrap_or(self.letters)
        } else {
            Letters::default()
        };
    }

    #[inline(never)]
    fn tell(&mut self, snapshot: &Snapshot) {
        if self.has_room() {
            let mut text = Text::default();
            self.stream.write(&mut text, snapshot);
            self.send(&mut text);
        } else {
            self.stream.dropped = self.stream.dropped.saturating_add(1);
        }
    }

    fn has_room(&self) -> bool {
        OUTPUT - self.output.len() >= MAX_LINE + 2
    }

    fn send(&mut self, text: &mut Text) {
        let check = self.params.is_on(Id::RequireCrc);
        self.send_with(text, check);
    }

    fn send_with(&mut self, text: &mut Text, check: bool) {
        for byte in text.finish(check) {
            // There is room: it was asked for.
            let _ = self.output.push_back(*byte);
        }
    }
}

/// The names of all commands, for completion.
pub fn commands() -> impl Iterator<Item = &'static str> {
    keyword::ALL.iter().map(|entry| entry.name)
}

/// Move and turn before any command.
fn motion_defaults(params: &Params) -> [AxisCommand; 2] {
    let nowhere = |speed, acceleration| AxisCommand {
        distance: 0.0,
        speed,
        acceleration,
    };
    [
        nowhere(params.get(Id::MoveSpeed), params.get(Id::MoveAccel)),
        nowhere(
            radians(params.get(Id::TurnSpeed)),
            radians(params.get(Id::TurnAccel)),
        ),
    ]
}

fn begin(address: Address) -> Text {
    let mut text = Text::default();
    if let Some(tag) = address.tag {
        text.byte(b'@');
        number::integer(&mut text, i64::from(tag));
        text.byte(b' ');
    }
    text
}

/// What stops the base needs no check.
fn stops(command: &Result<Command, Error>) -> bool {
    matches!(command, Ok(Command::Plain(Keyword::Stop | Keyword::EStop)))
}
