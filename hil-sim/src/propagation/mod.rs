//! The general propagation of p(X) over a journey, by particles: every particle is a base with radii, a wheel base and a steering of its own, drawn from their
//! priors, and makes random errors of its own on the way. It assumes neither that errors are small nor that anything is normal, so the estimator's linear covariance can be
//! held against it.
//!
//! After J. Hermosillo, C. Pradalier, S. Sekhavat, "Modeling Odometry and Uncertainty Propagation for a Bi-steerable Car" (2002), eq. (5): the integral over
//! p(X_{i−1}), p(U) and p(A), with A the gains and U the encoders' readings and the random errors beside them.

mod odometry;
mod report;

use crate::prior::Prior;
use crate::random::Random;
use crate::replay::{Log, replay};
use crate::robot::Robot;
use crate::se2::{self, Pose};
use crate::vehicle::steers;
use anyhow::{Result, ensure};
use nalgebra::{Matrix3, Vector3};
use odometry::{Gains, Moved, Odometry, Reading};
use rayon::prelude::*;
use vehicle_controller::controller::Estimate;
use vehicle_controller::params::{Id, Params};
use vehicle_controller::vehicle::Kind;

/// What the priors of the radii and the base look like; mean and covariance are the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// Normal.
    Gaussian,
    /// As likely anywhere within √3 standard deviations.
    Uniform,
}

/// What to do.
#[derive(Clone, Copy, Debug)]
pub struct Plan {
    /// How many particles.
    pub particles: usize,
    /// The prior.
    pub shape: Shape,
    /// Where the random numbers begin.
    pub seed: u64,
}

/// So many particles have random numbers of their own, so that what comes of it does not depend on how many run at once.
const FLOCK: usize = 1000;
/// So many are kept to be drawn.
const DRAWN: usize = 800;
/// A step of the particles: the circumference of a wheel moves this far, m; or a synchro drive turns so far, rad. Over so little, any
/// motion is an arc.
const STEP: f64 = 0.02;

/// What the wheels did in a step.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Step {
    /// By the nominal numbers.
    reading: Reading,
    /// Total variation of S, m.
    way: f64,
    /// Standard deviations of the random errors of ΔS (m), Δα (rad) and φ (rad).
    random: [f64; 3],
}

/// What came of it.
#[derive(Clone, Debug)]
pub struct Propagation {
    /// The log's name.
    pub name: String,
    /// The plan.
    pub plan: Plan,
    /// Length of the path, m.
    pub way: f64,
    /// The estimator's.
    pub linear: Estimate,
    /// Mean of the particles: x, y (m), θ (rad).
    pub mean: Vector3<f64>,
    /// Their covariance.
    pub covariance: Matrix3<f64>,
    /// The covariance of ξ = log(P̂⁻¹ P), with P̂ the linear estimate.
    pub exponential: Matrix3<f64>,
    /// Some of them, as seen from the linear estimate.
    seen: Vec<Pose>,
}

/// The shadow that a value drags along once it is more than a count away: its total variation is that of the motion, without the flicker of counts (theory
/// section 3).
#[derive(Clone, Copy, Debug, Default)]
struct Shadow(f64);

impl Shadow {
    /// How far the value drags it.
    fn follow(&mut self, value: f64, reach: f64) -> f64 {
        let before = self.0;
        self.0 = before.clamp(value - reach, value + reach);
        (self.0 - before).abs()
    }
}

/// The random part: variances per way and per angle.
#[derive(Clone, Copy, Debug)]
struct Noise {
    /// κ_S, m²/m.
    translation: f64,
    /// κ_drift, rad²/m.
    drift: f64,
    /// κ_rot, rad²/rad.
    rotation: f64,
    /// κ_steer, rad² m.
    steering: f64,
}

impl Noise {
    fn of(params: &Params) -> Self {
        let get = |id| f64::from(params.get(id));
        let degree = 1.0_f64.to_radians();
        Self {
            translation: get(Id::NoiseS),
            drift: get(Id::NoiseDrift) * degree * degree,
            rotation: get(Id::NoiseRot) * degree,
            steering: if steers(params.vehicle()) {
                get(Id::NoiseSteer) * degree * degree
            } else {
                0.0
            },
        }
    }

