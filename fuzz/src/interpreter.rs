//! Interpreter, desk and controller against a model of the protocol.
//!
//! The input is what comes over the serial line. LF lets the interpreter work, CR does not yet; bytes from 0x80 to 0x9F are not received: they let time
//! pass or something happen to the base.

use std::collections::VecDeque;

use vehicle_controller::controller::Snapshot;
use vehicle_controller::params::{Id, Kind, Params};
use vehicle_controller::supervisor::Fault;
use vehicle_controller::time::Duration;

use crate::base::{self, Asked, Base, Wheel};
use crate::grammar::{self, Ask, Codes, Doubts};
use crate::invariant;
use crate::protocol::{self, Damage, Line};
use crate::replies;

/// So many lines may wait for their replies.
const UNANSWERED: usize = 4;
/// Every line is answered within so many ticks, if the output is taken.
const PATIENCE: usize = 200;

/// Whether a line came when four were waiting.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Late {
    No,
    Yes,
    /// What has been answered could not be heard.
    Maybe,
}

/// A line that is to be answered.
struct Due<'a> {
    line: Line<'a>,
    late: Late,
}

/// What the base said.
#[derive(Clone, Copy, Default)]
struct Heard {
    anything: bool,
    /// A line was not refused …
    accepted: bool,
    /// … and changes something in the controller.
    obeyed: bool,
}

#[allow(
    clippy::struct_excessive_bools,
    reason = "they are independent of each other"
)]
/// What is known of the base besides its snapshot, and what its client waits for.
pub(crate) struct Session<'a> {
    pub(crate) base: Base<'a>,
    wheels: &'a [Wheel; 2],
    due: VecDeque<Due<'a>>,
    received: Vec<u8>,
    /// Nobody takes the output.
    stalled: bool,
    /// What comes was said some time ago.
    stale: bool,
    /// Only tags, checks, codes of damage, number and order are looked at.
    framing_only: bool,
    /// Rows of a list that are still to come.
    rows: usize,
    params: Params,
    /// The case of checks since they are required: upper, lower; nothing if it is not known.
    letters: Option<[bool; 2]>,
    /// v and a that the last accepted moves and turns gave.
    given: [[Option<f64>; 2]; 2],
    /// An EStop has come, which the interpreter has not looked at yet.
    estop_received: bool,
    /// It has: the next tick latches the fault.
    estop_due: bool,
    /// The largest v that any command could ask for, m/s and rad/s.
    fastest: [f32; 2],
    /// ResetPos was accepted: what the next estimate is, if the wheels stand.
    placed: Option<[f64; 3]>,
}

/// Runs an input.
///
/// # Panics
/// If a promise is broken.
pub fn run(data: &[u8]) {
    // What is received is a part of what is given: lines are slices of it.
    let is_byte = |b: &u8| !matches!(b, 0x80..=0x9F);
    let mut stream: Vec<u8> = Vec::with_capacity(data.len() + 1);
    stream.extend(data.iter().copied().filter(is_byte));
    stream.push(b'\n');
    let wheels = Default::default();
    let mut session = Session::new(&wheels, false);
    let (mut at, mut start) = (0, 0);
    for byte in data.iter().chain(b"\n") {
        if !is_byte(byte) {
            session.happen(*byte);
            continue;
        }
        at += 1;
        session.receive(&stream[start..at]);
        if matches!(byte, b'\r' | b'\n') {
            start = at;
        }
        if *byte == b'\n' {
            session.poll();
        }
    }
    session.finish();
}

impl<'a> Session<'a> {
    pub(crate) fn new(wheels: &'a [Wheel; 2], framing_only: bool) -> Self {
        let base = Base::new(wheels);
        let params = base::defaults().params;
        let limits = params.limits();
        Self {
            base,
            wheels,
            due: VecDeque::new(),
            received: Vec::new(),
            stalled: false,
            stale: false,
            framing_only,
            rows: 0,
            params,
            letters: Some([false; 2]),
            given: [[None; 2]; 2],
            estop_received: false,
            estop_due: false,
            fastest: [limits.speed, limits.turn_speed],
            placed: None,
        }
    }

