//! One wheel in front that is driven and steered, two behind that roll freely (theory section 1).

mod geometry;

use super::steering::{self, Helm, Steering};
use super::{
    Counter, Drive, Encoder, GAINS, Influence, Motion, OutputError, Twist, VirtualVehicle, Wheel,
    WheelCommand, observer::Observers, servo,
};
use crate::math::{larger, limit, sign, sin_cos, sqrt};
use core::f32::consts::FRAC_PI_2;
use embedded_hal_02::Qei;
pub use geometry::{Geometry, Steered};

/// Everything that parameters decide about this vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Config {
    /// Nominal distance L from the rear axle to the front wheel's contact, m.
    pub wheel_base: f32,
    /// Nominal metres for each count of the front wheel.
    pub metres_per_count: f32,
    /// True over nominal: k_d of the front wheel, of nothing, k_b of the wheel base; φ₀ of the steering, rad.
    pub gains: [f32; GAINS],
    /// Largest speed of the wheel's circumference, m/s.
    pub max_wheel_speed: f32,
    /// Bandwidth of the speed observer, rad/s.
    pub observer_bandwidth: f32,
    /// Encoder counts fall when the wheel rolls forward.
    pub encoder_reversed: bool,
    /// The servo of the wheel's motor.
    pub servo: servo::Config,
    /// What turns the wheel. Its offset is the gains' φ₀.
    pub steering: steering::Config,
}

/// Below this speed of its wheel (m/s) the vehicle is all but at rest: it steers first.
const CRAWL: f32 = 1e-3;
/// A wheel that can be turned so far, rad, rolls around the rear axle: the vehicle rotates without translating.
pub const ASIDE: f32 = FRAC_PI_2 - 0.01;
/// While the wheel is on its way aside, the vehicle goes so much faster ahead than it is to, at most, m/s.
const AHEAD: f32 = 0.01;
/// A wheel that is so far aside rolls around the rear axle, near enough: the cosine of its angle.
const NEARLY_ASIDE: f32 = 0.2;
/// A rotation with less translation than this share of it, at the wheel, is one in place.
const IN_PLACE: f32 = 0.02;

/// A tricycle: an encoder and a motor of the front wheel, and what turns it.
#[derive(Debug)]
pub struct Tricycle<E, D, S>
where
    E: Qei<Count: Counter>,
{
    encoder: Encoder<E>,
    motor: D,
    helm: Helm<S>,
    config: Config,
    geometry: Geometry,
    observer: Observers<1>,
    /// Where the wheel is to point while the vehicle is all but at rest, rad.
    aim: f32,
    /// The reference sets out from here: only where it goes matters, not what it is corrected by, or the wheels would never point where they should.
    sets_out: bool,
    duty: f32,
}

impl<E, D, S> Tricycle<E, D, S>
where
    E: Qei<Count: Counter>,
    D: Drive,
    S: Steering,
{
    /// Takes the front wheel's encoder, its motor and its steering over.
    pub fn new(encoder: E, motor: D, steering: S, config: &Config) -> Self {
        let mut vehicle = Self {
            encoder: Encoder::new(encoder),
            motor,
            helm: Helm::new(steering, &config.steering),
            config: *config,
            geometry: Geometry::new(config.wheel_base),
            observer: Observers::new(config.observer_bandwidth),
            aim: 0.0,
            sets_out: false,
            duty: 0.0,
        };
        vehicle.configure(config);
        vehicle.aim = vehicle.helm.sense();
        vehicle
    }

    /// Speed of the front wheel's circumference, for a twist at any steering angle, m/s.
    fn pace(&self, twist: Twist) -> f32 {
        let aside = twist.rotation * self.geometry.wheel_base();
        sqrt(twist.translation * twist.translation + aside * aside)
    }

    /// Where the wheel has to point for a twist, rad; where it points already for none.
    fn angle_for(&self, twist: Twist) -> f32 {
        let max = self.helm.max_angle();
        let aside = twist.rotation * self.geometry.wheel_base();
        if max >= ASIDE && twist.translation.abs() < IN_PLACE * aside.abs() {
            // Either side will do, as the wheel rolls both ways.
            return sign(self.aim) * FRAC_PI_2;
        }
        match self.geometry.command(twist) {
            Some(steered) => limit(steered.angle, max),
            None => self.aim,
        }
    }
}

