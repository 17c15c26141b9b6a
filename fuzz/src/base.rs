//! A base to fuzz: the real controller, desk and interpreter, on motors that do what those of the default robot do.

use std::cell::Cell;
use std::convert::Infallible;

use embedded_hal::digital::OutputPin;
use embedded_hal::pwm::SetDutyCycle;
use embedded_hal_02::{Direction, Qei};
use vehicle_controller::controller::{Action, Config, Controller, Inputs, Interface, Snapshot};
use vehicle_controller::interpreter::{Desk, Identity, Interpreter};
use vehicle_controller::map::Atlas;
use vehicle_controller::params::Params;
use vehicle_controller::time::{self, Duration, Instant};
use vehicle_controller::vehicle::{Counter, DifferentialDrive, Servo, differential};

/// The control loop's period.
pub const PERIOD: Duration = Duration::millis(1);
/// The timer's top.
const FULL: u16 = 8400;
/// Encoder counts per metre, with the default wheels.
const COUNTS_PER_METRE: f32 = 10_598.0;
/// The battery, V.
const SUPPLY: f32 = 12.0;
/// The default motor: V, V/(m/s) and V/(m/s²).
const FRICTION: f32 = 0.42;
const SPEED_GAIN: f32 = 13.3;
const ACCELERATION_GAIN: f32 = 0.5;

/// One motor with its encoder.
#[derive(Debug, Default)]
pub struct Wheel {
    duty: Cell<u16>,
    forward: Cell<bool>,
    powered: Cell<bool>,
    /// m/s.
    speed: Cell<f32>,
    /// Encoder counts and the part of one that does not show yet.
    rolled: Cell<u32>,
    part: Cell<f32>,
    /// The outputs refuse to be written.
    pub broken: Cell<bool>,
}

impl Wheel {
    /// A millisecond passes.
    pub fn roll(&self) {
        let before = self.speed.get();
        if self.duty.get() == 0 && before == 0.0 {
            return;
        }
        let sign = if self.forward.get() { 1.0 } else { -1.0 };
        let u = sign * SUPPLY * f32::from(self.duty.get()) / f32::from(FULL);
        // K_a Δv = (u − K_v v) Δt, and friction takes away what it can.
        let free = before + (u - SPEED_GAIN * before) / ACCELERATION_GAIN * 1e-3;
        let friction = FRICTION / ACCELERATION_GAIN * 1e-3;
        let speed = free - free.clamp(-friction, friction);
        self.speed.set(speed);
        let rolled = self.part.get() + speed * COUNTS_PER_METRE * 1e-3;
        self.part.set(rolled.fract());
        self.jump(rolled.trunc() as i32);
    }

    /// The encoder counts, whatever the motor does.
    pub fn jump(&self, counts: i32) {
        self.rolled
            .set(self.rolled.get().wrapping_add_signed(counts));
    }

    /// True if the motor has no voltage.
    pub fn is_off(&self) -> bool {
        self.duty.get() == 0
    }
}

/// The counter of a wheel's encoder: the low 16 bits or all 32 of it.
#[derive(Debug)]
pub struct Encoder<'a, C> {
    wheel: &'a Wheel,
    width: fn(u32) -> C,
}

impl<C> Qei for Encoder<'_, C> {
    type Count = C;

    fn count(&self) -> C {
        (self.width)(self.wheel.rolled.get())
    }

    fn direction(&self) -> Direction {
        Direction::Upcounting
    }
}

/// An output of a wheel's driver.
#[derive(Debug)]
pub enum Pin<'a> {
    /// High is forward.
    Direction(&'a Wheel),
    /// High is on.
    Power(&'a Wheel),
}

/// An output refused.
#[derive(Debug)]
pub struct Broken;

impl embedded_hal::digital::Error for Broken {
    fn kind(&self) -> embedded_hal::digital::ErrorKind {
        embedded_hal::digital::ErrorKind::Other
    }
}

impl embedded_hal::digital::ErrorType for Pin<'_> {
    type Error = Broken;
}

impl Pin<'_> {
    fn set(&self, high: bool) -> Result<(), Broken> {
        let (wheel, line) = match self {
            Self::Direction(wheel) => (wheel, &wheel.forward),
            Self::Power(wheel) => (wheel, &wheel.powered),
        };
        if wheel.broken.get() {
            return Err(Broken);
        }
        line.set(high);
        Ok(())
    }
}

impl OutputPin for Pin<'_> {
    fn set_low(&mut self) -> Result<(), Broken> {
        self.set(false)
    }

    fn set_high(&mut self) -> Result<(), Broken> {
        self.set(true)
    }
}

/// A wheel's PWM channel. It never refuses: what is broken is the driver's pins.
#[derive(Debug)]
pub struct Pwm<'a>(&'a Wheel);

