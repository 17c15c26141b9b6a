//! The motors: through whatever the library drives them with.

use super::{ControllerLine, FakePin, FakePwm, Wires};
use std::rc::Rc;
use vehicle_controller::vehicle::{
    Drive, OutputError, PositionIncrement, Servo, WheelCommand, WheelSpeed, servo,
};

/// A motor: behind a bridge, behind a controller of its own, or one that turns exactly as it is told.
#[derive(Debug)]
pub enum FakeDrive {
    /// PWM, direction and enable, through the library's servo.
    Bridge(Servo<FakePwm, FakePin, FakePin>),
    /// A motor controller that takes speeds.
    Speed(WheelSpeed<ControllerLine>),
    /// A motor controller that takes position increments.
    Increment(PositionIncrement<ControllerLine>, Rc<Wires>),
    /// Speeds are obeyed.
    Ideal(Rc<Wires>),
}

impl FakeDrive {
    /// A motor behind a bridge.
    ///
    /// # Errors
    /// None: the fakes never refuse.
    pub fn bridge(wires: Rc<Wires>, config: servo::Config) -> Result<Self, OutputError> {
        let pwm = FakePwm(Rc::clone(&wires));
        let direction = FakePin {
            wires: Rc::clone(&wires),
            level: |wires| &wires.forward,
        };
        let enable = FakePin {
            wires,
            level: |wires| &wires.enabled,
        };
        Ok(Self::Bridge(Servo::new(pwm, direction, enable, config)?))
    }

    /// A motor behind a controller of speeds, of which so many of its units make a metre.
    ///
    /// # Errors
    /// None: the fakes never refuse.
    pub fn speed(wires: Rc<Wires>, units: f64, config: servo::Config) -> Result<Self, OutputError> {
        let line = ControllerLine::new(wires, units);
        Ok(Self::Speed(WheelSpeed::new(line, &config)?))
    }

    /// A motor behind a controller of positions, of which so many of its units make a metre.
    ///
    /// # Errors
    /// None: the fakes never refuse.
    pub fn increment(
        wires: Rc<Wires>,
        units: f64,
        config: servo::Config,
    ) -> Result<Self, OutputError> {
        let line = ControllerLine::new(Rc::clone(&wires), units);
        let drive = PositionIncrement::new(line, units, &config)?;
        Ok(Self::Increment(drive, wires))
    }
}

/// What any of them does, but the ideal one.
macro_rules! any {
    ($self:ident, $drive:ident => $what:expr, $wires:ident => $ideal:expr) => {
        match $self {
            FakeDrive::Bridge($drive) => $what,
            FakeDrive::Speed($drive) => $what,
            FakeDrive::Increment($drive, _) => $what,
            FakeDrive::Ideal($wires) => $ideal,
        }
    };
}

impl Drive for FakeDrive {
    fn configure(&mut self, config: &servo::Config) {
        any!(self, drive => drive.configure(config), _wires => ());
    }

    /// An ideal motor does what it is told, whatever duty that takes.
    fn knows_duty(&self) -> bool {
        any!(self, drive => drive.knows_duty(), _wires => true)
    }

    fn command(&mut self, command: WheelCommand, supply: f32, dt: f32) -> Result<f32, OutputError> {
        if let Self::Increment(_, wires) = self {
            let step = f64::from(command.speed) * f64::from(dt);
            wires.asked.set(wires.asked.get() + step);
        }
        any!(self, drive => drive.command(command, supply, dt), wires => {
            wires.speed.set(command.speed);
            Ok(0.0)
        })
    }

    fn holds_load(&self) -> bool {
        any!(self, drive => drive.holds_load(), _wires => false)
    }

    fn brake(&mut self) -> Result<(), OutputError> {
        self.forget();
        any!(self, drive => drive.brake(), wires => {
            wires.speed.set(0.0);
            Ok(())
        })
    }

    fn off(&mut self) -> Result<(), OutputError> {
        self.forget();
        any!(self, drive => drive.off(), wires => {
            wires.speed.set(0.0);
            Ok(())
        })
    }
}

impl FakeDrive {
    fn forget(&self) {
        if let Self::Increment(_, wires) = self {
            wires.asked.set(0.0);
        }
    }
}
