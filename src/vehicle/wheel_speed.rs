//! A motor controller that takes speeds and closes the loop itself [C §6.2].

use super::{Drive, OutputError, WheelCommand, servo};

/// The way to such a motor controller: a serial line, a bus, an analogue voltage. A board implements it.
pub trait SpeedOutput {
    /// The speed of the wheel's circumference until the next call, m/s, in the motor's own direction. It is finite.
    ///
    /// Called every cycle, whether the speed has changed or not: some controllers take silence for a lost master, and stop. What their units round off
    /// is not carried here; where they are coarse, the position loop above adds up what is missing, in jerks, and
    /// [`PositionIncrement`](super::PositionIncrement) is better.
    ///
    /// # Errors
    /// [`OutputError`] if it could not be handed over.
    fn set_speed(&mut self, speed: f32) -> Result<(), OutputError>;

    /// Takes the supply from the motor and brakes without it, as a shorted motor does; one that cannot is switched off. A speed of zero is not to brake:
    /// the motor would be held by a loop that may be what is broken.
    ///
    /// # Errors
    /// [`OutputError`] if it could not be handed over.
    fn brake(&mut self) -> Result<(), OutputError> {
        self.off()
    }

    /// Takes the supply from the motor: the wheel is free. Called every cycle for as long as it is to be so. The next speed switches the motor on again.
    ///
    /// # Errors
    /// [`OutputError`] if it could not be handed over.
    fn off(&mut self) -> Result<(), OutputError>;
}

/// A motor behind a controller of speeds.
///
/// It has nothing to learn and nothing to regulate: of the servo's parameters only `reversed` matters, and neither the measured speed nor the supply
/// does. What share of the supply the motor gets is not known, so the duty is said to be 0, and the control loop's supervisor has no motor model then.
/// How the axes follow, the speeds and the counts are watched all the same.
#[derive(Debug)]
pub struct WheelSpeed<O> {
    output: O,
    reversed: bool,
}

impl<O: SpeedOutput> WheelSpeed<O> {
    /// Takes the output over and switches the motor off.
    ///
    /// # Errors
    /// [`OutputError`] if the output refused.
    pub fn new(output: O, config: &servo::Config) -> Result<Self, OutputError> {
        let mut drive = Self {
            output,
            reversed: config.reversed,
        };
        drive.off()?;
        Ok(drive)
    }
}

impl<O: SpeedOutput> Drive for WheelSpeed<O> {
    fn configure(&mut self, config: &servo::Config) {
        self.reversed = config.reversed;
    }

    fn knows_duty(&self) -> bool {
        false
    }

    /// # Errors
    /// [`OutputError`] if the output refused; also for a speed that is not finite, which is not handed over.
    fn command(&mut self, command: WheelCommand, _: f32, _: f32) -> Result<f32, OutputError> {
        if !command.speed.is_finite() {
            return Err(OutputError);
        }
        self.output.set_speed(if self.reversed {
            -command.speed
        } else {
            command.speed
        })?;
        Ok(0.0)
    }

    /// It may, and only letting go would tell. So a base that holds is never let go: its motors are commanded for as long as they are on.
    fn holds_load(&self) -> bool {
        true
    }

    fn brake(&mut self) -> Result<(), OutputError> {
        self.output.brake()
    }

    fn off(&mut self) -> Result<(), OutputError> {
        self.output.off()
    }
}
