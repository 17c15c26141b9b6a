//! What turns the wheels' direction: an actuator with a sensor of the angle, and how it is led.

use super::{Counter, Encoder, OutputError};
use crate::math::{larger, limit, smaller};
use embedded_hal::pwm::SetDutyCycle;
use embedded_hal_02::Qei;

/// What parameters decide about a steering. Angles are of the steered wheel, or of a car's front axle; positive to the left.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Config {
    /// The farthest that it turns to either side, rad.
    pub max_angle: f32,
    /// Its fastest, rad/s.
    pub max_rate: f32,
    /// φ₀: the true angle where the sensor says 0, rad.
    pub offset: f32,
    /// Width of the servo's pulse for an angle of 0, s.
    pub pulse_centre: f32,
    /// What it changes by for each radian, s; negative for a servo that turns the other way.
    pub pulse_per_radian: f32,
    /// Voltage of the potentiometer at an angle of 0, V.
    pub volts_centre: f32,
    /// Angle for each volt, rad/V; 0: there is no potentiometer, an encoder measures the angle.
    pub radians_per_volt: f32,
    /// Angle for each count of the encoder, rad, which is 0 where the base was switched on.
    pub radians_per_count: f32,
}

impl Config {
    /// Angle for each count, rad, of an encoder with so many counts for a turn; 0 for one that has none.
    #[must_use]
    pub fn per_count(counts_per_turn: f32) -> f32 {
        if counts_per_turn == 0.0 {
            0.0
        } else {
            core::f32::consts::TAU / counts_per_turn
        }
    }
}

/// A steering, as a vehicle uses it. Angles here are the sensor's, without the offset.
pub trait Steering {
    /// Takes other parameters over.
    fn configure(&mut self, config: &Config);

    /// The angle as measured, rad; positive to the left. It is finite.
    fn angle(&mut self) -> f32;

    /// Points there (rad) until the next call.
    ///
    /// # Errors
    /// [`OutputError`] if the output refused.
    fn steer(&mut self, angle: f32) -> Result<(), OutputError>;

    /// Lets go of the steering.
    ///
    /// # Errors
    /// [`OutputError`] if the output refused.
    fn off(&mut self) -> Result<(), OutputError>;
}

/// A voltage that a board measures.
pub trait Voltmeter {
    /// The last measurement, V.
    fn volts(&mut self) -> f32;
}

/// Between pulses of a servo lies so much time, s: what all of them take.
pub const PULSE_PERIOD: f32 = 0.02;
/// No servo takes shorter pulses, s …
const SHORTEST_PULSE: f32 = 0.5e-3;
/// … or longer ones.
const LONGEST_PULSE: f32 = 2.5e-3;

/// A hobby servo, and a potentiometer or an encoder on what it turns: which of the two, the configuration says.
///
/// The width of the pulse that comes every [`PULSE_PERIOD`] is where the servo is to point. Its own potentiometer is inside: another one, or an encoder, tells
/// where the wheels are while it is still on its way.
#[derive(Debug)]
pub struct ServoSteering<P, V, Q>
where
    Q: Qei<Count: Counter>,
{
    pwm: P,
    potentiometer: V,
    encoder: Encoder<Q>,
    config: Config,
}

impl<P, V, Q> ServoSteering<P, V, Q>
where
    P: SetDutyCycle,
    V: Voltmeter,
    Q: Qei<Count: Counter>,
{
    /// Takes a PWM channel with a period of [`PULSE_PERIOD`], a potentiometer and an encoder over, and gives no pulses yet. What is not connected is never
    /// looked at.
    ///
    /// # Errors
    /// [`OutputError`] if the output refused.
    pub fn new(pwm: P, potentiometer: V, encoder: Q, config: &Config) -> Result<Self, OutputError> {
        let mut steering = Self {
            pwm,
            potentiometer,
            encoder: Encoder::new(encoder),
            config: *config,
        };
        steering.off()?;
        Ok(steering)
    }
}

impl<P, V, Q> Steering for ServoSteering<P, V, Q>
where
    P: SetDutyCycle,
    V: Voltmeter,
    Q: Qei<Count: Counter>,
{
    fn configure(&mut self, config: &Config) {
        self.config = *config;
    }

    fn angle(&mut self) -> f32 {
        let config = &self.config;
        // Read in either case: it counts modulo its width, and must not be left alone for long.
        self.encoder.read();
        if config.radians_per_volt == 0.0 {
            return self.encoder.total() as f32 * config.radians_per_count;
        }
        let volts = self.potentiometer.volts();
        let angle = (volts - config.volts_centre) * config.radians_per_volt;
        // No potentiometer says more than it can turn; a torn wire must not either.
        limit(angle, core::f32::consts::PI)
    }

    fn steer(&mut self, angle: f32) -> Result<(), OutputError> {
        let pulse = self.config.pulse_centre + self.config.pulse_per_radian * angle;
        // Also for a NaN, which no comparison holds for.
        let pulse = larger(smaller(pulse, LONGEST_PULSE), SHORTEST_PULSE);
        let steps = pulse / PULSE_PERIOD * f32::from(self.pwm.max_duty_cycle());
        self.pwm
            .set_duty_cycle((steps + 0.5) as u16)
            .map_err(|_| OutputError)
    }

    fn off(&mut self) -> Result<(), OutputError> {
        self.pwm.set_duty_cycle(0).map_err(|_| OutputError)
    }
}

