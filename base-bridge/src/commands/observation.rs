//! Poses with a covariance: fixes (`ObservePos`) and new poses (`ResetPos`).

use super::Refusal;
use super::posture::triple;
use ros_messages::base::frames::Pose;

/// The base remembers its journey for so long, s: an older fix is of no use to it.
pub const MAX_AGE: f64 = 1.5;
/// A stamp may be of the future by this, s: clocks of two computers.
pub const MAX_FUTURE: f64 = 0.1;
/// Twins of a symmetric matrix may differ by this share of what they may be at most: f32 numbers.
const ASYMMETRY: f64 = 1e-5;
/// The same share for the determinants of one that is not positive by rounding only.
const INDEFINITE: f64 = 1e-9;
/// More than this says nothing (the base's own bound), m² or °².
const VAGUEST: f64 = 1e13;

/// A covariance of x, y and θ: m², m·rad, rad².
pub type Covariance = [[f64; 3]; 3];

/// Takes the covariance of x, y and yaw out of a message's 36 numbers, by rows x y z roll pitch yaw.
///
/// # Errors
/// If it is none: not finite, not symmetric, or not positive semi-definite; or if a variance is zero, which is what a message has that nobody has filled in.
pub fn planar(covariance: &[f64; 36]) -> Result<Covariance, Refusal> {
    const PLACES: [usize; 3] = [0, 1, 5];
    let c = PLACES.map(|row| PLACES.map(|column| covariance[row * 6 + column]));
    if !c.iter().flatten().all(|x| x.is_finite()) {
        return Err(Refusal::NotFinite);
    }
    let bound = |i: usize, j: usize| (c[i][i] * c[j][j]).sqrt();
    let positive = (0..3).all(|i| c[i][i] > 0.0 && c[i][i] <= VAGUEST);
    let symmetric = || {
        let pairs = [(0, 1), (0, 2), (1, 2)];
        pairs.into_iter().all(|(i, j)| {
            (c[i][j] - c[j][i]).abs() <= ASYMMETRY * bound(i, j)
                && c[i][j].abs() <= bound(i, j) * (1.0 + INDEFINITE)
        })
    };
    if positive && symmetric() && determinant_of_correlations(&c) >= -INDEFINITE {
        Ok(c)
    } else {
        Err(Refusal::Covariance)
    }
}

/// The determinant after each variance was made 1: its size does not depend on units. With the pairs' correlations within ±1, it decides.
fn determinant_of_correlations(c: &Covariance) -> f64 {
    let r = |i: usize, j: usize| c[i][j] / (c[i][i] * c[j][j]).sqrt();
    let (a, b, d) = (r(0, 1), r(0, 2), r(1, 2));
    1.0 + 2.0 * a * b * d - a * a - b * b - d * d
}

/// `ObservePos` without its age, which is known when the line is sent.
pub fn observe(pose: &Pose, covariance: &Covariance) -> String {
    format!("ObservePos {} {}", triple(pose), numbers(covariance))
}

/// `ResetPos`.
pub fn reset(pose: &Pose, covariance: &Covariance) -> String {
    format!("ResetPos {} {}", triple(pose), numbers(covariance))
}

/// Cxx Cxy Cxθ Cyy Cyθ Cθθ in m², m·°, °².
fn numbers(c: &Covariance) -> String {
    let degree = 1_f64.to_degrees();
    let values = [
        c[0][0],
        c[0][1],
        c[0][2] * degree,
        c[1][1],
        c[1][2] * degree,
        c[2][2] * degree * degree,
    ];
    values.map(|value| format!("{value:.5e}")).join(" ")
}

/// Is a fix of this age (s) of use?
///
/// # Errors
/// If it is too old, or of the future.
pub fn timely(age: f64) -> Result<(), Refusal> {
    if age > MAX_AGE {
        Err(Refusal::Stale)
    } else if age < -MAX_FUTURE {
        Err(Refusal::Future)
    } else {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    fn message(c: Covariance) -> [f64; 36] {
        let mut all = [0.0; 36];
        for (i, row) in [0, 1, 5].into_iter().enumerate() {
            for (j, column) in [0, 1, 5].into_iter().enumerate() {
                all[row * 6 + column] = c[i][j];
            }
        }
        all
    }

    const GOOD: Covariance = [[4e-2, 1e-2, 2e-3], [1e-2, 9e-2, -3e-3], [2e-3, -3e-3, 1e-3]];

    #[test]
    fn each_number_is_in_its_place_and_unit() {
        let c = planar(&message(GOOD)).unwrap();
        assert_eq!(c, GOOD);
        let pose = Pose::new(1.0, -2.0, FRAC_PI_2);
        assert_eq!(
            observe(&pose, &c),
            "ObservePos 1 -2 90 4.00000e-2 1.00000e-2 1.14592e-1 9.00000e-2 -1.71887e-1 3.28281e0"
        );
        assert!(reset(&pose, &c).starts_with("ResetPos 1 -2 90 4.00000e-2"));
    }

    #[test]
    fn what_is_no_covariance_is_refused() {
        let with = |i: usize, j: usize, value: f64, both: bool| {
            let mut c = GOOD;
            c[i][j] = value;
            if both {
                c[j][i] = value;
            }
            planar(&message(c))
        };
        assert_eq!(with(0, 1, f64::NAN, true), Err(Refusal::NotFinite));
        assert_eq!(with(2, 2, f64::INFINITY, true), Err(Refusal::NotFinite));
        assert_eq!(with(0, 0, 0.0, true), Err(Refusal::Covariance));
        assert_eq!(with(1, 1, -1.0, true), Err(Refusal::Covariance));
        assert_eq!(with(0, 1, 2e-2, false), Err(Refusal::Covariance));
        assert_eq!(with(0, 1, 7e-2, true), Err(Refusal::Covariance));
        assert_eq!(with(0, 0, 1e14, true), Err(Refusal::Covariance));
        assert_eq!(planar(&[0.0; 36]), Err(Refusal::Covariance));
        // Each pair could be, but not all three.
        let c = [[1.0, 0.9, 0.9], [0.9, 1.0, -0.9], [0.9, -0.9, 1.0]];
        assert_eq!(planar(&message(c)), Err(Refusal::Covariance));
        // A line without width is one, however f32 rounds it.
        let c = [[1.0, 1.0, 0.0], [1.0 + 1e-6, 1.0, 0.0], [0.0, 0.0, 1.0]];
        assert!(planar(&message(c)).is_ok());
    }

    #[test]
    fn fixes_have_their_time() {
        assert_eq!(timely(1.5), Ok(()));
        assert_eq!(timely(1.51), Err(Refusal::Stale));
        assert_eq!(timely(-0.1), Ok(()));
        assert_eq!(timely(-0.2), Err(Refusal::Future));
    }
}
