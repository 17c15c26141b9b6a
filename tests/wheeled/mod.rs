//! Any vehicle on ideal parts: wheels that roll as they are told, a steering that points where it is told, at its own rate, encoders of a micrometre.
#![allow(dead_code, reason = "each test file uses its own part")]

pub mod base;

use embedded_hal_02::{Direction, Qei};
use std::cell::Cell;
use std::rc::Rc;
use vehicle_controller::params::{Blueprint, Id, Params};
use vehicle_controller::time::Duration;
use vehicle_controller::vehicle::{
    BiSteerable, DifferentialDrive, Drive, Kind, OutputError, Steering, Synchro, Tricycle, Twist,
    VirtualVehicle, WheelCommand, servo, steering,
};

/// The control loop's period.
pub const PERIOD: Duration = Duration::millis(1);

/// One wheel: what it is told, and how far it has rolled.
#[derive(Debug, Default)]
pub struct Rolling {
    /// The speed that its motor was told, m/s.
    pub speed: Cell<f64>,
    /// Counts of its encoder.
    pub count: Cell<i64>,
    rolled: Cell<f64>,
    per_metre: Cell<f64>,
}

/// The wires of a wheel.
#[derive(Clone, Debug, Default)]
pub struct Wheel(pub Rc<Rolling>);

impl Wheel {
    /// Its encoder has so many counts for a metre.
    pub fn set_resolution(&self, per_metre: f64) {
        self.0.per_metre.set(per_metre);
    }

    /// It rolls by so much, m.
    pub fn roll(&self, metres: f64) {
        let rolled = self.0.rolled.get() + metres;
        self.0.rolled.set(rolled);
        self.0
            .count
            .set((rolled * self.0.per_metre.get()).round() as i64);
    }
}

impl Qei for Wheel {
    type Count = u32;

    fn count(&self) -> u32 {
        self.0.count.get() as u32
    }

    fn direction(&self) -> Direction {
        Direction::Upcounting
    }
}

impl Drive for Wheel {
    fn knows_duty(&self) -> bool {
        false
    }

    fn configure(&mut self, _: &servo::Config) {}

    fn command(&mut self, command: WheelCommand, _: f32, _: f32) -> Result<f32, OutputError> {
        self.0.speed.set(command.speed.into());
        Ok(0.0)
    }

    fn off(&mut self) -> Result<(), OutputError> {
        self.0.speed.set(0.0);
        Ok(())
    }
}

/// The wires of a steering: where it is told to point, and where it does, rad.
#[derive(Clone, Debug, Default)]
pub struct Pointer {
    pub told: Rc<Cell<f32>>,
    pub is: Rc<Cell<f32>>,
    pub off: Rc<Cell<bool>>,
}

impl Steering for Pointer {
    fn configure(&mut self, _: &steering::Config) {}

    fn angle(&mut self) -> f32 {
        self.is.get()
    }

    fn steer(&mut self, angle: f32) -> Result<(), OutputError> {
        self.told.set(angle);
        self.off.set(false);
        Ok(())
    }

    fn off(&mut self) -> Result<(), OutputError> {
        self.off.set(true);
        Ok(())
    }
}

/// The wires of a vehicle.
#[derive(Clone, Debug, Default)]
pub struct Wires {
    pub wheels: [Wheel; 2],
    pub front: [Wheel; 2],
    pub pointer: Pointer,
}

pub type Car = BiSteerable<Wheel, Wheel, Wheel, Wheel, Wheel, Wheel, Pointer>;

/// Parameters of a vehicle of that kind whose encoders have `counts` for each micrometre or so.
pub fn params(kind: Kind, values: &[(Id, f32)]) -> Params {
    let mut params = Params::of(kind);
    let mut all = vec![
        (Id::CountsPerTurn, 1e6),
        (Id::MaxSpeed, 4.0),
        (Id::MaxWheelSpeed, 20.0),
        (Id::MotorSpeedGain, 0.0),
        (Id::MotorTolerance, 10.0),
    ];
    all.extend_from_slice(values);
    params.set_all(&all).expect("all are in range");
    params
}

