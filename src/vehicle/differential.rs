//! Two independently driven wheels on one axis [C §6.1, §6.2].

use super::{
    Counter, Drive, Encoder, Gains, Motion, Observer, OutputError, Twist, VirtualVehicle, Wheel,
    WheelCommand, servo,
};
use crate::math::{Split, larger, smaller};
use embedded_hal_02::Qei;

/// The geometry: wheel base and what one count is worth, in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Geometry {
    /// Distance of the wheels' contacts w, m.
    pub wheel_base: f64,
    /// K_left, m per count.
    pub left: f64,
    /// K_right, m per count.
    pub right: f64,
}

impl Geometry {
    /// v_left = v_s − v_α w/2, v_right = v_s + v_α w/2 (theory section 1).
    #[must_use]
    pub fn wheel_speeds(&self, twist: Twist) -> [f32; 2] {
        Active::new(self).wheel_speeds(twist)
    }

    /// The inverse of [`Self::wheel_speeds`].
    #[must_use]
    pub fn twist(&self, speeds: [f32; 2]) -> Twist {
        Active::new(self).twist(speeds)
    }
}

/// The geometry in f32: what the tick needs of it, worked out once.
#[derive(Clone, Copy, Debug, Default)]
struct Active {
    half_base: f32,
    /// 1/w.
    curvature: f32,
    per_count: [f32; 2],
    resolution: Twist,
}

impl Active {
    fn new(geometry: &Geometry) -> Self {
        let coarser = if geometry.left > geometry.right {
            geometry.left
        } else {
            geometry.right
        };
        Self {
            half_base: (0.5 * geometry.wheel_base) as f32,
            curvature: (1.0 / geometry.wheel_base) as f32,
            per_count: [geometry.left as f32, geometry.right as f32],
            resolution: Twist {
                translation: coarser as f32,
                rotation: (coarser / geometry.wheel_base) as f32,
            },
        }
    }

    fn wheel_speeds(&self, twist: Twist) -> [f32; 2] {
        let sideways = twist.rotation * self.half_base;
        [twist.translation - sideways, twist.translation + sideways]
    }

    fn twist(&self, [left, right]: [f32; 2]) -> Twist {
        Twist {
            translation: 0.5 * (right + left),
            rotation: (right - left) * self.curvature,
        }
    }
}

/// Everything that parameters decide about this vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Config {
    /// Wheel base and metres per count.
    pub geometry: Geometry,
    /// Largest speed of a wheel's circumference, m/s.
    pub max_wheel_speed: f32,
    /// Bandwidth of the speed observers, rad/s.
    pub observer_bandwidth: f32,
    /// Encoder counts fall when the wheel rolls forward: left, right.
    pub encoder_reversed: [bool; 2],
    /// The servos: left, right.
    pub servo: [servo::Config; 2],
}

/// References use this much of the wheels' speed; the rest is for corrections.
const HEADROOM: f32 = 0.96;
/// A battery that is all but empty slows the references down, but does not stop them.
const SMALLEST_SHARE: f32 = 0.05;

/// One of ΔS, Δα as a function of the two wheels' counts: linear, with the rounding carried to the next cycle.
#[derive(Clone, Copy, Debug, Default)]
struct Odometer {
    left: Split,
    right: Split,
    carry: f32,
}

impl Odometer {
    fn new(left: f64, right: f64) -> Self {
        Self {
            left: Split::new(left),
            right: Split::new(right),
            carry: 0.0,
        }
    }

    /// The increments returned sum up to left·Σn_left + right·Σn_right, however many there are.
    #[inline]
    fn advance(&mut self, left: i32, right: i32) -> f32 {
        let (left, left_rest) = self.left.times(left);
        let (right, right_rest) = self.right.times(right);
        let sum = left + right;
        let taken = sum - left;
        let lost = (left - (sum - taken)) + (right - taken);
        let rest = lost + left_rest + right_rest + self.carry;
        let increment = sum + rest;
        self.carry = (sum - increment) + rest;
        increment
    }
}

/// A differential drive: two encoders, two motors.
#[derive(Debug)]
pub struct DifferentialDrive<L, R, DL, DR>
where
    L: Qei<Count: Counter>,
    R: Qei<Count: Counter>,
{
    left: Encoder<L>,
    right: Encoder<R>,
    left_drive: DL,
    right_drive: DR,
    config: Config,
    active: Active,
    translation: Odometer,
    rotation: Odometer,
    observers: [Observer; 2],
    gains: Gains,
    gains_dt: f32,
    duty: [f32; 2],
}

