//! One wheel: does what its encoder says fit what its motor was given?

use super::{Fault, Reading};
use crate::math::{larger, sign, smaller};

/// What is known of a wheel's motor, and how far it may be off.
///
/// ```text
///     K_a dv̂/dt = u − V_s sign v̂ − K_v v̂
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct MotorModel {
    /// V_s: voltage that overcomes friction, V.
    pub static_friction: f32,
    /// K_v: voltage per speed of the circumference, V/(m/s). Zero: there is no model, and nothing is compared with it.
    pub speed_gain: f32,
    /// K_a: voltage per acceleration, V/(m/s²).
    pub acceleration_gain: f32,
    /// R: the winding's resistance, Ω. Zero: not known, and currents tell nothing.
    pub resistance: f32,
    /// Share of the speed by which model and measurement may differ: other motors, loads, temperatures.
    pub tolerance: f32,
    /// What they may differ by besides, at speed, m/s.
    pub floor: f32,
    /// What they may differ by while the wheel is held, m/s: what holds a load is no fault.
    pub rest_floor: f32,
}

impl MotorModel {
    /// Speeds below this share of the free speed are no evidence, at speed …
    const FLOOR: f32 = 0.04;
    /// … and at rest.
    const REST_FLOOR: f32 = 0.11;

    /// A model with floors that fit its free speed at the nominal `supply`, V.
    #[must_use]
    pub fn new(gains: [f32; 3], resistance: f32, tolerance: f32, supply: f32) -> Self {
        let [static_friction, speed_gain, acceleration_gain] = gains;
        let free = if speed_gain > 0.0 {
            supply / speed_gain
        } else {
            0.0
        };
        Self {
            static_friction,
            speed_gain,
            acceleration_gain,
            resistance,
            tolerance,
            floor: Self::FLOOR * free,
            rest_floor: Self::REST_FLOOR * free,
        }
    }

    /// v̂ after `dt` seconds at the voltage `u`. Implicit, so stable for any `dt`; friction takes speed away and never reverses it.
    #[inline]
    fn predict(&self, speed: f32, u: f32, dt: f32) -> f32 {
        let momentum = self.acceleration_gain * speed + dt * u;
        let left = momentum.abs() - dt * self.static_friction;
        if left > 0.0 {
            let speed = left / (self.acceleration_gain + dt * self.speed_gain);
            if momentum < 0.0 { -speed } else { speed }
        } else {
            0.0
        }
    }
}

/// How a wheel contradicts its motor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Contradiction {
    /// It turns too fast or too slowly.
    #[default]
    Differs,
    /// It stands, or nearly.
    Stands,
    /// It turns the other way.
    Reversed,
}

/// What a wheel is suspected of, and for how long.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct WheelMonitor {
    /// v̂, m/s.
    expected: f32,
    contradiction: Contradiction,
    /// How much the wheel contradicts its model in this way, s: Page's CUSUM of the excess over the threshold.
    suspicion: f32,
    /// It has stood a moment ago.
    catches_up: bool,
    /// For how long the motor's current has said that it turns, s; time for which it said otherwise is taken off.
    turning: f32,
    /// The low bits of the count, its last direction, and how often in a row that was the opposite of the one before.
    count: i32,
    direction: i32,
    reversals: u8,
    /// How much farther than it can the wheel has rolled, m.
    ahead: f32,
}

/// The suspicion that is a verdict, s. A wheel that stands makes it in twice that …
const VERDICT: f32 = 0.04;
/// … one that turns again, but too slowly, has this: it may have been held for a moment, and has to catch up …
const LATE_VERDICT: f32 = 0.07;
/// … and one that the motor's current confirms to stand, in half a second: a bump is no stall.
const STALL_VERDICT: f32 = 0.25;
/// The excess counts for at most so much, in thresholds: how wrong a wheel is makes it no faster …
const FASTEST: f32 = 0.5;
/// … but for one that runs away.
const FASTEST_REVERSED: f32 = 1.5;
/// Below this share of the model's speed a wheel counts as standing.
const STANDING: f32 = 0.25;
/// So many reversals of the count in a row are the flicker of a lost channel.
const FLICKER: u8 = 4;
/// A wheel can be this much faster than its limit …
pub(super) const REACH: f32 = 3.0;
/// … and counts may come in so late, s.
const REACH_TIME: f32 = 0.01;
/// A motor turns if its current says so of more than this share of the model's speed.
const TURNING: f32 = 0.5;
/// A motor that draws less than this share of its stall current has no power.
const NO_CURRENT: f32 = 0.05;

impl WheelMonitor {
    /// A wheel at this speed that nothing is known against.
    pub(super) fn new(speed: f32) -> Self {
        Self {
            expected: speed,
            ..Self::default()
        }
    }

    /// True if the wheel has rolled farther than it can: more than `reach` in this cycle, and nothing in the last ones that would make up for it.
    pub(super) fn jumps(&mut self, rolled: f32, reach: f32, max_speed: f32) -> bool {
        let limit = REACH * REACH_TIME * max_speed;
        let ahead = larger(self.ahead + rolled.abs() - reach, 0.0);
        // However far it was, it is told once.
        self.ahead = smaller(ahead, limit);
        ahead > limit
    }

