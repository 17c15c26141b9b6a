//! Symmetric positive semi-definite matrices, kept so against rounding.

use nalgebra::{Matrix3, SMatrix, SVector};

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
pub fn is_finite<const N: usize>(m: &SMatrix<f64, N, N>) -> bool {
    m.iter().all(|e| e.is_finite())
}

/// The symmetric part of `m`.
///
/// # Errors
/// [`Asymmetric`] if mirrored elements differ by more than 1e-3 √(s_i s_j), where `scale` holds the variances s.
pub fn symmetric<const N: usize>(
    m: &SMatrix<f64, N, N>,
    scale: &SMatrix<f64, N, N>,
) -> Result<SMatrix<f64, N, N>, Asymmetric> {
    let d = scale.diagonal().map(|v| libm::sqrt(v.max(0.0)));
    let allowed = d * d.transpose() * ASYMMETRY;
    let difference = (m - m.transpose()).abs();
    // Written so that a NaN is refused too.
    if difference.iter().zip(allowed.iter()).all(|(a, b)| a <= b) {
        Ok((m + m.transpose()) * 0.5)
    } else {
        Err(Asymmetric)
    }
}

/// A covariance as it was written down with six digits: its own scale, and twice the tolerance, since a singular one can lose 1.7e-5 by them.
///
/// # Errors
/// [`NotPositive`] if an eigenvalue is below −2e-5 in correlation scale, or an element is not finite.
pub fn written_covariance<const N: usize>(
    m: &SMatrix<f64, N, N>,
) -> Result<SMatrix<f64, N, N>, NotPositive> {
    project(m, m, 2.0 * NEGATIVE)
}

/// The symmetric matrix `m` itself if it is positive semi-definite; if rounding made an eigenvalue slightly negative, the nearest one that is.
///
/// Eigenvalues are those of D^-½ m D^-½, with D the diagonal of `scale`: a matrix of metres and radians has no scale of its own.
///
/// # Errors
/// [`NotPositive`] if an eigenvalue is below −1e-5, or an element is not finite.
pub fn nearest_positive<const N: usize>(
    m: &SMatrix<f64, N, N>,
    scale: &SMatrix<f64, N, N>,
) -> Result<SMatrix<f64, N, N>, NotPositive> {
    project(m, scale, NEGATIVE)
}

fn project<const N: usize>(
    m: &SMatrix<f64, N, N>,
    scale: &SMatrix<f64, N, N>,
    most_negative: f64,
) -> Result<SMatrix<f64, N, N>, NotPositive> {
    if !is_finite(m) {
        return Err(NotPositive);
    }
    let d = deviations(scale);
    // A state with no variance at all has no covariances either.
    for (row, d) in m.row_iter().zip(d.iter()) {
        if *d == 0.0 && row.iter().any(|e| *e != 0.0) {
            return Err(NotPositive);
        }
    }
    let (smallest, projected) = clamp_eigenvalues(m, &d);
    if smallest.is_nan() || smallest < most_negative {
        return Err(NotPositive);
    }
    Ok(projected)
}

/// The positive semi-definite part of a symmetric matrix, however large its negative part is. What is not finite stays as it is.
#[must_use]
pub fn positive_part<const N: usize>(m: &SMatrix<f64, N, N>) -> SMatrix<f64, N, N> {
    if !is_finite(m) {
        return *m;
    }
    let mut m = *m;
    // Without a variance there is no scale: rounding may have left covariances.
    for i in 0..N {
        if m[(i, i)] <= 0.0 {
            m.row_mut(i).fill(0.0);
            m.column_mut(i).fill(0.0);
        }
    }
    clamp_eigenvalues(&m, &deviations(&m)).1
}

/// Square roots of the diagonal, 0 for what is not positive.
fn deviations<const N: usize>(m: &SMatrix<f64, N, N>) -> SVector<f64, N> {
    m.diagonal()
        .map(|v| if v > 0.0 { libm::sqrt(v) } else { 0.0 })
}

