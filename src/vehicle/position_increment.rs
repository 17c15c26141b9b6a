//! A motor controller that takes positions, as the paper's own vehicle had: each cycle's increment, in its units [C §6.2].
//!
//! (The paper divides the wheel's speed by the cycle time. It means the product.)

use super::{Drive, OutputError, WheelCommand, servo};
use crate::math::{Factor, Sum};

/// The way to such a motor controller: a serial line, a bus, pulses for a stepper. A board implements it.
///
/// Here for one that takes a pulse for each unit, with a direction and an enable input, as drivers of steppers and many servo drives do:
///
/// ```
/// use embedded_hal::delay::DelayNs;
/// use embedded_hal::digital::OutputPin;
/// use vehicle_controller::vehicle::{IncrementOutput, OutputError};
///
/// struct Pulses<S, D, E, W> {
///     step: S,
///     direction: D,
///     enable: E,
///     delay: W,
/// }
///
/// /// In a cycle: of 5 µs each, they take a tenth of a millisecond. Where there are more, a timer makes them.
/// const MOST: u32 = 20;
///
/// impl<S: OutputPin, D: OutputPin, E: OutputPin, W: DelayNs> IncrementOutput for Pulses<S, D, E, W> {
///     fn advance(&mut self, units: i32) -> Result<(), OutputError> {
///         // All of them or none: what is handed over in part would be lost.
///         if units.unsigned_abs() > MOST {
///             return Err(OutputError);
///         }
///         self.enable.set_high().map_err(|_| OutputError)?;
///         self.direction.set_state((units >= 0).into()).map_err(|_| OutputError)?;
///         for _ in 0..units.unsigned_abs() {
///             self.step.set_high().map_err(|_| OutputError)?;
///             self.delay.delay_ns(2_500);
///             self.step.set_low().map_err(|_| OutputError)?;
///             self.delay.delay_ns(2_500);
///         }
///         Ok(())
///     }
///
///     /// A driver that is not enabled counts no pulses: the next ones begin where the motor is.
///     fn off(&mut self) -> Result<(), OutputError> {
///         self.enable.set_low().map_err(|_| OutputError)
///     }
/// }
/// # use embedded_hal::digital::ErrorType;
/// # #[derive(Default)]
/// # struct Pin(u32, bool);
/// # impl ErrorType for Pin {
/// #     type Error = core::convert::Infallible;
/// # }
/// # impl OutputPin for Pin {
/// #     fn set_low(&mut self) -> Result<(), Self::Error> {
/// #         self.1 = false;
/// #         Ok(())
/// #     }
/// #     fn set_high(&mut self) -> Result<(), Self::Error> {
/// #         self.0 += u32::from(!self.1);
/// #         self.1 = true;
/// #         Ok(())
/// #     }
/// # }
/// # #[derive(Default)]
/// # struct NoDelay;
/// # impl DelayNs for NoDelay {
/// #     fn delay_ns(&mut self, _: u32) {}
/// # }
/// # fn pulses() -> Pulses<Pin, Pin, Pin, NoDelay> {
/// #     Pulses { step: Pin::default(), direction: Pin::default(), enable: Pin::default(), delay: NoDelay }
/// # }
/// #
/// let mut motor = pulses();
/// motor.advance(3)?;
/// motor.advance(-2)?;
/// assert_eq!(motor.advance(21), Err(OutputError));
/// # assert_eq!((motor.step.0, motor.direction.1, motor.enable.1), (5, false, true));
/// # motor.off()?;
/// # assert!(!motor.enable.1);
/// # Ok::<(), OutputError>(())
/// ```
///
/// A controller that takes positions, not increments, is sent their sum, which begins at the position that the controller tells after it was off.
pub trait IncrementOutput {
    /// Moves the motor's target by so many of its units, in the motor's own direction. An error says that the target was not moved.
    ///
    /// Called every cycle, with 0 too: some controllers take silence for a lost master, and stop.
    ///
    /// # Errors
    /// [`OutputError`] if it could not be handed over.
    fn advance(&mut self, units: i32) -> Result<(), OutputError>;

    /// Takes the supply from the motor and brakes without it, as a shorted motor does; one that cannot is switched off. To hold the target is not to
    /// brake: the motor would be held by a loop that may be what is broken.
    ///
    /// # Errors
    /// [`OutputError`] if it could not be handed over.
    fn brake(&mut self) -> Result<(), OutputError> {
        self.off()
    }