/// The steering points where it should, if it is off by less than this, rad (2°) …
const POINTED: f32 = 0.035;
/// … or has had so long for it, s: a worn linkage stops no vehicle, and a broken one shows in how the heading is followed.
const PATIENCE: f32 = 0.5;
/// Farther than this from where it is told to point, rad (10°) …
const ASTRAY: f32 = 0.175;
/// … for so long, s, is no lag any more.
const LOST: f32 = 0.5;
/// More readings than this in a row of an angle that it cannot have are no noise.
const TORN: u8 = 10;

/// Leads a steering to the angles that are wanted: no farther and no faster than it can.
#[derive(Debug)]
pub struct Helm<S> {
    steering: S,
    config: Config,
    /// φ as measured, with the offset, rad.
    angle: f32,
    /// φ as commanded, on its way to what is wanted; none while nobody steers.
    commanded: Option<f32>,
    /// For so long it has been commanded to point where it does, s.
    waited: f32,
    /// For so long it has been somewhere else, s; time for which it was not is taken off.
    astray: f32,
    /// So many readings in a row were of an angle that it cannot have.
    beyond: u8,
}

impl<S: Steering> Helm<S> {
    /// Takes a steering over, and lets it be.
    pub fn new(steering: S, config: &Config) -> Self {
        let mut helm = Self {
            steering,
            config: *config,
            angle: 0.0,
            commanded: None,
            waited: 0.0,
            astray: 0.0,
            beyond: 0,
        };
        helm.configure(config);
        helm.sense();
        helm
    }

    /// Takes other parameters over.
    pub fn configure(&mut self, config: &Config) {
        self.config = *config;
        self.steering.configure(config);
    }

    /// φ₀ from here on, rad.
    pub fn set_offset(&mut self, offset: f32) {
        self.config.offset = offset;
    }

    /// Reads the sensor, and gives φ, rad.
    pub fn sense(&mut self) -> f32 {
        self.angle = self.steering.angle() + self.config.offset;
        // Also for a NaN, which no comparison holds for.
        let is_possible = self.angle.abs() <= self.config.max_angle + ASTRAY;
        self.beyond = if is_possible {
            0
        } else {
            self.beyond.saturating_add(1)
        };
        self.angle
    }

    /// φ as of the last reading, or the end of its way that it is beyond: what a wheel's speed may be worked out with, rad.
    #[must_use]
    pub fn angle_within(&self) -> f32 {
        limit(self.angle, self.config.max_angle)
    }

    /// φ as of the last reading, rad.
    #[must_use]
    pub fn angle(&self) -> f32 {
        self.angle
    }

    /// The farthest that it turns to either side, rad.
    #[must_use]
    pub fn max_angle(&self) -> f32 {
        self.config.max_angle
    }

    /// Goes on to `wanted` (rad; a NaN counts as 0) for `dt` seconds.
    ///
    /// # Errors
    /// [`OutputError`] if the output refused.
    pub fn steer(&mut self, wanted: f32, dt: f32) -> Result<(), OutputError> {
        let Config {
            max_angle,
            max_rate,
            offset,
            ..
        } = self.config;
        let wanted = limit(wanted, max_angle);
        let from = limit(self.commanded.unwrap_or(self.angle), max_angle);
        let left = wanted - from;
        let commanded = from + limit(left, max_rate * dt);
        self.waited = if left == 0.0 { self.waited + dt } else { 0.0 };
        let is_there = (self.angle - commanded).abs() <= ASTRAY;
        self.astray = larger(self.astray + if is_there { -dt } else { dt }, 0.0);
        self.commanded = Some(commanded);
        self.steering.steer(commanded - offset)
    }

    /// True if it points to `wanted` (rad), as well as it may.
    #[must_use]
    pub fn points_to(&self, wanted: f32) -> bool {
        let wanted = limit(wanted, self.config.max_angle);
        self.commanded == Some(wanted)
            && ((self.angle - wanted).abs() < POINTED || self.waited > PATIENCE)
    }

    /// True if it has been too far from where it was told to point for too long, or its sensor says what cannot be: a torn wire.
    #[must_use]
    pub fn is_astray(&self) -> bool {
        self.astray > LOST || self.beyond > TORN
    }

    /// Lets go of the steering.
    ///
    /// # Errors
    /// [`OutputError`] if the output refused.
    pub fn off(&mut self) -> Result<(), OutputError> {
        self.commanded = None;
        self.waited = 0.0;
        self.astray = 0.0;
        self.steering.off()
    }
}