/// The smallest eigenvalue of D⁻¹ m D⁻¹, and m without its negative ones.
fn clamp_eigenvalues<const N: usize>(
    m: &SMatrix<f64, N, N>,
    d: &SVector<f64, N>,
) -> (f64, SMatrix<f64, N, N>) {
    // Most are, and the proof takes a hundredth of the work.
    if has_positive_pivots(m) {
        return (0.0, *m);
    }
    let inverse = d.map(|v| if v > 0.0 { 1.0 / v } else { 0.0 });
    let correlation = m.component_mul(&(inverse * inverse.transpose()));
    let (values, vectors) = eigen(&correlation);
    let smallest = values.min();
    if smallest >= 0.0 {
        return (smallest, *m);
    }
    let positive =
        vectors * SMatrix::from_diagonal(&values.map(|v| v.max(0.0))) * vectors.transpose();
    let projected = positive.component_mul(&(d * d.transpose()));
    (smallest, (projected + projected.transpose()) * 0.5)
}

/// True if Gauss's elimination meets no negative pivot, and none that is zero but in a row of zeros: the matrix is positive semi-definite, but for the
/// elimination's own rounding.
fn has_positive_pivots<const N: usize>(m: &SMatrix<f64, N, N>) -> bool {
    let mut a = *m;
    for p in 0..N {
        let pivot = a[(p, p)];
        if pivot > 0.0 {
            let inverse = 1.0 / pivot;
            for row in p + 1..N {
                let factor = a[(row, p)] * inverse;
                for column in row..N {
                    a[(column, row)] -= factor * a[(column, p)];
                }
            }
        } else if pivot.is_nan() || pivot < 0.0 || (p + 1..N).any(|row| a[(row, p)] != 0.0) {
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

/// Eigenvalues and eigenvectors (columns) of a symmetric matrix by cyclic Jacobi rotations.
///
/// Convergence is quadratic: some four sweeps leave nothing above 1e-17 of a correlation matrix of the 3 to 6 states that occur here.
fn eigen<const N: usize>(m: &SMatrix<f64, N, N>) -> (SVector<f64, N>, SMatrix<f64, N, N>) {
    const SWEEPS: usize = 8;
    const NOTHING: f64 = 1e-17;
    let mut a = *m;
    let mut v = SMatrix::<f64, N, N>::identity();
    for _ in 0..SWEEPS {
        let mut rotated = false;
        for p in 0..N {
            for q in p + 1..N {
                let apq = a[(p, q)];
                if apq.abs() < NOTHING {
                    continue;
                }
                rotated = true;
                // tan 2φ = 2 a_pq / (a_qq − a_pp); the smaller root keeps the rotation below 45°.
                let tau = (a[(q, q)] - a[(p, p)]) / (2.0 * apq);
                let sign = if tau < 0.0 { -1.0 } else { 1.0 };
                let t = sign / (tau.abs() + libm::sqrt(1.0 + tau * tau));
                let c = 1.0 / libm::sqrt(1.0 + t * t);
                rotate_columns(&mut a, p, q, c, t * c);
                a.transpose_mut();
                rotate_columns(&mut a, p, q, c, t * c);
                rotate_columns(&mut v, p, q, c, t * c);
            }
        }
        if !rotated {
            break;
        }
    }
    (a.diagonal(), v)
}

/// m R, with R the rotation in the plane of p and q.
fn rotate_columns<const N: usize>(m: &mut SMatrix<f64, N, N>, p: usize, q: usize, c: f64, s: f64) {
    for k in 0..N {
        let (x, y) = (m[(k, p)], m[(k, q)]);
        m[(k, p)] = c * x - s * y;
        m[(k, q)] = s * x + c * y;
    }
}

/// The six different elements of a symmetric matrix: xx, xy, xθ, yy, yθ, θθ, the order in which the protocol prints them.
#[must_use]
pub fn upper_triangle(m: &Matrix3<f64>) -> [f64; 6] {
    [m.m11, m.m12, m.m13, m.m22, m.m23, m.m33]
}
