//! The vehicles of the simulated robots, on fake peripherals: any of the library's.

use crate::peripherals::{FakeDrive, FakeQei, FakeSteering, Harness, Wires};
use crate::robot::{Drives, Model, Robot};
use anyhow::Result;
use std::rc::Rc;
use vehicle_controller::controller::Interface;
use vehicle_controller::params::{Blueprint, Params};
use vehicle_controller::time::Duration;
use vehicle_controller::vehicle::gains::{GAINS, Influence};
use vehicle_controller::vehicle::{
    BiSteerable, DifferentialDrive, Kind, Motion, OutputError, Synchro, Tricycle, Twist,
    VirtualVehicle, Wheel, bisteerable, differential, synchro, tricycle,
};

/// A vehicle of any kind.
#[derive(Debug)]
pub enum Vehicle {
    /// Two driven wheels.
    Differential(DifferentialDrive<FakeQei, FakeQei, FakeDrive, FakeDrive>),
    /// Wheels that are driven and steered together.
    Synchro(Synchro<FakeQei, FakeQei, FakeDrive, FakeDrive>),
    /// A driven and steered front wheel.
    Tricycle(Tricycle<FakeQei, FakeDrive, FakeSteering>),
    /// A car.
    BiSteerable(Box<Car>),
}

/// A car on fake peripherals.
pub type Car = BiSteerable<FakeQei, FakeQei, FakeQei, FakeQei, FakeDrive, FakeDrive, FakeSteering>;

/// What it is configured with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Configuration {
    /// Of a differential drive.
    Differential(differential::Config),
    /// Of a synchro drive.
    Synchro(synchro::Config),
    /// Of a tricycle.
    Tricycle(tricycle::Config),
    /// Of a car.
    BiSteerable(bisteerable::Config),
}

/// The desk that a simulated robot is commanded from.
pub type Desk = Interface<Configuration>;

impl Blueprint for Configuration {
    fn build(params: &Params) -> Self {
        match params.vehicle() {
            Kind::Differential => Self::Differential(Blueprint::build(params)),
            Kind::Synchro => Self::Synchro(Blueprint::build(params)),
            Kind::Tricycle => Self::Tricycle(Blueprint::build(params)),
            Kind::BiSteerable => Self::BiSteerable(Blueprint::build(params)),
        }
    }
}

/// True if it has a steering angle.
#[must_use]
pub fn steers(vehicle: Kind) -> bool {
    matches!(vehicle, Kind::Tricycle | Kind::BiSteerable)
}

/// The vehicle of a robot whose controller believes in these parameters.
///
/// # Errors
/// None: the fakes never refuse.
pub fn vehicle(harness: &Harness, robot: &Robot, params: &Params) -> Result<Vehicle> {
    let qei = |wires: &Rc<Wires>| FakeQei::new(Rc::clone(wires), robot.narrow_counters);
    let [left, right] = &harness.wheels;
    let drive = |motor: usize, servo| -> Result<FakeDrive> {
        let wires = Rc::clone(&harness.wheels[motor]);
        Ok(match (robot.model, &robot.drives) {
            (Model::Ideal, _) => FakeDrive::Ideal(wires),
            (Model::Dynamic, Drives::Bridge) => FakeDrive::bridge(wires, servo)?,
            (Model::Dynamic, Drives::Speed(params)) => {
                FakeDrive::speed(wires, params.units_per_metre[motor], servo)?
            }
            (Model::Dynamic, Drives::Increment(params)) => {
                FakeDrive::increment(wires, params.units_per_metre[motor], servo)?
            }
        })
    };
    let config = Configuration::build(params);
    Ok(match &config {
        Configuration::Differential(config) => Vehicle::Differential(DifferentialDrive::new(
            qei(left),
            qei(right),
            drive(0, config.servo[0])?,
            drive(1, config.servo[1])?,
            config,
        )),
        Configuration::Synchro(config) => Vehicle::Synchro(Synchro::new(
            qei(left),
            qei(right),
            drive(0, config.servo[0])?,
            drive(1, config.servo[1])?,
            config,
        )),
        Configuration::Tricycle(config) => Vehicle::Tricycle(Tricycle::new(
            qei(left),
            drive(0, config.servo)?,
            FakeSteering::new(&harness.steering, &config.steering)?,
            config,
        )),
        Configuration::BiSteerable(config) => {
            let [front_left, front_right] = &harness.front;
            Vehicle::BiSteerable(Box::new(BiSteerable::new(
                qei(left),
                qei(right),
                Some((qei(front_left), qei(front_right))),
                drive(0, config.servo[0])?,
                drive(1, config.servo[1])?,
                FakeSteering::new(&harness.steering, &config.steering)?,
                config,
            )))
        }
    })
}

