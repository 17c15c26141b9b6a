//! A base without a plant: a vehicle that follows perfectly, the real controller, desk and interpreter, stepped at 1 kHz.
#![allow(dead_code, reason = "each test file uses a part of it")]
#![allow(
    clippy::large_types_passed_by_value,
    reason = "a test makes parameters for one base"
)]

pub(crate) mod paths;

use std::f64::consts::PI;
use vehicle_controller::controller::{Action, Controller, Estimate, Inputs, Interface, Snapshot};
use vehicle_controller::interpreter::{Desk, Identity, Interpreter};
use vehicle_controller::map::Atlas;
use vehicle_controller::params::{Id, Params};
use vehicle_controller::supervisor::Fault;
use vehicle_controller::time::{self, Duration, Instant};
use vehicle_controller::vehicle::differential::Config;
use vehicle_controller::vehicle::{Motion, OutputError, Twist, VirtualVehicle, Wheel};

/// The control loop's period.
pub(crate) const PERIOD: Duration = Duration::millis(1);
/// Degrees in a radian.
pub(crate) const DEGREES: f64 = 180.0 / PI;

/// A vehicle that does what it is told, at once and exactly.
#[derive(Debug)]
pub(crate) struct Perfect {
    config: Config,
    speed: Twist,
    /// What its motors are driven for, and were in the cycle before.
    driven: [Twist; 2],
    rolled: [f64; 2],
    /// The outputs refuse to be written.
    broken: std::rc::Rc<std::cell::Cell<bool>>,
    hand: std::rc::Rc<Hand>,
}

/// What happens to a vehicle, whatever its motors do; and what they do.
#[derive(Debug, Default)]
pub(crate) struct Hand {
    /// The vehicle is carried along at this speed, m/s.
    pub(crate) carries: std::cell::Cell<Option<f32>>,
    /// What the next increment is wrong by, m.
    pub(crate) error: std::cell::Cell<f32>,
    /// The motors are driven.
    pub(crate) drives: std::cell::Cell<bool>,
    /// They are not, and brake.
    pub(crate) brakes: std::cell::Cell<bool>,
}

impl Perfect {
    /// What its motor would need to come from one speed to another in a cycle, at the default robot's nominal battery.
    fn duty(&self, wheel: usize, before: f32, speed: f32) -> f32 {
        let servo = self.config.servo[wheel];
        let friction = if speed == 0.0 {
            0.0
        } else {
            servo.static_friction * speed.signum()
        };
        let acceleration = (speed - before) / time::seconds(PERIOD);
        (friction + servo.speed_gain * speed + servo.acceleration_gain * acceleration) / 12.0
    }
}

impl VirtualVehicle for Perfect {
    type Config = Config;

    fn configure(&mut self, config: &Config) {
        self.config = *config;
    }

    fn resolution(&self) -> Twist {
        // There are no counts whose flicker would have to be told from motion.
        Twist::ZERO
    }

    fn sense(&mut self, dt: f32) -> Motion {
        if let Some(translation) = self.hand.carries.get() {
            self.speed = Twist {
                translation,
                rotation: 0.0,
            };
        }
        let speeds = self.config.geometry.wheel_speeds(self.speed);
        for (rolled, speed) in self.rolled.iter_mut().zip(speeds) {
            *rolled += f64::from(speed * dt);
        }
        Motion {
            increment: Twist {
                translation: self.speed.translation * dt + self.hand.error.take(),
                rotation: self.speed.rotation * dt,
            },
            speed: self.speed,
            acceleration: Twist::ZERO,
            rolled: speeds.map(|speed| speed * dt),
        }
    }

    fn drive(&mut self, speed: Twist, _: Twist, _: f32, _: f32) -> Result<(), OutputError> {
        if self.broken.get() {
            return Err(OutputError);
        }
        self.hand.drives.set(true);
        self.hand.brakes.set(false);
        self.driven = [speed, self.driven[0]];
        self.speed = speed;
        Ok(())
    }

