//! Symmetric positive semi-definite matrices, kept so against rounding.

use super::matrix::{add_outer, symmetric_part};
use nalgebra::{Matrix3, SMatrix, Vector3};

/// The matrix is further from its transpose than rounding explains.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Asymmetric;

/// The matrix has an eigenvalue below what rounding explains, or is not finite.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct NotPositive;

impl core::fmt::Display for Asymmetric {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("the matrix is not symmetric")
    }
}
impl core::error::Error for Asymmetric {}

impl core::fmt::Display for NotPositive {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("the matrix is not positive semi-definite")
    }
}
impl core::error::Error for NotPositive {}

/// How far two mirrored elements may differ, in units of √(C_ii C_jj) (theory section 4).
const ASYMMETRY: f64 = 1e-3;
/// The most negative eigenvalue, in correlation scale, that passes for rounding (theory section 3).
const NEGATIVE: f64 = -1e-5;

/// True if every element is finite.
#[must_use]
pub fn is_finite<const R: usize, const C: usize>(m: &SMatrix<f64, R, C>) -> bool {
    all_finite(m.as_slice())
}

/// Of no constant length: one for all shapes.
#[inline(never)]
fn all_finite(elements: &[f64]) -> bool {
    elements.iter().all(|e| e.is_finite())
}

/// The symmetric part of `m`.
///
/// # Errors
/// [`Asymmetric`] if mirrored elements differ by more than 1e-3 √(s_i s_j), where `scale` holds the variances s.
pub fn symmetric(m: &Matrix3<f64>, scale: &Matrix3<f64>) -> Result<Matrix3<f64>, Asymmetric> {
    let d = scale.diagonal().map(|v| libm::sqrt(v.max(0.0)));
    let mirrored = [
        (m.m12 - m.m21, d.x * d.y),
        (m.m13 - m.m31, d.x * d.z),
        (m.m23 - m.m32, d.y * d.z),
    ];
    // Written so that a NaN is refused too.
    if mirrored.iter().all(|(a, b)| a.abs() <= ASYMMETRY * b) && is_finite(m) {
        Ok(symmetric_part(m))
    } else {
        Err(Asymmetric)
    }
}

/// A covariance as it was written down with six digits: its own scale, and twice the tolerance, since a singular one can lose 1.7e-5 by them.
///
/// # Errors
/// [`NotPositive`] if an eigenvalue is below −2e-5 in correlation scale, or an element is not finite.
pub fn written_covariance(m: &Matrix3<f64>) -> Result<Matrix3<f64>, NotPositive> {
    project(m, m, 2.0 * NEGATIVE)
}

/// The symmetric matrix `m` itself if it is positive semi-definite; if rounding made an eigenvalue slightly negative, one near it that is.
///
/// Eigenvalues are those of D^-½ m D^-½, with D the diagonal of `scale`: a matrix of metres and radians has no scale of its own.
///
/// # Errors
/// [`NotPositive`] if an eigenvalue is below −1e-5, or an element is not finite.
pub fn nearest_positive(
    m: &Matrix3<f64>,
    scale: &Matrix3<f64>,
) -> Result<Matrix3<f64>, NotPositive> {
    project(m, scale, NEGATIVE)
}

fn project(
    m: &Matrix3<f64>,
    scale: &Matrix3<f64>,
    most_negative: f64,
) -> Result<Matrix3<f64>, NotPositive> {
    if !is_finite(m) {
        return Err(NotPositive);
    }
    // The eigenvalues of m + λ D are those of m, in that scale, and λ more. A state with no variance at all has no covariances either.
    let mut raised = *m;
    for i in 0..3 {
        raised[(i, i)] -= most_negative * scale[(i, i)].max(0.0);
    }
    if has_positive_pivots(&raised) {
        Ok(positive_part(m))
    } else {
        Err(NotPositive)
    }
}

/// A symmetric matrix itself if it is positive semi-definite; otherwise with the same variances, as far as they are none below 0, and covariances just so
/// much smaller that it is. What is not finite stays as it is.
#[must_use]
pub fn positive_part(m: &Matrix3<f64>) -> Matrix3<f64> {
    /// Of a variance, so much may be rounding.
    const NOTHING: f64 = 1e-14;
    // Most are, and the proof takes a tenth of the work.
    if has_positive_pivots(m) || !is_finite(m) {
        return *m;
    }
    let scale = m.diagonal();
    let (mut rest, mut positive) = (*m, Matrix3::zeros());
    for _ in 0..3 {
        // Cholesky's columns, the largest pivot first, each in units of its own.
        let mut largest = (NOTHING, None);
        for ((column, pivot), scale) in rest.data.0.iter().zip(&rest.diagonal()).zip(&scale) {
            if *scale > 0.0 && pivot / scale > largest.0 {
                largest = (pivot / scale, Some((*pivot, Vector3::from(*column))));
            }
        }
        let Some((pivot, mut column)) = largest.1 else {
            break;
        };
        let root = libm::sqrt(pivot);
        for (element, variance) in column.iter_mut().zip(&rest.diagonal()) {
            // No correlation is beyond 1.
            let most = libm::sqrt(variance.max(0.0));
            *element = (*element / root).min(most).max(-most);
        }
        add_outer(&mut positive, 1.0, &column, &column);
        add_outer(&mut rest, -1.0, &column, &column);
    }
    symmetric_part(&positive)
}

/// True if Gauss's elimination meets no negative pivot, and none that is zero but in a row of zeros: the matrix is positive semi-definite, but for the
/// elimination's own rounding.
fn has_positive_pivots(m: &Matrix3<f64>) -> bool {
    let mut a = *m;
    for p in 0..3 {
        let pivot = a[(p, p)];
        if pivot > 0.0 {
            let inverse = 1.0 / pivot;
            for row in p + 1..3 {
                let factor = a[(row, p)] * inverse;
                for column in row..3 {
                    a[(column, row)] -= factor * a[(column, p)];
                }
            }
        } else if pivot.is_nan() || pivot < 0.0 || (p + 1..3).any(|row| a[(row, p)] != 0.0) {
            return false;
        }
    }
    true
}

/// F M Fᵀ for a symmetric M, where F is the derivative of a pose with respect to an earlier one that lies (Δx, Δy) behind: of the 54 products of two
/// matrix multiplications, 6 are not with 0 or 1.
#[must_use]
pub fn transported(m: &Matrix3<f64>, dx: f64, dy: f64) -> Matrix3<f64> {
    let tt = m.m33;
    let xt = m.m13 - dy * tt;
    let yt = m.m23 + dx * tt;
    let xx = m.m11 - dy * (m.m13 + xt);
    let xy = m.m12 + dx * xt - dy * m.m23;
    let yy = m.m22 + dx * (m.m23 + yt);
    Matrix3::new(xx, xy, xt, xy, yy, yt, xt, yt, tt)
}

/// The six different elements of a symmetric matrix: xx, xy, xθ, yy, yθ, θθ, the order in which the protocol prints them.
#[must_use]
pub fn upper_triangle(m: &Matrix3<f64>) -> [f64; 6] {
    [m.m11, m.m12, m.m13, m.m22, m.m23, m.m33]
}
