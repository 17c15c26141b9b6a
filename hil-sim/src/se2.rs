//! The group of plane motions SE(2), and its exponential coordinates, in which the error of a pose that comes from many small errors of its heading is
//! normal where its x and y are not.

use nalgebra::{Matrix3, Vector3};
use vehicle_controller::controller::{self, Estimate};

/// A pose: x, y (m), θ (rad).
pub type Pose = [f64; 3];

/// A⁻¹ B: pose `b` as seen from pose `a`, the angle between −π and π.
#[must_use]
pub fn between(a: Pose, b: Pose) -> Pose {
    let (sin, cos) = a[2].sin_cos();
    let (dx, dy, turned) = (b[0] - a[0], b[1] - a[1], b[2] - a[2]);
    let turned = turned.sin().atan2(turned.cos());
    [dx * cos + dy * sin, dy * cos - dx * sin, turned]
}

/// The motion that a constant twist (m, m, rad) makes in unit time.
#[must_use]
pub fn exp(twist: &Vector3<f64>) -> Pose {
    let angle = twist.z;
    // (sin φ)/φ and (1 − cos φ)/φ.
    let (a, b) = if angle.abs() < 1e-4 {
        (1.0 - angle * angle / 6.0, 0.5 * angle)
    } else {
        (angle.sin() / angle, (1.0 - angle.cos()) / angle)
    };
    [a * twist.x - b * twist.y, b * twist.x + a * twist.y, angle]
}

/// The twist that makes a motion, whose angle is between −π and π.
#[must_use]
pub fn log([x, y, angle]: Pose) -> Vector3<f64> {
    let half = 0.5 * angle;
    // h cot h.
    let a = if half.abs() < 1e-4 {
        1.0 - half * half / 3.0
    } else {
        half / half.tan()
    };
    Vector3::new(a * x + half * y, a * y - half * x, angle)
}

/// Mᵀ C M with M = diag(R(θ), 1): the covariance of a pose's error in the directions of the pose itself.
#[must_use]
pub fn in_body(covariance: &Matrix3<f64>, theta: f64) -> Matrix3<f64> {
    let (sin, cos) = theta.sin_cos();
    let m = Matrix3::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0);
    m.transpose() * covariance * m
}

/// Where an estimate believes to be.
#[must_use]
pub fn pose_of(estimate: &Estimate) -> Pose {
    let controller::Pose { x, y, theta } = estimate.pose;
    [x, y, theta]
}

/// The error of an estimate: ξ = log(P̂⁻¹ P), m, m, rad (theory section 3).
#[must_use]
pub fn error(estimate: &Estimate, truth: Pose) -> Vector3<f64> {
    log(between(pose_of(estimate), truth))
}

/// The normalised squared error of an estimate, ξᵀ (Mᵀ C M)⁻¹ ξ: of χ² with three degrees of freedom, if the estimate is as wrong as it says. None if its
/// covariance is singular.
#[must_use]
pub fn nees(estimate: &Estimate, truth: Pose) -> Option<f64> {
    let covariance = in_body(&estimate.covariance, estimate.pose.theta);
    let xi = error(estimate, truth);
    Some(xi.dot(&covariance.cholesky()?.solve(&xi)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_2, PI};

    #[test]
    fn the_logarithm_undoes_the_exponential() {
        for angle in [-3.0, -1.0, -1e-3, -1e-9, 0.0, 1e-5, 0.3, 3.1] {
            let twist = Vector3::new(0.7, -0.4, angle);
            assert!((log(exp(&twist)) - twist).norm() < 1e-12, "{angle}");
        }
    }

    #[test]
    fn a_quarter_circle() {
        // A path of π/2 m on a circle of 1 m ends beside its centre.
        let [x, y, theta] = exp(&Vector3::new(FRAC_PI_2, 0.0, FRAC_PI_2));
        assert!((x - 1.0).abs() < 1e-15 && (y - 1.0).abs() < 1e-15);
        assert_eq!(theta, FRAC_PI_2);
    }

    #[test]
    fn a_pose_seen_from_another() {
        let [x, y, theta] = between([1.0, 2.0, FRAC_PI_2], [1.0, 5.0, -PI]);
        assert!((x - 3.0).abs() < 1e-15 && y.abs() < 1e-15);
        assert!((theta - FRAC_PI_2).abs() < 1e-15);
    }

    fn at(x: f64, y: f64, theta: f64) -> Estimate {
        let pose = controller::Pose { x, y, theta };
        Estimate {
            pose,
            covariance: Matrix3::from_diagonal(&Vector3::new(0.04, 0.01, 0.25)),
        }
    }

    #[test]
    fn an_arc_is_straight_in_exponential_coordinates() {
        // A quarter of a circle of 2 m to the left, begun at 30°: ξ is its length and its angle.
        let start = FRAC_PI_2 / 3.0;
        let (sin, cos) = start.sin_cos();
        let truth = [
            1.0 + 2.0 * (cos - sin),
            2.0 + 2.0 * (sin + cos),
            start + FRAC_PI_2,
        ];
        let xi = error(&at(1.0, 2.0, start), truth);
        let wanted = Vector3::new(2.0 * FRAC_PI_2, 0.0, FRAC_PI_2);
        assert!((xi - wanted).norm() < 1e-12, "{xi}");
    }

    #[test]
    fn the_error_is_taken_in_the_body_s_frame() {
        // Facing +y: what is ahead lies across the covariance's x. 0.3² of 0.01 and 0.2² of 0.04.
        let mut estimate = at(0.0, 0.0, FRAC_PI_2);
        let nees = nees(&estimate, [0.2, 0.3, FRAC_PI_2]).unwrap();
        assert!((nees - 10.0).abs() < 1e-12, "{nees}");
        estimate.covariance = Matrix3::zeros();
        assert_eq!(super::nees(&estimate, [0.0; 3]), None);
    }

    #[test]
    fn what_lies_across_the_heading_lies_along_y() {
        // Heading north, uncertain to the east.
        let body = in_body(
            &Matrix3::from_diagonal(&Vector3::new(4.0, 1.0, 2.0)),
            FRAC_PI_2,
        );
        let expected = Matrix3::from_diagonal(&Vector3::new(1.0, 4.0, 2.0));
        assert!((body - expected).norm() < 1e-14);
    }
}
