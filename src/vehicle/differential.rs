//! Two independently driven wheels on one axis [C §6.1, §6.2].

mod geometry;

use super::{
    Counter, Drive, Encoder, GAINS, Gains, Influence, Motion, Observer, OutputError, Twist,
    VirtualVehicle, Wheel, WheelCommand, servo,
};
use crate::math::{larger, smaller};
use embedded_hal_02::Qei;
use geometry::Carry;
pub use geometry::Geometry;

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
    carry: Carry,
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
            carry: Carry::default(),
            observers: [Observer::default(); 2],
            gains: Gains::new(config.observer_bandwidth, nominal_dt),
            gains_dt: nominal_dt,
            duty: [0.0; 2],
        };
        vehicle.configure(config);
        vehicle
    }

    /// Another interval than before. After a gap there is no telling how the speed came about.
    #[cold]
    #[inline(never)]
    fn retune(&mut self, metres: [f32; 2], dt: f32) {
        self.gains = Gains::new(self.config.observer_bandwidth, dt);
        self.gains_dt = dt;
        if dt > Observer::GAP {
            for (observer, moved) in self.observers.iter_mut().zip(metres) {
                observer.restart(moved / dt);
            }
        }
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
        self.config = *config;
        self.carry = Carry::default();
        self.left.set_reversed(config.encoder_reversed[0]);
        self.right.set_reversed(config.encoder_reversed[1]);
        self.left_drive.configure(&config.servo[0]);
        self.right_drive.configure(&config.servo[1]);
        self.gains = Gains::new(config.observer_bandwidth, self.gains_dt);
    }

    fn set_gains(&mut self, gains: [f32; GAINS]) {
        self.config.geometry.set_gains(gains);
    }

    fn influence(&self) -> Influence {
        self.config.geometry.influence()
    }

    fn resolution(&self) -> Twist {
        self.config.geometry.resolution()
    }

    fn sense(&mut self, dt: f32) -> Motion {
        let counts = [self.left.read(), self.right.read()];
        let metres = self.config.geometry.rolled(counts);
        if dt > 0.0 {
            if dt != self.gains_dt {
                self.retune(metres, dt);
            }
            for (observer, moved) in self.observers.iter_mut().zip(metres) {
                observer.update(moved, &self.gains);
            }
        } else {
            for (observer, moved) in self.observers.iter_mut().zip(metres) {
                observer.update_at_once(moved);
            }
        }
        let geometry = &self.config.geometry;
        Motion {
            increment: self.carry.advance(geometry, counts),
            speed: geometry.twist(self.observers.map(|o| o.speed())),
            acceleration: geometry.twist(self.observers.map(|o| o.acceleration())),
            rolled: metres,
        }
    }

    // A call of it would cost the tick a tenth of what it does.
    #[allow(clippy::inline_always)]
    #[inline(always)]
    fn share(&self, wanted: Twist, supply: f32) -> f32 {
        let [left, right] = self.config.geometry.wheel_speeds(wanted);
        let fastest = larger(left.abs(), right.abs());
        let needed = fastest * (1.0 / HEADROOM);
        let [left, right] = &self.config.servo;
        if needed <= self.config.max_wheel_speed
            && left.reaches(needed, supply)
            && right.reaches(needed, supply)
        {
            return 1.0;
        }
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
        let mut speeds = self.config.geometry.wheel_speeds(speed);
        let mut accelerations = self.config.geometry.wheel_speeds(acceleration);
        // A common factor keeps the curvature v_α / v_s.
        let fastest = larger(speeds[0].abs(), speeds[1].abs());
        let limit = self.config.max_wheel_speed;
        if fastest > limit {
            let scale = limit / fastest;
            speeds = speeds.map(|speed| scale * speed);
            accelerations = accelerations.map(|acceleration| scale * acceleration);
        }
        let command = |wheel: usize| WheelCommand {
            speed: speeds[wheel],
            acceleration: accelerations[wheel],
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
