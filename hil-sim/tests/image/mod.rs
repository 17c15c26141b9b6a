//! A client of the shipped image, on the emulated board.
#![allow(dead_code, reason = "each test uses a part of it")]

use hil_sim::base::Base;
use hil_sim::emulator::{ImageBase, Setup};
use hil_sim::map::landmarks::Landmarks;
use hil_sim::rig::Rig;
use hil_sim::robot::Robot;
use hil_sim::script::{Action, Script};
use std::path::PathBuf;

/// The seed of runs that need only one.
pub const SEED: u64 = 1;

/// The image under test.
///
/// # Panics
/// If it has not been built.
pub fn image() -> PathBuf {
    let given = std::env::var_os("VEHICLE_CONTROLLER_IMAGE").map(PathBuf::from);
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("..");
    let path = given.unwrap_or_else(|| root.join("target/firmware/vehicle-controller.elf"));
    assert!(
        path.is_file(),
        "there is no image at {}: build it with `cargo firmware`, or name one in VEHICLE_CONTROLLER_IMAGE",
        path.display()
    );
    path
}

/// The image for another vehicle, which lies beside it.
///
/// # Panics
/// If it has not been built.
pub fn image_of(vehicle: &str) -> PathBuf {
    if vehicle == "differential" {
        return image();
    }
    let path = image().with_file_name(format!("vehicle-controller-{vehicle}.elf"));
    assert!(
        path.is_file(),
        "there is no image at {}: build it with `cargo firmware --vehicle {vehicle}`",
        path.display()
    );
    path
}

/// The image on the robot `default`.
pub fn emulated(setup: &Setup) -> ImageBase {
    let robot = Robot::load("default").unwrap();
    ImageBase::with(&image(), &robot, SEED, setup).unwrap()
}

/// The library on this computer, on the same robot.
pub fn host() -> Rig {
    host_on("default")
}

/// The image on a robot.
pub fn emulated_on(robot: &str) -> ImageBase {
    let robot = Robot::load(robot).unwrap();
    ImageBase::with(&image(), &robot, SEED, &Setup::default()).unwrap()
}

/// The library on this computer, on a robot.
pub fn host_on(robot: &str) -> Rig {
    Rig::new(&Robot::load(robot).unwrap(), SEED).unwrap()
}

/// Somebody at the serial line of a base.
pub struct Client<B> {
    /// The base.
    pub base: B,
    /// What it has sent: milliseconds and line.
    pub lines: Vec<(u64, String)>,
    /// Bytes of the line that is arriving.
    partial: Vec<u8>,
    /// Milliseconds since power-on.
    pub time: u64,
    /// Bytes that it has sent.
    pub received: usize,
}

impl<B: Base> Client<B> {
    /// Nothing has been said.
    pub fn new(base: B) -> Self {
        Self {
            base,
            lines: Vec::new(),
            partial: Vec::new(),
            time: 0,
            received: 0,
        }
    }

    /// Sends a line.
    pub fn send(&mut self, line: &str) {
        self.base.send(format!("{line}\n").as_bytes()).unwrap();
    }

    /// One millisecond.
    pub fn tick(&mut self) {
        self.base.tick().unwrap();
        self.time += 1;
        for byte in self.base.receive() {
            self.received += 1;
            match byte {
                b'\r' => {}
                b'\n' => {
                    let line = String::from_utf8(std::mem::take(&mut self.partial)).unwrap();
                    self.lines.push((self.time, line));
                }
                byte => self.partial.push(byte),
            }
        }
    }

    /// Some milliseconds.
    pub fn run(&mut self, milliseconds: u64) {
        for _ in 0..milliseconds {
            self.tick();
        }
    }

    /// Runs until a line that starts with `what` arrives, and gives all of it; fails after some milliseconds.
    pub fn wait_for(&mut self, what: &str, milliseconds: u64) -> String {
        let from = self.lines.len();
        for _ in 0..milliseconds {
            self.tick();
            let found = self.lines[from..]
                .iter()
                .find(|(_, line)| line.starts_with(what));
            if let Some((_, line)) = found {
                return line.clone();
            }
        }
        panic!("no `{what}` within {milliseconds} ms: {:?}", self.lines);
    }

    /// Sends a line and waits for what it is answered.
    pub fn ask(&mut self, line: &str) -> String {
        let from = self.lines.len();
        self.send(line);
        for _ in 0..500 {
            self.tick();
            let is_reply = |line: &&(u64, String)| !line.1.starts_with(['!', '~']);
            if let Some((_, reply)) = self.lines[from..].iter().find(is_reply) {
                return reply.clone();
            }
        }
        panic!("`{line}` was not answered: {:?}", self.lines);
    }

    /// Plays a script, and on until the base has been at rest and silent for a second; fails after a minute.
    pub fn play(&mut self, script: &Script) {
        self.play_and(script, |_| ());
    }

    /// The same, with a look at the base after each millisecond.
    pub fn play_and(&mut self, script: &Script, mut look: impl FnMut(&B)) {
        let mut steps = script.steps.iter().peekable();
        let mut landmarks = Landmarks::new(SEED);
        let mut patience = 60_000;
        loop {
            let now = self.time;
            let due = |step: &&hil_sim::script::Step| (step.time * 1e3).round() as u64 <= now;
            while let Some(step) = steps.next_if(due) {
                match &step.action {
                    Action::Send(line) => self.send(line),
                    Action::Push {
                        force,
                        torque,
                        seconds,
                    } => self.base.push(*force, *torque, *seconds),
                    Action::Fault(fault) => Base::inject(&mut self.base, *fault).unwrap(),
                    Action::Clear => self.base.clear_faults().unwrap(),
                    Action::Landmark(name, at) => landmarks.place(name, *at),
                    Action::Sight(name, bearing, range) => {
                        let pose = self.base.plant().pose();
                        let line = landmarks.sight(name, pose, *bearing, *range).unwrap();
                        self.send(&line);
                    }
                    Action::End => return,
                }
            }
            self.tick();
            look(&self.base);
            if steps.peek().is_some() {
                continue;
            }
            patience -= 1;
            let spoke = self.lines.last().map_or(0, |(at, _)| *at);
            let quiet_since = spoke.max(last(script));
            let busy = self.base.backlog() > 0 || !self.base.holds().unwrap();
            assert!(patience > 0, "it does not come to rest");
            if !busy && self.time > quiet_since + 1000 {
                return;
            }
        }
    }
}

fn last(script: &Script) -> u64 {
    script
        .steps
        .last()
        .map_or(0, |step| (step.time * 1e3).round() as u64)
}
