//! Bottom layer: the virtual vehicle, and the geometries that implement it [C §6].
//!
//! The controller above knows a vehicle that translates and rotates, and nothing of wheels. A geometry turns encoder counts into (ΔS, Δα) and a
//! commanded (v_s, v_α) into wheel speeds; a [`Drive`] turns a wheel's speed into whatever its motor wants.

mod axle;
#[cfg(feature = "vehicles")]
pub mod bisteerable;
pub mod differential;
mod encoder;
pub mod gains;
mod jacobian;
mod observer;
mod position_increment;
pub mod servo;
pub mod steering;
#[cfg(feature = "vehicles")]
pub mod synchro;
#[cfg(feature = "vehicles")]
pub mod tricycle;
mod wheel_speed;

pub use axle::{Axle, Relation, STEEPEST, Scaling};
#[cfg(feature = "vehicles")]
pub use bisteerable::BiSteerable;
pub use differential::DifferentialDrive;
pub use encoder::{Counter, Encoder};
pub use gains::{Calibration, GAINS, Influence, Spread};
pub use jacobian::Jacobian;
pub use observer::{Gains, Observer};
pub use position_increment::{IncrementOutput, PositionIncrement};
pub use servo::{NoPin, Servo};
pub use steering::{ServoSteering, Steering, Voltmeter};
#[cfg(feature = "vehicles")]
pub use synchro::Synchro;
#[cfg(feature = "vehicles")]
pub use tricycle::Tricycle;
pub use wheel_speed::{SpeedOutput, WheelSpeed};

/// A translation and a rotation of the virtual vehicle: an increment, a speed, an acceleration, or a resolution.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Twist {
    /// Along the path: m, m/s or m/s². Positive forward.
    pub translation: f32,
    /// About the vertical: rad, rad/s or rad/s². Positive counter-clockwise.
    pub rotation: f32,
}

impl Twist {
    /// Neither translation nor rotation.
    pub const ZERO: Self = Self {
        translation: 0.0,
        rotation: 0.0,
    };

    /// Itself, or no motion if a part of it is not a finite number.
    pub(crate) fn or_none(self) -> Self {
        if self.translation.is_finite() && self.rotation.is_finite() {
            self
        } else {
            Self::ZERO
        }
    }
}

/// What the vehicle did since it was last asked.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Motion {
    /// ΔS (m) and Δα (rad). Over any number of calls these sum up to the encoders' totals: rounding is carried, not lost.
    pub increment: Twist,
    /// v_s (m/s) and v_α (rad/s), from the tracking observers.
    pub speed: Twist,
    /// S'' (m/s²) and α'' (rad/s²), from the tracking observers.
    pub acceleration: Twist,
    /// How far the wheels' circumferences rolled, left first, m.
    pub rolled: [f32; 2],
}

/// One wheel, as reports show it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Wheel {
    /// Encoder counts since start-up, positive forward.
    pub count: i64,
    /// Speed of the circumference, m/s.
    pub speed: f32,
    /// Motor output as a fraction of the supply, −1 to 1; 0 where only a motor controller knows it.
    pub duty: f32,
}

/// An output refused to be written: a pin or a PWM channel returned an error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct OutputError;

impl core::fmt::Display for OutputError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("a motor output could not be written")
    }
}
impl core::error::Error for OutputError {}

/// The geometries that there are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Kind {
    /// Two driven wheels on one axis.
    #[default]
    Differential,
    /// Wheels that are all driven and all steered together.
    Synchro,
    /// One wheel in front that is driven and steered.
    Tricycle,
    /// A car, whose rear axle may be steered along with the front one.
    BiSteerable,
}

/// A vehicle of any geometry, seen as one that translates and rotates.
pub trait VirtualVehicle {
    /// Everything that parameters decide, in SI units and ready to use.
    type Config: Clone;

    /// Takes a new configuration over; what the servos have learned stays. Geometry changes at rest only: the caller sees to it.
    fn configure(&mut self, config: &Self::Config);

    /// What one encoder count amounts to: the half-width of the play through which total variations are taken (theory section 3).
    fn resolution(&self) -> Twist;

    /// Takes other gains over, while it moves or not. A vehicle whose gains are known has none.
    fn set_gains(&mut self, gains: [f32; GAINS]) {
        let _ = gains;
    }

    /// What a change of the gains would do to its motions.
    fn influence(&self) -> Influence {
        Influence::default()
    }

    /// True if its wheels are steered: what its gains do to a motion depends on where they point, it may have to point them before it moves, and it holds its
    /// heading only while it moves.
    fn steers(&self) -> bool {
        false
    }