impl<E, D, S> VirtualVehicle for Tricycle<E, D, S>
where
    E: Qei<Count: Counter>,
    D: Drive,
    S: Steering,
{
    type Config = Config;

    fn configure(&mut self, config: &Config) {
        self.config = *config;
        self.encoder.set_reversed(config.encoder_reversed);
        self.motor.configure(&config.servo);
        self.helm.configure(&config.steering);
        self.observer.configure(config.observer_bandwidth);
        self.set_gains(config.gains);
    }

    fn set_gains(&mut self, gains: [f32; GAINS]) {
        self.config.gains = gains;
        let [_, _, base, offset] = gains;
        self.geometry = Geometry::new(base * self.config.wheel_base);
        self.helm.set_offset(offset);
    }

    /// With d cos φ = ΔS and d sin φ = L Δα all of them are linear in ΔS and Δα, whatever φ is:
    ///
    /// ```text
    ///     ∂ΔS/∂k_d = ΔS/k_d      ∂Δα/∂k_d = Δα/k_d      ∂Δα/∂k_b = −Δα/k_b      ∂ΔS/∂φ₀ = −L Δα      ∂Δα/∂φ₀ = ΔS/L
    /// ```
    fn influence(&self) -> Influence {
        let [drive, _, base, _] = self.config.gains;
        let length = self.geometry.wheel_base();
        Influence {
            by_gain: [
                [1.0 / drive, 0.0, 0.0, 1.0 / drive],
                [0.0; 4],
                [0.0, 0.0, 0.0, -1.0 / base],
                [0.0, -length, 1.0 / length, 0.0],
            ],
        }
    }

    fn resolution(&self) -> Twist {
        let [drive, ..] = self.config.gains;
        let count = drive * self.config.metres_per_count;
        Twist {
            translation: count,
            rotation: count / self.geometry.wheel_base(),
        }
    }

    fn steers(&self) -> bool {
        true
    }

    fn max_curvature(&self) -> f32 {
        let max = self.helm.max_angle();
        if max >= ASIDE {
            f32::INFINITY
        } else {
            let (sin, cos) = sin_cos(max);
            sin / (cos * self.geometry.wheel_base())
        }
    }

    fn heading_distance(&self) -> f32 {
        self.geometry.wheel_base()
    }

    fn prepare(&mut self, present: Twist, next: Twist) -> bool {
        let crawls = self.pace(present) <= CRAWL;
        let (_, cos) = sin_cos(self.helm.angle());
        if !crawls && present.translation == 0.0 && cos.abs() > NEARLY_ASIDE {
            // A turn that goes on in place: it waits until the wheel is aside.
            self.sets_out = true;
            self.aim = self.angle_for(present);
            return false;
        }
        self.sets_out = crawls && next != Twist::ZERO;
        if !crawls {
            return true;
        }
        self.aim = self.angle_for(next);
        self.helm.points_to(self.aim)
    }

    fn is_astray(&self) -> bool {
        self.helm.is_astray()
    }

    fn steering(&self) -> f32 {
        self.helm.angle()
    }

    fn sense(&mut self, dt: f32) -> Motion {
        let [drive, ..] = self.config.gains;
        let rolled = drive * self.config.metres_per_count * self.encoder.read() as f32;
        let angle = self.helm.sense();
        self.observer.update([rolled], dt);
        let [speed] = self.observer.speeds();
        let [acceleration] = self.observer.accelerations();
        Motion {
            increment: self.geometry.twist(rolled, angle),
            speed: self.geometry.twist(speed, angle),
            acceleration: self.geometry.twist(acceleration, angle),
            rolled: [rolled, 0.0],
        }
    }

    fn share(&self, wanted: Twist, supply: f32) -> f32 {
        let config = &self.config;
        let servos = [config.servo; 2];
        servo::share(self.pace(wanted), config.max_wheel_speed, &servos, supply)
    }

    fn holds_load(&self) -> bool {
        self.motor.holds_load()
    }

    fn knows_duty(&self) -> bool {
        self.motor.knows_duty()
    }

    fn drive(
        &mut self,
        speed: Twist,
        acceleration: Twist,
        supply: f32,
        dt: f32,
    ) -> Result<(), OutputError> {
        if !self.sets_out && self.pace(speed) > CRAWL {
            self.aim = self.angle_for(speed);
        }
        self.helm.steer(self.aim, dt)?;
        // As the wheel points now, whether that is right already or not.
        let angle = self.helm.angle_within();
        let [measured] = self.observer.speeds();
        let (_, cos) = sin_cos(angle);
        let most = (speed.translation.abs() + AHEAD) / larger(cos.abs(), 1e-3);
        let command = WheelCommand {
            speed: limit(
                limit(self.geometry.speed_at(speed, angle), most),
                self.config.max_wheel_speed,
            ),
            acceleration: self.geometry.speed_at(acceleration, angle),
            measured,
        };
        self.duty = self.motor.command(command, supply, dt)?;
        Ok(())
    }

    /// The steering is held: only a wheel that points somewhere brakes the base where it stands.
    fn brake(&mut self) -> Result<(), OutputError> {
        self.duty = 0.0;
        self.motor.brake()
    }

    fn off(&mut self) -> Result<(), OutputError> {
        self.duty = 0.0;
        let motor = self.motor.off();
        let steering = self.helm.off();
        motor.and(steering)
    }

    /// The front wheel, and none.
    fn wheels(&self) -> [Wheel; 2] {
        let [speed] = self.observer.speeds();
        let wheel = Wheel {
            count: self.encoder.total(),
            speed,
            duty: self.duty,
        };
        [wheel, Wheel::default()]
    }
}
