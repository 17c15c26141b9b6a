//! The tricycle: one wheel in front, driven and steered, and two free ones behind.

use rand_chacha::ChaCha8Rng;

use super::super::body::{Body, GRAVITY, Velocity};
use super::super::input::Push;
use super::super::params::{Physics, TricycleParams};
use super::super::servo::Servo;
use super::super::stance::Stance;
use super::super::wheel::Wheel;
use super::planar;

/// What a tricycle has besides the body and its front wheel. The plant's second wheel is not there.
#[derive(Clone, Debug)]
pub(in super::super) struct Tricycle {
    wheel_base: f64,
    /// Centre of mass ahead of the rear axle \[m\].
    pub centre_of_mass: f64,
    half_track: f64,
    /// Left and right.
    pub rear: [Wheel; 2],
    pub servo: Servo,
}

impl Tricycle {
    /// The rear and the steering of this robot.
    pub(super) fn new(physics: &Physics, params: &TricycleParams, random: &mut ChaCha8Rng) -> Self {
        let wheels = &physics.wheels;
        let [_, rear] = loads(physics, params);
        Self {
            wheel_base: params.wheel_base,
            centre_of_mass: params.centre_of_mass,
            half_track: 0.5 * wheels.base,
            rear: [wheels.diameter_left, wheels.diameter_right]
                .map(|diameter| Wheel::free(physics, diameter, rear)),
            servo: Servo::new(&params.servo, random),
        }
    }

    /// The wheels' stances: front, rear left, rear right.
    fn stances(&self) -> [Stance; 3] {
        let back = -self.centre_of_mass;
        [
            Stance::new([self.wheel_base + back, 0.0], self.servo.truth()),
            Stance::new([back, self.half_track], 0.0),
            Stance::new([back, -self.half_track], 0.0),
        ]
    }

    /// A step of `dt` \[s\] with this voltage on the motor \[V\].
    pub(super) fn drive(
        &mut self,
        body: &mut Body,
        front: &mut Wheel,
        voltage: f64,
        push: Push,
        dt: f64,
    ) {
        let stances = self.stances();
        let [left, right] = &mut self.rear;
        planar::drive(
            body,
            [front, left, right],
            &stances,
            [voltage, 0.0, 0.0],
            push,
            dt,
        );
    }

    /// A step with the front wheel rolling at this speed of its rim \[m/s\].
    pub(super) fn roll(&mut self, body: &mut Body, front: &mut Wheel, rim: f64, dt: f64) {
        front.follow(rim, dt);
        // The rear axle's middle moves along the axis, the front wheel where it points.
        let (sin, cos) = self.servo.truth().sin_cos();
        let (forward, yaw) = (rim * cos, rim * sin / self.wheel_base);
        let [left, right] = &mut self.rear;
        left.follow(forward - yaw * self.half_track, dt);
        right.follow(forward + yaw * self.half_track, dt);
        body.travel(
            Velocity {
                forward,
                lateral: yaw * self.centre_of_mass,
                yaw,
            },
            dt,
        );
    }
}

/// What the front wheel and each of the rear wheels carry \[N\].
pub(super) fn loads(physics: &Physics, params: &TricycleParams) -> [f64; 2] {
    let weight = physics.body.load_share * physics.body.mass * GRAVITY;
    let front = weight * params.centre_of_mass / params.wheel_base;
    [front, 0.5 * (weight - front)]
}