    /// The last byte of `so_far` comes: all that has come since the last line end.
    pub(crate) fn receive(&mut self, so_far: &'a [u8]) {
        let Some((byte, line)) = so_far.split_last() else {
            return;
        };
        if !self.base.interpreter.can_receive() {
            self.settle();
        }
        self.base.interpreter.receive(*byte);
        if !matches!(byte, b'\r' | b'\n') {
            return;
        }
        if let Some(line) = protocol::read(line) {
            self.estop_received |= is(&line, b"EStop");
            let late = self.is_late();
            self.due.push_back(Due { line, late });
        }
    }

    /// Whether a line that comes now is too late.
    fn is_late(&self) -> Late {
        let full = self.due.len() >= UNANSWERED;
        let unsure = self.stalled || self.due.iter().any(|due| due.late == Late::Maybe);
        if unsure && full {
            Late::Maybe
        } else if unsure && self.due.iter().all(|due| due.late == Late::No) {
            Late::No
        } else if unsure {
            Late::Maybe
        } else if full || self.due.iter().any(|due| due.late == Late::Yes) {
            Late::Yes
        } else {
            Late::No
        }
    }

    fn happen(&mut self, what: u8) {
        let [left, right] = self.wheels;
        let inputs = &mut self.base.inputs;
        match what {
            0x80..=0x87 => (0..=what - 0x80).for_each(|_| self.tick(0)),
            0x88..=0x8F => {
                let late = [2, 5, 10, 30, 100, 300, 1000, 3000];
                self.tick(late[usize::from(what - 0x88)]);
            }
            0x90 => inputs.stop_button = true,
            0x91 => inputs.stop_button = false,
            0x92 => inputs.estop_open = true,
            0x93 => inputs.estop_open = false,
            0x94 => left.broken.set(true),
            0x95 => left.broken.set(false),
            0x96 => self.stalled = true,
            0x97 => self.listen_again(),
            0x98 => inputs.battery = None,
            0x99 => inputs.battery = Some(0.0),
            0x9A => inputs.battery = Some(f32::NAN),
            0x9B => inputs.battery = Some(12.0 / 11.0),
            0x9C => self.poll(),
            0x9D => left.jump(100),
            0x9E => right.jump(-100),
            _ => left.jump(30_000),
        }
    }

    fn listen_again(&mut self) {
        if self.stalled {
            self.stalled = false;
            self.stale = true;
            while self.hear().anything {
                self.work();
            }
            self.stale = false;
            self.params = *self.base.interpreter.params();
            self.note_limits();
        }
    }

    pub(crate) fn tick(&mut self, late: u64) {
        let before = self.base.snapshot().wheels.map(|wheel| wheel.count);
        self.base.tick(Duration::millis(late));
        let snapshot = self.base.snapshot();
        invariant::check(snapshot);
        if core::mem::take(&mut self.estop_due) {
            assert_eq!(snapshot.fault, Some(Fault::Estop), "after an EStop");
            assert!(self.base.is_off(), "after an EStop");
        }
        for (axis, fastest) in [&snapshot.translation, &snapshot.rotation]
            .into_iter()
            .zip(self.fastest)
        {
            let v = axis.reference_speed.abs();
            assert!(v <= fastest * 1.000_01, "{v} beyond {fastest}: {axis:?}");
        }
        if let Some([x, y, theta]) = self.placed.take()
            && before == snapshot.wheels.map(|wheel| wheel.count)
        {
            let pose = snapshot.estimator.present().pose;
            let [dx, dy] = [pose.x - x, pose.y - y].map(f64::abs);
            let turned = (pose.theta - theta.to_radians()).abs();
            assert!(
                // The vehicle may still have the rounding of earlier counts to tell.
                dx <= 1e-6 + 1e-12 * x.abs()
                    && dy <= 1e-6 + 1e-12 * y.abs()
                    && turned <= 1e-5 + 1e-12 * theta.abs(),
                "ResetPos {x} {y} {theta} made {pose:?}"
            );
        }
        self.poll();
    }

    /// The interpreter works.
    fn work(&mut self) -> Asked {
        self.estop_due |= core::mem::take(&mut self.estop_received);
        self.base.poll()
    }

