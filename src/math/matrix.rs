//! Products of 3 × 3 matrices in f64, each in one place: unrolled wherever they are used they would take a tenth of the flash.

use nalgebra::{Matrix3, Vector3};

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
        for (sum, b) in product.data.0.iter_mut().zip(b) {
            for (sum, a) in sum.iter_mut().zip(a) {
                *sum += a * b;
            }
        }
    }
    product
}

/// A v.
#[inline(never)]
#[must_use]
pub fn applied(a: &Matrix3<f64>, v: &Vector3<f64>) -> Vector3<f64> {
    let mut sum = Vector3::zeros();
    for (column, v) in a.data.0.iter().zip(v) {
        for (sum, a) in sum.iter_mut().zip(column) {
            *sum += a * v;
        }
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
    for (sum, y) in sum.iter_mut().zip(y) {
        *sum += s * y;
    }
    sum
}

/// A := A + s x yᵀ.
#[inline(never)]
pub fn add_outer(a: &mut Matrix3<f64>, s: f64, x: &Vector3<f64>, y: &Vector3<f64>) {
    for (column, y) in a.data.0.iter_mut().zip(y) {
        let s = s * y;
        for (a, x) in column.iter_mut().zip(x) {
            *a += s * x;
        }
    }
}

/// A + s B.
#[inline(never)]
#[must_use]
pub fn sum(a: &Matrix3<f64>, s: f64, b: &Matrix3<f64>) -> Matrix3<f64> {
    let mut sum = *a;
    for (a, b) in sum.iter_mut().zip(b) {
        *a += s * b;
    }
    sum
}

/// (A + Aᵀ)/2.
#[inline(never)]
#[must_use]
pub fn symmetric_part(a: &Matrix3<f64>) -> Matrix3<f64> {
    sum(a, 1.0, &a.transpose()) * 0.5
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
        assert_eq!(symmetric_part(&a), (a + a.transpose()) * 0.5);
        let mut c = a;
        add_outer(&mut c, 2.0, &x, &y);
        assert_eq!(c, a + x * y.transpose() * 2.0);
    }
}
