//! Which robot an image is for, and what of that robot is soldered to where.

use crate::plant::Chassis;
use anyhow::{Result, bail};

/// What an image that does not say so is for.
const UNNAMED: &str = "differential";

/// What is on the board besides two motors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Wiring {
    /// The place of the steering's encoder among the board's, if the robot is steered by a servo.
    pub steering_encoder: Option<usize>,
}

impl Wiring {
    /// A robot's, with the image of the firmware for this vehicle in its flash.
    ///
    /// # Errors
    /// If the image is for another vehicle.
    pub(super) fn new(chassis: &Chassis, image: Option<&str>) -> Result<Self> {
        // A tricycle has one motor: the other one's encoder is free.
        let (vehicle, steering_encoder) = match chassis {
            Chassis::Differential => ("differential", None),
            Chassis::Synchro(_) => ("synchro", None),
            Chassis::Tricycle(_) => ("tricycle", Some(1)),
            Chassis::Bisteerable(_) => ("bisteerable", Some(2)),
        };
        let image = image.unwrap_or(UNNAMED);
        if image != vehicle {
            bail!(
                "the image is for the vehicle `{image}`, and this robot is a `{vehicle}`: build its image with `cargo firmware --vehicle {vehicle}`"
            );
        }
        Ok(Self { steering_encoder })
    }
}
