//! A base whose motors have controllers of their own, which do at once and exactly what they are told; the real vehicle and control loop above them.
#![allow(dead_code, reason = "each test file uses its own part")]

use embedded_hal_02::{Direction, Qei};
use std::cell::Cell;
use std::rc::Rc;
use vehicle_controller::controller::{
    self, Action, AxisCommand, Controller, Event, Inputs, Request,
};
use vehicle_controller::params::{Id, Params};
use vehicle_controller::time::{Duration, Instant};
use vehicle_controller::vehicle::differential::{Config, Geometry};
use vehicle_controller::vehicle::{
    Calibration, DifferentialDrive, Drive, IncrementOutput, OutputError, SpeedOutput, WheelCommand,
    servo,
};

/// The control loop's period.
pub const PERIOD: Duration = Duration::millis(1);
/// Wheel base, m.
pub const BASE: f64 = 0.2;
/// The motor controllers' units per metre.
pub const UNITS: f64 = 10_000.0;
/// Encoder counts per metre: so many more that nothing is lost between units and counts.
pub const COUNTS: f64 = 16.0 * UNITS;

/// A motor with its controller, wheel and encoder.
#[derive(Debug, Default)]
pub struct Motor {
    /// Where its increments have taken it, units.
    pub units: Cell<i64>,
    /// How often it was told an increment that is not 0.
    pub steps: Cell<u32>,
    /// The last speed it was told, m/s.
    pub speed: Cell<f32>,
    /// It has the supply.
    pub on: Cell<bool>,
    /// How often it was told to brake, and to be off.
    pub stops: [Cell<u32>; 2],
    /// It takes no orders.
    pub refuses: Cell<bool>,
    /// Its wheel is held: the encoder stands.
    pub held: Cell<bool>,
    /// The integral of the commanded speed, m.
    pub integral: Cell<f64>,
    /// Where speeds have taken the wheel, m.
    pub rolled: Cell<f64>,
    count: Cell<i64>,
}

impl Motor {
    fn obey(&self) -> Result<(), OutputError> {
        if self.refuses.get() {
            return Err(OutputError);
        }
        self.on.set(true);
        Ok(())
    }

    fn stop(&self, how: usize) {
        self.stops[how].set(self.stops[how].get() + 1);
        self.on.set(false);
        self.speed.set(0.0);
    }

    /// A cycle passes; the encoder follows.
    pub fn pass(&self, dt: f64) {
        let rolled = self.rolled.get() + f64::from(self.speed.get()) * dt;
        self.rolled.set(rolled);
        if !self.held.get() {
            let metres = self.units.get() as f64 / UNITS + rolled;
            self.count.set((metres * COUNTS).floor() as i64);
        }
    }
}

/// The wire to a motor.
#[derive(Clone, Debug, Default)]
pub struct Wire(pub Rc<Motor>);

impl IncrementOutput for Wire {
    fn advance(&mut self, units: i32) -> Result<(), OutputError> {
        self.0.obey()?;
        self.0.units.set(self.0.units.get() + i64::from(units));
        self.0.steps.set(self.0.steps.get() + u32::from(units != 0));
        Ok(())
    }

    fn off(&mut self) -> Result<(), OutputError> {
        self.0.stop(1);
        Ok(())
    }
}

impl SpeedOutput for Wire {
    fn set_speed(&mut self, speed: f32) -> Result<(), OutputError> {
        self.0.obey()?;
        self.0.speed.set(speed);
        Ok(())
    }

    fn brake(&mut self) -> Result<(), OutputError> {
        self.0.stop(0);
        Ok(())
    }

    fn off(&mut self) -> Result<(), OutputError> {
        self.0.stop(1);
        Ok(())
    }
}

impl Qei for Wire {
    type Count = u16;

    fn count(&self) -> u16 {
        self.0.count.get() as u16
    }

    fn direction(&self) -> Direction {
        Direction::Upcounting
    }
}

