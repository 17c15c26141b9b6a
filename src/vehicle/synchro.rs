//! All wheels are driven by one motor and steered by another (theory section 1).
//!
//! Where the wheels point is the vehicle's heading, whatever its body does: ΔS comes from the drive's encoder, Δα from the steering's. Wheels that are not
//! quite alike turn the body, and with it all of them, a little with every metre: the drift, rad/m, which no encoder sees.

use super::{
    Counter, Drive, Encoder, GAINS, Influence, Motion, OutputError, Twist, VirtualVehicle, Wheel,
    WheelCommand, observer::Observers, servo,
};
use crate::math::larger;
use embedded_hal_02::Qei;

/// Everything that parameters decide about this vehicle.
///
/// The steering's motor is told speeds of a circumference as the drive's is: that of a circle of the radius `lever`, which is for the parameters' author to
/// choose. With it, one servo's parameters fit both motors.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Config {
    /// Nominal metres for each count of the drive.
    pub metres_per_count: f32,
    /// Nominal angle for each count of the steering, rad.
    pub radians_per_count: f32,
    /// Speed of the steering's circumference for each rad/s, m.
    pub lever: f32,
    /// True over nominal: of the drive, of nothing, of the steering; the drift, rad/m.
    pub gains: [f32; GAINS],
    /// Largest speed of a circumference, m/s.
    pub max_wheel_speed: f32,
    /// Bandwidth of the speed observers, rad/s.
    pub observer_bandwidth: f32,
    /// Encoder counts fall in forward motion: drive; in a turn to the left: steering.
    pub encoder_reversed: [bool; 2],
    /// The servos: drive, steering.
    pub servo: [servo::Config; 2],
}

/// A synchro drive: two encoders, two motors.
#[derive(Debug)]
pub struct Synchro<D, T, DD, DT>
where
    D: Qei<Count: Counter>,
    T: Qei<Count: Counter>,
{
    drive: Encoder<D>,
    steering: Encoder<T>,
    drive_motor: DD,
    steering_motor: DT,
    config: Config,
    observers: Observers<2>,
    duty: [f32; 2],
}

impl<D, T, DD, DT> Synchro<D, T, DD, DT>
where
    D: Qei<Count: Counter>,
    T: Qei<Count: Counter>,
    DD: Drive,
    DT: Drive,
{
    /// Takes encoders and motors over: first the drive's, then the steering's.
    pub fn new(
        drive: D,
        steering: T,
        drive_motor: DD,
        steering_motor: DT,
        config: &Config,
    ) -> Self {
        let mut vehicle = Self {
            drive: Encoder::new(drive),
            steering: Encoder::new(steering),
            drive_motor,
            steering_motor,
            config: *config,
            observers: Observers::new(config.observer_bandwidth),
            duty: [0.0; 2],
        };
        vehicle.configure(config);
        vehicle
    }
}

impl Config {
    /// k and the drift c: ΔS = k_d ΔS', Δα = k_α Δα' + c ΔS, with ΔS' and Δα' by nominal numbers.
    fn twist(&self, [rolled, turned]: [f32; 2]) -> Twist {
        let [drive, _, steering, drift] = self.gains;
        let translation = drive * rolled;
        Twist {
            translation,
            rotation: steering * turned / self.lever + drift * translation,
        }
    }

    /// Speeds of the two circumferences: the inverse of [`Self::twist`].
    fn rims(&self, twist: Twist) -> [f32; 2] {
        let [drive, _, steering, drift] = self.gains;
        [
            twist.translation / drive,
            (twist.rotation - drift * twist.translation) * self.lever / steering,
        ]
    }

    fn fastest(&self, twist: Twist) -> f32 {
        let [drive, steering] = self.rims(twist);
        larger(drive.abs(), steering.abs())
    }
}

