//! A client that drives at random, by the protocol's rules.

use super::book::Book;
use super::line::{Motion, Said};
use super::mishaps::log;
use super::sight::Sight;
use crate::robot::Robot;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use vehicle_controller::params::Id;
use vehicle_controller::supervisor::{Fault, Reaction};

/// A stream of velocities has this period, ms.
const STREAM_MS: u64 = 50;
/// There is a line at least this often, ms: less than the dead-man's switch waits.
const LIFE_MS: u64 = 700;

/// A line to send.
#[derive(Clone, Debug)]
pub struct Wish {
    /// What to send.
    pub text: String,
    /// What it asks for.
    pub said: Said,
}

/// A stream of velocities.
#[derive(Clone, Copy, Debug)]
struct Stream {
    until: u64,
    speeds: [f64; 2],
    accelerations: [f64; 2],
}

/// The random client.
#[derive(Debug)]
pub struct Driver {
    /// Largest speeds and accelerations, in the protocol's units: translation, rotation.
    limits: [[f64; 2]; 2],
    /// Names and values of the parameters that it sets: speed, acceleration, stop rate.
    defaults: [[(&'static str, f64); 3]; 2],
    stream: Option<Stream>,
    next: u64,
    /// When the last line was accepted, or one was sent that is, ms.
    lived: u64,
    patience: u64,
}

impl Driver {
    /// A client of a robot.
    pub fn new(robot: &Robot) -> Self {
        let get = |id| f64::from(robot.params.get(id));
        let named = |id: Id| (id.spec().name, get(id));
        Self {
            limits: [
                [get(Id::MaxSpeed), get(Id::MaxAccel)],
                [get(Id::MaxTurnSpeed), get(Id::MaxTurnAccel)],
            ],
            defaults: [
                [Id::MoveSpeed, Id::MoveAccel, Id::StopAccel].map(named),
                [Id::TurnSpeed, Id::TurnAccel, Id::StopTurnAccel].map(named),
            ],
            stream: None,
            next: 100,
            lived: 0,
            patience: LIFE_MS,
        }
    }

    /// Nothing is sent before then, ms, and a stream ends.
    pub fn pause(&mut self, until: u64) {
        self.stream = None;
        self.next = self.next.max(until);
    }

    /// What it wants to send now: up to two lines.
    pub fn wishes(
        &mut self,
        now: u64,
        random: &mut ChaCha8Rng,
        sight: &Sight,
        book: &Book,
        is_idle: bool,
    ) -> Vec<Wish> {
        let mut wishes = Vec::new();
        if now >= self.next {
            wishes = self.next_wishes(now, random, sight, book, is_idle);
        } else if now >= self.lived + self.patience {
            self.live(now);
            self.patience = random.random_range(LIFE_MS / 4..LIFE_MS);
            let queries = ["GetTime", "GetEstPos", "GetStatus", "GetWheels", "GetState"];
            wishes.push(other(queries[random.random_range(0..queries.len())].into()));
        }
        wishes
    }

    /// The base has accepted a line.
    pub fn live(&mut self, now: u64) {
        self.lived = now;
    }

    fn next_wishes(
        &mut self,
        now: u64,
        random: &mut ChaCha8Rng,
        sight: &Sight,
        book: &Book,
        is_idle: bool,
    ) -> Vec<Wish> {
        if let Some(stream) = &mut self.stream {
            if now < stream.until {
                self.next = now + STREAM_MS;
                return self.stream_on(random);
            }
            self.stream = None;
        }
        self.next = now + log(random, 20.0, 4000.0) as u64;
        if book.disabled && random.random_bool(0.5) {
            return vec![plain("Enable", Said::Enable)];
        }
        // Power off and on again on the way to rest must not take back that a fault switches off.
        let stops = |fault: Fault| fault.reaction() == Reaction::Stop;
        if book.latched.is_some_and(stops) && !book.disabled && random.random_bool(0.3) {
            self.next = now + random.random_range(10..300);
            return vec![plain("Disable", Said::Disable)];
        }
        match random.random_range(0..100) {
            0..20 => vec![self.motion(0, random, book, is_idle)],
            20..40 => vec![self.motion(1, random, book, is_idle)],
            40..56 => vec![
                self.motion(0, random, book, is_idle),
                self.motion(1, random, book, false),
            ],
            56..62 => vec![self.rest(random)],
            62..70 => vec![plain("Stop", Said::Stop)],
            70..73 => vec![self.beyond(random)],
            73..80 => {
                self.begin_stream(now, random);
                self.next = now;
                Vec::new()
            }
            80..86 => vec![self.set(random)],
            86..94 => vec![correction(random, sight)],
            94..96 => {
                self.next = now + random.random_range(1..2000);
                vec![plain("Disable", Said::Disable)]
            }
            96..98 => vec![plain("EStop", Said::EStop)],
            98 if book.latched.is_none() => vec![plain("ClearFault", Said::ClearFault)],
            _ => vec![other("SaveParams".into())],
        }
    }

    /// A motion of an axis within its limits, with an end or without.
    fn motion(&self, axis: usize, random: &mut ChaCha8Rng, book: &Book, may_omit: bool) -> Wish {
        let [max_speed, max_acceleration] = self.limits[axis];
        let far = if axis == 0 { 2.0 } else { 720.0 };
        let endless = random.random_bool(0.4);
        let sign = if random.random() { "" } else { "-" };
        let distance = log(random, 0.002 * far, far);
        let speed = written(log(random, 0.02 * max_speed, max_speed)).min(max_speed);
        let acceleration =
            written(log(random, 0.03 * max_acceleration, max_acceleration)).min(max_acceleration);
        let text = if endless {
            format!("{} {sign}inf", NAMES[axis])
        } else {
            format!("{} {sign}{distance:.4}", NAMES[axis])
        };
        let omitted = if may_omit && random.random_bool(0.3) {
            book.last(axis)
                .filter(|[speed, _]| *speed > 0.0)
                .map(|last| (last, random.random_bool(0.5)))
        } else {
            None
        };
        let unit = UNITS[axis];
        let [speed_si, acceleration_si] = [speed * unit, acceleration * unit];
        let (text, speed, acceleration, gives) = match omitted {
            None => (
                format!("{text} {speed} {acceleration}"),
                speed_si,
                acceleration_si,
                [true, true],
            ),
            Some(([_, last], true)) => (format!("{text} {speed}"), speed_si, last, [true, false]),
            Some(([v, a], false)) => (text, v, a, [false; 2]),
        };
        let motion = Motion {
            endless,
            distance: distance * unit,
            speed,
            acceleration,
            gives,
        };
        Wish {
            text,
            said: Said::Motion(axis, motion),
        }
    }

    /// One axis alone comes to rest.
    fn rest(&self, random: &mut ChaCha8Rng) -> Wish {
        let axis = random.random_range(0..2);
        let max = self.limits[axis][1];
        let acceleration = written(log(random, 0.1 * max, max)).min(max);
        drive(axis, 0.0, acceleration)
    }

    fn beyond(&self, random: &mut ChaCha8Rng) -> Wish {
        let axis = random.random_range(0..2);
        let mut limits = self.limits[axis];
        limits[random.random_range(0..2)] *= random.random_range(1.01..10.0);
        let [speed, acceleration] = limits;
        Wish {
            text: format!("{} inf {speed:.4} {acceleration:.4}", NAMES[axis]),
            said: Said::Beyond,
        }
    }

    fn begin_stream(&mut self, now: u64, random: &mut ChaCha8Rng) {
        let accelerations = [0, 1].map(|axis| {
            let max = self.limits[axis][1];
            written(random.random_range(0.1 * max..max)).min(max)
        });
        self.stream = Some(Stream {
            until: now + random.random_range(1000..10_000),
            speeds: [0.0; 2],
            accelerations,
        });
    }

    /// The stream's velocities wander.
    fn stream_on(&mut self, random: &mut ChaCha8Rng) -> Vec<Wish> {
        let limits = self.limits;
        let Some(stream) = &mut self.stream else {
            return Vec::new();
        };
        for (speed, [max, _]) in stream.speeds.iter_mut().zip(limits) {
            let change = 0.15 * max;
            *speed += random.random_range(-change..=change);
            *speed = written(speed.clamp(-max, max)).clamp(-max, max);
        }
        let Stream {
            speeds,
            accelerations,
            ..
        } = *stream;
        [0, 1]
            .map(|axis| drive(axis, speeds[axis], accelerations[axis]))
            .into()
    }

    /// Sets one of the parameters that motions take what they leave out from.
    fn set(&self, random: &mut ChaCha8Rng) -> Wish {
        let axis = random.random_range(0..2);
        let which = random.random_range(0..3);
        let (name, usual) = self.defaults[axis][which];
        let max = self.limits[axis][usize::from(which > 0)];
        let value = written(log(random, 0.3 * usual, 2.0 * usual).min(max)).min(max);
        let si = value * UNITS[axis];
        let said = if which == 2 {
            Said::StopRate(axis, si)
        } else {
            Said::Default(axis, which, si)
        };
        Wish {
            text: format!("SetParam {name} {value}"),
            said,
        }
    }
}

const NAMES: [&str; 2] = ["m", "t"];
/// Of the protocol's units.
const UNITS: [f64; 2] = [1.0, std::f64::consts::PI / 180.0];

/// As it is written with four decimals.
fn written(value: f64) -> f64 {
    (value * 1e4).round() / 1e4
}

/// A motion without an end at a velocity.
fn drive(axis: usize, velocity: f64, acceleration: f64) -> Wish {
    let speed = velocity.abs();
    let sign = if velocity < 0.0 { "-" } else { "" };
    Wish {
        text: format!("{} {sign}inf {speed} {acceleration}", NAMES[axis]),
        said: Said::Motion(
            axis,
            Motion {
                endless: speed > 0.0,
                distance: 0.0,
                speed: speed * UNITS[axis],
                acceleration: acceleration * UNITS[axis],
                gives: [true; 2],
            },
        ),
    }
}

fn plain(text: &str, said: Said) -> Wish {
    Wish {
        text: text.into(),
        said,
    }
}

fn other(text: String) -> Wish {
    Wish {
        text,
        said: Said::Other,
    }
}

/// An observation near the estimate, or a correction by a client's own gain, or another pose.
fn correction(random: &mut ChaCha8Rng, sight: &Sight) -> Wish {
    let [x, y, theta] = sight.pose;
    let mut off = |size: f64| random.random_range(-size..=size);
    let (dx, dy, dt) = (off(0.02), off(0.02), off(2.0));
    let heading = theta.to_degrees();
    other(match random.random_range(0..10) {
        0..4 => {
            let age = random.random_range(0.0..0.5);
            let (x, y, heading) = (x + dx, y + dy, heading + dt);
            format!("ObservePos {x:.4} {y:.4} {heading:.3} 1e-4 0 0 1e-4 0 1 {age:.3}")
        }
        4..6 => format!("ObserveScalar {dx:.4} 1e-4 0.6 0.8 0"),
        6..9 => {
            let k = random.random_range(0.0..1.0);
            format!("CorrectPos {dx:.4} {dy:.4} {dt:.3} {k:.3} 0 0 0 {k:.3} 0 0 0 {k:.3}")
        }
        _ => format!("ResetPos {dx:.4} {dy:.4} {dt:.3}"),
    })
}