    pub(crate) fn poll(&mut self) {
        let must_ask = self.estop_received;
        let asks = self.work();
        if self.stalled {
            // Whatever it does is heard of later.
            self.params = *self.base.interpreter.params();
            self.note_limits();
            return;
        }
        let Heard {
            obeyed, accepted, ..
        } = self.hear();
        if !self.framing_only {
            assert_eq!(
                asks.acts,
                obeyed || must_ask,
                "a refused command changes nothing, an accepted one something"
            );
            // Whatever acts is a sign of life, too.
            assert!(
                if accepted {
                    asks.lives || asks.acts
                } else {
                    !asks.lives
                },
                "an accepted line is a sign of life, and nothing else is: {asks:?}"
            );
        }
        assert!(
            self.params == *self.base.interpreter.params(),
            "parameters that no command has changed"
        );
    }

    /// Hears what the base says.
    fn hear(&mut self) -> Heard {
        self.received.clear();
        let mut received = core::mem::take(&mut self.received);
        received.extend(std::iter::from_fn(|| self.base.interpreter.transmit()));
        let required = self.params.is_on(Id::RequireCrc);
        let mut heard = Heard {
            anything: !received.is_empty(),
            ..Heard::default()
        };
        for line in replies::lines(&received) {
            let text = str::from_utf8(line).unwrap_or_default();
            if matches!(line, [b'!' | b'~', ..]) {
                self.hear_unsolicited(text, required);
            } else {
                let reply = self.hear_reply(text, required);
                heard.obeyed |= reply.obeyed;
                heard.accepted |= reply.accepted;
            }
        }
        self.received = received;
        heard
    }

    fn hear_unsolicited(&mut self, line: &str, required: bool) {
        // A command that was obeyed in this same poll may have changed what is required.
        let now = self.base.interpreter.params().is_on(Id::RequireCrc);
        let line = if required == now && !self.stale {
            unchecked(line, required)
        } else {
            either(line)
        };
        let name = line.split(' ').nth(1).unwrap_or_default();
        let next = Id::ALL.len() - self.rows;
        match Id::ALL.get(next) {
            Some(id) if id.spec().name == name => {
                self.rows -= 1;
                if !self.stale {
                    replies::row(line, &self.params, *id);
                }
            }
            _ if self.framing_only => {}
            _ => replies::unsolicited(line),
        }
    }

    /// Hears a reply.
    fn hear_reply(&mut self, reply: &str, required: bool) -> Heard {
        assert_eq!(self.rows, 0, "a reply within a list: {reply}");
        let Some(Due { line, late }) = self.due.pop_front() else {
            panic!("nobody asked for {reply}");
        };
        let reply = if self.stale && !line.has_check {
            either(reply)
        } else {
            unchecked(reply, line.has_check || required)
        };
        let reply = match line.tag {
            None => reply,
            Some(tag) => reply
                .strip_prefix('@')
                .and_then(|reply| reply.split_once(' '))
                .filter(|(echoed, _)| *echoed == tag.to_string())
                .map_or_else(|| panic!("@{tag} is answered {reply}"), |(_, reply)| reply),
        };
        let code = code(reply);
        let (ask, mut doubts) = match line.body {
            Ok(body) => grammar::read(body),
            Err(damage) => {
                let must = Codes::named(damage.code().as_bytes());
                let may = Codes::NONE;
                (None, Doubts { must, may })
            }
        };
        if let Some(ask) = ask {
            self.judge(ask, &mut doubts);
        }
        let missing = !line.has_check && !stops(&line);
        let damaged = matches!(line.body, Err(Damage::TooLong | Damage::BadByte));
        if missing && !damaged && (required || self.stale) {
            let certain = if self.stale {
                &mut doubts.may
            } else {
                doubts.must = Codes::NONE;
                &mut doubts.must
            };
            certain.add(Codes::CHECKSUM);
        }
        let mixes = |letters: [bool; 2]| letters == [true; 2];
        let counts = matches!(line.body, Ok(_) | Err(Damage::Tag)) && !stops(&line);
        let together = self.letters.map(|letters| both(letters, line.letters));
        let refused = mixes(line.letters) || together.is_some_and(mixes);
        if counts && self.stale {
            // What was required then is not known.
            doubts.may.add(Codes::CHECKSUM);
        } else if counts && required && refused {
            doubts.must = Codes::CHECKSUM;
        } else if counts && required && together.is_none() {
            doubts.may.add(Codes::CHECKSUM);
        }
        match late {
            Late::No => {}
            Late::Yes if stops(&line) => {}
            Late::Yes => doubts.must = Codes::BUSY,
            Late::Maybe => doubts.may.add(Codes::BUSY),
        }
        match code {
            Some(code) => assert!(
                doubts.must.has(code) || doubts.may.has(code),
                "{} is answered {reply}; {doubts:?}",
                shown(&line)
            ),
            None => assert!(
                doubts.must.is_empty() || self.framing_only && line.body.is_ok(),
                "{} is answered {reply}; {doubts:?}",
                shown(&line)
            ),
        }
        let obeyed = match (code, ask) {
            (None, Some(ask)) => self.obeyed(ask, reply),
            _ => false,
        };
        if code.is_none() {
            self.note_letters(&line, late);
        }
        Heard {
            anything: true,
            accepted: code.is_none(),
            obeyed,
        }
    }

