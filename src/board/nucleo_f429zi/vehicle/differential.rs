//! A differential drive.

use super::Spare;
use crate::board::nucleo_f429zi::wheels::{
    LeftEncoder, LeftMotor, RightEncoder, RightMotor, Wheels,
};
use stm32f4xx_hal::rcc::Rcc;
use vehicle_controller::vehicle::{self, DifferentialDrive, differential};

/// The vehicle.
pub type Vehicle = DifferentialDrive<LeftEncoder, RightEncoder, LeftMotor, RightMotor>;
/// What parameters decide about it.
pub type Config = differential::Config;

/// Whose parameters it has.
pub const KIND: vehicle::Kind = vehicle::Kind::Differential;
/// Its name.
pub const NAME: [u8; 12] = *b"differential";
/// What the image runs on.
pub const TARGET: &str = "nucleo-f429zi";

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
        let [left, right] = config.servo;
        Ok(DifferentialDrive::new(
            wheels.left_encoder,
            wheels.right_encoder,
            wheels.left_bridge.servo(left)?,
            wheels.right_bridge.servo(right)?,
            config,
        ))
    }
}