/// A drive whose commands are summed up.
#[derive(Debug)]
pub struct Integrated<D> {
    drive: D,
    motor: Rc<Motor>,
}

impl<D: Drive> Drive for Integrated<D> {
    fn configure(&mut self, config: &servo::Config) {
        self.drive.configure(config);
    }

    fn command(&mut self, command: WheelCommand, supply: f32, dt: f32) -> Result<f32, OutputError> {
        let step = f64::from(command.speed) * f64::from(dt);
        self.motor.integral.set(self.motor.integral.get() + step);
        self.drive.command(command, supply, dt)
    }

    fn knows_duty(&self) -> bool {
        self.drive.knows_duty()
    }

    fn holds_load(&self) -> bool {
        self.drive.holds_load()
    }

    fn brake(&mut self) -> Result<(), OutputError> {
        self.drive.brake()
    }

    fn off(&mut self) -> Result<(), OutputError> {
        self.drive.off()
    }
}

/// A base with two of them.
#[derive(Debug)]
pub struct Base<D: Drive> {
    /// Left and right.
    pub motors: [Rc<Motor>; 2],
    /// What the control loop was given.
    pub config: controller::Config<Config>,
    controller: Controller<DifferentialDrive<Wire, Wire, Integrated<D>, Integrated<D>>>,
    ticks: u64,
}

impl<D: Drive> Base<D> {
    /// The default parameters but for `changed`.
    pub fn new(
        drive: impl Fn(Wire, &servo::Config) -> Result<D, OutputError>,
        changed: &[(Id, f32)],
    ) -> Self {
        let mut params = Params::default();
        params.set_all(changed).unwrap();
        let mut config = params.build::<Config>(PERIOD);
        config.vehicle = Config {
            geometry: Geometry::new(BASE, 1.0 / COUNTS, 1.0 / COUNTS, Calibration::NOMINAL),
            ..config.vehicle
        };
        let wires = [Wire::default(), Wire::default()];
        let motors = wires.each_ref().map(|wire| Rc::clone(&wire.0));
        let [left, right] = [0, 1].map(|wheel: usize| Integrated {
            drive: drive(wires[wheel].clone(), &config.vehicle.servo[wheel]).unwrap(),
            motor: Rc::clone(&motors[wheel]),
        });
        let [left_encoder, right_encoder] = wires;
        let vehicle =
            DifferentialDrive::new(left_encoder, right_encoder, left, right, &config.vehicle);
        let mut base = Self {
            motors,
            config,
            controller: Controller::new(vehicle, config, None),
            ticks: 0,
        };
        base.tick();
        base
    }

    /// A cycle, and what happened in it.
    pub fn tick(&mut self) -> Vec<Event> {
        let now = Instant::from_ticks(self.ticks * PERIOD.ticks());
        self.ticks += 1;
        let events = self.controller.tick(now, &Inputs::default()).to_vec();
        for motor in &self.motors {
            motor.pass(1e-3);
        }
        events
    }

    /// The next tick comes so many periods later than it should; −1: at once.
    pub fn delay(&mut self, periods: i64) {
        self.ticks = self.ticks.saturating_add_signed(periods);
    }

    /// Asks for something.
    pub fn request(&mut self, action: impl Into<Request<Config>>) {
        self.controller.request(action).unwrap();
    }

    /// Goes `distance` metres.
    pub fn go(&mut self, distance: f32) {
        self.request(Action::Move(AxisCommand {
            distance,
            speed: 0.3,
            acceleration: 0.5,
        }));
    }

    /// Turns by `angle` radians.
    pub fn turn(&mut self, angle: f32) {
        self.request(Action::Turn(AxisCommand {
            distance: angle,
            speed: 1.5,
            acceleration: 3.0,
        }));
    }

    /// Runs for `cycles`, looking at the base after each; what happened.
    pub fn run(&mut self, cycles: u32, mut look: impl FnMut(&Self)) -> Vec<Event> {
        let mut events = Vec::new();
        for _ in 0..cycles {
            events.extend(self.tick());
            look(self);
        }
        events
    }
}