    fn off(&mut self) -> Result<(), OutputError> {
        self.hand.drives.set(false);
        self.hand.brakes.set(false);
        self.driven = [Twist::ZERO; 2];
        self.speed = Twist::ZERO;
        if self.broken.get() {
            return Err(OutputError);
        }
        Ok(())
    }

    fn brake(&mut self) -> Result<(), OutputError> {
        self.off()?;
        self.hand.brakes.set(true);
        Ok(())
    }

    fn wheels(&self) -> [Wheel; 2] {
        let geometry = &self.config.geometry;
        let per_count = geometry.per_count();
        let speeds = geometry.wheel_speeds(self.speed);
        let [driven, before] = self.driven.map(|speed| geometry.wheel_speeds(speed));
        [0, 1].map(|wheel: usize| Wheel {
            count: (self.rolled[wheel] / per_count[wheel]) as i64,
            speed: speeds[wheel],
            duty: self.duty(wheel, before[wheel], driven[wheel]),
        })
    }
}

/// A base, and the client that talks to it.
#[derive(Debug)]
pub(crate) struct Rig {
    controller: Controller<Perfect>,
    desk: Desk,
    interpreter: Interpreter,
    atlas: Atlas,
    now: Instant,
    /// What the board measures.
    pub(crate) inputs: Inputs,
    /// The client takes bytes off the line.
    pub(crate) listening: bool,
    /// The client shows signs of life even when it has nothing to say.
    pub(crate) alive: bool,
    /// The motor outputs refuse to be written.
    pub(crate) broken: std::rc::Rc<std::cell::Cell<bool>>,
    /// What happens to the vehicle.
    pub(crate) hand: std::rc::Rc<Hand>,
    received: Vec<u8>,
    unsolicited: Vec<String>,
}

impl Rig {
    /// A base with the default parameters.
    pub(crate) fn new() -> Self {
        Self::with(Params::default())
    }

    /// A base with these parameters.
    pub(crate) fn with(params: Params) -> Self {
        Self::after(params, None)
    }

    /// A base that starts with a fault.
    pub(crate) fn after(params: Params, fault: Option<Fault>) -> Self {
        let broken = std::rc::Rc::default();
        let hand = std::rc::Rc::default();
        let config = params.build(PERIOD);
        let vehicle = Perfect {
            config: config.vehicle,
            speed: Twist::ZERO,
            driven: [Twist::ZERO; 2],
            rolled: [0.0; 2],
            broken: std::rc::Rc::clone(&broken),
            hand: std::rc::Rc::clone(&hand),
        };
        let mut controller = Controller::new(vehicle, config, fault);
        let now = Instant::from_ticks(0);
        controller.tick(now, &Inputs::default());
        let desk = Interface::new(controller.snapshot(), params.limits());
        let identity = Identity {
            target: "test",
            reset_cause: "power-on",
            period: PERIOD,
        };
        let mut rig = Self {
            controller,
            desk,
            interpreter: Interpreter::new(identity, params),
            atlas: Atlas::new(),
            now,
            inputs: Inputs::default(),
            listening: true,
            alive: true,
            broken,
            hand,
            received: Vec::new(),
            unsolicited: Vec::new(),
        };
        // The boot event is told.
        rig.pump();
        rig
    }

    /// A base whose odometry adds no uncertainty.
    pub(crate) fn noiseless() -> Self {
        let mut params = Params::default();
        for id in [Id::NoiseS, Id::NoiseDrift, Id::NoiseRot] {
            params.set(id, 0.0).unwrap();
        }
        Self::with(params)
    }

