//! The mathematics of bounds, in f64: on the Cortex-M4F it runs in software, and only idle needs it.

use core::f64::consts::{FRAC_2_PI, FRAC_PI_2};

/// The smaller one; `b` if one is NaN.
pub(super) fn smaller(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// The larger one; `b` if one is NaN.
pub(super) fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// Square root; zero for a negative argument or NaN: callers pass squares, where either is rounding.
pub(super) fn sqrt(x: f64) -> f64 {
    if x > 0.0 { libm::sqrt(x) } else { 0.0 }
}

/// √(x² + y²), of lengths whose squares an f64 holds.
pub(super) fn length(x: f64, y: f64) -> f64 {
    sqrt(x * x + y * y)
}

/// Sine and cosine for |x| ≤ 2π, error below 1e-14: by Taylor series on ±π/4, where the first terms left out are 5e-17 and 1e-15. (`libm`'s handle any angle, with
/// tables and a table's panics.) What is no such angle is taken for 0.
pub(super) fn sin_cos(x: f64) -> (f64, f64) {
    if x.is_nan() || x.abs() > 7.0 {
        return (0.0, 1.0);
    }
    let quadrant = (x * FRAC_2_PI + if x < 0.0 { -0.5 } else { 0.5 }) as i32;
    let (s, c) = series(x - f64::from(quadrant) * FRAC_PI_2);
    match quadrant & 3 {
        0 => (s, c),
        1 => (c, -s),
        2 => (-s, -c),
        _ => (-c, s),
    }
}

/// Sine and cosine on ±π/4, by Horner's scheme.
fn series(r: f64) -> (f64, f64) {
    // 1/3!, 1/5! … and 1/2!, 1/4! …, the highest first, with their signs.
    const SINE: [f64; 7] = [
        -1.0 / 1_307_674_368_000.0,
        1.0 / 6_227_020_800.0,
        -1.0 / 39_916_800.0,
        1.0 / 362_880.0,
        -1.0 / 5040.0,
        1.0 / 120.0,
        -1.0 / 6.0,
    ];
    const COSINE: [f64; 7] = [
        -1.0 / 87_178_291_200.0,
        1.0 / 479_001_600.0,
        -1.0 / 3_628_800.0,
        1.0 / 40_320.0,
        -1.0 / 720.0,
        1.0 / 24.0,
        -0.5,
    ];
    let square = r * r;
    let horner = |sum: f64, factor: &f64| sum * square + factor;
    let sine = SINE.iter().fold(0.0, horner);
    let cosine = COSINE.iter().fold(0.0, horner);
    (r + r * square * sine, 1.0 + square * cosine)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sine_and_cosine_are_good_to_1e_14() {
        let mut x = -6.9_f64;
        while x < 6.9 {
            let (s, c) = sin_cos(x);
            assert!((s - libm::sin(x)).abs() < 1e-14, "sin {x}");
            assert!((c - libm::cos(x)).abs() < 1e-14, "cos {x}");
            x += 0.001_7;
        }
        assert_eq!(sin_cos(f64::NAN), (0.0, 1.0));
        assert_eq!(sin_cos(f64::INFINITY), (0.0, 1.0));
    }

    #[test]
    fn what_is_no_number_counts_as_none() {
        assert_eq!(sqrt(-1.0), 0.0);
        assert_eq!(sqrt(f64::NAN), 0.0);
        assert_eq!(smaller(f64::NAN, 1.0), 1.0);
        assert_eq!(larger(f64::NAN, 1.0), 1.0);
    }
}
