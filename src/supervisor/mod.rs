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
    /// How far they rolled, m.
    pub rolled: [f32; 2],
    /// The motors' currents, A, where they are measured.
    pub currents: [Option<f32>; 2],
    /// The battery's voltage as measured, V …
    pub supply: f32,
    /// … and as the duties were computed with, V.
    pub motor_supply: f32,
    /// A turn is under way.
    pub turns: bool,
    /// An axis is far from its reference.
    pub lags: bool,
    /// An axis does not get on.
    pub held_up: bool,
    /// Every number of the estimate is one.
    pub estimate_is_finite: bool,
}

/// A wheel in a cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Reading {
    /// u, V.
    voltage: f32,
    /// m/s.
    speed: f32,
    /// m.
    rolled: f32,
    /// A.
    current: Option<f32>,
}

/// A condition that counts once it has lasted; time without it is taken off again.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Lasting(f32);

impl Lasting {
    fn note(&mut self, holds: bool, dt: f32) {
        self.0 = larger(self.0 + if holds { dt } else { -dt }, 0.0);
    }
}

/// How long what is out of bounds may be so, s: a wheel's speed …
const OVERSPEED_TIME: f32 = 0.03;
/// … a motor's current …
const OVERCURRENT_TIME: f32 = 0.02;
/// … the battery's voltage, already filtered …
const SUPPLY_TIME: f32 = 0.1;
/// … an axis far from its reference …
const LAG_TIME: f32 = 0.05;
/// … and one that does not get on.
const HELD_UP_TIME: f32 = 1.0;
/// A wheel can be this much faster than its limit: regulation overshoots.
const OVERSPEED: f32 = 1.25;
/// Each tick that comes forgives half a missed one. A gap of twenty periods is too much, and so is whatever adds up to it.
const OVERRUN: u32 = 37;

/// The supervisor's memory.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Supervisor {
    wheels: [WheelMonitor; 2],
    overspeed: Lasting,
    overcurrent: Lasting,
    undervoltage: Lasting,
    overvoltage: Lasting,
    lag: Lasting,
    held_up: Lasting,
    /// Something was out of bounds lately.
    alert: bool,
    /// Ticks missed and not forgiven, halves.
    missed: u32,
    /// Since the last sign of life, s.
    silence: f32,
}

