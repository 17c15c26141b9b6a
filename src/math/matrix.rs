//! Sums and products of 3 × 3 matrices in f64, each in one place, and all in terms of one loop: unrolled wherever they are used they would take a tenth
//! of the flash.

use nalgebra::{Matrix3, Vector3};

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
pub fn product(a: &Matrix3<f64>, b: &Matrix3<f64>) -> Matrix3<f64> {
    product_transposed(a, &b.transpose())
}

/// A Bᵀ.
#[inline(never)]
#[must_use]
pub fn product_transposed(a: &Matrix3<f64>, b: &Matrix3<f64>) -> Matrix3<f64> {
    let mut product = Matrix3::zeros();
    for (a, b) in a.data.0.iter().zip(&b.data.0) {
        add_columns(&mut product, a, b);
    }
    product
}

/// A := A + x yᵀ.
#[inline(never)]
fn add_columns(a: &mut Matrix3<f64>, x: &[f64; 3], y: &[f64; 3]) {
    for (column, y) in a.data.0.iter_mut().zip(y) {
        accumulate(column, *y, x);
    }
}

/// A v.
#[inline(never)]
#[must_use]
pub fn applied(a: &Matrix3<f64>, v: &Vector3<f64>) -> Vector3<f64> {
    let mut sum = Vector3::zeros();
    for (column, v) in a.data.0.iter().zip(v) {
        accumulate(sum.as_mut_slice(), *v, column);
    }
    sum
}

/// x·y.
#[inline(never)]
#[must_use]
pub fn inner(x: &Vector3<f64>, y: &Vector3<f64>) -> f64 {
    x.iter().zip(y).map(|(x, y)| x * y).sum()
}

/// x + s y.
#[inline(never)]
#[must_use]
pub fn along(x: &Vector3<f64>, s: f64, y: &Vector3<f64>) -> Vector3<f64> {
    let mut sum = *x;
    accumulate(sum.as_mut_slice(), s, y.as_slice());
    sum
}

/// A := A + s x yᵀ.
#[inline(never)]
pub fn add_outer(a: &mut Matrix3<f64>, s: f64, x: &Vector3<f64>, y: &Vector3<f64>) {
    add_columns(a, &x.data.0[0], &(y * s).data.0[0]);
}

/// A + s B.
#[inline(never)]
#[must_use]
pub fn sum(a: &Matrix3<f64>, s: f64, b: &Matrix3<f64>) -> Matrix3<f64> {
    let mut sum = *a;
    accumulate(sum.as_mut_slice(), s, b.as_slice());
    sum
}

/// s A.
#[inline(never)]
#[must_use]
pub fn scaled(s: f64, a: &Matrix3<f64>) -> Matrix3<f64> {
    sum(&Matrix3::zeros(), s, a)
}

/// (A + Aᵀ)/2.
#[inline(never)]
#[must_use]
pub fn symmetric_part(a: &Matrix3<f64>) -> Matrix3<f64> {
    sum(&scaled(0.5, a), 0.5, &a.transpose())
}

#[cfg(test)]
mod tests {
    use super::*;

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
}
