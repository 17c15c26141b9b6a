//! The general propagation of p(X) over a journey, by particles: every particle is a base with radii and a wheel base of its own, drawn from their priors, and
//! makes random errors of its own on the way. It assumes neither that errors are small nor that anything is normal, so the estimator's linear covariance can be
//! held against it.
//!
//! After J. Hermosillo, C. Pradalier, S. Sekhavat, "Modeling Odometry and Uncertainty Propagation for a Bi-steerable Car" (2002), eq. (5): the integral over
//! p(X_{i−1}), p(U) and p(A), with A the gains and U the encoders' readings and the random errors beside them.

use crate::plot::Cloud;
use crate::prior::Prior;
use crate::random::Random;
use crate::replay::{Log, replay};
use crate::robot::Robot;
use crate::se2::{self, Pose};
use anyhow::{Result, ensure};
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;
use std::f64::consts::PI;
use std::fmt;
use vehicle_controller::controller::Estimate;
use vehicle_controller::math::wrap;
use vehicle_controller::params::{Id, Params};

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
/// A step of the particles: the circumference of a wheel moves this far, m. Over so little, any motion is an arc.
const STEP: f64 = 0.02;

/// What the wheels did in a step.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Step {
    /// Right, left: m by the nominal radii.
    rolled: [f64; 2],
    /// Total variation of S, m.
    way: f64,
    /// Standard deviations of the random errors of ΔS (m) and Δα (rad).
    random: [f64; 2],
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
}

impl Noise {
    fn of(params: &Params) -> Self {
        let get = |id| f64::from(params.get(id));
        let degree = 1.0_f64.to_radians();
        Self {
            translation: get(Id::NoiseS),
            drift: get(Id::NoiseDrift) * degree * degree,
            rotation: get(Id::NoiseRot) * degree,
        }
    }

    /// Standard deviations of ΔS and Δα for these variations.
    fn deviations(&self, way: f64, turning: f64) -> [f64; 2] {
        let [s, alpha] = [
            self.translation * way,
            self.drift * way + self.rotation * turning,
        ];
        [s.sqrt(), alpha.sqrt()]
    }
}

