//! Beside the middle layer: watches each tick, and may only take motion away.
//!
//! [`Supervisor::watch`] sees what the wheels did and what their motors were given, the battery, the currents, the clock; what it finds is one of the
//! [`Fault`]s, and the fault's [`Reaction`] is the controller's to carry out. It keeps no clock and knows no board. `docs/safety.md` has the table of
//! faults for people, with measured times and distances.
//!
//! The encoders are watched by a model of the motors: each wheel's speed v̂ is predicted from the voltage that its motor has, and compared with what
//! its encoder says. What exceeds the tolerance adds up (Page's CUSUM), so that a push or a bump passes and a fault does not. See [`MotorModel`].

mod fault;
mod heartbeat;
mod wheel;

pub use fault::{Fault, Place, Reaction};
pub use heartbeat::Heartbeat;
pub use wheel::MotorModel;

use crate::math::larger;
use crate::vehicle::Wheel;
use wheel::WheelMonitor;

/// What the supervisor holds the base to.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Config {
    /// The motors, which are alike.
    pub motor: MotorModel,
    /// The fastest that a wheel can roll, m/s.
    pub max_wheel_speed: f32,
    /// The largest current of a motor, A; infinite if there is no limit.
    pub max_current: f32,
    /// The lowest and the highest battery voltage, V; infinite if it is not measured.
    pub supply: [f32; 2],
    /// A motion without an end goes on so long without a sign of life, s; infinite: for ever.
    pub deadman: f32,
}

/// What a cycle looked like.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cycle {
    /// Time since the last one, s.
    pub dt: f32,
    /// Nominal periods since the last one.
    pub steps: u32,
    /// The wheels, left first: their speeds now, and the duties that they had.
    pub wheels: [Wheel; 2],
    /// The motors' currents, A, where they are measured.
    pub currents: [Option<f32>; 2],
    /// The battery's voltage as measured, V …
    pub supply: f32,
    /// … and as the duties were computed with, V.
    pub motor_supply: f32,
    /// A turn is under way.
    pub turns: bool,
    /// Every number of the estimate is one.
    pub estimate_is_finite: bool,
}

/// How well an axis follows its reference.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Following {
    /// As it should.
    Closely,
    /// The reference waits for a vehicle that does not come.
    HeldUp,
    /// The vehicle is so far away that this is no lag any more.
    FarOff,
}

/// A wheel in a cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Reading {
    /// u, V.
    voltage: f32,
    /// m/s.
    speed: f32,
    /// The low bits of the encoder's count.
    count: i32,
    /// A.
    current: Option<f32>,
}

/// What may not last, for how long (s), and what it is: the ones that demand more come first. The battery's voltage is filtered before.
const BOUNDS: [(f32, Fault); 6] = [
    (0.03, Fault::Overspeed),
    (0.02, Fault::Overcurrent),
    (0.1, Fault::Overvoltage),
    (0.05, Fault::Following),
    (1.0, Fault::Following),
    (0.1, Fault::Undervoltage),
];
/// A wheel can be this much faster than its limit: regulation overshoots.
const OVERSPEED: f32 = 1.25;
/// Each tick that comes forgives half a missed one. A gap of twenty periods is too much, and so is whatever adds up to it.
const OVERRUN: u32 = 37;

/// The supervisor's memory.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Supervisor {
    wheels: [WheelMonitor; 2],
    /// What is looked at next: the left wheel, the bounds, the right wheel, the bounds.
    turn: u8,
    /// Since a wheel was looked at, and from the look before to that one, s.
    unwatched: f32,
    unwatched_before: f32,
    /// How long each of [`BOUNDS`] has been exceeded, s; time within it is taken off again.
    exceeded: [f32; BOUNDS.len()],
    /// A wheel has rolled farther than it can in a cycle lately.
    is_ahead: bool,
    /// Something was out of bounds lately.
    alert: bool,
    /// Ticks missed and not forgiven, halves.
    missed: u32,
    /// Since the last sign of life, s.
    silence: f32,
}

