//! The little mathematics that everything above needs: angles, trigonometry, exact sums, small matrices.
//!
//! Nothing here allocates, panics or reads anything but its arguments.

mod covariance;
mod matrix;
mod split;
mod sum;
mod trigonometry;

pub use covariance::{
    Asymmetric, NotPositive, is_finite, nearest_positive, positive_part, symmetric, transported,
    upper_triangle, written_covariance,
};
pub use matrix::{
    add_outer, along, applied, inner, product, product_transposed, scaled, sum, symmetric_part,
};
pub use split::Split;
pub use sum::{Factor, Sum};
pub use trigonometry::{reduced, sin_cos, sinc, sinc_cosc};

use core::f64::consts::{PI, TAU};

/// Square root, f32. Zero for a negative argument or NaN: callers pass squares and variances, where either is rounding.
#[must_use]
pub fn sqrt(x: f32) -> f32 {
    if x > 0.0 { libm::sqrtf(x) } else { 0.0 }
}

/// `x` limited to `-limit ..= limit`; a NaN becomes 0. (`f32::clamp` would panic on a NaN limit.)
#[inline]
#[must_use]
pub fn limit(x: f32, limit: f32) -> f32 {
    // One comparison for what is mostly so.
    if x.abs() <= limit {
        return x;
    }
    // Comparisons: `min` and `max` are function calls on the target.
    if x > limit {
        limit
    } else if x < -limit {
        -limit
    } else if x.is_nan() {
        0.0
    } else {
        x
    }
}

/// 1 or −1; 1 for zero and for NaN.
#[must_use]
pub fn sign(x: f32) -> f32 {
    if x < 0.0 { -1.0 } else { 1.0 }
}

/// The smaller one; `b` if one is NaN. (`f32::min` is a function call on the target.)
#[must_use]
pub fn smaller(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// The larger one; `b` if one is NaN. (`f32::max` is a function call on the target.)
#[must_use]
pub fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// Wraps an angle in radians to (−π, π].
///
/// ```
/// use core::f64::consts::PI;
/// use vehicle_controller::math::wrap;
/// assert_eq!(wrap(PI), PI);
/// assert_eq!(wrap(-PI), PI);
/// assert!((wrap(7.0) - (7.0 - 2.0 * PI)).abs() < 1e-15);
/// ```
#[must_use]
pub fn wrap(angle: f64) -> f64 {
    if angle > -PI && angle <= PI {
        return angle;
    }
    let wrapped = angle - TAU * libm::ceil((angle - PI) / TAU);
    // The division rounds: at a boundary the result may sit one turn off.
    if wrapped > PI {
        wrapped - TAU
    } else if wrapped <= -PI {
        wrapped + TAU
    } else {
        wrapped
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn wrapped_angle_is_in_range_and_congruent(angle in -1e6..1e6f64) {
            let wrapped = wrap(angle);
            prop_assert!(wrapped > -PI && wrapped <= PI);
            let turns = (angle - wrapped) / TAU;
            prop_assert!((turns - libm::round(turns)).abs() < 1e-9);
        }
    }

    #[test]
    fn limit_survives_anything() {
        assert_eq!(limit(f32::NAN, 1.0), 0.0);
        assert_eq!(limit(f32::INFINITY, 1.0), 1.0);
        assert_eq!(limit(-3.0, 2.0), -2.0);
    }
}