    /// A line was obeyed, with this check: from here the case of its letters counts.
    fn note_letters(&mut self, line: &Line<'_>, late: Late) {
        if late != Late::No {
            // What stops the base decides nothing when it comes too late, and something when not.
            self.letters = self.letters.filter(|_| late == Late::Yes);
            return;
        }
        if self.stale {
            self.letters = None;
            return;
        }
        let [upper, lower] = line.letters;
        self.letters = match self.letters {
            _ if !self.params.is_on(Id::RequireCrc) => Some([false; 2]),
            Some(letters) if both(letters, line.letters) != [true; 2] => {
                Some(both(letters, line.letters))
            }
            None if upper != lower && !stops(line) => Some(line.letters),
            unchanged => unchanged,
        };
    }

    /// Why a command that is well written must or may be refused now.
    fn judge(&self, ask: Ask, doubts: &mut Doubts) {
        let snapshot = self.base.snapshot();
        if self.stale {
            // Then it was another time.
            for code in [
                Codes::RANGE,
                Codes::FAULT,
                Codes::DISABLED,
                Codes::MOVING,
                Codes::GATE,
                Codes::NOT_PSD,
                Codes::STORAGE,
            ] {
                doubts.may.add(code);
            }
            return;
        }
        match ask {
            Ask::Motion(axis, [_, v, a]) => {
                let [v_id, a_id, v_max, a_max] = MOTION[axis];
                let [v_last, a_last] = self.given[axis];
                let get = |id| f64::from(self.params.get(id));
                let v = v.or(v_last).unwrap_or_else(|| get(v_id));
                let a = a.or(a_last).unwrap_or_else(|| get(a_id));
                doubts.limit(v, 0.0, get(v_max));
                doubts.limit(a, 0.0, get(a_max));
                doubts.must.add_if(a == 0.0, Codes::RANGE);
                doubts.must.add_if(snapshot.fault.is_some(), Codes::FAULT);
                doubts.must.add_if(!snapshot.enabled, Codes::DISABLED);
            }
            Ask::CorrectPos => {
                doubts.may.add(Codes::NOT_PSD);
                doubts.may.add(Codes::RANGE);
            }
            Ask::ResetPos(_, c) => {
                if !invariant::is_positive(c, 1e-3) {
                    doubts.must.add(Codes::NOT_PSD);
                }
                doubts
                    .may
                    .add_if(!invariant::is_positive(c, 0.0), Codes::NOT_PSD);
            }
            Ask::Observe(aged) => {
                doubts.may.add(Codes::NOT_PSD);
                // What comes out may be too large, or the past not known.
                doubts.may.add(Codes::RANGE);
                let _ = aged;
                doubts
                    .may
                    .add_if(self.params.get(Id::Gate) > 0.0, Codes::GATE);
            }
            Ask::SetParam(id, value) => self.judge_param(id, value, doubts),
            Ask::Plain("ClearFault") => {
                let lasts = snapshot.fault.is_some() && snapshot.fault_persists;
                doubts.must.add_if(lasts, Codes::FAULT);
            }
            Ask::Plain("ResetParams") => {
                doubts.must.add_if(snapshot.is_moving(), Codes::MOVING);
            }
            Ask::Plain("SaveParams" | "LoadParams") => {
                doubts.may.add(Codes::MOVING);
                doubts.may.add(Codes::STORAGE);
            }
            Ask::Plain(_) | Ask::Help | Ask::Stream | Ask::GetParam(_) => {}
        }
    }