impl Supervisor {
    /// The motors are switched on, the wheels are as they are.
    pub fn start(&mut self, wheels: &[Wheel; 2]) {
        *self = Self {
            wheels: wheels.map(|wheel| WheelMonitor::new(wheel.speed)),
            silence: self.silence,
            ..Self::default()
        };
    }

    /// Whoever commands the base is alive.
    pub fn sign_of_life(&mut self) {
        self.silence = 0.0;
    }

    /// Notes that time passes; true if there has been no sign of life for too long.
    #[inline]
    pub fn is_silent(&mut self, config: &Config, dt: f32) -> bool {
        self.silence += dt;
        self.silence > config.deadman
    }

    /// Which wheels have made more counts than they can: what they say of this cycle is not to be used. Call it once a cycle.
    #[inline]
    pub fn jumps(&mut self, config: &Config, rolled: [f32; 2], dt: f32) -> Option<Place> {
        let reach = config.max_wheel_speed * dt * wheel::REACH;
        if larger(rolled[0].abs(), rolled[1].abs()) <= reach && !self.is_ahead {
            return None;
        }
        self.run_ahead(rolled, reach, config.max_wheel_speed)
    }

    #[cold]
    fn run_ahead(&mut self, rolled: [f32; 2], reach: f32, max_speed: f32) -> Option<Place> {
        let [left, right] = &mut self.wheels;
        let jump = [
            left.jumps(rolled[0], reach, max_speed),
            right.jumps(rolled[1], reach, max_speed),
        ];
        self.is_ahead = left.is_ahead() || right.is_ahead();
        place(jump[0], jump[1])
    }

    /// Looks at a cycle in which the motors were on.
    ///
    /// What it looks for takes many cycles to be sure of, so it takes turns: the left wheel, the bounds, the right wheel, the bounds. `following` says how
    /// well translation and rotation follow their references.
    #[inline]
    pub fn watch(
        &mut self,
        config: &Config,
        cycle: &Cycle,
        following: impl Fn() -> [Following; 2],
    ) -> Option<(Fault, Place)> {
        if cycle.steps != 1 || self.missed > 0 {
            self.missed = (self.missed + 2 * cycle.steps.saturating_sub(1)).saturating_sub(1);
            self.alert |= self.missed >= OVERRUN;
        }
        self.unwatched += cycle.dt;
        self.turn = self.turn.wrapping_add(1);
        let mut contradicts = false;
        if self.turn & 1 == 0 {
            let [lowest, highest] = config.supply;
            self.alert |= cycle.supply < lowest
                || cycle.supply > highest
                || is_fast(config, cycle)
                || !cycle.estimate_is_finite
                || following() != [Following::Closely; 2]
                || over(config, cycle.currents) != [false; 2];
        } else {
            let dt = self.unwatched + self.unwatched_before;
            self.unwatched_before = self.unwatched;
            self.unwatched = 0.0;
            let [left, right] = &mut self.wheels;
            contradicts = if self.turn & 2 == 0 {
                left.contradicts(&config.motor, &reading(cycle, 0), dt)
            } else {
                right.contradicts(&config.motor, &reading(cycle, 1), dt)
            };
        }
        if !contradicts && !self.alert {
            return None;
        }
        self.judge(config, cycle, following())
    }

    #[cold]
    fn judge(
        &mut self,
        config: &Config,
        cycle: &Cycle,
        following: [Following; 2],
    ) -> Option<(Fault, Place)> {
        self.verdict(config, cycle)
            .or_else(|| self.bounds(config, cycle, following))
    }