    /// Bytes arrive; the interpreter is not asked to answer yet.
    pub(crate) fn receive(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.interpreter.receive(*byte);
        }
    }

    /// True if a byte can be taken in.
    pub(crate) fn can_receive(&self) -> bool {
        self.interpreter.can_receive()
    }

    /// A tick took this share of its period.
    pub fn note_tick_load(&mut self, share: f32) {
        self.interpreter.note_tick_load(share);
    }

    /// The interpreter does what it can; nothing is handed over yet.
    pub(crate) fn poll_only(&mut self) {
        self.interpreter.poll(&mut self.desk, &mut self.atlas);
    }

    /// A tick for which the clock did not advance.
    pub(crate) fn tick_at_the_same_time(&mut self) {
        for event in self.controller.tick(self.now, &self.inputs) {
            self.interpreter.notify(*event);
        }
        self.desk.update(self.controller.snapshot());
        while self.desk.work() {}
    }

    /// The interpreter does what it can.
    pub(crate) fn pump(&mut self) {
        self.interpreter.poll(&mut self.desk, &mut self.atlas);
        if self.alive {
            self.desk.sign_of_life();
        }
        while let Some(request) = self.desk.take_request() {
            assert!(self.controller.request(request).is_ok());
        }
        if self.listening {
            self.received
                .extend(std::iter::from_fn(|| self.interpreter.transmit()));
        }
    }

    /// One millisecond.
    pub(crate) fn tick(&mut self) {
        self.now = time::after(self.now, PERIOD);
        for event in self.controller.tick(self.now, &self.inputs) {
            self.interpreter.notify(*event);
        }
        self.desk.update(self.controller.snapshot());
        while self.desk.work() {}
        self.pump();
    }

    /// Time passes.
    pub(crate) fn run(&mut self, seconds: f64) {
        for _ in 0..(seconds * 1e3).round() as u64 {
            self.tick();
        }
    }

    /// All bytes that came.
    pub(crate) fn bytes(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.received)
    }

    /// All lines that came: whole ones, ended by CR LF, of at most 255 bytes.
    pub(crate) fn lines(&mut self) -> Vec<String> {
        let text = String::from_utf8(self.bytes()).expect("only ASCII is sent");
        if text.is_empty() {
            return Vec::new();
        }
        let text = text.strip_suffix("\r\n").expect("a line has an end");
        let lines: Vec<String> = text.split("\r\n").map(str::to_owned).collect();
        for line in &lines {
            assert!(
                line.bytes().all(|b| (b' '..=b'~').contains(&b)),
                "{line:?} is one line"
            );
            assert!((1..=255).contains(&line.len()), "{line:?}");
        }
        lines
    }

    /// The replies that came; what was not asked for is kept for [`Rig::unsolicited`].
    pub(crate) fn replies(&mut self) -> Vec<String> {
        let (unsolicited, replies) = self.lines().into_iter().partition(|l| is_unsolicited(l));
        self.unsolicited.extend::<Vec<String>>(unsolicited);
        replies
    }

    /// Sends a line and waits for its one reply.
    pub(crate) fn ask(&mut self, line: &str) -> String {
        self.ask_bytes(format!("{line}\n").as_bytes())
    }

    /// Sends bytes that are one line and waits for its one reply.
    pub(crate) fn ask_bytes(&mut self, bytes: &[u8]) -> String {
        let mut replies = self.ask_all(bytes, 1);
        assert_eq!(
            replies.len(),
            1,
            "{:?}: {replies:?}",
            String::from_utf8_lossy(bytes)
        );
        replies.remove(0)
    }

    /// Sends bytes and waits for so many replies.
    pub(crate) fn ask_all(&mut self, bytes: &[u8], count: usize) -> Vec<String> {
        self.receive(bytes);
        self.pump();
        let mut replies = self.replies();
        for _ in 0..1000 {
            if replies.len() >= count {
                return replies;
            }
            self.tick();
            replies.extend(self.replies());
        }
        panic!(
            "{:?} was answered by {replies:?} only",
            String::from_utf8_lossy(bytes)
        );
    }

    /// Sends a line that is answered `OK`, and lets it be carried out.
    pub(crate) fn ok(&mut self, line: &str) {
        assert_eq!(self.ask(line), "OK", "{line}");
        self.tick();
    }

    /// Sends a line whose reply will be heard later.
    pub(crate) fn ok_unheard(&mut self, line: &str) {
        self.receive(format!("{line}\n").as_bytes());
        self.pump();
        self.tick();
    }

    /// Sends a line that is refused with this code; it must change nothing at all.
    pub(crate) fn refused(&mut self, line: &str, code: &str) -> String {
        let before = self.state();
        let reply = self.ask(line);
        assert!(
            reply.starts_with(&format!("ERR {code} ")),
            "{line:?} is answered {reply:?}, not ERR {code}"
        );
        self.assert_unchanged(&before, line);
        reply
    }

    /// Nothing at all is different from what [`Rig::state`] told.
    pub(crate) fn assert_unchanged(&self, before: &str, line: &str) {
        let after = self.state();
        if after != before {
            let same = before
                .bytes()
                .zip(after.bytes())
                .take_while(|(a, b)| a == b);
            let from = same.count().saturating_sub(100);
            let part = |s: &str| s.chars().skip(from).take(200).collect::<String>();
            panic!("{line:?} changed\n{}\nto\n{}", part(before), part(&after));
        }
    }

    /// The numbers of a data line, after the name that it must have.
    pub(crate) fn data(&mut self, line: &str, name: &str) -> Vec<f64> {
        let reply = self.ask(line);
        let mut words = reply.split(' ');
        assert_eq!(words.next(), Some(name), "{line:?}: {reply:?}");
        words
            .map(|w| w.parse().unwrap_or_else(|_| panic!("{reply:?}")))
            .collect()
    }

    /// Events and telemetry since the last call.
    pub(crate) fn unsolicited(&mut self) -> Vec<String> {
        let replies = self.replies();
        assert!(replies.is_empty(), "nobody asked for {replies:?}");
        std::mem::take(&mut self.unsolicited)
    }

    /// Something on the same processor asks for this, past the desk.
    pub(crate) fn act(&mut self, action: &Action<Config>) {
        assert!(self.controller.request(*action).is_ok());
    }

    /// What is known after the last tick.
    pub(crate) fn snapshot(&self) -> &Snapshot {
        self.desk.snapshot()
    }

    /// The estimate after the last tick.
    pub(crate) fn estimate(&self) -> Estimate {
        self.snapshot().estimator.present()
    }

    /// The parameters in force.
    pub(crate) fn params(&self) -> &Params {
        self.interpreter.params()
    }

    /// Everything there is: floats are written so that different ones look different.
    pub(crate) fn state(&self) -> String {
        format!(
            "{:?} {:?} {:?}",
            self.controller, self.desk, self.interpreter
        )
    }
}