/// Counts for each metre of a wheel with that diameter.
pub fn per_metre(params: &Params, diameter: Id) -> f64 {
    let turn = std::f64::consts::PI * f64::from(params.get(diameter));
    f64::from(params.get(Id::CountsPerTurn)) / turn
}

pub fn differential(params: &Params) -> (DifferentialDrive<Wheel, Wheel, Wheel, Wheel>, Wires) {
    let wires = Wires::default();
    let [left, right] = &wires.wheels;
    left.set_resolution(per_metre(params, Id::LeftDiameter));
    right.set_resolution(per_metre(params, Id::RightDiameter));
    let vehicle = DifferentialDrive::new(
        left.clone(),
        right.clone(),
        left.clone(),
        right.clone(),
        &Blueprint::build(params),
    );
    (vehicle, wires)
}

pub fn synchro(params: &Params) -> (Synchro<Wheel, Wheel, Wheel, Wheel>, Wires) {
    let wires = Wires::default();
    let [drive, turn] = &wires.wheels;
    drive.set_resolution(per_metre(params, Id::WheelDiameter));
    // The steering's circumference is that of the lever.
    let lever = f64::from(params.get(Id::TurnLever));
    turn.set_resolution(f64::from(params.get(Id::TurnCounts)) / (std::f64::consts::TAU * lever));
    let vehicle = Synchro::new(
        drive.clone(),
        turn.clone(),
        drive.clone(),
        turn.clone(),
        &Blueprint::build(params),
    );
    (vehicle, wires)
}

pub fn tricycle(params: &Params) -> (Tricycle<Wheel, Wheel, Pointer>, Wires) {
    let wires = Wires::default();
    let wheel = &wires.wheels[0];
    wheel.set_resolution(per_metre(params, Id::WheelDiameter));
    let vehicle = Tricycle::new(
        wheel.clone(),
        wheel.clone(),
        wires.pointer.clone(),
        &Blueprint::build(params),
    );
    (vehicle, wires)
}

pub fn car(params: &Params) -> (Car, Wires) {
    let wires = Wires::default();
    let [left, right] = &wires.wheels;
    let [front_left, front_right] = &wires.front;
    for (wheel, diameter) in [
        (left, Id::LeftDiameter),
        (right, Id::RightDiameter),
        (front_left, Id::LeftDiameter),
        (front_right, Id::RightDiameter),
    ] {
        wheel.set_resolution(per_metre(params, diameter));
    }
    let vehicle = BiSteerable::new(
        left.clone(),
        right.clone(),
        Some((front_left.clone(), front_right.clone())),
        left.clone(),
        right.clone(),
        wires.pointer.clone(),
        &Blueprint::build(params),
    );
    (vehicle, wires)
}

/// Drives a vehicle with one twist until its steering has come to it, and then for a cycle of `dt` in which its wheels roll as they were told; what it says of
/// that cycle. A car's front wheels roll by `front` of the rear ones' speeds.
pub fn driven<V: VirtualVehicle>(
    vehicle: &mut V,
    wires: &Wires,
    twist: Twist,
    dt: f32,
    front: impl Fn([f64; 2], f64) -> [f64; 2],
) -> Twist {
    for _ in 0..3 {
        // The steering's rate is without a limit worth a second.
        vehicle
            .drive(twist, Twist::ZERO, 12.0, 1.0)
            .expect("nothing refuses");
        wires.pointer.is.set(wires.pointer.told.get());
        vehicle.sense(0.0);
    }
    let speeds = wires.wheels.each_ref().map(|wheel| wheel.0.speed.get());
    let dt64 = f64::from(dt);
    for (wheel, speed) in wires.wheels.iter().zip(speeds) {
        wheel.roll(speed * dt64);
    }
    let angle = f64::from(wires.pointer.is.get());
    for (wheel, speed) in wires.front.iter().zip(front(speeds, angle)) {
        wheel.roll(speed * dt64);
    }
    vehicle.sense(dt).increment
}
