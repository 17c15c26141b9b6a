//! What must hold after every tick.

use vehicle_controller::controller::{Estimate, Snapshot};
use vehicle_controller::supervisor::{Fault, Reaction};

/// Every number is finite, duties are duties, and a fault that switches off has done so.
///
/// # Panics
/// If not.
pub fn check(snapshot: &Snapshot) {
    let [left, right] = &snapshot.wheels;
    // One sum: it is finite only if all of it is. f64 holds the sum of any f32 there are.
    let sum: f64 = [&snapshot.translation, &snapshot.rotation]
        .into_iter()
        .map(|axis| {
            axis.displacement.to_f64()
                + f64::from(axis.error)
                + f64::from(axis.speed)
                + f64::from(axis.reference_speed)
                + f64::from(axis.acceleration)
        })
        .chain([left, right].map(|wheel| f64::from(wheel.speed) + f64::from(wheel.duty)))
        .chain(snapshot.currents.iter().flatten().map(|a| f64::from(*a)))
        .sum();
    assert!(
        sum.is_finite() && snapshot.supply.is_finite(),
        "not finite: {snapshot:?}"
    );
    for wheel in [left, right] {
        assert!(wheel.duty.abs() <= 1.0, "{snapshot:?}");
    }
    let reaction = snapshot.fault.map(Fault::reaction);
    if reaction == Some(Reaction::Off) {
        assert!(
            left.duty == 0.0 && right.duty == 0.0,
            "a fault, and the motors are on: {snapshot:?}"
        );
    }
}

/// Pose and covariance are finite, and the covariance is one: symmetric, positive semi-definite but for rounding.
///
/// # Panics
/// If not.
pub fn check_estimate(estimate: &Estimate) {
    let (pose, c) = (&estimate.pose, &estimate.covariance);
    assert!(
        (pose.x + pose.y + pose.theta).is_finite() && c.iter().all(|e| e.is_finite()),
        "not finite: {estimate:?}"
    );
    assert!(
        is_positive([c.m11, c.m12, c.m13, c.m22, c.m23, c.m33], 1e-5)
            && c.m12 == c.m21
            && c.m13 == c.m31
            && c.m23 == c.m32,
        "no covariance: {estimate:?}"
    );
}

/// True if all principal minors of a symmetric matrix (its upper triangle), scaled to a correlation matrix, are above −`tolerance`.
pub fn is_positive([xx, xy, xt, yy, yt, tt]: [f64; 6], tolerance: f64) -> bool {
    if xx < 0.0 || yy < 0.0 || tt < 0.0 {
        return false;
    }
    let correlation = |c: f64, a: f64, b: f64| {
        let scale = a.sqrt() * b.sqrt();
        match (c == 0.0, scale > 0.0) {
            (true, _) => Some(0.0),
            (false, true) => Some(c / scale),
            // What does not vary does not vary with anything.
            (false, false) => None,
        }
    };
    let (Some(a), Some(b), Some(c)) = (
        correlation(xy, xx, yy),
        correlation(xt, xx, tt),
        correlation(yt, yy, tt),
    ) else {
        return false;
    };
    let minor = |r: f64| 1.0 - r * r >= -tolerance;
    let determinant = 1.0 + 2.0 * a * b * c - a * a - b * b - c * c;
    // Without a variance a row and column of zeros: the minors that are left say it all.
    let whole = xx == 0.0 || yy == 0.0 || tt == 0.0 || determinant >= -tolerance;
    minor(a) && minor(b) && minor(c) && whole
}
