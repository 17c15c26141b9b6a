//! A base whose wheels turn as the test says, with its controller and the desk from which it is corrected.

use super::{COUNT, Counts, Vehicle, config, geometry, quantised, vehicle};
use nalgebra::{Matrix3, Vector3};
use vehicle_controller::controller::{
    Config, Controller, Estimate, Inputs, Interface, Noise, Observation, Pose, Refusal,
};
use vehicle_controller::params::Params;
use vehicle_controller::time::{Duration, Instant};
use vehicle_controller::vehicle::differential;

/// The base, ticked once at time 0.
pub struct Base {
    /// Where it is commanded.
    pub desk: Interface<differential::Config>,
    controller: Controller<Vehicle<u16>>,
    counts: Counts,
    rolled: [f64; 2],
    now: u64,
}

/// C as the controller keeps it.
pub fn wide(estimate: &Estimate) -> Matrix3<f64> {
    estimate.covariance.cast()
}

/// x, y, θ.
pub fn vector(pose: &Pose) -> Vector3<f64> {
    Vector3::new(pose.x, pose.y, pose.theta)
}

/// The pose of x, y, θ.
pub fn pose(v: Vector3<f64>) -> Pose {
    Pose {
        x: v.x,
        y: v.y,
        theta: v.z,
    }
}

/// The symmetric matrix of an upper triangle.
pub fn symmetric([xx, xy, xt, yy, yt, tt]: [f64; 6]) -> Matrix3<f64> {
    Matrix3::new(xx, xy, xt, xy, yy, yt, xt, yt, tt)
}

/// The largest difference of two covariances in units of the second one's √(`C_ii` `C_jj`).
pub fn difference(is: &Matrix3<f64>, wanted: &Matrix3<f64>) -> f64 {
    let d = wanted.diagonal().map(f64::sqrt);
    let scale = d * d.transpose();
    (is - wanted).abs().component_div(&scale).max()
}

impl Base {
    /// At the origin, certain of it.
    pub fn new(noise: Noise) -> Self {
        Self::with(&Params::default(), noise)
    }

    /// At the origin, certain of it, with these parameters but for the noise.
    pub fn with(params: &Params, noise: Noise) -> Self {
        let vehicle_config = config(geometry());
        let (vehicle, counts) = vehicle(&vehicle_config, [0, 0]);
        let config = Config {
            noise,
            ..params.build(Duration::millis(1))
        };
        let mut controller = Controller::new(vehicle, config, None);
        controller.tick(Instant::from_ticks(0), &Inputs::default());
        let desk = Interface::new(controller.snapshot(), params.limits());
        Self {
            desk,
            controller,
            counts,
            rolled: [0.0; 2],
            now: 0,
        }
    }

    /// At a pose that is known as well as `covariance` says.
    pub fn at(pose: Pose, covariance: &Matrix3<f64>, noise: Noise) -> Self {
        let mut base = Self::new(noise);
        base.desk.reset_pos(pose, covariance).unwrap();
        base.drive(1, 0.0, 0.0);
        base
    }

    /// What the desk asks for goes to the controller.
    pub fn hand_over(&mut self) {
        if let Some(request) = self.desk.take_request() {
            self.controller.request(request).unwrap();
        }
    }

    /// A tick, `micros` after the last, of driving at these speeds; the desk sees it, and hands nothing over.
    pub fn tick(&mut self, micros: u64, v: f64, omega: f64) {
        self.now += micros;
        let dt = micros as f64 * 1e-6;
        let sideways = 0.5 * super::BASE * omega;
        self.rolled[0] += dt * (v - sideways);
        self.rolled[1] += dt * (v + sideways);
        for (count, rolled) in self.counts.iter().zip(self.rolled) {
            count.set(quantised(rolled / COUNT, 0.5));
        }
        self.controller
            .tick(Instant::from_ticks(self.now), &Inputs::default());
        self.desk.update(self.controller.snapshot());
        while self.desk.work() {}
    }

    /// Drives for `millis`, at 1 kHz.
    pub fn drive(&mut self, millis: u32, v: f64, omega: f64) {
        for _ in 0..millis {
            self.hand_over();
            self.tick(1000, v, omega);
        }
    }

    /// A pose fix without a gate.
    pub fn fix(&mut self, z: Pose, covariance: Matrix3<f64>, age: f32) -> Result<f32, Refusal> {
        let observation = Observation::Pose {
            pose: z,
            covariance,
        };
        self.desk.observe(&observation, age, 0.0)
    }

    /// The estimate as of the last tick.
    pub fn estimate(&self) -> Estimate {
        self.desk.snapshot().estimator.present()
    }
}
