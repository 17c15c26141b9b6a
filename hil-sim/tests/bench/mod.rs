//! A base on a bench: commands in as lines, the truth and the base's lines out.
#![allow(dead_code, reason = "each test uses a part of it")]

use hil_sim::rig::Rig;
use hil_sim::robot::Robot;
use std::cell::Cell;
use vehicle_controller::params::Id;

/// A simulated base under test.
pub struct Bench {
    /// The base.
    pub rig: Rig,
    /// What it has sent: seconds and line.
    pub lines: Vec<(f64, String)>,
    partial: Vec<u8>,
}

/// The truth at an instant.
#[derive(Clone, Copy, Debug)]
pub struct Truth {
    /// s.
    pub t: f64,
    /// m.
    pub x: f64,
    /// m.
    pub y: f64,
    /// °.
    pub heading: f64,
    /// m/s, along the body.
    pub speed: f64,
    /// °/s.
    pub turn_speed: f64,
}

impl Bench {
    /// Powers a robot up. Nobody need repeat himself here: motions go on without a sign of life.
    pub fn new(robot: &str, seed: u64) -> Self {
        Self::of(&Robot::load(robot).unwrap(), seed)
    }

    /// Powers a robot of one's own up.
    pub fn of(robot: &Robot, seed: u64) -> Self {
        let mut robot = robot.clone();
        robot.params.set(Id::Deadman, 0.0).unwrap();
        Self {
            rig: Rig::new(&robot, seed).unwrap(),
            lines: Vec::new(),
            partial: Vec::new(),
        }
    }

    /// Sends a line.
    pub fn send(&mut self, line: &str) {
        self.rig.send(format!("{line}\n").as_bytes());
    }

    /// One millisecond.
    pub fn tick(&mut self) -> Truth {
        self.rig.tick();
        for byte in self.rig.receive() {
            match byte {
                b'\r' => {}
                b'\n' => {
                    let line = String::from_utf8(std::mem::take(&mut self.partial)).unwrap();
                    assert!(!line.contains("ERR"), "{line}");
                    self.lines
                        .push((self.rig.now().ticks() as f64 * 1e-6, line));
                }
                byte => self.partial.push(byte),
            }
        }
        self.truth()
    }

    /// The truth now.
    pub fn truth(&self) -> Truth {
        let [x, y, theta] = self.rig.plant().pose();
        let (speed, turn_speed) = self.rig.plant().speed();
        Truth {
            t: self.rig.now().ticks() as f64 * 1e-6,
            x,
            y,
            heading: theta.to_degrees(),
            speed,
            turn_speed: turn_speed.to_degrees(),
        }
    }

    /// Runs for some seconds; the truth at each millisecond.
    pub fn run(&mut self, seconds: f64) -> Vec<Truth> {
        (0..(seconds * 1000.0).round() as u32)
            .map(|_| self.tick())
            .collect()
    }

    /// Runs until a line that starts with `what` arrives, and gives the rest of it; fails after `seconds`.
    pub fn wait_for(&mut self, what: &str, seconds: f64) -> String {
        let from = self.lines.len();
        let found = Cell::new(None);
        for _ in 0..(seconds * 1000.0) as u32 {
            self.tick();
            for (_, line) in &self.lines[from..] {
                if let Some(rest) = line.strip_prefix(what) {
                    found.set(Some(rest.trim().to_owned()));
                }
            }
            if let Some(rest) = found.take() {
                return rest;
            }
        }
        panic!("no `{what}` within {seconds} s: {:?}", self.lines);
    }
}

/// Largest of some values.
pub fn max(values: impl IntoIterator<Item = f64>) -> f64 {
    values.into_iter().fold(f64::NEG_INFINITY, f64::max)
}

/// Root of the mean square.
pub fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt()
}
