//! Two independently driven wheels on one axis [C §6.1, §6.2].

mod geometry;

use super::{
    Counter, Drive, Encoder, GAINS, Influence, Motion, OutputError, Twist, VirtualVehicle, Wheel,
    WheelCommand, observer::Observers, servo,
};
use crate::math::larger;
use embedded_hal_02::Qei;
pub(super) use geometry::Carry;
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
    observers: Observers<2>,
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
        let mut vehicle = Self {
            left: Encoder::new(left),
            right: Encoder::new(right),
            left_drive,
            right_drive,
            config: *config,
            carry: Carry::default(),
            observers: Observers::new(config.observer_bandwidth),
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
        self.config = *config;
        self.carry = Carry::default();
        self.left.set_reversed(config.encoder_reversed[0]);
        self.right.set_reversed(config.encoder_reversed[1]);
        self.left_drive.configure(&config.servo[0]);
        self.right_drive.configure(&config.servo[1]);
        self.observers.configure(config.observer_bandwidth);
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
        self.observers.update(metres, dt);
        let geometry = &self.config.geometry;
        Motion {
            increment: self.carry.advance(geometry, counts),
            speed: geometry.twist(self.observers.speeds()),
            acceleration: geometry.twist(self.observers.accelerations()),
            rolled: metres,
        }
    }

    // A call of it would cost the tick a tenth of what it does.
    #[allow(clippy::inline_always)]
    #[inline(always)]
    fn share(&self, wanted: Twist, supply: f32) -> f32 {
        let [left, right] = self.config.geometry.wheel_speeds(wanted);
        let fastest = larger(left.abs(), right.abs());
        servo::share(
            fastest,
            self.config.max_wheel_speed,
            &self.config.servo,
            supply,
        )
    }

    fn holds_load(&self) -> bool {
        self.left_drive.holds_load() || self.right_drive.holds_load()
    }

    fn knows_duty(&self) -> bool {
        self.left_drive.knows_duty() && self.right_drive.knows_duty()
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
            measured: self.observers.each[wheel].speed(),
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
            speed: self.observers.each[index].speed(),
            duty: self.duty[index],
        };
        [wheel(0, self.left.total()), wheel(1, self.right.total())]
    }
}
