//! A tricycle: the left motor and its encoder are the front wheel's, a servo steers it. The right encoder is the steering's, if it has one.

use super::Spare;
use super::steering::{self, Steering};
use crate::board::nucleo_f429zi::wheels::{LeftEncoder, LeftMotor, RightEncoder, Wheels};
use stm32f4xx_hal::rcc::Rcc;
use vehicle_controller::vehicle::{self, tricycle};

/// The vehicle.
pub type Vehicle = vehicle::Tricycle<LeftEncoder, LeftMotor, Steering<RightEncoder>>;
/// What parameters decide about it.
pub type Config = tricycle::Config;

/// Whose parameters it has.
pub const KIND: vehicle::Kind = vehicle::Kind::Tricycle;
/// Its name.
pub const NAME: [u8; 8] = *b"tricycle";
/// What the image runs on.
pub const TARGET: &str = "nucleo-f429zi-tricycle";

/// What it is made of.
pub struct Parts {
    wheels: Wheels,
    steering: steering::Parts,
}

impl Parts {
    /// Starts the steering. A right motor's driver stays disabled.
    pub fn start(wheels: Wheels, spare: Spare, rcc: &mut Rcc) -> Self {
        Self {
            wheels,
            steering: steering::Parts::start(spare.tim8, spare.pc8, spare.pc2, rcc),
        }
    }

    /// Puts it together.
    ///
    /// # Errors
    /// A message if an output refused.
    pub fn assemble(self, config: &Config) -> Result<Vehicle, &'static str> {
        let Self { wheels, steering } = self;
        Ok(Vehicle::new(
            wheels.left_encoder,
            wheels.left_bridge.servo(config.servo)?,
            steering.assemble(wheels.right_encoder, &config.steering)?,
            config,
        ))
    }
}