    /// True if it has rolled farther than it can lately.
    pub(super) fn is_ahead(&self) -> bool {
        self.ahead > 0.0
    }

    /// Follows the motor for a cycle; `u` is the voltage that it had. True if the wheel does not do what the motor would.
    #[inline]
    pub(super) fn contradicts(&mut self, model: &MotorModel, reading: &Reading, dt: f32) -> bool {
        if model.speed_gain <= 0.0 {
            return false;
        }
        let expected = model.predict(self.expected, reading.voltage, dt);
        self.expected = expected;
        let measured = reading.speed;
        let difference = (measured - expected).abs();
        let faster = larger(measured.abs(), expected.abs());
        let threshold = larger(model.floor + model.tolerance * faster, model.rest_floor);
        if difference <= threshold && self.suspicion <= 0.0 {
            return false;
        }
        self.suspect(model, reading, difference / threshold - 1.0, dt)
    }

    #[inline(never)]
    fn suspect(&mut self, model: &MotorModel, reading: &Reading, excess: f32, dt: f32) -> bool {
        let measured = reading.speed;
        let contradiction = if measured.abs() < STANDING * self.expected.abs() {
            Contradiction::Stands
        } else if measured * self.expected < 0.0 {
            Contradiction::Reversed
        } else {
            Contradiction::Differs
        };
        if contradiction != self.contradiction {
            // A wheel that loses most of its counts now stands and now turns too slowly: either is evidence of the same. But one that was held for
            // longer than a verdict takes, as a motor's current can say, has come free.
            let reverses = contradiction == Contradiction::Reversed
                || self.contradiction == Contradiction::Reversed;
            if reverses || self.is_convicted() {
                self.suspicion = 0.0;
                self.turning = 0.0;
            }
            self.catches_up = contradiction == Contradiction::Differs && self.suspicion > 0.0;
            self.contradiction = contradiction;
        }
        let fastest = match contradiction {
            Contradiction::Reversed => FASTEST_REVERSED,
            _ => FASTEST,
        };
        self.suspicion = larger(self.suspicion + smaller(excess, fastest) * dt, 0.0);
        self.catches_up &= self.suspicion > 0.0;
        let turns = self.turns_by_current(model, reading) == Some(true);
        self.turning = larger(self.turning + if turns { dt } else { -dt }, 0.0);
        let step = reading.count.wrapping_sub(self.count).signum();
        self.count = reading.count;
        if step != 0 {
            self.reversals = if step == -self.direction {
                self.reversals.saturating_add(1)
            } else {
                0
            };
            self.direction = step;
        }
        self.is_convicted()
    }

    /// True if the suspicion is enough for a verdict.
    pub(super) fn is_convicted(&self) -> bool {
        let verdict = if self.catches_up {
            LATE_VERDICT
        } else {
            VERDICT
        };
        self.suspicion > verdict
    }

    /// The suspicion, s.
    pub(super) fn suspicion(&self) -> f32 {
        self.suspicion
    }

    /// v̂, m/s.
    pub(super) fn expected(&self) -> f32 {
        self.expected
    }

    /// True if the wheel stands although the motor would turn it.
    pub(super) fn stands(&self) -> bool {
        self.contradiction == Contradiction::Stands
    }

    /// True if this cannot be a stall that passes.
    pub(super) fn is_stalled(&self) -> bool {
        self.suspicion > STALL_VERDICT
    }

    /// What is wrong with a wheel that contradicts its motor. A stall may still pass: see [`Self::is_stalled`].
    #[inline(never)]
    pub(super) fn verdict(&self, model: &MotorModel, reading: &Reading) -> Option<Fault> {
        // The other wheel is suspected more; this one shares its fault if it is well on the way.
        if self.suspicion < 0.5 * VERDICT {
            return None;
        }
        match self.contradiction {
            Contradiction::Differs => return Some(Fault::Mismatch),
            Contradiction::Reversed => return Some(Fault::EncoderSign),
            Contradiction::Stands => {}
        }
        if self.reversals >= FLICKER {
            return Some(Fault::EncoderChannel);
        }
        match self.turns_by_current(model, reading) {
            None => Some(Fault::NoMotion),
            Some(_) if self.turning > VERDICT => Some(Fault::EncoderStuck),
            Some(_) => Some(Fault::Stall),
        }
    }

    /// Whether the motor turns as its model does, by its current; nothing if that is not known, or so little that the motor has no power.
    fn turns_by_current(&self, model: &MotorModel, reading: &Reading) -> Option<bool> {
        let drop = reading.current.filter(|_| model.resistance > 0.0)? * model.resistance;
        let u = reading.voltage;
        if drop.abs() < NO_CURRENT * u.abs() && u.abs() > model.speed_gain * model.rest_floor {
            return None;
        }
        // Back-EMF over voltage per speed, in the model's direction.
        let speed = (u - drop) / model.speed_gain;
        Some(speed * sign(self.expected) > TURNING * self.expected.abs())
    }
}
