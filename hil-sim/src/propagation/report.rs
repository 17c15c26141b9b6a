//! What particles tell, beside what the estimator says: for people, and for a picture.

use super::{Propagation, Shape};
use crate::plot::Cloud;
use crate::se2;
use nalgebra::{Matrix3, Vector3};
use std::fmt;
use vehicle_controller::math::wrap;

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
