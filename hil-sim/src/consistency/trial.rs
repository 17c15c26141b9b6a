//! One run: a base that is not what its controller believes, and what the controller makes of it.

use super::Plan;
use super::world::{Drawing, World};
use crate::peripherals::Harness;
use crate::prior::Prior;
use crate::random::Random;
use crate::robot::Robot;
use crate::se2::{self, Pose, pose_of};
use crate::vehicle::{Desk, Vehicle, vehicle};
use anyhow::{Result, anyhow};
use nalgebra::{Matrix3, Vector3};
use vehicle_controller::controller::{
    self, Controller, CorrectionError, Estimate, Inputs, Interface, Observation, Refusal,
};
use vehicle_controller::math::wrap;
use vehicle_controller::params::Id;
use vehicle_controller::time::{self, Duration, Instant};
use vehicle_controller::vehicle::GAINS;

/// How wrong an estimate is, and how wrong it says it may be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Check {
    /// When, in ticks: what was checked at the same one belongs together, also where some runs have nothing to check.
    pub tick: u64,
    /// The same, s.
    pub time: f64,
    /// [`se2::nees`].
    pub nees: f64,
    /// The same of the differences of x, y and θ.
    pub cartesian: f64,
}

/// A fix that was offered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fix {
    /// Its innovation in units of what it should be, in the base's own directions: three independent numbers of variance 1, if all is right.
    pub innovation: Vector3<f64>,
    /// What became of it.
    pub outcome: Outcome,
}

/// What the controller made of a fix.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Outcome {
    /// It was taken; d², as the filter has it.
    Taken(f64),
    /// It lay beyond the gate.
    Gate,
    /// A gain would have been beyond what any vehicle can have.
    Gains,
}

/// A run.
#[derive(Clone, Debug)]
pub struct Trial {
    /// Before each fix; without fixes, every second.
    pub before: Vec<Check>,
    /// After each fix that was taken.
    pub after: Vec<Check>,
    /// The fixes, taken or not.
    pub fixes: Vec<Fix>,
    /// The true pose at the end as seen from the estimated one, m, m, rad.
    pub miss: Pose,
    /// Mᵀ C M at the end.
    pub covariance: Matrix3<f64>,
    /// Estimated minus true gains at the end: right, left, base …
    pub gain_errors: Vector3<f64>,
    /// … and the standard deviations that the filter gives them.
    pub gain_deviations: Vector3<f64>,
}

/// The path of theory section 6: speeds in m/s and rad/s.
fn wanted(t: f64) -> (f64, f64) {
    (0.4 + 0.1 * (0.3 * t).sin(), 0.15 + 0.8 * (0.21 * t).sin())
}

/// The controller on the wires of a base.
struct Post {
    harness: Harness,
    controller: Controller<Vehicle>,
    desk: Desk,
    now: Instant,
    period: Duration,
}

impl Post {
    fn new(robot: &Robot, plan: &Plan, counts: [i64; 2]) -> Result<Self> {
        let harness = Harness::default();
        for (wires, count) in harness.wheels.iter().zip(counts) {
            wires.edges.set(count);
        }
        let vehicle = vehicle(&harness, robot, &robot.params)?;
        let mut controller = Controller::new(vehicle, robot.params.build(plan.period), None);
        let now = Instant::from_ticks(0);
        controller.tick(now, &Inputs::default());
        let mut desk = Interface::new(controller.snapshot(), robot.params.limits());
        desk.learn(plan.learns);
        Ok(Self {
            harness,
            controller,
            desk,
            now,
            period: plan.period,
        })
    }

    fn tick(&mut self, counts: [i64; 2]) {
        for (wires, count) in self.harness.wheels.iter().zip(counts) {
            wires.edges.set(count);
        }
        self.now = time::after(self.now, self.period);
        self.controller.tick(self.now, &Inputs::default());
        self.desk.update(self.controller.snapshot());
        while self.desk.work() {}
    }

    fn estimate(&self) -> Estimate {
        self.desk.snapshot().estimator.present()
    }

    /// The next tick corrects.
    fn observe(&mut self, fix: Pose, covariance: Matrix3<f64>, gate: f32) -> Result<Outcome> {
        let [x, y, theta] = fix;
        let observation = Observation::Pose {
            pose: controller::Pose { x, y, theta },
            covariance,
        };
        let outcome = match self.desk.observe(&observation, 0.0, gate) {
            Ok(distance) => Outcome::Taken(f64::from(distance)),
            Err(Refusal::Correction(CorrectionError::Gate(_))) => Outcome::Gate,
            Err(Refusal::Correction(CorrectionError::Gains)) => Outcome::Gains,
            Err(Refusal::Correction(why)) => return Err(anyhow!("a fix was refused: {why}")),
            Err(refusal) => return Err(anyhow!("a fix was refused: {refusal}")),
        };
        if let Some(request) = self.desk.take_request() {
            self.controller
                .request(request)
                .map_err(|_| anyhow!("the controller takes no request"))?;
        }
        Ok(outcome)
    }
}

