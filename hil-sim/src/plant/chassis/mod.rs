//! The chassis: which wheels there are besides the two motors, where they are, and how a step goes.
//!
//! Each kind is written from the wheels' places and directions and from the forces of their tyres;
//! what circle comes out of that is not put in.

mod car;
mod differential;
pub(super) mod params;
mod planar;
mod synchro;
mod tricycle;

use rand_chacha::ChaCha8Rng;

use super::body::{Body, GRAVITY};
use super::input::Push;
use super::params::{Chassis, Physics};
use super::servo::Servo;
use super::wheel::Wheel;
use car::Car;
use synchro::Synchro;
use tricycle::Tricycle;

/// A chassis without its body and the wheels on its two motors.
#[derive(Clone, Debug)]
pub(super) enum Undercarriage {
    /// The two wheels are all there is.
    Differential,
    /// Three wheels on both motors.
    Synchro(Synchro),
    /// A driven and steered wheel in front.
    Tricycle(Box<Tricycle>),
    /// Two driven wheels behind, steered ones in front.
    Car(Box<Car>),
}

/// What one of the two motors drives.
pub(super) struct Side {
    /// As the motor has it.
    pub physics: Physics,
    /// Of the wheel \[m\].
    pub diameter: f64,
    /// On the wheel's own tyre \[N\].
    pub load: f64,
    /// Torque of the resistance to its turning \[N·m\].
    pub rolling: f64,
}

/// What the two motors of a robot drive.
pub(super) fn sides(physics: &Physics) -> [Side; 2] {
    let wheels = &physics.wheels;
    let side = |diameter: f64, load: f64| Side {
        physics: physics.clone(),
        diameter,
        load,
        rolling: wheels.rolling_resistance * load * (0.5 * diameter),
    };
    match &physics.chassis {
        Chassis::Differential => {
            let load = 0.5 * physics.body.load_share * physics.body.mass * GRAVITY;
            [wheels.diameter_left, wheels.diameter_right].map(|diameter| side(diameter, load))
        }
        Chassis::Synchro(params) => {
            let [shaft, steering] = synchro::wheels(physics, params);
            let mean = synchro::diameters(physics, params).iter().sum::<f64>() / 3.0;
            let weight = physics.body.load_share * physics.body.mass * GRAVITY;
            [
                Side {
                    physics: shaft,
                    load: 0.0,
                    ..side(mean, weight)
                },
                Side {
                    physics: steering,
                    rolling: params.steering_friction,
                    ..side(2.0 * params.steer_lever, 0.0)
                },
            ]
        }
        Chassis::Tricycle(params) => {
            let [front, _] = tricycle::loads(physics, params);
            [front, 0.0].map(|load| side(params.front_diameter, load))
        }
        Chassis::Bisteerable(params) => {
            let [rear, _] = car::loads(physics, params);
            [wheels.diameter_left, wheels.diameter_right].map(|diameter| side(diameter, rear))
        }
    }
}

impl Undercarriage {
    /// The undercarriage of this robot, whose motors drive these wheels.
    pub(super) fn new(physics: &Physics, wheels: &[Wheel; 2], random: &mut ChaCha8Rng) -> Self {
        match &physics.chassis {
            Chassis::Differential => Self::Differential,
            Chassis::Synchro(params) => Self::Synchro(Synchro::new(physics, params, &wheels[1])),
            Chassis::Tricycle(params) => {
                Self::Tricycle(Box::new(Tricycle::new(physics, params, random)))
            }
            Chassis::Bisteerable(params) => Self::Car(Box::new(Car::new(physics, params, random))),
        }
    }

    /// The body of this robot, with its reference point at the origin.
    pub(super) fn body(&self, physics: &Physics) -> Body {
        Body::new(&physics.body, physics.wheels.base).centred(self.centre(), self.reference())
    }

    /// Centre of mass ahead of the rear axle \[m\].
    fn centre(&self) -> f64 {
        match self {
            Self::Differential | Self::Synchro(_) => 0.0,
            Self::Tricycle(tricycle) => tricycle.centre_of_mass,
            Self::Car(car) => car.centre_of_mass,
        }
    }

    /// Reference point ahead of the rear axle \[m\].
    fn reference(&self) -> f64 {
        match self {
            Self::Differential | Self::Synchro(_) | Self::Tricycle(_) => 0.0,
            Self::Car(car) => car.reference,
        }
    }