/// The steps of a log, for a base as its drawings have it.
fn steps(log: &Log, params: &Params) -> Vec<Step> {
    let get = |id| f64::from(params.get(id));
    let per_count = |diameter| PI * get(diameter) / get(Id::CountsPerTurn);
    let (right, left) = (per_count(Id::RightDiameter), per_count(Id::LeftDiameter));
    let base = get(Id::WheelBase);
    let count = right.max(left);
    let (mut s, mut alpha) = (0.0, 0.0);
    let (mut s_shadow, mut alpha_shadow) = (Shadow::default(), Shadow::default());
    let noise = Noise::of(params);
    let mut steps = Vec::new();
    let (mut rolled, mut way, mut turning) = ([0.0; 2], 0.0, 0.0);
    let mut counts = log.counts().peekable();
    while let Some([left_counts, right_counts]) = counts.next() {
        let moved = [right_counts as f64 * right, left_counts as f64 * left];
        s += 0.5 * (moved[0] + moved[1]);
        alpha += (moved[0] - moved[1]) / base;
        rolled = [rolled[0] + moved[0], rolled[1] + moved[1]];
        way += s_shadow.follow(s, count);
        turning += alpha_shadow.follow(alpha, count / base);
        if counts.peek().is_none() || rolled.iter().any(|rolled| rolled.abs() >= STEP) {
            steps.push(Step {
                rolled,
                way,
                random: noise.deviations(way, turning),
            });
            (rolled, way, turning) = ([0.0; 2], 0.0, 0.0);
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
    /// w, m.
    base: f64,
}

impl Journey<'_> {
    fn travel(&self, random: &mut Random, shape: Shape) -> Pose {
        let mut draw = || match shape {
            Shape::Gaussian => random.normal(),
            Shape::Uniform => random.uniform(),
        };
        let errors = [draw(), draw(), draw()];
        let [k_right, k_left, k_base]: [f64; 3] = self.prior.sample(errors).into();
        let base = k_base * self.base;
        let [mut x, mut y, mut theta] = self.start;
        for step in self.steps {
            let (right, left) = (k_right * step.rolled[0], k_left * step.rolled[1]);
            let slip = step.random[0] * random.normal();
            let skid = step.random[1] * random.normal();
            let ahead = 0.5 * (right + left) + slip;
            let half = 0.5 * ((right - left) / base + skid);
            // The chord of the arc; half an angle of some degrees needs no more of the series.
            let h = half * half;
            let chord = ahead * (1.0 - h / 6.0 * (1.0 - h / 20.0));
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
/// If there are too few particles.
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
    let linear = *replay(log, robot, params)?.last();
    let steps = steps(log, params);
    let journey = Journey {
        steps: &steps,
        start: log.start(),
        prior: Prior::of(params),
        base: f64::from(params.get(Id::WheelBase)),
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

fn largest_difference(a: &Matrix3<f64>, b: &Matrix3<f64>) -> f64 {
    let scale = b
        .diagonal()
        .map(|variance| 1.0 / variance.max(f64::MIN_POSITIVE).sqrt());
    (a - b)
        .component_mul(&(scale * scale.transpose()))
        .abs()
        .max()
}

impl Propagation {
    /// The largest element of the difference of the covariances, particles' minus linear, in units of √(C_ii C_jj) of the linear one.
    #[must_use]
    pub fn difference(&self) -> f64 {
        largest_difference(&self.covariance, &self.linear.covariance)
    }

    /// The same in exponential coordinates.
    #[must_use]
    pub fn exponential_difference(&self) -> f64 {
        let linear = se2::in_body(&self.linear.covariance, self.linear.pose.theta);
        largest_difference(&self.exponential, &linear)
    }

    /// What the plot wants to know.
    #[must_use]
    pub fn cloud(&self) -> Cloud {
        let pose = self.linear.pose;
        let shift = se2::between(
            [pose.x, pose.y, pose.theta],
            [self.mean.x, self.mean.y, self.mean.z],
        );
        Cloud {
            points: self.seen.iter().map(|[x, y, _]| [*x, *y]).collect(),
            points_name: "particles".into(),
            covariance: se2::in_body(&self.linear.covariance, pose.theta),
            other: Some((
                [shift[0], shift[1]],
                se2::in_body(&self.covariance, pose.theta),
                "95 % ellipse of the particles' covariance".into(),
            )),
            over_time: None,
        }
    }
}

/// A part of nothing is `none`.
fn over(part: f64, whole: f64, none: f64) -> f64 {
    if whole > 0.0 { part / whole } else { none }
}

impl fmt::Display for Propagation {
    /// For people.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let degree = f64::to_degrees(1.0);
        writeln!(
            f,
            "{}: {:.2} m, {} particles, {} priors, seed {}",
            self.name,
            self.way,
            self.plan.particles,
            match self.plan.shape {
                Shape::Gaussian => "gaussian",
                Shape::Uniform => "uniform",
            },
            self.plan.seed
        )?;
        let pose = self.linear.pose;
        let means = [
            ("linear", Vector3::new(pose.x, pose.y, pose.theta)),
            ("particles", self.mean),
        ];
        for (name, mean) in means {
            writeln!(
                f,
                "  {name:<10} mean        x {:.4} m  y {:.4} m  theta {:.3} deg",
                mean.x,
                mean.y,
                wrap(mean.z) * degree
            )?;
        }
        for (name, c) in [
            ("linear", &self.linear.covariance),
            ("particles", &self.covariance),
        ] {
            writeln!(
                f,
                "  {name:<10} deviations  x {:.4} m  y {:.4} m  theta {:.3} deg   correlations  xy {:.4}  xt {:.4}  yt {:.4}",
                c.m11.sqrt(),
                c.m22.sqrt(),
                c.m33.sqrt() * degree,
                over(c.m12, (c.m11 * c.m22).sqrt(), 0.0),
                over(c.m13, (c.m11 * c.m33).sqrt(), 0.0),
                over(c.m23, (c.m22 * c.m33).sqrt(), 0.0),
            )?;
        }
        let ratio = self
            .covariance
            .zip_map(&self.linear.covariance, |is, linear| over(is, linear, 1.0));
        writeln!(
            f,
            "  variances, particles' over linear   x {:.4}  y {:.4}  theta {:.4}",
            ratio.m11, ratio.m22, ratio.m33,
        )?;
        writeln!(
            f,
            "  covariances differ by {:.2} % at most, in exponential coordinates by {:.2} %",
            100.0 * self.difference(),
            100.0 * self.exponential_difference()
        )
    }
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