impl<D, T, DD, DT> VirtualVehicle for Synchro<D, T, DD, DT>
where
    D: Qei<Count: Counter>,
    T: Qei<Count: Counter>,
    DD: Drive,
    DT: Drive,
{
    type Config = Config;

    fn configure(&mut self, config: &Config) {
        self.config = *config;
        self.drive.set_reversed(config.encoder_reversed[0]);
        self.steering.set_reversed(config.encoder_reversed[1]);
        self.drive_motor.configure(&config.servo[0]);
        self.steering_motor.configure(&config.servo[1]);
        self.observers.configure(config.observer_bandwidth);
    }

    fn set_gains(&mut self, gains: [f32; GAINS]) {
        self.config.gains = gains;
    }

    /// ```text
    ///     ∂ΔS/∂k_d = ΔS/k_d      ∂Δα/∂k_d = c ΔS/k_d      ∂Δα/∂k_α = (Δα − c ΔS)/k_α      ∂Δα/∂c = ΔS
    /// ```
    fn influence(&self) -> Influence {
        let [drive, _, steering, drift] = self.config.gains;
        Influence {
            by_gain: [
                [1.0 / drive, 0.0, drift / drive, 0.0],
                [0.0; 4],
                [0.0, 0.0, -drift / steering, 1.0 / steering],
                [0.0, 0.0, 1.0, 0.0],
            ],
        }
    }

    fn resolution(&self) -> Twist {
        let [drive, _, steering, _] = self.config.gains;
        Twist {
            translation: drive * self.config.metres_per_count,
            rotation: steering * self.config.radians_per_count,
        }
    }

    fn sense(&mut self, dt: f32) -> Motion {
        let counts = [self.drive.read(), self.steering.read()];
        let rolled = [
            counts[0] as f32 * self.config.metres_per_count,
            counts[1] as f32 * self.config.radians_per_count * self.config.lever,
        ];
        self.observers.update(rolled, dt);
        Motion {
            increment: self.config.twist(rolled),
            speed: self.config.twist(self.observers.speeds()),
            acceleration: self.config.twist(self.observers.accelerations()),
            rolled,
        }
    }

    fn share(&self, wanted: Twist, supply: f32) -> f32 {
        let config = &self.config;
        let fastest = config.fastest(wanted);
        servo::share(fastest, config.max_wheel_speed, &config.servo, supply)
    }

    fn holds_load(&self) -> bool {
        self.drive_motor.holds_load() || self.steering_motor.holds_load()
    }

    fn knows_duty(&self) -> bool {
        self.drive_motor.knows_duty() && self.steering_motor.knows_duty()
    }

    fn drive(
        &mut self,
        speed: Twist,
        acceleration: Twist,
        supply: f32,
        dt: f32,
    ) -> Result<(), OutputError> {
        let mut speeds = self.config.rims(speed);
        let mut accelerations = self.config.rims(acceleration);
        let fastest = self.config.fastest(speed);
        let limit = self.config.max_wheel_speed;
        if fastest > limit {
            let scale = limit / fastest;
            speeds = speeds.map(|speed| scale * speed);
            accelerations = accelerations.map(|acceleration| scale * acceleration);
        }
        let measured = self.observers.speeds();
        let command = |motor: usize| WheelCommand {
            speed: speeds[motor],
            acceleration: accelerations[motor],
            measured: measured[motor],
        };
        let (drive, steering) = (command(0), command(1));
        self.duty = [
            self.drive_motor.command(drive, supply, dt)?,
            self.steering_motor.command(steering, supply, dt)?,
        ];
        Ok(())
    }

    fn brake(&mut self) -> Result<(), OutputError> {
        self.duty = [0.0; 2];
        let drive = self.drive_motor.brake();
        let steering = self.steering_motor.brake();
        drive.and(steering)
    }

    fn off(&mut self) -> Result<(), OutputError> {
        self.duty = [0.0; 2];
        let drive = self.drive_motor.off();
        let steering = self.steering_motor.off();
        drive.and(steering)
    }

    /// The drive, and the steering at its lever.
    fn wheels(&self) -> [Wheel; 2] {
        let speeds = self.observers.speeds();
        let wheel = |index: usize, count| Wheel {
            count,
            speed: speeds[index],
            duty: self.duty[index],
        };
        [
            wheel(0, self.drive.total()),
            wheel(1, self.steering.total()),
        ]
    }
}