/// Events and telemetry.
pub(crate) fn is_unsolicited(line: &str) -> bool {
    line.starts_with("! ") || line.starts_with("~ ")
}

/// CRC-16/CCITT-FALSE, bit by bit: polynomial 0x1021, from 0xFFFF.
pub(crate) fn crc(bytes: &[u8]) -> u16 {
    bytes.iter().fold(0xFFFF, |crc, byte| {
        (0..8).fold(crc ^ (u16::from(*byte) << 8), |crc, _| {
            (crc << 1) ^ if crc & 0x8000 == 0 { 0 } else { 0x1021 }
        })
    })
}

/// A line with its check.
pub(crate) fn checked(line: &str) -> String {
    format!("{line}*{:04X}", crc(line.as_bytes()))
}

/// What a line says whose check must be there and right.
pub(crate) fn unchecked(line: &str) -> &str {
    let (content, check) = line.rsplit_once('*').unwrap_or_else(|| panic!("{line:?}"));
    assert_eq!(
        u16::from_str_radix(check, 16),
        Ok(crc(content.as_bytes())),
        "{line:?}"
    );
    content
}

/// xorshift64*: the same bytes on every machine.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    /// The next 32 bits.
    pub(crate) fn next(&mut self) -> u32 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 32) as u32
    }

    /// Below `n`.
    pub(crate) fn below(&mut self, n: usize) -> usize {
        self.next() as usize % n
    }

    /// Between `low` and `high`.
    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * f64::from(self.next()) / 4_294_967_296.0
    }
}