    /// Standard deviations of ΔS, Δα and φ for these variations: over the way of a step, an error of φ that is white along it has the variance κ_steer/way.
    fn deviations(&self, way: f64, turning: f64, steered: f64) -> [f64; 3] {
        let [s, alpha] = [
            self.translation * way,
            self.drift * way + self.rotation * turning,
        ];
        let phi = if steered > 0.0 {
            self.steering / steered
        } else {
            0.0
        };
        [s, alpha, phi].map(f64::sqrt)
    }
}

/// The steps of a log, for a base with these gains.
fn steps(log: &Log, odometry: &Odometry, gains: &Gains, noise: &Noise) -> Vec<Step> {
    let [metre, radian] = odometry.resolution();
    let (mut s, mut alpha) = (0.0, 0.0);
    let (mut s_shadow, mut alpha_shadow) = (Shadow::default(), Shadow::default());
    let mut steps = Vec::new();
    let (mut sum, mut way, mut turning) = (Reading::default(), 0.0, 0.0);
    // The steering of a step is that of its rows, each by how far it goes.
    let (mut weighed, mut weight, mut turned) = (0.0, 0.0, 0.0);
    let mut rows = log.rows().iter().skip(1).peekable();
    while let Some(row) = rows.next() {
        let reading = odometry.reading(row);
        let Moved { ahead, turned: by } = odometry.moved(&reading, gains, 0.0);
        s += ahead;
        alpha += by;
        turned += by;
        for (sum, more) in sum.rolled.iter_mut().zip(reading.rolled) {
            *sum += more;
        }
        for (sum, more) in sum.front.iter_mut().zip(reading.front) {
            *sum += more;
        }
        let rolled = reading.rolled[0].abs() + reading.rolled[1].abs();
        weighed += rolled * reading.steer;
        weight += rolled;
        way += s_shadow.follow(s, metre);
        turning += alpha_shadow.follow(alpha, radian);
        let is_full = sum.rolled.iter().any(|rolled| rolled.abs() >= STEP);
        if rows.peek().is_none() || is_full {
            sum.steer = if weight > 0.0 { weighed / weight } else { 0.0 };
            steps.push(Step {
                reading: sum,
                way,
                random: noise.deviations(way, turning, odometry.steered_way(way, turned)),
            });
            (sum, way, turning) = (Reading::default(), 0.0, 0.0);
            (weighed, weight, turned) = (0.0, 0.0, 0.0);
        }
    }
    steps
}

/// Sums over errors, and over their products.
#[derive(Clone, Copy, Debug, Default)]
struct Moments {
    first: Vector3<f64>,
    second: Matrix3<f64>,
}

impl Moments {
    fn add(&mut self, error: Vector3<f64>) {
        self.first += error;
        self.second += error * error.transpose();
    }

    fn merge(&mut self, other: &Self) {
        self.first += other.first;
        self.second += other.second;
    }

    /// Mean and covariance of so many.
    fn of(&self, count: f64) -> (Vector3<f64>, Matrix3<f64>) {
        let mean = self.first / count;
        let rest = self.second - mean * mean.transpose() * count;
        (mean, rest / (count - 1.0))
    }
}

/// Some particles together: their errors against the linear estimate, in differences and in exponential coordinates.
#[derive(Clone, Debug, Default)]
struct Flock {
    differences: Moments,
    exponential: Moments,
    seen: Vec<Pose>,
}

/// What all particles have in common.
struct Journey<'a> {
    steps: &'a [Step],
    start: Pose,
    prior: Prior,
    odometry: Odometry,
    /// So many gains are drawn.
    gains: usize,
    /// The steering is uncertain, step by step.
    skews: bool,
}

