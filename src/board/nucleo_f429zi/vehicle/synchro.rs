//! A synchro drive: the left motor and its encoder drive all wheels, the right ones steer them.

use super::Spare;
use crate::board::nucleo_f429zi::wheels::{
    LeftEncoder, LeftMotor, RightEncoder, RightMotor, Wheels,
};
use stm32f4xx_hal::rcc::Rcc;
use vehicle_controller::vehicle::{self, synchro};

/// The vehicle.
pub type Vehicle = vehicle::Synchro<LeftEncoder, RightEncoder, LeftMotor, RightMotor>;
/// What parameters decide about it.
pub type Config = synchro::Config;

/// Whose parameters it has.
pub const KIND: vehicle::Kind = vehicle::Kind::Synchro;
/// Its name.
pub const NAME: [u8; 7] = *b"synchro";
/// What the image runs on.
pub const TARGET: &str = "nucleo-f429zi-synchro";

/// What it is made of.
pub struct Parts(Wheels);

impl Parts {
    /// Nothing but the wheels.
    pub fn start(wheels: Wheels, _: Spare, _: &mut Rcc) -> Self {
        Self(wheels)
    }

    /// Puts it together.
    ///
    /// # Errors
    /// A message if an output refused.
    pub fn assemble(self, config: &Config) -> Result<Vehicle, &'static str> {
        let Self(wheels) = self;
        let [drive, steering] = config.servo;
        Ok(Vehicle::new(
            wheels.left_encoder,
            wheels.right_encoder,
            wheels.left_bridge.servo(drive)?,
            wheels.right_bridge.servo(steering)?,
            config,
        ))
    }
}
