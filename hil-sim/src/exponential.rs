//! Errors of a pose in exponential coordinates (theory section 3): over a long run the position error is banana-shaped, and there it is an ellipse.

use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};
use vehicle_controller::controller::Estimate;
use vehicle_controller::math::wrap;

/// The 99 % quantile of χ² with three degrees of freedom.
pub const REGION_99: f64 = 11.344_866_730_144_37;

/// ξ = log(P̂⁻¹ P) on SE(2): m, m, rad.
#[must_use]
pub fn error(estimate: &Estimate, [x, y, theta]: [f64; 3]) -> Vector3<f64> {
    let pose = &estimate.pose;
    let turned = wrap(theta - pose.theta);
    let (sin, cos) = pose.theta.sin_cos();
    let (dx, dy) = (x - pose.x, y - pose.y);
    let ahead = Vector2::new(dx * cos + dy * sin, dy * cos - dx * sin);
    // V⁻¹ of the translation, by half angles: (φ/2) cot(φ/2) on the diagonal, ± φ/2 beside it.
    let half = 0.5 * turned;
    let diagonal = if half.abs() < 1e-6 {
        1.0 - half * half / 3.0
    } else {
        half / half.tan()
    };
    let along = Matrix2::new(diagonal, half, -half, diagonal) * ahead;
    Vector3::new(along.x, along.y, turned)
}

/// The squared Mahalanobis distance ξᵀ (Mᵀ C M)⁻¹ ξ with M = diag(R(θ̂), 1); none if the covariance is singular.
#[must_use]
pub fn distance(estimate: &Estimate, truth: [f64; 3]) -> Option<f64> {
    let (sin, cos) = estimate.pose.theta.sin_cos();
    let m = Matrix3::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0);
    let covariance = m.transpose() * estimate.covariance * m;
    let xi = error(estimate, truth);
    Some(xi.dot(&(covariance.try_inverse()? * xi)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use vehicle_controller::controller::Pose;

    fn at(x: f64, y: f64, theta: f64) -> Estimate {
        Estimate {
            pose: Pose { x, y, theta },
            covariance: Matrix3::from_diagonal(&Vector3::new(0.04, 0.01, 0.25)),
        }
    }

    #[test]
    fn an_arc_is_straight_in_exponential_coordinates() {
        // A quarter of a circle of 2 m to the left, begun at 30°: ξ is its length and its angle.
        let (start, quarter) = (0.5_f64, std::f64::consts::FRAC_PI_2);
        let turned = |dx: f64, dy: f64| {
            let (sin, cos) = start.sin_cos();
            [1.0 + dx * cos - dy * sin, 2.0 + dx * sin + dy * cos]
        };
        let [x, y] = turned(2.0, 2.0);
        let xi = error(&at(1.0, 2.0, start), [x, y, start + quarter]);
        let wanted = Vector3::new(2.0 * quarter, 0.0, quarter);
        assert!((xi - wanted).norm() < 1e-12, "{xi}");
    }

    #[test]
    fn the_distance_is_taken_in_the_body_s_frame() {
        // Facing +y: what is ahead lies across the covariance's x. 3² of 0.01 and 1² of 0.04.
        let quarter = std::f64::consts::FRAC_PI_2;
        let distance = distance(&at(0.0, 0.0, quarter), [0.2, 0.3, quarter]).unwrap();
        assert!((distance - 10.0).abs() < 1e-12, "{distance}");
        let mut singular = at(0.0, 0.0, 0.0);
        singular.covariance = Matrix3::zeros();
        assert_eq!(super::distance(&singular, [0.0; 3]), None);
    }
}
