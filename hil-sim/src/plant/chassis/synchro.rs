//! The synchro drive: three wheels that one motor drives together and another one steers together.

use std::array;

use super::super::MAX_TRIALS;
use super::super::balance::Balance;
use super::super::body::{Body, GRAVITY, Velocity};
use super::super::input::Push;
use super::super::params::{MotorParams, Physics, SynchroParams};
use super::super::stance::{Stance, product};
use super::super::tyre::Tyre;
use super::super::wheel::Wheel;

/// What a synchro drive has besides the body. The plant's first wheel is the shaft that the drive
/// turns, with the three wheels' mean radius and without a tyre of its own; the second one is the
/// steering, whose radius is the lever.
///
/// What the steering's torques do to the body is left out: the tyres hold it.
#[derive(Clone, Debug)]
pub(in super::super) struct Synchro {
    /// Front, left, right, from the body's centre \[m\].
    places: [[f64; 2]; 3],
    /// By which they point beside the heading \[rad\].
    misalignment: [f64; 3],
    radii: [f64; 3],
    tyres: [Tyre; 3],
    /// Angle at which the steering started \[rad\].
    zero: f64,
}

impl Synchro {
    /// The three wheels of this robot; `steering` is its steering.
    pub(super) fn new(physics: &Physics, params: &SynchroParams, steering: &Wheel) -> Self {
        // An equilateral triangle: its side is the distance of the left and the right wheel.
        let half = 0.5 * physics.wheels.base;
        let radius = half * 2.0 / 3f64.sqrt();
        let load = physics.body.load_share * physics.body.mass * GRAVITY / 3.0;
        Self {
            places: [[radius, 0.0], [-0.5 * radius, half], [-0.5 * radius, -half]],
            misalignment: params.misalignment,
            radii: diameters(physics, params).map(|diameter| 0.5 * diameter),
            tyres: [(); 3].map(|()| Tyre::new(&physics.tyre, load)),
            zero: steering.turned(),
        }
    }

    /// Where the wheels point, from the body's x axis \[rad\].
    pub(super) fn direction(&self, steering: &Wheel) -> f64 {
        steering.turned() - self.zero
    }

    /// The wheels' stances when the steering is at this angle \[rad\].
    fn stances(&self, direction: f64) -> [Stance; 3] {
        array::from_fn(|i| Stance::new(self.places[i], direction + self.misalignment[i]))
    }

    /// A step of `dt` \[s\] with these voltages on drive and steering \[V\].
    pub(super) fn drive(
        &mut self,
        body: &mut Body,
        [shaft, steering]: &mut [Wheel; 2],
        voltage: [f64; 2],
        push: Push,
        dt: f64,
    ) {
        let before = self.direction(steering);
        steer(steering, voltage[1], dt);
        let direction = 0.5 * (before + self.direction(steering));
        let stances = self.stances(direction);
        let start = body.turned(dt);
        let (sin, cos) = direction.sin_cos();
        let base = Balance::new(body, start, [cos, sin], push, dt);
        let mut guess = shaft.guess(0.0, 0.0, dt);
        let mut grips: [f64; 3] = array::from_fn(|i| {
            let (along, across) = stances[i].speeds(start);
            self.tyres[i].grip(self.radii[i] * shaft.speed, along, across)
        });
        let mut remaining = MAX_TRIALS;
        let (trial, velocity) = loop {
            let trial = shaft.attempt(&guess, voltage[0], dt);
            // J·ω' = J·ω_0 − dt·Σ R·D·(R·ω' − v_c'): so ω' = (J·ω_0 + dt·p·q')/j with the row
            // p = Σ R·D·along and j = J + dt·Σ R²·D
            let mut balance = base;
            let (mut pull, mut held) = ([0.0; 3], trial.own);
            for ((stance, &grip), &radius) in stances.iter().zip(&grips).zip(&self.radii) {
                for (sum, factor) in pull.iter_mut().zip(stance.along) {
                    *sum += radius * grip * factor;
                }
                held += dt * radius * radius * grip;
                balance.resist(&stance.along, dt * grip);
                balance.resist(&stance.across, dt * grip);
            }
            // Put into the body's equations, Σ D·(R·ω' − v_c')·along takes back some of the
            // resistance: what the shaft yields.
            let free = trial.own * trial.wheel_fixed / held;
            balance.push(&pull, dt * free);
            balance.resist(&pull, -dt * dt / held);
            let velocity = balance.solve();
            let trial = trial.turning(free + dt * product(&pull, velocity) / held);
            remaining -= 1;
            if remaining == 0 {
                break (trial, velocity);
            }
            let mut wrong = shaft.judge(&mut guess, &trial, voltage[0], (0.0, 0.0), dt);
            for i in 0..3 {
                let radius = self.radii[i];
                // The other tyres hold the shaft too.
                let compliance = dt * radius * radius / (held - dt * radius * radius * grips[i]);
                wrong |= self.tyres[i].judge(
                    &mut grips[i],
                    radius * trial.wheel_fixed,
                    stances[i].speeds(velocity),
                    compliance,
                );
            }
            if !wrong {
                break (trial, velocity);
            }
        };
        shaft.settle(&guess, &trial, 0.0, dt);
        body.travel(velocity, dt);
    }