    /// The wheels against their motors.
    fn verdict(&self, config: &Config, cycle: &Cycle) -> Option<(Fault, Place)> {
        let [left, right] = &self.wheels;
        let left_fault = left.verdict(&config.motor, &reading(cycle, 0));
        let right_fault = right.verdict(&config.motor, &reading(cycle, 1));
        if !left.is_convicted() && !right.is_convicted() {
            return None;
        }
        let (wheel, fault, mut place) = if left.suspicion() >= right.suspicion() {
            (left, left_fault?, Place::Left)
        } else {
            (right, right_fault?, Place::Right)
        };
        if fault == Fault::Stall && !wheel.is_stalled() {
            return None;
        }
        if left_fault == right_fault {
            place = Place::Both;
        }
        // Neither wheel moves, and nobody wants them to turn the base.
        let opposed = left.expected() * right.expected() < 0.0;
        let both_stand = left.stands() && right.stands();
        if matches!(fault, Fault::NoMotion | Fault::Stall) && opposed && both_stand && !cycle.turns
        {
            return Some((Fault::WheelsFighting, Place::Both));
        }
        Some((fault, place))
    }

    /// True if something has been out of bounds, and may be found soon.
    fn remembers(&self) -> bool {
        self.exceeded.iter().any(|time| *time > 0.0)
    }

    /// What is out of bounds, and for how long.
    fn bounds(
        &mut self,
        config: &Config,
        cycle: &Cycle,
        following: [Following; 2],
    ) -> Option<(Fault, Place)> {
        let overcurrent = over(config, cycle.currents);
        let [lowest, highest] = config.supply;
        let exceeds = [
            is_fast(config, cycle),
            overcurrent != [false; 2],
            cycle.supply > highest,
            following.contains(&Following::FarOff),
            following.contains(&Following::HeldUp),
            cycle.supply < lowest,
        ];
        let mut found = None;
        for ((time, exceeds), (limit, fault)) in self.exceeded.iter_mut().zip(exceeds).zip(BOUNDS) {
            *time = larger(*time + if exceeds { cycle.dt } else { -cycle.dt }, 0.0);
            if exceeds && found.is_none() && *time > limit {
                found = Some(fault);
            }
        }
        self.alert = self.remembers();
        if let Some(fault) = found {
            let place = match fault {
                Fault::Overcurrent => place(overcurrent[0], overcurrent[1]),
                _ => None,
            };
            return Some((fault, place.unwrap_or(Place::Base)));
        }
        if self.missed >= OVERRUN {
            return Some((Fault::Overrun, Place::Base));
        }
        (!cycle.estimate_is_finite).then_some((Fault::Estimator, Place::Base))
    }
}

impl Config {
    /// True if the fault's cause is there now, as far as can be told with the motors off.
    #[must_use]
    pub fn persists(&self, fault: Fault, now: &Cycle) -> bool {
        let [lowest, highest] = self.supply;
        match fault {
            Fault::Undervoltage => now.supply < lowest,
            Fault::Overvoltage => now.supply > highest,
            Fault::Overcurrent => over(self, now.currents) != [false; 2],
            Fault::Overspeed => now
                .wheels
                .iter()
                .any(|wheel| wheel.speed.abs() > self.max_wheel_speed),
            Fault::Estimator => !now.estimate_is_finite,
            _ => false,
        }
    }
}

#[inline]
fn over(config: &Config, currents: [Option<f32>; 2]) -> [bool; 2] {
    currents.map(|current| current.is_some_and(|current| current.abs() > config.max_current))
}

#[inline]
fn is_fast(config: &Config, cycle: &Cycle) -> bool {
    let [left, right] = &cycle.wheels;
    larger(left.speed.abs(), right.speed.abs()) > OVERSPEED * config.max_wheel_speed
}

#[inline]
fn reading(cycle: &Cycle, side: usize) -> Reading {
    let ([left, right], [left_current, right_current]) = (cycle.wheels, cycle.currents);
    let (wheel, current) = if side == 0 {
        (left, left_current)
    } else {
        (right, right_current)
    };
    Reading {
        voltage: wheel.duty * cycle.motor_supply,
        speed: wheel.speed,
        count: wheel.count as i32,
        current,
    }
}

fn place(left: bool, right: bool) -> Option<Place> {
    match (left, right) {
        (true, true) => Some(Place::Both),
        (true, false) => Some(Place::Left),
        (false, true) => Some(Place::Right),
        (false, false) => None,
    }
}
