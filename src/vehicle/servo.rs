//! Wheel servo: feed-forward plus PI, out through a PWM channel, a direction pin and the driver's enable pin.

use super::{Drive, OutputError, WheelCommand};
use crate::math::{larger, limit, smaller};
use core::convert::Infallible;
use embedded_hal::digital::{ErrorType, OutputPin};
use embedded_hal::pwm::SetDutyCycle;

/// Parameters of the servo of one wheel. Voltages are at the motor; speeds are those of the wheel's circumference.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Config {
    /// Voltage that overcomes friction, V.
    pub static_friction: f32,
    /// Voltage per speed (back-EMF and viscous friction), V/(m/s).
    pub speed_gain: f32,
    /// Voltage per acceleration (inertia), V/(m/s²).
    pub acceleration_gain: f32,
    /// Proportional gain on the speed error, V/(m/s).
    pub proportional: f32,
    /// Integral gain, V/m.
    pub integral: f32,
    /// Largest part of the integral in the output, V.
    pub integral_limit: f32,
    /// Largest duty, 0 to 1.
    pub max_duty: f32,
    /// The motor turns backward on a positive voltage.
    pub reversed: bool,
}

impl Config {
    /// True if a speed (m/s, above 0) needs no more voltage than the supply can give: less work than [`Self::top_speed`].
    #[must_use]
    pub fn reaches(&self, speed: f32, supply: f32) -> bool {
        self.static_friction + self.speed_gain * speed <= supply * self.max_duty
    }

    /// The speed at which the motor's voltage reaches what the supply can give, m/s.
    #[must_use]
    pub fn top_speed(&self, supply: f32) -> f32 {
        if self.speed_gain > 0.0 {
            larger(
                (supply * self.max_duty - self.static_friction) / self.speed_gain,
                0.0,
            )
        } else {
            f32::INFINITY
        }
    }
}

/// References use this much of the wheels' speed; the rest is for corrections.
const HEADROOM: f32 = 0.96;
/// A battery that is all but empty slows the references down, but does not stop them.
const SMALLEST_SHARE: f32 = 0.05;

/// How much of a wanted speed there is to have if the fastest of two wheels has to roll at `fastest` m/s for it, above 0 and up to 1: less than
/// `max_speed` (m/s), and than what the motors reach with the `supply` (V).
// A call of it would cost the tick a tenth of what it does.
#[allow(clippy::inline_always)]
#[inline(always)]
#[must_use]
pub(super) fn share(fastest: f32, max_speed: f32, servos: &[Config; 2], supply: f32) -> f32 {
    let needed = fastest * (1.0 / HEADROOM);
    let [left, right] = servos;
    if needed <= max_speed && left.reaches(needed, supply) && right.reaches(needed, supply) {
        return 1.0;
    }
    let limit = servos
        .iter()
        .map(|servo| servo.top_speed(supply))
        .fold(max_speed, smaller);
    let reachable = HEADROOM * limit;
    if fastest > reachable {
        larger(reachable / fastest, SMALLEST_SHARE)
    } else {
        1.0
    }
}

/// The direction of a friction voltage is blended over this speed, so that a command that flickers about zero does not shake the gears (m/s).
const FRICTION_BLEND: f32 = 0.004;
/// The integral learns only while the speed error is below this share of the commanded speed, or below [`LEARNING_FLOOR`]: what a wheel that is
/// blocked at speed would teach it is wrong once the wheel is free.
const LEARNING_SHARE: f32 = 0.3;
/// m/s. An axis whose reference waits asks for less than this, so a base that is stuck gathers force.
const LEARNING_FLOOR: f32 = 0.06;
/// Once the wheel runs ahead of its command by this much (m/s) …
const OVERRUN: f32 = 0.01;
/// … the integral is forgotten with this time constant, s: what freed a stuck wheel must be gone before the wheel has gathered speed.
const FORGETTING: f32 = 0.02;

/// At rest, a voltage above this share of the friction's may hold a load that would carry the wheel away …
const LOAD: f32 = 0.8;
/// … if it is above this duty …
const SLIGHT_DUTY: f32 = 0.02;
/// … and lasts, s.
const LOAD_FILTER: f32 = 0.1;

/// The controller proper: speed error to voltage.
///
/// ```text
///     u = V_s sat(v/v_0) + K_v v + K_a a + k_p e + ∫ k_i e dt        e = v − v_measured
/// ```
///
/// Anti-windup: the integral is bounded, stands still while the output is saturated in its direction and while e is too large to be friction, and is
/// forgotten while the wheel overruns its command.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Regulator {
    integral: f32,
}

impl Regulator {
    /// Voltage for a command; `available` is the largest voltage the bridge can give, `dt` the time until the next call.
    // A call of it would cost the tick a fifth of what it does.
    #[allow(clippy::inline_always)]
    #[inline(always)]
    pub fn update(
        &mut self,
        config: &Config,
        command: WheelCommand,
        available: f32,
        dt: f32,
    ) -> f32 {
        let error = command.speed - command.measured;
        let feed_forward = config.static_friction * limit(command.speed / FRICTION_BLEND, 1.0)
            + config.speed_gain * command.speed
            + config.acceleration_gain * command.acceleration;
        let proportional = config.proportional * error;
        let wanted = feed_forward + proportional + self.integral;
        let saturated = wanted.abs() > available && wanted * error > 0.0;
        let plausible =
            error.abs() < LEARNING_FLOOR || error.abs() < LEARNING_SHARE * command.speed.abs();
        if plausible && !saturated {
            self.integral = limit(
                self.integral + config.integral * error * dt,
                config.integral_limit,
            );
        }
        if error * self.integral < 0.0 && error.abs() > OVERRUN {
            self.integral -= self.integral * dt / (FORGETTING + dt);
        }
        limit(feed_forward + proportional + self.integral, available)
    }