    fn judge_param(&self, id: Id, value: f64, doubts: &mut Doubts) {
        let spec = id.spec();
        doubts.limit(value, f64::from(spec.min), f64::from(spec.max));
        // A limit itself is no doubt: numbers are compared as f32.
        let value = value as f32;
        if value == spec.min || value == spec.max {
            doubts.may = Codes::NONE;
        }
        let is_switch = matches!(spec.kind, Kind::Switch | Kind::Wiring);
        doubts
            .must
            .add_if(is_switch && value != 0.0 && value != 1.0, Codes::RANGE);
        let with = |other: Id| {
            if other == id {
                value
            } else {
                self.params.get(other)
            }
        };
        for (small, large) in ORDERED {
            if (small == id || large == id) && with(small) > with(large) {
                // By a hair, rounding decides.
                let hair = with(small) <= with(large) * 1.000_001;
                let doubt = if hair {
                    &mut doubts.may
                } else {
                    &mut doubts.must
                };
                doubt.add(Codes::RANGE);
            }
        }
        let geometry = matches!(spec.kind, Kind::Geometry | Kind::Wiring);
        let moving = self.base.snapshot().is_moving();
        doubts.must.add_if(geometry && moving, Codes::MOVING);
    }

    /// A command was obeyed: its reply tells what it must, and what it changes is changed. True if the controller is to do something.
    fn obeyed(&mut self, ask: Ask, reply: &str) -> bool {
        if self.framing_only {
            self.params = *self.base.interpreter.params();
            self.note_limits();
            self.expect_rows(ask);
            return false;
        }
        let snapshot: &Snapshot = self.base.snapshot();
        match ask {
            Ask::Help => {
                assert!(reply.starts_with("Help "), "{reply}");
                return false;
            }
            Ask::GetParam(id) => {
                if !self.stale {
                    replies::param(reply, &self.params, id);
                }
                return false;
            }
            Ask::Observe(_) => {
                let [distance] = replies::numbers(reply, "Observed", [6]);
                let gate = f64::from(self.params.get(Id::Gate));
                let inside = gate == 0.0 || self.stale || distance <= gate * 1.000_001 + 1e-6;
                assert!(distance >= 0.0 && inside, "{reply}, gate {gate}");
                return true;
            }
            Ask::Plain("ListParams") => {
                assert_eq!(reply, format!("Params {}", Id::ALL.len()));
                self.expect_rows(ask);
                return false;
            }
            Ask::Plain(command) if command.starts_with("Get") || command == "Version" => {
                if !self.stale {
                    replies::of_snapshot(command, reply, snapshot);
                    invariant::check_estimate(&snapshot.estimator.present());
                }
                return false;
            }
            _ => assert_eq!(reply, "OK", "{ask:?}"),
        }
        match ask {
            Ask::Motion(axis, [_, v, a]) => {
                let [v_last, a_last] = &mut self.given[axis];
                *v_last = v.or(*v_last);
                *a_last = a.or(*a_last);
            }
            Ask::SetParam(id, value) if !self.stale => {
                let now = *self.base.interpreter.params();
                let set = now.get(id);
                let same = (f64::from(set) - value).abs() <= value.abs() * 1.3e-7 + 1e-40;
                assert!(same, "{ask:?} set {set}");
                // All others are as they were: it is compared as a whole.
                let kept = self.params.set(id, set);
                assert_eq!(kept, Ok(()), "{ask:?}");
                self.note_limits();
            }
            Ask::Plain("ResetParams") => {
                self.params = base::defaults().params;
                self.note_limits();
            }
            Ask::Plain("LoadParams") => {
                self.params = *self.base.interpreter.params();
                self.note_limits();
            }
            Ask::ResetPos(pose, _) if !self.stale => self.placed = Some(pose),
            _ => {}
        }
        !matches!(ask, Ask::Stream)
    }