impl Supervisor {
    /// The motors are switched on, the wheels are as they are.
    pub fn start(&mut self, config: &Config, wheels: &[Wheel; 2]) {
        *self = Self {
            wheels: wheels.map(|wheel| WheelMonitor::new(wheel.speed, config.max_wheel_speed)),
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

    /// True if a wheel has made more counts than it can: what it says of this cycle is not to be used. Call it once a cycle, before
    /// [`watch`](Self::watch).
    #[inline]
    pub fn jumps(&mut self, config: &Config, rolled: [f32; 2], dt: f32) -> Option<Place> {
        let [left, right] = &mut self.wheels;
        let left = left.jumps(rolled[0], config.max_wheel_speed, dt);
        let right = right.jumps(rolled[1], config.max_wheel_speed, dt);
        place(left, right)
    }

    /// Looks at a cycle in which the motors were on.
    #[inline]
    pub fn watch(&mut self, config: &Config, cycle: &Cycle) -> Option<(Fault, Place)> {
        let wheels = self.compare(config, cycle);
        if wheels.is_some() {
            return wheels;
        }
        if cycle.steps != 1 || self.missed > 0 {
            self.missed = (self.missed + 2 * cycle.steps.saturating_sub(1)).saturating_sub(1);
        }
        let fastest = larger(cycle.wheels[0].speed.abs(), cycle.wheels[1].speed.abs());
        let [lowest, highest] = config.supply;
        let out_of_bounds = fastest > OVERSPEED * config.max_wheel_speed
            || cycle.supply < lowest
            || cycle.supply > highest
            || over(config, cycle.currents) != [false; 2]
            || cycle.lags
            || cycle.held_up
            || !cycle.estimate_is_finite
            || self.missed > 0;
        if out_of_bounds || self.alert {
            self.judge(config, cycle, fastest)
        } else {
            None
        }
    }

    /// The wheels against their motors.
    #[inline]
    fn compare(&mut self, config: &Config, cycle: &Cycle) -> Option<(Fault, Place)> {
        if config.motor.speed_gain <= 0.0 {
            return None;
        }
        let readings = readings(cycle);
        let [left, right] = &mut self.wheels;
        let left = left.contradicts(&config.motor, &readings[0], cycle.dt);
        let right = right.contradicts(&config.motor, &readings[1], cycle.dt);
        if left || right {
            self.verdict(config, cycle, &readings)
        } else {
            None
        }
    }

    #[inline(never)]
    fn verdict(
        &self,
        config: &Config,
        cycle: &Cycle,
        readings: &[Reading; 2],
    ) -> Option<(Fault, Place)> {
        let [left, right] = &self.wheels;
        let [left_reading, right_reading] = readings;
        let left_fault = left.verdict(&config.motor, left_reading);
        let right_fault = right.verdict(&config.motor, right_reading);
        let (fault, mut place) = if left.suspicion() >= right.suspicion() {
            (left_fault?, Place::Left)
        } else {
            (right_fault?, Place::Right)
        };
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

    /// What is out of bounds, and for how long.
    #[inline(never)]
    fn judge(&mut self, config: &Config, cycle: &Cycle, fastest: f32) -> Option<(Fault, Place)> {
        let dt = cycle.dt;
        let overcurrent = over(config, cycle.currents);
        let [lowest, highest] = config.supply;
        self.overspeed
            .note(fastest > OVERSPEED * config.max_wheel_speed, dt);
        self.overcurrent.note(overcurrent != [false; 2], dt);
        self.undervoltage.note(cycle.supply < lowest, dt);
        self.overvoltage.note(cycle.supply > highest, dt);
        self.lag.note(cycle.lags, dt);
        self.held_up.note(cycle.held_up, dt);
        let all = [
            (self.overspeed, OVERSPEED_TIME, Fault::Overspeed),
            (self.overcurrent, OVERCURRENT_TIME, Fault::Overcurrent),
            (self.overvoltage, SUPPLY_TIME, Fault::Overvoltage),
            (self.lag, LAG_TIME, Fault::Following),
            (self.held_up, HELD_UP_TIME, Fault::Following),
            (self.undervoltage, SUPPLY_TIME, Fault::Undervoltage),
        ];
        self.alert = all.iter().any(|(lasting, ..)| lasting.0 > 0.0);
        let lasted = all.iter().find(|(lasting, limit, _)| lasting.0 > *limit);
        if let Some((.., fault)) = lasted {
            let place = match fault {
                Fault::Overcurrent => place(overcurrent[0], overcurrent[1]),
                _ => None,
            };
            return Some((*fault, place.unwrap_or(Place::Base)));
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

fn over(config: &Config, currents: [Option<f32>; 2]) -> [bool; 2] {
    currents.map(|current| current.is_some_and(|current| current.abs() > config.max_current))
}

fn readings(cycle: &Cycle) -> [Reading; 2] {
    let [left, right] = cycle.wheels;
    let reading = |wheel: Wheel, rolled, current| Reading {
        voltage: wheel.duty * cycle.motor_supply,
        speed: wheel.speed,
        rolled,
        current,
    };
    [
        reading(left, cycle.rolled[0], cycle.currents[0]),
        reading(right, cycle.rolled[1], cycle.currents[1]),
    ]
}

fn place(left: bool, right: bool) -> Option<Place> {
    match (left, right) {
        (true, true) => Some(Place::Both),
        (true, false) => Some(Place::Left),
        (false, true) => Some(Place::Right),
        (false, false) => None,
    }
}
