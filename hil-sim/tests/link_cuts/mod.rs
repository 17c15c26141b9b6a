//! The link is cut in the midst of motions without an end, at random: what the base does then, and what it says afterwards.
#![allow(dead_code, reason = "each test uses a part of it")]

use hil_sim::base::Base;
use hil_sim::faults::Fault;
use hil_sim::robot::Robot;
use hil_sim::trace::Row;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use vehicle_controller::params::Id;

/// The seed of the choice of cuts, and of the bases.
pub const SEED: u64 = 4;
/// The dead-man's switch as it comes, ms.
const DEADMAN_MS: u64 = 1000;
/// Somebody says something this often, ms.
const LIFE_MS: u64 = 300;
/// From a line's first byte to the tick that has it as a sign of life, ms: a line of 40 bytes takes 3.5 ms at 115 200 baud, and the tick is one more.
const LINE_MS: u64 = 5;
/// The reference starts to slow down in the tick of the fault, and its ramp ends on a whole tick; what is seen of an image may be a tick old.
const TICKS_MS: u64 = 3;
/// A base below this stands, m/s and rad/s: its wheels settle within their play, and the speeds of that are not driving. The base is that slow before its
/// reference rests, so it needs no time of its own.
const STANDS: [f64; 2] = [0.01, 2.0 / 180.0 * std::f64::consts::PI];
/// The axes wait for so long to come to rest before the motors are switched off, ms.
const PATIENCE_MS: u64 = 600;

/// Somebody at the line of a base.
pub struct Caller<B: ?Sized> {
    pub lines: Vec<(u64, String)>,
    partial: Vec<u8>,
    /// ms.
    pub now: u64,
    pub base: Box<B>,
}

impl<B: Base + ?Sized> Caller<B> {
    pub fn new(base: Box<B>) -> Self {
        let mut caller = Self {
            lines: Vec::new(),
            partial: Vec::new(),
            now: 0,
            base,
        };
        caller.run(100);
        caller
    }

    pub fn send(&mut self, line: &str) {
        self.base.send(format!("{line}\n").as_bytes()).unwrap();
    }

    pub fn tick(&mut self) {
        self.base.tick().unwrap();
        self.now += 1;
        for byte in self.base.receive() {
            match byte {
                b'\r' => {}
                b'\n' => {
                    let line = String::from_utf8_lossy(&self.partial).into_owned();
                    self.partial.clear();
                    self.lines.push((self.now, line));
                }
                byte => self.partial.push(byte),
            }
        }
    }

    pub fn run(&mut self, milliseconds: u64) {
        for _ in 0..milliseconds {
            self.tick();
        }
    }

    /// Sends a line, and gives its answer.
    pub fn ask(&mut self, line: &str) -> String {
        let from = self.lines.len();
        self.send(line);
        for _ in 0..300 {
            self.tick();
            let is_reply = |line: &&(u64, String)| !line.1.starts_with(['!', '~']);
            if let Some((_, reply)) = self.lines[from..].iter().find(is_reply) {
                return reply.clone();
            }
        }
        panic!("`{line}` was not answered: {:?}", self.lines);
    }

    pub fn row(&self) -> Row {
        self.base.row().unwrap()
    }

    pub fn has_stopped(&self) -> bool {
        let (speed, turn_speed) = self.base.plant().speed();
        speed.abs() < STANDS[0] && turn_speed.abs() < STANDS[1]
    }

    pub fn set_cut(&mut self, cut: bool) {
        if cut {
            self.base.inject(Fault::LinkCut).unwrap();
            // Half of a line never gets its other half.
            self.partial.clear();
        } else {
            self.base.clear_faults().unwrap();
        }
    }

    /// The events since a time, without what follows their names.
    pub fn events(&self, since: u64) -> Vec<&str> {
        let events = self.lines.iter().filter(|(at, _)| *at >= since);
        events
            .filter_map(|(_, line)| line.strip_prefix("! "))
            .collect()
    }
}

/// A cut.
#[derive(Clone, Debug)]
pub struct Cut {
    /// Speeds without an end of translation and rotation, in the protocol's units; one of them may be 0.
    speeds: [f64; 2],
    accelerations: [f64; 2],
    /// ms after the commands.
    phase: u64,
    /// ms by which the signs of life are shifted.
    shift: u64,
}

impl Cut {
    /// So many random ones.
    pub fn random(number: usize) -> Vec<Self> {
        let mut random = ChaCha8Rng::seed_from_u64(SEED);
        let mut cut = || {
            let mut speed = |most: f64| {
                let sign = if random.random() { 1.0 } else { -1.0 };
                (sign * random.random_range(0.05..1.0) * most * 100.0).round() / 100.0
            };
            let (s, r) = (speed(0.7), speed(360.0));
            let speeds = match random.random_range(0..3) {
                0 => [s, 0.0],
                1 => [0.0, r],
                _ => [s, r],
            };
            Self {
                speeds,
                accelerations: [
                    random.random_range(0.2..2.0_f64),
                    random.random_range(90.0..1440.0_f64),
                ],
                phase: random.random_range(1..4000),
                shift: random.random_range(0..LIFE_MS),
            }
        };
        (0..number).map(|_| cut()).collect()
    }

