//! Corrections from outside: the Kalman command, and observations that arrive late [C §3], theory section 4.
//!
//! Everything here runs outside the control interrupt, against a snapshot. Differences of nearly equal covariances are formed: interpolated or rounded,
//! they may be slightly indefinite, and their positive part is what counts.
//!
//! An older observation after a newer one is taken as if the newer had not told of the older's instant: what the two share is counted as the theory's
//! section 4 does, which may be off by a tenth of the covariance. Keeping the cross-covariances would cost 4 KiB.

use super::estimator::{Estimate, Pose, transport};
use crate::math::{
    NotPositive, is_finite, nearest_positive, positive_part, symmetric, transported, wrap,
    written_covariance,
};
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

/// Why a correction was refused. Nothing has changed.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum CorrectionError {
    /// A covariance, a gain, or their result is not symmetric or not positive semi-definite.
    NotPositive,
    /// The observation lies beyond the gate; the squared Mahalanobis distance of its innovation.
    Gate(f32),
    /// A result is not a finite number.
    NotFinite,
}

impl core::fmt::Display for CorrectionError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::NotPositive => "the covariance would not be symmetric positive semi-definite",
            Self::Gate(_) => "the observation is beyond the gate",
            Self::NotFinite => "the result would not be finite",
        })
    }
}
impl core::error::Error for CorrectionError {}

impl From<NotPositive> for CorrectionError {
    fn from(_: NotPositive) -> Self {
        Self::NotPositive
    }
}

/// A change of the estimate at one instant, in a form that can be carried to any other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Update {
    /// The estimate that was corrected: pose and covariance before …
    pose: Pose,
    before: Matrix3<f64>,
    /// … the correction of the pose (m, m, rad), and the covariance after.
    shift: Vector3<f64>,
    after: Matrix3<f64>,
    /// C⁻¹, where C is regular: what a correction says of earlier poses goes through it.
    inverse: Option<Matrix3<f64>>,
}

/// P := P + K ΔP, C := C − K C (CorrectPos). `shift` is ΔP in m, m, rad; `gain` is K.
///
/// # Errors
/// [`CorrectionError::NotPositive`] if the result is not symmetric (1e-3) or not positive semi-definite (−1e-5), both in correlation scale.
pub fn with_gain(
    estimate: &Estimate,
    shift: Vector3<f64>,
    gain: &Matrix3<f64>,
) -> Result<Update, CorrectionError> {
    let c = estimate.covariance;
    let after = symmetric(&(c - gain * c), &c).map_err(|_| CorrectionError::NotPositive)?;
    Update::new(estimate, gain * shift, nearest_positive(&after, &c)?)
}

/// An observation with innovation ν, covariance R and Jacobian H of M rows: the gain is computed here, the update is Joseph's.
///
/// ```text
///     S = R + H C Hᵀ     d² = νᵀ S⁻¹ ν     K = C Hᵀ S⁻¹
///     P := P + K ν       C := (I − K H) C (I − K H)ᵀ + K R Kᵀ
/// ```
///
/// Returns the update and d².
///
/// # Errors
/// [`CorrectionError::NotPositive`] if R is not symmetric positive semi-definite or S is singular;
/// [`CorrectionError::Gate`] if d² exceeds `gate` (0 turns the gate off).
pub fn observe<const M: usize>(
    estimate: &Estimate,
    innovation: SVector<f64, M>,
    r: &SMatrix<f64, M, M>,
    h: &SMatrix<f64, M, 3>,
    gate: f64,
) -> Result<(Update, f32), CorrectionError> {
    let r = written_covariance(r)?;
    let c = estimate.covariance;
    let s = r + h * c * h.transpose();
    // A singular S means that both the estimate and the observation claim to be exact.
    let inverse = invert(&s).ok_or(CorrectionError::NotPositive)?;
    let distance = innovation.dot(&(inverse * innovation));
    if !distance.is_finite() {
        return Err(CorrectionError::NotFinite);
    }
    if gate > 0.0 && distance > gate {
        return Err(CorrectionError::Gate(distance as f32));
    }
    let k = c * h.transpose() * inverse;
    let rest = Matrix3::identity() - k * h;
    let joseph = rest * c * rest.transpose() + k * r * k.transpose();
    let after = nearest_positive(&((joseph + joseph.transpose()) * 0.5), &c)?;
    Ok((
        Update::new(estimate, k * innovation, after)?,
        distance as f32,
    ))
}