    /// Takes the supply from the motor: the wheel is free. Called every cycle for as long as it is to be so. The next increment switches the motor on
    /// again, and counts from where it is then: were the old target kept, a wheel that was turned by hand would leap back.
    ///
    /// # Errors
    /// [`OutputError`] if it could not be handed over.
    fn off(&mut self) -> Result<(), OutputError>;
}

/// Increments of this many units are refused: no i32 holds them.
const TOO_MANY: f32 = 2_147_483_648.0;

/// A motor behind a controller of positions.
///
/// ```text
///     n = trunc(r + u v dt)      r := r + u v dt − n
/// ```
///
/// with u units per metre and r, the fraction that is carried to the next cycle. So what was sent differs from the integral of the commanded speed by r,
/// less than one unit, for as long as the motor is on. r is cut off (at 24 bits) rather than rounded: a speed that flickers about zero has to add up to
/// a whole unit before one is taken back, so nothing chatters. r and the products have 46 bits and more: it takes 10¹³ units, or ten thousand years of
/// ticks of a millisecond, until what that rounds off is a unit.
///
/// [`brake`](Drive::brake) and [`off`](Drive::off) forget r: the wheel may go anywhere then, and what was owed to where it should have been is owed no
/// more. The first unit after them is sent when a whole one has been asked for. [`configure`](Drive::configure) keeps it.
///
/// Of the servo's parameters only `reversed` matters, and neither the measured speed nor the supply does. What share of the supply the motor gets is
/// not known, so the duty is said to be 0, and the control loop's supervisor has no motor model then. How the axes follow, the speeds and the counts are
/// watched all the same.
#[derive(Debug)]
pub struct PositionIncrement<O> {
    output: O,
    /// u, 1/m.
    units_per_metre: Sum,
    reversed: bool,
    /// r, positive forward.
    fraction: Sum,
}

impl<O: IncrementOutput> PositionIncrement<O> {
    /// Takes the output over and switches the motor off. `units_per_metre` is what the motor controller counts while the wheel's circumference
    /// rolls a metre, above 0.
    ///
    /// # Errors
    /// [`OutputError`] if the output refused.
    pub fn new(
        output: O,
        units_per_metre: f64,
        config: &servo::Config,
    ) -> Result<Self, OutputError> {
        let mut drive = Self {
            output,
            units_per_metre: Sum::from_f64(units_per_metre),
            reversed: config.reversed,
            fraction: Sum::default(),
        };
        drive.off()?;
        Ok(drive)
    }
}

/// The whole part of a number below [`TOO_MANY`], and the rest, which is smaller than 1.
fn split(number: Sum) -> (i32, Sum) {
    let mut rest = number;
    // The leading 24 bits first: they hold whatever is above 64, or all but the fraction.
    let leading = rest.get() as i32;
    rest.add(-(leading as f32));
    let trailing = rest.get() as i32;
    rest.add(-(trailing as f32));
    (leading.saturating_add(trailing), rest)
}

impl<O: IncrementOutput> Drive for PositionIncrement<O> {
    fn configure(&mut self, config: &servo::Config) {
        self.reversed = config.reversed;
    }

    fn knows_duty(&self) -> bool {
        false
    }

    /// # Errors
    /// [`OutputError`] if the output refused; also for a speed or a time that is not finite, a negative time, and more units than an i32 holds, of
    /// which nothing is handed over. What was refused is not asked for again with the next command.
    fn command(&mut self, command: WheelCommand, _: f32, dt: f32) -> Result<f32, OutputError> {
        let asked = self
            .units_per_metre
            .times(Factor::new(command.speed))
            .times(Factor::new(dt));
        let owed = self.fraction.plus(asked);
        // Both comparisons are false for NaN, which infinities have become in the products.
        if !(dt >= 0.0 && owed.get().abs() < TOO_MANY) {
            return Err(OutputError);
        }
        let (units, rest) = split(owed);
        self.output.advance(if self.reversed {
            units.saturating_neg()
        } else {
            units
        })?;
        self.fraction = rest;
        Ok(0.0)
    }

    /// It may, and only letting go would tell. So a base that holds is never let go: its motors are commanded for as long as they are on.
    fn holds_load(&self) -> bool {
        true
    }

    fn brake(&mut self) -> Result<(), OutputError> {
        self.fraction = Sum::default();
        self.output.brake()
    }

    fn off(&mut self) -> Result<(), OutputError> {
        self.fraction = Sum::default();
        self.output.off()
    }
}