    /// The largest curvature v_α/v_s of its path, 1/m; infinite if it rotates without translating.
    fn max_curvature(&self) -> f32 {
        f32::INFINITY
    }

    /// The distance over which a vehicle that steers takes a heading error out, at least, m.
    fn heading_distance(&self) -> f32 {
        0.0
    }

    /// Points the wheels for what is to come, if the vehicle is all but at rest. `present` is the speed of the references; of `next` only the proportion of
    /// its parts counts. True if the references may go on, false if they have to wait for the steering.
    fn prepare(&mut self, present: Twist, next: Twist) -> bool {
        let _ = (present, next);
        true
    }

    /// True if the steering does not go where it is told to.
    fn is_astray(&self) -> bool {
        false
    }

    /// The steering angle as measured, rad; positive to the left. 0 for a vehicle that does not steer.
    fn steering(&self) -> f32 {
        0.0
    }

    /// Reads the encoders. `dt` is the time since the last call in seconds; zero is allowed.
    fn sense(&mut self, dt: f32) -> Motion;

    /// How much of a wanted speed the wheels can give, above 0 and up to 1, with some room left to correct: both axes are scaled by it, which keeps
    /// the curvature v_α / v_s. `supply` is the battery voltage. A vehicle without limits gives all.
    fn share(&self, wanted: Twist, supply: f32) -> f32 {
        let _ = (wanted, supply);
        1.0
    }

    /// True if the motors hold a load that friction alone would not hold. A vehicle that cannot tell says no.
    fn holds_load(&self) -> bool {
        false
    }

    /// True if [`Wheel::duty`] is what its motors get. False if only controllers of their own know: the supervisor then has no motor model, and at rest those
    /// controllers hold the base. It never changes.
    fn knows_duty(&self) -> bool {
        true
    }

    /// Drives with the given speed (m/s, rad/s) and acceleration (m/s², rad/s²); a wheel that would exceed its limit scales both axes alike.
    ///
    /// `supply` is the battery voltage, `dt` the time until the next call in seconds; 0 in a tick that is not due yet, whose time has been driven for already.
    ///
    /// # Errors
    /// [`OutputError`] if an output refused; the caller switches off.
    fn drive(
        &mut self,
        speed: Twist,
        acceleration: Twist,
        supply: f32,
        dt: f32,
    ) -> Result<(), OutputError>;

    /// Takes the supply from every motor but lets the bridges short them, which brakes; forgets what the servos have learned. A vehicle that cannot
    /// brake switches off.
    ///
    /// # Errors
    /// [`OutputError`] if an output refused; the others brake all the same.
    fn brake(&mut self) -> Result<(), OutputError> {
        self.off()
    }

    /// Switches every motor and its driver off: the wheels are free. Forgets what the servos have learned.
    ///
    /// # Errors
    /// [`OutputError`] if an output refused; the others are off all the same.
    fn off(&mut self) -> Result<(), OutputError>;

    /// The wheels, left first.
    fn wheels(&self) -> [Wheel; 2];
}

/// What a wheel is asked to do in the coming cycle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct WheelCommand {
    /// Speed of the circumference, m/s.
    pub speed: f32,
    /// Its derivative, m/s².
    pub acceleration: f32,
    /// The speed that was measured, m/s.
    pub measured: f32,
}

/// One wheel's motor: a PWM bridge behind a [`Servo`], or a motor controller that takes speeds ([`WheelSpeed`]) or positions ([`PositionIncrement`]).
pub trait Drive {
    /// Takes new servo parameters over; what it has learned stays.
    fn configure(&mut self, config: &servo::Config);

    /// True if [`command`](Self::command) returns the duty that the motor gets; false if only a controller of its own knows. It never changes.
    fn knows_duty(&self) -> bool;

    /// Acts on a command until the next one; `supply` in volts, `dt` in seconds, zero is allowed. Returns the duty, −1 to 1; 0 if it is not known.
    ///
    /// # Errors
    /// [`OutputError`] if the output refused.
    fn command(&mut self, command: WheelCommand, supply: f32, dt: f32) -> Result<f32, OutputError>;

    /// True if the motor holds a load that friction alone would not hold. A drive that cannot tell says no.
    fn holds_load(&self) -> bool {
        false
    }

    /// Takes the supply from the motor; a bridge shorts it, which brakes. A drive that cannot brake switches off.
    ///
    /// # Errors
    /// [`OutputError`] if the output refused.
    fn brake(&mut self) -> Result<(), OutputError> {
        self.off()
    }

    /// Switches the motor and its driver off.
    ///
    /// # Errors
    /// [`OutputError`] if the output refused.
    fn off(&mut self) -> Result<(), OutputError>;
}