    /// Forgets the integral.
    pub fn reset(&mut self) {
        self.integral = 0.0;
    }
}

/// The pin of a driver that has none, for instance no enable input.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoPin;

impl ErrorType for NoPin {
    type Error = Infallible;
}

impl OutputPin for NoPin {
    fn set_low(&mut self) -> Result<(), Infallible> {
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

/// A motor behind an H-bridge: duty by PWM, direction by a pin (high is forward), the driver's power by another (high is enabled; pull it down at the
/// driver, so that it is off while the controller is in reset).
#[derive(Debug)]
pub struct Servo<P, D, E> {
    pwm: P,
    direction: D,
    enable: E,
    config: Config,
    regulator: Regulator,
    /// The voltage of the last tenth of a second, V.
    load: f32,
    /// What the battery had then, V.
    supply: f32,
}

impl<P: SetDutyCycle, D: OutputPin, E: OutputPin> Servo<P, D, E> {
    /// Takes a PWM channel and the pins over and switches the motor off.
    ///
    /// # Errors
    /// [`OutputError`] if an output refused.
    pub fn new(pwm: P, direction: D, enable: E, config: Config) -> Result<Self, OutputError> {
        let mut servo = Self {
            pwm,
            direction,
            enable,
            config,
            regulator: Regulator::default(),
            load: 0.0,
            supply: 0.0,
        };
        servo.off()?;
        Ok(servo)
    }

    fn output(&mut self, duty: f32) -> Result<(), OutputError> {
        let forward = (duty >= 0.0) != self.config.reversed;
        let full = self.pwm.max_duty_cycle();
        // A NaN casts to 0: off. By way of 32 bits, which is one instruction on the target.
        let counts = (duty.abs() * f32::from(full) + 0.5) as u32;
        let counts = counts.min(u32::from(full)) as u16;
        self.direction
            .set_state(forward.into())
            .map_err(|_| OutputError)?;
        self.pwm.set_duty_cycle(counts).map_err(|_| OutputError)?;
        self.enable.set_high().map_err(|_| OutputError)
    }

    fn forget(&mut self) {
        self.regulator.reset();
        self.load = 0.0;
    }
}

impl<P: SetDutyCycle, D: OutputPin, E: OutputPin> Drive for Servo<P, D, E> {
    fn configure(&mut self, config: &Config) {
        self.config = *config;
    }

    fn knows_duty(&self) -> bool {
        true
    }

    fn command(&mut self, command: WheelCommand, supply: f32, dt: f32) -> Result<f32, OutputError> {
        let available = supply * self.config.max_duty;
        let voltage = self.regulator.update(&self.config, command, available, dt);
        self.load += (voltage - self.load) * dt / (LOAD_FILTER + dt);
        self.supply = supply;
        // Within the largest duty, as the voltage is within what is available.
        let duty = voltage / supply;
        self.output(duty)?;
        Ok(duty)
    }

    fn holds_load(&self) -> bool {
        let slight = larger(
            LOAD * self.config.static_friction,
            SLIGHT_DUTY * self.supply,
        );
        self.load.abs() > slight
    }

    fn brake(&mut self) -> Result<(), OutputError> {
        self.forget();
        self.pwm.set_duty_cycle_fully_off().map_err(|_| OutputError)
    }

    fn off(&mut self) -> Result<(), OutputError> {
        // Both, whatever the other one says.
        let disabled = self.enable.set_low().map_err(|_| OutputError);
        self.brake().and(disabled)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CONFIG: Config = Config {
        static_friction: 0.5,
        speed_gain: 13.0,
        acceleration_gain: 0.5,
        proportional: 20.0,
        integral: 100.0,
        integral_limit: 3.0,
        max_duty: 0.95,
        reversed: false,
    };

    #[test]
    fn feed_forward_alone_when_speed_is_right() {
        let mut regulator = Regulator::default();
        let command = WheelCommand {
            speed: 0.2,
            acceleration: 1.0,
            measured: 0.2,
        };
        let voltage = regulator.update(&CONFIG, command, 12.0, 1e-3);
        assert!((voltage - (0.5 + 13.0 * 0.2 + 0.5)).abs() < 1e-5);
    }

    #[test]
    fn blocked_wheel_does_not_wind_up() {
        let mut regulator = Regulator::default();
        let command = WheelCommand {
            speed: 0.3,
            acceleration: 0.0,
            measured: 0.0,
        };
        for _ in 0..10_000 {
            regulator.update(&CONFIG, command, 12.0, 1e-3);
        }
        assert_eq!(regulator, Regulator::default());
    }

    #[test]
    fn integral_is_bounded_and_unwinds() {
        let mut regulator = Regulator::default();
        let slow = WheelCommand {
            speed: 0.1,
            acceleration: 0.0,
            measured: 0.08,
        };
        for _ in 0..10_000 {
            regulator.update(&CONFIG, slow, 12.0, 1e-3);
        }
        assert_eq!(regulator.integral, CONFIG.integral_limit);
        let fast = WheelCommand {
            measured: 0.12,
            ..slow
        };
        regulator.update(&CONFIG, fast, 12.0, 1e-3);
        assert!(regulator.integral < CONFIG.integral_limit);
    }
}