    fn expect_rows(&mut self, ask: Ask) {
        if ask == Ask::Plain("ListParams") {
            self.rows = Id::ALL.len();
        }
    }

    fn note_limits(&mut self) {
        let limits = self.params.limits();
        for (fastest, limit) in self
            .fastest
            .iter_mut()
            .zip([limits.speed, limits.turn_speed])
        {
            *fastest = fastest.max(limit);
        }
    }

    /// All is answered in time.
    fn settle(&mut self) {
        self.listen_again();
        self.poll();
        for _ in 0..PATIENCE {
            if self.due.is_empty() && self.rows == 0 {
                return;
            }
            self.tick(0);
        }
        panic!(
            "no answer to {:?}",
            self.due.front().map(|due| shown(&due.line))
        );
    }

    /// Whatever came, the next good line is answered as ever.
    pub(crate) fn finish(&mut self) {
        const LAST: &[u8] = b"@7 GetStatus*609F\n";
        self.settle();
        for at in 1..=LAST.len() {
            self.receive(&LAST[..at]);
        }
        self.poll();
        self.settle();
        invariant::check_estimate(&self.base.snapshot().estimator.present());
    }
}

/// v and a of a command, and their limits.
const MOTION: [[Id; 4]; 2] = [
    [Id::MoveSpeed, Id::MoveAccel, Id::MaxSpeed, Id::MaxAccel],
    [
        Id::TurnSpeed,
        Id::TurnAccel,
        Id::MaxTurnSpeed,
        Id::MaxTurnAccel,
    ],
];

/// A default or a stop beyond what a command may ask for is refused.
const ORDERED: [(Id, Id); 6] = [
    (Id::MoveSpeed, Id::MaxSpeed),
    (Id::MoveAccel, Id::MaxAccel),
    (Id::StopAccel, Id::MaxAccel),
    (Id::TurnSpeed, Id::MaxTurnSpeed),
    (Id::TurnAccel, Id::MaxTurnAccel),
    (Id::StopTurnAccel, Id::MaxTurnAccel),
];

fn is(line: &Line<'_>, command: &[u8]) -> bool {
    line.body
        .is_ok_and(|body| body.eq_ignore_ascii_case(command))
}

/// Stop and EStop: they need no check, and are never too late.
fn stops(line: &Line<'_>) -> bool {
    is(line, b"Stop") || is(line, b"EStop")
}

fn both(a: [bool; 2], b: [bool; 2]) -> [bool; 2] {
    [a[0] || b[0], a[1] || b[1]]
}

/// The code of a refusal; a refusal without one is none.
fn code(reply: &str) -> Option<Codes> {
    let refusal = reply.strip_prefix("ERR ")?;
    let (code, text) = refusal.split_once(' ').unwrap_or((refusal, ""));
    let code = Codes::named(code.as_bytes());
    assert!(!code.is_empty() && !text.is_empty(), "{reply}");
    Some(code)
}

/// A line without its check, which must be there and right; or must not be there.
fn unchecked(line: &str, must: bool) -> &str {
    if !must {
        let checked = line.rsplit_once('*').is_some_and(|(content, check)| {
            protocol::is_right(content.as_bytes(), check.as_bytes())
        });
        assert!(!checked, "a check that nobody wants: {line}");
        return line;
    }
    let (content, check) = line.rsplit_once('*').unwrap_or((line, ""));
    assert!(
        protocol::is_right(content.as_bytes(), check.as_bytes()),
        "no right check: {line}"
    );
    content
}

/// A line without its check, if it has one.
fn either(line: &str) -> &str {
    line.rsplit_once('*')
        .filter(|(content, check)| protocol::is_right(content.as_bytes(), check.as_bytes()))
        .map_or(line, |(content, _)| content)
}

fn shown(line: &Line<'_>) -> String {
    format!(
        "{:?}",
        line.body.map(|body| body.escape_ascii().to_string())
    )
}