impl<L, R, DL, DR> DifferentialDrive<L, R, DL, DR>
where
    L: Qei<Count: Counter>,
    R: Qei<Count: Counter>,
    DL: Drive,
    DR: Drive,
{
    /// Takes encoders and drives over.
    pub fn new(left: L, right: R, left_drive: DL, right_drive: DR, config: &Config) -> Self {
        let nominal_dt = 1e-3;
        let mut vehicle = Self {
            left: Encoder::new(left),
            right: Encoder::new(right),
            left_drive,
            right_drive,
            config: *config,
            active: Active::new(&config.geometry),
            translation: Odometer::default(),
            rotation: Odometer::default(),
            observers: [Observer::default(); 2],
            gains: Gains::new(config.observer_bandwidth, nominal_dt),
            gains_dt: nominal_dt,
            duty: [0.0; 2],
        };
        vehicle.configure(config);
        vehicle
    }
}

impl<L, R, DL, DR> VirtualVehicle for DifferentialDrive<L, R, DL, DR>
where
    L: Qei<Count: Counter>,
    R: Qei<Count: Counter>,
    DL: Drive,
    DR: Drive,
{
    type Config = Config;

    fn configure(&mut self, config: &Config) {
        let Geometry {
            wheel_base,
            left,
            right,
        } = config.geometry;
        self.config = *config;
        self.active = Active::new(&config.geometry);
        // ΔS = (ΔS_right + ΔS_left)/2      Δα = (ΔS_right − ΔS_left)/w
        self.translation = Odometer::new(0.5 * left, 0.5 * right);
        self.rotation = Odometer::new(left / wheel_base, right / wheel_base);
        self.left.set_reversed(config.encoder_reversed[0]);
        self.right.set_reversed(config.encoder_reversed[1]);
        self.left_drive.configure(&config.servo[0]);
        self.right_drive.configure(&config.servo[1]);
        self.gains = Gains::new(config.observer_bandwidth, self.gains_dt);
    }

    fn resolution(&self) -> Twist {
        self.active.resolution
    }

    fn sense(&mut self, dt: f32) -> Motion {
        let counts = [self.left.read(), self.right.read()];
        let metres = [
            counts[0] as f32 * self.active.per_count[0],
            counts[1] as f32 * self.active.per_count[1],
        ];
        if dt > 0.0 {
            if dt != self.gains_dt {
                self.gains = Gains::new(self.config.observer_bandwidth, dt);
                self.gains_dt = dt;
            }
            for (observer, moved) in self.observers.iter_mut().zip(metres) {
                observer.update(moved, &self.gains);
            }
        } else {
            for (observer, moved) in self.observers.iter_mut().zip(metres) {
                observer.update_at_once(moved);
            }
        }
        let active = &self.active;
        Motion {
            increment: Twist {
                translation: self.translation.advance(counts[0], counts[1]),
                rotation: self.rotation.advance(counts[0].saturating_neg(), counts[1]),
            },
            speed: active.twist(self.observers.map(|o| o.speed())),
            acceleration: active.twist(self.observers.map(|o| o.acceleration())),
        }
    }

    fn share(&self, wanted: Twist, supply: f32) -> f32 {
        let [left, right] = self.active.wheel_speeds(wanted);
        let fastest = larger(left.abs(), right.abs());
        let limit = self
            .config
            .servo
            .iter()
            .map(|servo| servo.top_speed(supply))
            .fold(self.config.max_wheel_speed, smaller);
        let reachable = HEADROOM * limit;
        if fastest > reachable {
            larger(reachable / fastest, SMALLEST_SHARE)
        } else {
            1.0
        }
    }

    fn holds_load(&self) -> bool {
        self.left_drive.holds_load() || self.right_drive.holds_load()
    }

    fn drive(
        &mut self,
        speed: Twist,
        acceleration: Twist,
        supply: f32,
        dt: f32,
    ) -> Result<(), OutputError> {
        let speeds = self.active.wheel_speeds(speed);
        let accelerations = self.active.wheel_speeds(acceleration);
        // A common factor keeps the curvature v_α / v_s.
        let fastest = larger(speeds[0].abs(), speeds[1].abs());
        let scale = if fastest > self.config.max_wheel_speed {
            self.config.max_wheel_speed / fastest
        } else {
            1.0
        };
        let command = |wheel: usize| WheelCommand {
            speed: scale * speeds[wheel],
            acceleration: scale * accelerations[wheel],
            measured: self.observers[wheel].speed(),
        };
        let (left, right) = (command(0), command(1));
        self.duty = [
            self.left_drive.command(left, supply, dt)?,
            self.right_drive.command(right, supply, dt)?,
        ];
        Ok(())
    }

    fn brake(&mut self) -> Result<(), OutputError> {
        self.duty = [0.0; 2];
        let left = self.left_drive.brake();
        let right = self.right_drive.brake();
        left.and(right)
    }

    fn off(&mut self) -> Result<(), OutputError> {
        self.duty = [0.0; 2];
        let left = self.left_drive.off();
        let right = self.right_drive.off();
        left.and(right)
    }

    fn wheels(&self) -> [Wheel; 2] {
        let wheel = |index: usize, count| Wheel {
            count,
            speed: self.observers[index].speed(),
            duty: self.duty[index],
        };
        [wheel(0, self.left.total()), wheel(1, self.right.total())]
    }
}
