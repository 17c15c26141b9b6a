//! Interpreter, desk and controller against a model of the protocol.
//!
//! The input is what comes over the serial line. LF lets the interpreter work, CR does not yet; bytes from 0x80 to 0x9F are not received: they let time
//! pass or something happen to the base.

mod hear;
mod judge;
mod reply;
mod route;

use std::collections::VecDeque;

use vehicle_controller::params::Params;
use vehicle_controller::supervisor::Fault;
use vehicle_controller::time::Duration;

use crate::base::{self, Asked, Base, Wheel};
use crate::grammar::Ask;
use crate::invariant;
use crate::protocol::{self, Line};
use route::Known;

/// So many lines may wait for their replies.
const UNANSWERED: usize = 4;
/// Every line is answered within so many ticks, if the output is taken.
const PATIENCE: usize = 600;

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
    /// An EStop came while it waited, so it may not move the base any more …
    stopped: bool,
    /// … if it still waited then.
    unsure: bool,
}

/// Rows of a list that are still to come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Rows {
    None,
    /// So many parameters.
    Params(usize),
    /// So many postures, from this number; nothing if it is not known.
    Path(Option<u64>, usize),
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
    rows: Rows,
    /// Paths and chases.
    route: Known,
    /// Rows of the map that are still to come.
    map_rows: usize,
    params: Params,
    /// Observations correct the gains.
    learns: bool,
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
            rows: Rows::None,
            route: Known::NEW,
            map_rows: 0,
            params,
            learns: false,
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
            if is(&line, b"EStop") {
                self.estop_received = true;
                for due in &mut self.due {
                    due.unsure |= self.stalled && !due.stopped;
                    due.stopped = true;
                }
            }
            self.due.push_back(Due {
                line,
                late: self.is_late(),
                stopped: false,
                unsure: false,
            });
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
            self.route = Known::NOTHING;
            while self.hear().anything {
                self.work();
            }
            self.stale = false;
            self.route = Known::NOTHING;
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
        // It overtakes what takes long.
        let may_ask = self.due.iter().any(|due| is(&due.line, b"Stop"));
        // A path is driven without being asked for it.
        let may_ask = may_ask || self.route.may_drive();
        let asks = self.work();
        if self.stalled {
            // Whatever it does is heard of later.
            self.params = *self.base.interpreter.params();
            self.note_limits();
            return;
        }
        if asks.acts {
            self.route.settle();
        }
        let Heard {
            obeyed, accepted, ..
        } = self.hear();
        if !self.framing_only {
            let must_ask = must_ask || obeyed;
            let may_ask = may_ask || self.route.may_drive();
            assert!(
                asks.acts == must_ask || asks.acts && may_ask,
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

    fn expect_rows(&mut self, ask: Ask, reply: &str) {
        match ask {
            Ask::Plain("ListParams") => self.rows = Rows::Params(Params::default().count()),
            Ask::Plain("GetPath") => self.hear_path(reply),
            Ask::Plain("GetMap") | Ask::Map("Route" | "AmIThere", _) => {
                self.map_rows = crate::replies::map_rows(ask, reply);
            }
            _ => {}
        }
        // A list of nothing has come whole.
        if let Rows::Path(_, 0) = self.rows {
            self.rows = Rows::None;
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
            if self.due.is_empty() && self.rows == Rows::None && self.map_rows == 0 {
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
        const LAST: [&[u8]; 2] = [b"@7 GetStatus*609F\n", b"@8 GetPath*89D4\n"];
        for line in LAST {
            self.settle();
            for at in 1..=line.len() {
                self.receive(&line[..at]);
            }
            self.poll();
        }
        self.settle();
        assert!(self.route.all_told(), "not all was told: {:?}", self.route);
        invariant::check_estimate(&self.base.snapshot().estimator.present());
    }
}

fn is(line: &Line<'_>, command: &[u8]) -> bool {
    line.body
        .is_ok_and(|body| body.eq_ignore_ascii_case(command))
}

/// Stop and EStop: they need no check, and are never too late.
fn stops(line: &Line<'_>) -> bool {
    is(line, b"Stop") || is(line, b"EStop")
}

fn shown(line: &Line<'_>) -> String {
    format!(
        "{:?}",
        line.body.map(|body| body.escape_ascii().to_string())
    )
}