/// Inverse of a symmetric positive definite matrix, if it is one in correlation scale.
fn invert<const N: usize>(m: &SMatrix<f64, N, N>) -> Option<SMatrix<f64, N, N>> {
    let d = m
        .diagonal()
        .map(|v| if v > 0.0 { 1.0 / libm::sqrt(v) } else { 0.0 });
    let scale = d * d.transpose();
    // Gauss–Jordan without pivoting: stable for a positive definite matrix, and its pivots tell whether it is one.
    let mut a = m.component_mul(&scale);
    let mut inverse = SMatrix::<f64, N, N>::identity();
    for p in 0..N {
        let pivot = a[(p, p)];
        if pivot.is_nan() || pivot < 1e-10 {
            return None;
        }
        for column in 0..N {
            a[(p, column)] /= pivot;
            inverse[(p, column)] /= pivot;
        }
        for row in 0..N {
            if row != p {
                let factor = a[(row, p)];
                for column in 0..N {
                    a[(row, column)] -= factor * a[(p, column)];
                    inverse[(row, column)] -= factor * inverse[(p, column)];
                }
            }
        }
    }
    Some(inverse.component_mul(&scale))
}

impl Update {
    fn new(
        estimate: &Estimate,
        shift: Vector3<f64>,
        after: Matrix3<f64>,
    ) -> Result<Self, CorrectionError> {
        if !shift.iter().all(|e| e.is_finite()) || !is_finite(&after) {
            return Err(CorrectionError::NotFinite);
        }
        let before = estimate.covariance;
        Ok(Self {
            pose: estimate.pose,
            before,
            shift,
            after,
            inverse: invert(&before),
        })
    }

    /// Carries the update to a later estimate of the same journey (or to the same one).
    ///
    /// With Φ the product of F since: P := P + Φ K ν, C := Φ C⁺ Φᵀ + Q, where Q = C − Φ C⁻ Φᵀ is the noise since.
    #[must_use]
    pub fn carried_to_later(&self, estimate: &Estimate) -> Estimate {
        let dx = estimate.pose.x - self.pose.x;
        let dy = estimate.pose.y - self.pose.y;
        let noise = estimate.covariance - transported(&self.before, dx, dy);
        let c = transported(&self.after, dx, dy) + positive_part(&noise);
        moved(estimate, transport(dx, dy) * self.shift, &c)
    }

    /// Carries the update to an earlier estimate: the smoother's gain is C_τ Φᵀ C⁻¹. Where C is singular, the past is left as it was.
    #[must_use]
    pub fn carried_to_earlier(&self, estimate: &Estimate) -> Estimate {
        let Some(inverse) = self.inverse else {
            return *estimate;
        };
        // Φ from there to here is the inverse of Φ from here to there.
        let phi = transport(self.pose.x - estimate.pose.x, self.pose.y - estimate.pose.y);
        let c = estimate.covariance;
        let gain = c * phi.transpose() * inverse;
        let c = c + gain * (self.after - self.before) * gain.transpose();
        let c = positive_part(&((c + c.transpose()) * 0.5));
        moved(estimate, gain * self.shift, &c)
    }
}

fn moved(estimate: &Estimate, shift: Vector3<f64>, c: &Matrix3<f64>) -> Estimate {
    Estimate {
        pose: Pose {
            x: estimate.pose.x + shift.x,
            y: estimate.pose.y + shift.y,
            theta: estimate.pose.theta + shift.z,
        },
        covariance: *c,
    }
}

/// z − P̂ for a full observation, the angle wrapped to the nearer side.
#[must_use]
pub fn pose_innovation(observed: &Pose, estimate: &Pose) -> Vector3<f64> {
    Vector3::new(
        observed.x - estimate.x,
        observed.y - estimate.y,
        wrap(observed.theta - estimate.theta),
    )
}