    /// A step of ideal wheels: the mean speed of the rims, and the heading's rate times the lever
    /// \[m/s\].
    ///
    /// Three wheels of different diameters or directions cannot all roll; the body moves as with
    /// equal creep at each of them, that is with the least squares of their slips.
    pub(super) fn roll(
        &mut self,
        body: &mut Body,
        [shaft, steering]: &mut [Wheel; 2],
        rims: [f64; 2],
        dt: f64,
    ) {
        let before = self.direction(steering);
        steering.follow(rims[1], dt);
        shaft.follow(rims[0], dt);
        let stances = self.stances(0.5 * (before + self.direction(steering)));
        // As the places' sum is zero, u and v are the means of the rims' velocities, and r is the
        // sum of their moments over that of the distances' squares.
        let (mut sum, mut squares) = ([0.0; 3], 0.0);
        for ((stance, [x, y]), radius) in stances.iter().zip(self.places).zip(self.radii) {
            for (sum, factor) in sum.iter_mut().zip(stance.along) {
                *sum += radius * shaft.speed * factor;
            }
            squares += x * x + y * y;
        }
        body.travel(
            Velocity {
                forward: sum[0] / 3.0,
                lateral: sum[1] / 3.0,
                yaw: sum[2] / squares,
            },
            dt,
        );
    }
}

/// A step of the steering. A wheel that turns where it stands meets no force but its friction.
fn steer(steering: &mut Wheel, voltage: f64, dt: f64) {
    let mut guess = steering.guess(0.0, 0.0, dt);
    for _ in 1..MAX_TRIALS {
        let trial = steering.attempt(&guess, voltage, dt);
        if !steering.judge(&mut guess, &trial, voltage, (0.0, 0.0), dt) {
            break;
        }
    }
    let trial = steering.attempt(&guess, voltage, dt);
    steering.settle(&guess, &trial, 0.0, dt);
}

/// Diameters of the wheels: front, left, right \[m\].
pub(super) fn diameters(physics: &Physics, params: &SynchroParams) -> [f64; 3] {
    let wheels = &physics.wheels;
    [
        params.front_diameter,
        wheels.diameter_left,
        wheels.diameter_right,
    ]
}

/// The shaft of the drive and the steering, where everything is referred to the heading, as the
/// parameters of robots with one such wheel.
pub(super) fn wheels(physics: &Physics, params: &SynchroParams) -> [Physics; 2] {
    let mut shaft = physics.clone();
    shaft.wheels.inertia *= 3.0;
    let mut steering = physics.clone();
    steering.wheels.inertia = params.steering_inertia;
    let (g, motor) = (params.steer_gear, &physics.motor);
    steering.motor = MotorParams {
        torque_constant: motor.torque_constant * g,
        inertia: motor.inertia * g * g,
        viscous: motor.viscous * g * g,
        coulomb: motor.coulomb * g,
        stiction: motor.stiction * g,
        stribeck_speed: motor.stribeck_speed / g,
        backlash: motor.backlash / g,
        gear_stiffness: motor.gear_stiffness * g * g,
        gear_damping: motor.gear_damping * g * g,
        ..motor.clone()
    };
    steering.encoder.counts_per_turn = params.steer_counts_per_turn;
    [shaft, steering]
}
