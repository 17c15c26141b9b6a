//! The bi-steerable car: two driven wheels behind, two free ones in front, and both axles, or only
//! the front one, steered so that no wheel has to slide.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::super::body::{Body, GRAVITY, Velocity};
use super::super::encoder::Encoder;
use super::super::input::Push;
use super::super::params::{BisteerableParams, Physics, RearSteering};
use super::super::servo::Servo;
use super::super::stance::Stance;
use super::super::wheel::Wheel;
use super::planar;

/// What a car has besides the body and its driven wheels.
#[derive(Clone, Debug)]
pub(in super::super) struct Car {
    rear_steering: RearSteering,
    wheel_base: f64,
    /// Centre of mass ahead of the rear axle \[m\].
    pub centre_of_mass: f64,
    /// The point of the axis that moves along the heading, ahead of the rear axle \[m\].
    pub reference: f64,
    /// Rear left, rear right, front left, front right, from the rear axle's middle \[m\].
    places: [[f64; 2]; 4],
    /// Left and right.
    pub front: [Wheel; 2],
    pub front_encoders: [Encoder; 2],
    pub servo: Servo,
}

impl Car {
    /// The front and the steering of this robot.
    pub(super) fn new(
        physics: &Physics,
        params: &BisteerableParams,
        random: &mut ChaCha8Rng,
    ) -> Self {
        let length = params.wheel_base;
        let (rear, front) = (0.5 * physics.wheels.base, 0.5 * params.front_track);
        let [_, load] = loads(physics, params);
        Self {
            rear_steering: params.rear,
            wheel_base: length,
            centre_of_mass: params.centre_of_mass,
            reference: match params.rear {
                RearSteering::Opposite => 0.5 * length,
                RearSteering::Fixed => 0.0,
            },
            places: [[0.0, rear], [0.0, -rear], [length, front], [length, -front]],
            front: [params.front_diameter_left, params.front_diameter_right]
                .map(|diameter| Wheel::free(physics, diameter, load)),
            front_encoders: [(); 2].map(|()| Encoder::new(&physics.encoder, random.random())),
            servo: Servo::new(&params.servo, random),
        }
    }

    /// By which the places of the wheels become directions, at this steering angle \[rad\]: the
    /// curvature k \[1/m\] and the slope t of the way of the rear axle's middle.
    ///
    /// The common centre of all wheels is where the axles' normals cross: at (−t/k, 1/k) with
    /// t = tan φ_r and k = (tan φ_f − tan φ_r)/L. The body turns about it, so the floor under the
    /// place (x, y) goes as (1 − k·y, k·x + t).
    fn way(&self, front: f64) -> (f64, f64) {
        let slope = match self.rear_steering {
            RearSteering::Opposite => -front.tan(),
            RearSteering::Fixed => 0.0,
        };
        ((front.tan() - slope) / self.wheel_base, slope)
    }

    /// How the four places move for a forward speed of 1 \[1\].
    fn motions(&self) -> [[f64; 2]; 4] {
        let (curvature, slope) = self.way(self.servo.truth());
        self.places
            .map(|[x, y]| [1.0 - curvature * y, curvature * x + slope])
    }

    /// The wheels' stances, in the order of the places: each points where it has to go.
    fn stances(&self) -> [Stance; 4] {
        let motions = self.motions();
        std::array::from_fn(|i| {
            let [x, y] = self.places[i];
            Stance::new(
                [x - self.centre_of_mass, y],
                motions[i][1].atan2(motions[i][0]),
            )
        })
    }

    /// A step of `dt` \[s\] with these voltages on the motors \[V\].
    pub(super) fn drive(
        &mut self,
        body: &mut Body,
        [rear_left, rear_right]: &mut [Wheel; 2],
        [left, right]: [f64; 2],
        push: Push,
        dt: f64,
    ) {
        let stances = self.stances();
        let [front_left, front_right] = &mut self.front;
        planar::drive(
            body,
            [rear_left, rear_right, front_left, front_right],
            &stances,
            [left, right, 0.0, 0.0],
            push,
            dt,
        );
    }

    /// A step of ideal wheels. They can only turn as the circle has it; the mean of what the driven
    /// ones are told \[m/s\] is theirs.
    pub(super) fn roll(&mut self, body: &mut Body, rear: &mut [Wheel; 2], rims: [f64; 2], dt: f64) {
        let motions = self.motions();
        let ways = motions.map(|[x, y]| x.hypot(y));
        let forward = (rims[0] + rims[1]) / (ways[0] + ways[1]);
        for (wheel, way) in rear.iter_mut().chain(&mut self.front).zip(ways) {
            wheel.follow(forward * way, dt);
        }
        let (curvature, slope) = self.way(self.servo.truth());
        body.travel(
            Velocity {
                forward,
                lateral: forward * (curvature * self.centre_of_mass + slope),
                yaw: forward * curvature,
            },
            dt,
        );
    }
}

/// What each of the rear wheels and each of the front wheels carries \[N\].
pub(super) fn loads(physics: &Physics, params: &BisteerableParams) -> [f64; 2] {
    let weight = physics.body.load_share * physics.body.mass * GRAVITY;
    let front = weight * params.centre_of_mass / params.wheel_base;
    [0.5 * (weight - front), 0.5 * front]
}