    /// Cuts the link of a base, and checks what it does. Gives the times from the cut until the reference and until the base itself were at rest, over
    /// deadman + v/a + the line's time.
    pub fn try_on<B: Base + ?Sized>(&self, base: Box<B>, robot: &Robot) -> [f64; 2] {
        let mut caller = Caller::new(base);
        let names = ["m", "t"];
        for axis in [0, 1] {
            let (speed, acceleration) = (self.speeds[axis], self.accelerations[axis]);
            if speed != 0.0 {
                let sign = if speed < 0.0 { "-" } else { "" };
                caller.send(&format!(
                    "{} {sign}inf {} {acceleration:.3}",
                    names[axis],
                    speed.abs()
                ));
            }
        }
        let begun = caller.now;
        let mut lives = vec![begun];
        while caller.now < begun + self.phase {
            if (caller.now + self.shift).is_multiple_of(LIFE_MS) {
                caller.send("GetTime");
                lives.push(caller.now);
            }
            caller.tick();
        }
        let cut = caller.now;
        caller.set_cut(true);

        // A line that the cut may have caught in its midst may count or not.
        let sure = lives.iter().rev().find(|at| **at + LINE_MS <= cut).copied();
        // Before the commands have arrived there is nothing to stop.
        let Some(sure) = sure else { return [0.0; 2] };
        let latest = lives.last().copied().unwrap_or(sure);
        let get = |id| f64::from(robot.params.get(id));
        let rates = [get(Id::StopAccel), get(Id::StopTurnAccel)];
        let ramp = (0..2).map(|axis| self.speeds[axis].abs() / rates[axis]);
        let ramp_ms = (1e3 * ramp.fold(0.0, f64::max)).ceil() as u64;

        let (mut latched, mut still, mut stopped, mut driven) = (None, cut, cut, cut);
        let end = cut + DEADMAN_MS + LINE_MS + ramp_ms + PATIENCE_MS + 300;
        while caller.now < end {
            caller.tick();
            let row = caller.row();
            let now = caller.now;
            if row.v_s_ref != 0.0 || row.v_alpha_ref != 0.0 {
                still = now + 1;
            }
            if !caller.has_stopped() {
                stopped = now + 1;
            }
            if row.left_duty != 0.0 || row.right_duty != 0.0 {
                driven = now + 1;
            }
            if latched.is_none() && row.fault != "none" {
                assert_eq!(row.fault, "link", "{self:?}");
                latched = Some(now);
            }
        }
        let latched = latched.unwrap_or_else(|| panic!("{self:?}: no fault"));
        let earliest = sure + DEADMAN_MS;
        let deadline = latest + DEADMAN_MS + LINE_MS;
        assert!(
            (earliest..=deadline + TICKS_MS).contains(&latched),
            "{self:?}: latched at {latched} ms, cut at {cut} ms, last sign of life at {sure} to {latest} ms"
        );
        // v/a counts from the fault: deadman + v/a after the last sign of life, which is at most a line's time after the cut.
        let still_by = deadline + ramp_ms + TICKS_MS;
        assert!(
            still <= still_by,
            "{self:?}: reference {still}, {still_by} ms"
        );
        assert!(
            stopped <= still_by,
            "{self:?}: base {stopped}, {still_by} ms"
        );
        let off_by = deadline + ramp_ms + PATIENCE_MS;
        assert!(driven <= off_by, "{self:?}: driven {driven}, {off_by} ms");
        Self::is_over(&mut caller);
        [still, stopped]
            .map(|at| at.saturating_sub(cut) as f64 / (DEADMAN_MS + LINE_MS + ramp_ms) as f64)
    }

    /// The link is back: the base says what was, and nothing moves it but a new command after ClearFault.
    fn is_over<B: Base + ?Sized>(caller: &mut Caller<B>) {
        caller.set_cut(false);
        // Whatever half of a line got through ends here, and its refusal is not what is asked for.
        caller.send("");
        caller.run(20);
        let counts = caller.base.plant().counts();
        assert_eq!(caller.ask("GetStatus"), "Status HOLD HOLD enabled link");
        assert!(caller.ask("m 0.1").starts_with("ERR fault"));
        caller.run(100);
        assert_eq!(caller.ask("ClearFault"), "OK");
        caller.run(300);
        assert_eq!(caller.base.plant().counts(), counts, "it moves by itself");
        assert_eq!(caller.ask("m 0.03 0.3 2"), "OK");
        let since = caller.now;
        caller.run(1000);
        let done = caller
            .events(since)
            .iter()
            .any(|e| e.starts_with("move done"));
        assert!(done, "{:?}", caller.lines);
    }
}
