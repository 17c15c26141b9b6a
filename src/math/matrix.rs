//! Sums and products of small matrices in f64, each in one place, and all in terms of one loop: unrolled wherever they are used they would take a tenth
//! of the flash.

use nalgebra::{SMatrix, SVector};

/// x := x + s y, element by element. The length is no constant, so that nobody unrolls it.
#[inline(never)]
fn accumulate(x: &mut [f64], s: f64, y: &[f64]) {
    for (x, y) in x.iter_mut().zip(y) {
        *x += s * y;
    }
}

/// A B.
#[inline(never)]
#[must_use]
pub fn product<const R: usize, const N: usize, const C: usize>(
    a: &SMatrix<f64, R, N>,
    b: &SMatrix<f64, N, C>,
) -> SMatrix<f64, R, C> {
    product_transposed(a, &b.transpose())
}

/// A Bᵀ.
#[inline(never)]
#[must_use]
pub fn product_transposed<const R: usize, const N: usize, const C: usize>(
    a: &SMatrix<f64, R, N>,
    b: &SMatrix<f64, C, N>,
) -> SMatrix<f64, R, C> {
    let mut product = SMatrix::zeros();
    for (a, b) in a.data.0.iter().zip(&b.data.0) {
        add_columns(&mut product, a, b);
    }
    product
}

/// A := A + x yᵀ.
#[inline(never)]
fn add_columns<const R: usize, const C: usize>(
    a: &mut SMatrix<f64, R, C>,
    x: &[f64; R],
    y: &[f64; C],
) {
    for (column, y) in a.data.0.iter_mut().zip(y) {
        accumulate(column, *y, x);
    }
}

/// A v.
#[inline(never)]
#[must_use]
pub fn applied<const R: usize, const C: usize>(
    a: &SMatrix<f64, R, C>,
    v: &SVector<f64, C>,
) -> SVector<f64, R> {
    let mut sum = SVector::<f64, R>::zeros();
    for (column, v) in a.data.0.iter().zip(v) {
        accumulate(sum.as_mut_slice(), *v, column);
    }
    sum
}

/// x·y.
#[inline(never)]
#[must_use]
pub fn inner<const N: usize>(x: &SVector<f64, N>, y: &SVector<f64, N>) -> f64 {
    x.iter().zip(y).map(|(x, y)| x * y).sum()
}

/// x + s y.
#[inline(never)]
#[must_use]
pub fn along<const N: usize>(x: &SVector<f64, N>, s: f64, y: &SVector<f64, N>) -> SVector<f64, N> {
    let mut sum = *x;
    accumulate(sum.as_mut_slice(), s, y.as_slice());
    sum
}

/// A := A + s x yᵀ.
#[inline(never)]
pub fn add_outer<const R: usize, const C: usize>(
    a: &mut SMatrix<f64, R, C>,
    s: f64,
    x: &SVector<f64, R>,
    y: &SVector<f64, C>,
) {
    add_columns(a, &x.data.0[0], &(y * s).data.0[0]);
}

/// A + s B.
#[inline(never)]
#[must_use]
pub fn sum<const R: usize, const C: usize>(
    a: &SMatrix<f64, R, C>,
    s: f64,
    b: &SMatrix<f64, R, C>,
) -> SMatrix<f64, R, C> {
    let mut sum = *a;
    accumulate(sum.as_mut_slice(), s, b.as_slice());
    sum
}

/// s A.
#[inline(never)]
#[must_use]
pub fn scaled<const R: usize, const C: usize>(
    s: f64,
    a: &SMatrix<f64, R, C>,
) -> SMatrix<f64, R, C> {
    sum(&SMatrix::zeros(), s, a)
}

/// (A + Aᵀ)/2.
#[inline(never)]
#[must_use]
pub fn symmetric_part<const N: usize>(a: &SMatrix<f64, N, N>) -> SMatrix<f64, N, N> {
    sum(&scaled(0.5, a), 0.5, &a.transpose())
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix2x3, Matrix3, Matrix3x4, Vector3, Vector4};

    #[test]
    fn they_are_what_the_library_makes_of_them() {
        let a = Matrix3::new(1.0, 2.0, -3.0, 0.5, -1.5, 2.5, 7.0, 0.25, -4.0);
        let b = Matrix3::new(-2.0, 1.0, 3.0, 4.0, 0.5, -0.25, 1.0, 8.0, 2.0);
        let (x, y) = (Vector3::new(1.0, -2.0, 4.0), Vector3::new(0.5, 3.0, -1.0));
        assert_eq!(product(&a, &b), a * b);
        assert_eq!(product_transposed(&a, &b), a * b.transpose());
        assert_eq!(applied(&a, &x), a * x);
        assert_eq!(inner(&x, &y), x.dot(&y));
        assert_eq!(along(&x, 2.0, &y), x + y * 2.0);
        assert_eq!(sum(&a, -2.0, &b), a - b * 2.0);
        assert_eq!(scaled(-2.0, &a), a * -2.0);
        assert_eq!(symmetric_part(&a), (a + a.transpose()) * 0.5);
        let mut c = a;
        add_outer(&mut c, 2.0, &x, &y);
        assert_eq!(c, a + x * y.transpose() * 2.0);
    }

    #[test]
    fn so_they_are_of_any_shape() {
        let a = Matrix2x3::new(1.0, 2.0, -3.0, 0.5, -1.5, 2.5);
        let b = Matrix3x4::new(
            -2.0, 1.0, 3.0, 4.0, 0.5, -0.25, 1.0, 8.0, 2.0, -1.0, 0.125, 6.0,
        );
        let (x, y) = (
            Vector3::new(1.0, -2.0, 4.0),
            Vector4::new(0.5, 3.0, -1.0, 7.0),
        );
        assert_eq!(product(&a, &b), a * b);
        assert_eq!(product_transposed(&a, &b.transpose()), a * b);
        assert_eq!(applied(&b, &y), b * y);
        assert_eq!(inner(&y, &y), y.dot(&y));
        assert_eq!(sum(&b, 4.0, &scaled(0.5, &b)), b * 3.0);
        let mut c = b;
        add_outer(&mut c, 2.0, &x, &y);
        assert_eq!(c, b + x * y.transpose() * 2.0);
    }
}