/// What any of them does.
macro_rules! any {
    ($self:ident, $vehicle:ident => $what:expr) => {
        match $self {
            Vehicle::Differential($vehicle) => $what,
            Vehicle::Synchro($vehicle) => $what,
            Vehicle::Tricycle($vehicle) => $what,
            Vehicle::BiSteerable($vehicle) => $what,
        }
    };
}

impl VirtualVehicle for Vehicle {
    type Config = Configuration;

    fn configure(&mut self, config: &Configuration) {
        match (self, config) {
            (Self::Differential(vehicle), Configuration::Differential(config)) => {
                vehicle.configure(config);
            }
            (Self::Synchro(vehicle), Configuration::Synchro(config)) => vehicle.configure(config),
            (Self::Tricycle(vehicle), Configuration::Tricycle(config)) => vehicle.configure(config),
            (Self::BiSteerable(vehicle), Configuration::BiSteerable(config)) => {
                vehicle.configure(config);
            }
            _ => unreachable!("parameters do not change their vehicle"),
        }
    }

    fn resolution(&self) -> Twist {
        any!(self, vehicle => vehicle.resolution())
    }

    fn set_gains(&mut self, gains: [f32; GAINS]) {
        any!(self, vehicle => vehicle.set_gains(gains));
    }

    fn influence(&self) -> Influence {
        any!(self, vehicle => vehicle.influence())
    }

    fn steers(&self) -> bool {
        any!(self, vehicle => vehicle.steers())
    }

    fn max_curvature(&self) -> f32 {
        any!(self, vehicle => vehicle.max_curvature())
    }

    fn heading_distance(&self) -> f32 {
        any!(self, vehicle => vehicle.heading_distance())
    }

    fn prepare(&mut self, present: Twist, next: Twist) -> bool {
        any!(self, vehicle => vehicle.prepare(present, next))
    }

    fn is_astray(&self) -> bool {
        any!(self, vehicle => vehicle.is_astray())
    }

    fn steering(&self) -> f32 {
        any!(self, vehicle => vehicle.steering())
    }

    fn sense(&mut self, dt: f32) -> Motion {
        any!(self, vehicle => vehicle.sense(dt))
    }

    fn share(&self, wanted: Twist, supply: f32) -> f32 {
        any!(self, vehicle => vehicle.share(wanted, supply))
    }

    fn holds_load(&self) -> bool {
        any!(self, vehicle => vehicle.holds_load())
    }

    fn knows_duty(&self) -> bool {
        any!(self, vehicle => vehicle.knows_duty())
    }

    fn drive(
        &mut self,
        speed: Twist,
        acceleration: Twist,
        supply: f32,
        dt: f32,
    ) -> Result<(), OutputError> {
        any!(self, vehicle => vehicle.drive(speed, acceleration, supply, dt))
    }

    fn brake(&mut self) -> Result<(), OutputError> {
        any!(self, vehicle => vehicle.brake())
    }

    fn off(&mut self) -> Result<(), OutputError> {
        any!(self, vehicle => vehicle.off())
    }

    fn wheels(&self) -> [Wheel; 2] {
        any!(self, vehicle => vehicle.wheels())
    }
}

/// The whole configuration for a tick of the given period.
pub fn configuration(
    params: &Params,
    period: Duration,
) -> vehicle_controller::controller::Config<Configuration> {
    params.build(period)
}