/// Runs run number `index` of a plan: a controller with the parameters of `robot` on a base that is drawn from those of `bases`.
pub fn run(plan: &Plan, robot: &Robot, bases: &Robot, index: u64) -> Result<Trial> {
    // What is drawn once, what happens under way and what the fixes are do not depend on each other: with fixes and without, it is the same journey.
    let mut draws = Random::new(plan.seed, 3 * index);
    let prior = Prior::of(&bases.params);
    let errors = [draws.normal(), draws.normal(), draws.normal(), 0.0];
    let [right, left, base, _]: [f64; 4] = prior.sample(errors).into();
    let gains = [right, left, base];
    let drawing = Drawing::of(&bases.params);
    let mut world = World::new(drawing, gains, Random::new(plan.seed, 3 * index + 1));
    let mut sight = Random::new(plan.seed, 3 * index + 2);
    let mut post = Post::new(robot, plan, world.counts())?;

    let dt = plan.period.ticks() as f64 * 1e-6;
    let ticks = |seconds: f64| (seconds / dt).round().max(1.0) as u64;
    let (length, every) = (ticks(plan.seconds), ticks(plan.fix_every.unwrap_or(1.0)));
    let gate = robot.params.get(Id::Gate);
    let mut trial = Trial {
        before: Vec::new(),
        after: Vec::new(),
        fixes: Vec::new(),
        miss: [0.0; 3],
        covariance: Matrix3::zeros(),
        gain_errors: Vector3::zeros(),
        gain_deviations: Vector3::zeros(),
    };
    let mut corrected = false;
    for tick in 1..=length {
        let (speed, turn_speed) = wanted((tick as f64 - 0.5) * dt);
        world.drive(speed, turn_speed, dt);
        post.tick(world.counts());
        if std::mem::take(&mut corrected) {
            trial.after.push(check(tick, dt, &world, &post)?);
        }
        if tick.is_multiple_of(every) {
            trial.before.push(check(tick, dt, &world, &post)?);
            // The last one would have no time to tell.
            if plan.fix_every.is_some() && tick < length {
                let fix = fix(plan, world.pose(), &mut sight);
                let (pose, r) = fix;
                let innovation = whitened(&post.estimate(), pose, &r)?;
                let outcome = post.observe(pose, r, gate)?;
                corrected = matches!(outcome, Outcome::Taken(_));
                trial.fixes.push(Fix {
                    innovation,
                    outcome,
                });
            }
        }
    }
    let estimate = post.estimate();
    trial.miss = se2::between(pose_of(&estimate), world.pose());
    trial.covariance = se2::in_body(&estimate.covariance, estimate.pose.theta);
    let calibration = post.desk.calibration();
    let of_wheels_and_base =
        |[right, left, base, ..]: [f32; GAINS]| Vector3::new(right, left, base).map(f64::from);
    trial.gain_errors = of_wheels_and_base(calibration.gains) - Vector3::from(gains);
    trial.gain_deviations = of_wheels_and_base(calibration.spread.deviations());
    Ok(trial)
}

fn check(tick: u64, dt: f64, world: &World, post: &Post) -> Result<Check> {
    let estimate = post.estimate();
    let (is, believed) = (world.pose(), pose_of(&estimate));
    let apart = Vector3::new(
        is[0] - believed[0],
        is[1] - believed[1],
        wrap(is[2] - believed[2]),
    );
    Ok(Check {
        tick,
        time: tick as f64 * dt,
        nees: se2::nees(&estimate, is).ok_or_else(exact)?,
        cartesian: white(&apart, &estimate.covariance)?.norm_squared(),
    })
}

fn exact() -> anyhow::Error {
    anyhow!("the estimate claims to be exact: there is nothing to compare its errors with")
}

/// L⁻¹ v with L Lᵀ = C.
fn white(v: &Vector3<f64>, covariance: &Matrix3<f64>) -> Result<Vector3<f64>> {
    covariance
        .cholesky()
        .and_then(|root| root.l().solve_lower_triangular(v))
        .ok_or_else(exact)
}

/// A measurement of the pose, and its covariance.
fn fix(plan: &Plan, pose: Pose, sight: &mut Random) -> (Pose, Matrix3<f64>) {
    let [along, angle] = plan.fix_deviations;
    let deviations = [along, along, angle];
    let mut seen = pose;
    for (number, deviation) in seen.iter_mut().zip(deviations) {
        *number += deviation * sight.normal();
    }
    let variances = Vector3::from(deviations.map(|deviation| deviation * deviation));
    (seen, Matrix3::from_diagonal(&variances))
}

fn whitened(estimate: &Estimate, seen: Pose, r: &Matrix3<f64>) -> Result<Vector3<f64>> {
    let believed = pose_of(estimate);
    // Turned only: with the chord's length, not the arc's, it is what the filter takes.
    let ahead = se2::between(believed, seen);
    let s = se2::in_body(&(estimate.covariance + r), believed[2]);
    white(&Vector3::from(ahead), &s)
}