impl Journey<'_> {
    fn travel(&self, random: &mut Random, shape: Shape) -> Pose {
        let mut errors = [0.0; 4];
        for error in errors.iter_mut().take(self.gains) {
            *error = match shape {
                Shape::Gaussian => random.normal(),
                Shape::Uniform => random.uniform(),
            };
        }
        let gains: Gains = self.prior.sample(errors).into();
        let [mut x, mut y, mut theta] = self.start;
        for step in self.steps {
            let slip = step.random[0] * random.normal();
            let skid = step.random[1] * random.normal();
            let skew = if self.skews {
                step.random[2] * random.normal()
            } else {
                0.0
            };
            let moved = self.odometry.moved(&step.reading, &gains, skew);
            let half = 0.5 * (moved.turned + skid);
            // The chord of the arc; half an angle of some degrees needs no more of the series.
            let h = half * half;
            let chord = (moved.ahead + slip) * (1.0 - h / 6.0 * (1.0 - h / 20.0));
            let (sin, cos) = (theta + half).sin_cos();
            x += chord * cos;
            y += chord * sin;
            theta += 2.0 * half;
        }
        [x, y, theta]
    }
}

/// Sends particles along a log, beside the estimator; tells `progress` of those that have arrived.
///
/// # Errors
/// If there are too few particles, or the log does not tell how a vehicle was steered that steers.
pub fn propagate(
    log: &Log,
    robot: &Robot,
    plan: Plan,
    progress: &(dyn Fn(u64) + Sync),
) -> Result<Propagation> {
    ensure!(
        (100..=100_000_000).contains(&plan.particles),
        "from a hundred particles to a hundred million"
    );
    let params = &robot.params;
    let odometry = Odometry::of(params);
    log.check(params.vehicle())?;
    let linear = *replay(log, robot, params)?.last();
    let (prior, noise) = (Prior::of(params), Noise::of(params));
    let steps = steps(log, &odometry, &prior.gains.into(), &noise);
    let journey = Journey {
        steps: &steps,
        start: log.start(),
        prior,
        odometry,
        gains: match params.vehicle() {
            Kind::Differential => 3,
            _ => 4,
        },
        skews: noise.steering > 0.0,
    };
    let (pose, flocks) = (linear.pose, plan.particles.div_ceil(FLOCK));
    let drawn = DRAWN.div_ceil(flocks);
    let sums: Vec<Flock> = (0..flocks)
        .into_par_iter()
        .map(|index| {
            let mut random = Random::new(plan.seed, index as u64);
            let members = FLOCK.min(plan.particles - index * FLOCK);
            let mut flock = Flock::default();
            for member in 0..members {
                let [x, y, theta] = journey.travel(&mut random, plan.shape);
                // Unwrapped: a heading that is wrong by more than half a turn is just that.
                let error = Vector3::new(x - pose.x, y - pose.y, theta - pose.theta);
                flock.differences.add(error);
                let apart = se2::between([pose.x, pose.y, pose.theta], [x, y, theta]);
                flock.exponential.add(se2::log(apart));
                if member < drawn {
                    flock.seen.push(apart);
                }
            }
            progress(members as u64);
            flock
        })
        .collect();
    let count = plan.particles as f64;
    let mut all = Flock::default();
    for flock in sums {
        all.differences.merge(&flock.differences);
        all.exponential.merge(&flock.exponential);
        all.seen.extend(flock.seen);
    }
    let (bias, covariance) = all.differences.of(count);
    let (_, exponential) = all.exponential.of(count);
    Ok(Propagation {
        name: log.name.clone(),
        plan,
        way: steps.iter().map(|step| step.way).sum(),
        linear,
        mean: Vector3::new(pose.x, pose.y, pose.theta) + bias,
        covariance,
        exponential,
        seen: all.seen,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shadow_leaves_flicker_out() {
        let mut shadow = Shadow::default();
        let mut total = 0.0;
        for k in 0..100 {
            total += shadow.follow(f64::from(k % 2), 1.0);
        }
        assert_eq!(total, 0.0);
        for k in 0..=10 {
            total += shadow.follow(-f64::from(k), 1.0);
        }
        assert_eq!(total, 9.0);
    }
}