impl embedded_hal::pwm::ErrorType for Pwm<'_> {
    type Error = Infallible;
}

impl SetDutyCycle for Pwm<'_> {
    fn max_duty_cycle(&self) -> u16 {
        FULL
    }

    fn set_duty_cycle(&mut self, duty: u16) -> Result<(), Infallible> {
        assert!(duty <= FULL, "duty {duty} of {FULL}");
        self.0.duty.set(duty);
        Ok(())
    }
}

type Motor<'a> = Servo<Pwm<'a>, Pin<'a>, Pin<'a>>;
/// The vehicle on two wheels, with counters of either width.
pub type Vehicle<'a, C> = DifferentialDrive<Encoder<'a, C>, Encoder<'a, C>, Motor<'a>, Motor<'a>>;

/// A vehicle on these wheels.
///
/// # Panics
/// If an output is broken already.
pub fn vehicle<'a, C: Counter>(
    wheels: &'a [Wheel; 2],
    width: fn(u32) -> C,
    config: &differential::Config,
) -> Vehicle<'a, C> {
    let motor = |wheel, config| {
        let servo = Servo::new(Pwm(wheel), Pin::Direction(wheel), Pin::Power(wheel), config);
        servo.expect("nothing is broken yet")
    };
    let [left, right] = wheels;
    DifferentialDrive::new(
        Encoder { wheel: left, width },
        Encoder {
            wheel: right,
            width,
        },
        motor(left, config.servo[0]),
        motor(right, config.servo[1]),
        config,
    )
}

/// What is the same in each execution.
#[derive(Debug)]
pub struct Defaults {
    /// The parameters of a new base.
    pub params: Params,
    config: Config<differential::Config>,
}

/// Built once: it takes longer than many an execution.
pub fn defaults() -> &'static Defaults {
    static DEFAULTS: std::sync::LazyLock<Defaults> = std::sync::LazyLock::new(|| {
        let params = Params::default();
        Defaults {
            params,
            config: params.build(PERIOD),
        }
    });
    &DEFAULTS
}

/// What the interpreter handed to the controller.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Asked {
    /// Something is to be done.
    pub acts: bool,
    /// Nothing is, but somebody is there.
    pub lives: bool,
}

/// A base as the firmware has it, without its queues.
#[derive(Debug)]
pub struct Base<'a> {
    wheels: &'a [Wheel; 2],
    controller: Controller<Vehicle<'a, u16>>,
    /// The desk.
    pub desk: Desk,
    /// The interpreter.
    pub interpreter: Interpreter,
    atlas: Atlas,
    now: Instant,
    /// What the board measures.
    pub inputs: Inputs,
}

impl<'a> Base<'a> {
    /// A base that has just started, and has had its first tick.
    pub fn new(wheels: &'a [Wheel; 2]) -> Self {
        let Defaults { params, config } = defaults();
        let vehicle = vehicle(wheels, |count| count as u16, &config.vehicle);
        let mut controller = Controller::new(vehicle, *config, None);
        let now = Instant::from_ticks(0);
        let inputs = Inputs {
            battery: Some(12.0 / 11.0),
            ..Inputs::default()
        };
        controller.tick(now, &inputs);
        let identity = Identity {
            target: "fuzz",
            reset_cause: "power-on",
            period: PERIOD,
        };
        Self {
            wheels,
            desk: Interface::new(controller.snapshot(), params.limits()),
            controller,
            interpreter: Interpreter::new(identity, *params),
            atlas: Atlas::new(),
            now,
            inputs,
        }
    }

    /// What was known after the last tick.
    pub fn snapshot(&self) -> &Snapshot {
        self.desk.snapshot()
    }

    /// The interpreter does what it can, and its requests go to the controller.
    ///
    /// # Panics
    /// If there are more requests than the controller takes.
    pub fn poll(&mut self) -> Asked {
        self.interpreter.poll(&mut self.desk, &mut self.atlas);
        let mut asked = Asked::default();
        while let Some(request) = self.desk.take_request() {
            match request.action() {
                Action::Live => asked.lives = true,
                _ => asked.acts = true,
            }
            assert!(self.controller.request(request).is_ok(), "no room");
        }
        asked
    }

    /// A tick, `late` after it was due.
    pub fn tick(&mut self, late: Duration) {
        for wheel in self.wheels {
            wheel.roll();
        }
        self.now = time::after(time::after(self.now, PERIOD), late);
        for event in self.controller.tick(self.now, &self.inputs) {
            self.interpreter.notify(*event);
        }
        self.desk.update(self.controller.snapshot());
        while self.desk.work() {}
    }

    /// True if neither motor has a voltage.
    pub fn is_off(&self) -> bool {
        self.wheels.iter().all(Wheel::is_off)
    }
}