    /// Whether there is a second motor.
    #[inline]
    pub(super) fn has_second_motor(&self) -> bool {
        !matches!(self, Self::Tricycle(_))
    }

    /// A step of `dt` \[s\] with these voltages on the motors \[V\].
    #[inline]
    pub(super) fn drive(
        &mut self,
        body: &mut Body,
        wheels: &mut [Wheel; 2],
        voltage: [f64; 2],
        push: Push,
        dt: f64,
    ) {
        match self {
            Self::Differential => differential::drive(body, wheels, voltage, push, dt),
            Self::Synchro(synchro) => synchro.drive(body, wheels, voltage, push, dt),
            Self::Tricycle(tricycle) => {
                tricycle.drive(body, &mut wheels[0], voltage[0], push, dt);
            }
            Self::Car(car) => car.drive(body, wheels, voltage, push, dt),
        }
    }

    /// A step of ideal wheels.
    pub(super) fn roll(
        &mut self,
        body: &mut Body,
        wheels: &mut [Wheel; 2],
        rims: [f64; 2],
        dt: f64,
    ) {
        match self {
            Self::Differential => differential::roll(body, wheels, rims, dt),
            Self::Synchro(synchro) => synchro.roll(body, wheels, rims, dt),
            Self::Tricycle(tricycle) => tricycle.roll(body, &mut wheels[0], rims[0], dt),
            Self::Car(car) => car.roll(body, wheels, rims, dt),
        }
    }

    /// The steering servo, if there is one.
    pub(super) fn servo(&self) -> Option<&Servo> {
        match self {
            Self::Differential | Self::Synchro(_) => None,
            Self::Tricycle(tricycle) => Some(&tricycle.servo),
            Self::Car(car) => Some(&car.servo),
        }
    }

    /// The steering servo, to be moved.
    #[inline]
    pub(super) fn servo_mut(&mut self) -> Option<&mut Servo> {
        match self {
            Self::Differential | Self::Synchro(_) => None,
            Self::Tricycle(tricycle) => Some(&mut tricycle.servo),
            Self::Car(car) => Some(&mut car.servo),
        }
    }

    /// The wheels that no motor drives.
    #[cfg(test)]
    pub(super) fn free_wheels(&mut self) -> &mut [Wheel] {
        match self {
            Self::Differential | Self::Synchro(_) => &mut [],
            Self::Tricycle(tricycle) => &mut tricycle.rear,
            Self::Car(car) => &mut car.front,
        }
    }

    /// Angle of the steering \[rad\].
    pub(super) fn steering(&self, wheels: &[Wheel; 2]) -> f64 {
        match self {
            Self::Synchro(synchro) => synchro.direction(&wheels[1]),
            _ => self.servo().map_or(0.0, Servo::truth),
        }
    }

    /// Counts of the encoders on the front wheels.
    pub(super) fn front_counts(&self) -> [i64; 2] {
        match self {
            Self::Car(car) => {
                [0, 1].map(|side| car.front_encoders[side].counts(car.front[side].turned()))
            }
            _ => [0; 2],
        }
    }

    /// Position of the reference point \[m\] and heading \[rad\].
    pub(super) fn pose(&self, body: &Body, wheels: &[Wheel; 2]) -> [f64; 3] {
        let [x, y, heading] = body.pose;
        match self {
            Self::Differential => body.pose,
            Self::Synchro(synchro) => [x, y, heading + synchro.direction(&wheels[1])],
            Self::Tricycle(_) | Self::Car(_) => {
                let ahead = self.reference() - self.centre();
                let (sin, cos) = heading.sin_cos();
                [x + ahead * cos, y + ahead * sin, heading]
            }
        }
    }

    /// Speed along the heading \[m/s\] and rate of the heading \[rad/s\].
    pub(super) fn speed(&self, body: &Body, wheels: &[Wheel; 2]) -> (f64, f64) {
        let velocity = body.velocity;
        match self {
            Self::Synchro(synchro) => {
                let (sin, cos) = synchro.direction(&wheels[1]).sin_cos();
                (
                    velocity.forward * cos + velocity.lateral * sin,
                    velocity.yaw + wheels[1].speed,
                )
            }
            _ => (velocity.forward, velocity.yaw),
        }
    }
}
