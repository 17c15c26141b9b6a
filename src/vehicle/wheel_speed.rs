//! A motor controller that takes speeds and closes the loop itself [C §6.2].

use super::{Drive, OutputError, WheelCommand, servo};

/// The way to such a motor controller: a serial line, a bus, an analogue voltage. A board implements it.
///
/// Here for one that takes lines of text, such as `v 0 2.500`, 2.5 turns a second for its motor 0, and that needs to be told when its motor is to have the
/// supply (the ODrive's ASCII protocol):
///
/// ```
/// use core::fmt::{Arguments, Write as _};
/// use embedded_hal_nb::serial::Write;
/// use vehicle_controller::vehicle::{OutputError, SpeedOutput};
///
/// struct Lines<W> {
///     /// A queue with room for two lines, which an interrupt or a DMA channel empties: the control interrupt waits for nothing.
///     port: W,
///     turns_per_metre: f32,
///     on: bool,
/// }
///
/// impl<W: Write<u8>> Lines<W> {
///     fn send(&mut self, line: Arguments) -> Result<(), OutputError> {
///         let mut text = heapless::String::<40>::new();
///         text.write_fmt(line).map_err(|_| OutputError)?;
///         // A queue that is full is one that is not emptied: the motor controller is lost.
///         let sent = text.bytes().try_for_each(|byte| self.port.write(byte));
///         sent.map_err(|_| OutputError)
///     }
/// }
///
/// impl<W: Write<u8>> SpeedOutput for Lines<W> {
///     fn set_speed(&mut self, speed: f32) -> Result<(), OutputError> {
///         if !self.on {
///             self.send(format_args!("w axis0.requested_state 8\n"))?;
///             self.on = true;
///         }
///         // By way of thousandths: to write an f32 as text takes 20 kB of flash.
///         let speed = libm::roundf(speed * self.turns_per_metre * 1000.0) as i32;
///         let (sign, size) = (if speed < 0 { "-" } else { "" }, speed.unsigned_abs());
///         self.send(format_args!("v 0 {sign}{}.{:03}\n", size / 1000, size % 1000))
///     }
///
///     fn off(&mut self) -> Result<(), OutputError> {
///         self.on = false;
///         // A line that a full queue tore ends with the first line feed.
///         self.send(format_args!("\nw axis0.requested_state 1\n"))
///     }
/// }
/// # #[derive(Default)]
/// # struct Port(Vec<u8>);
/// # impl embedded_hal_nb::serial::ErrorType for Port {
/// #     type Error = core::convert::Infallible;
/// # }
/// # impl Write<u8> for Port {
/// #     fn write(&mut self, byte: u8) -> nb::Result<(), Self::Error> {
/// #         self.0.push(byte);
/// #         Ok(())
/// #     }
/// #     fn flush(&mut self) -> nb::Result<(), Self::Error> {
/// #         Ok(())
/// #     }
/// # }
/// #
/// let mut motor = Lines { port: Port::default(), turns_per_metre: 4.0, on: false };
/// motor.set_speed(0.625)?;
/// motor.set_speed(-0.0105)?;
/// motor.off()?;
/// assert_eq!(
///     motor.port.0,
///     b"w axis0.requested_state 8\nv 0 2.500\nv 0 -0.042\n\nw axis0.requested_state 1\n"
/// );
/// # Ok::<(), OutputError>(())
/// ```
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
