//! Sine, cosine and sinc in f32, for angles that were reduced before they came here.

use super::Sum;

/// π/2 as the sum of two f32: the first has 12 bits, so that its product with a small integer is exact.
const HALF_PI_HEAD: f32 = 1.570_312_5;
const HALF_PI_TAIL: f32 = 4.838_268e-4;

/// 2π in three parts: the first two have 9 bits, so that their products with up to 2¹⁵ turns are exact.
const TURN: [f32; 3] = [6.281_25, 1.934_051_5e-3, 1.255_665_9e-6];

/// An angle without its whole turns, in f32: within ±π but for rounding. Good to 3e-7 up to 30 000 turns.
#[must_use]
pub fn reduced(angle: Sum) -> f32 {
    let turns = round_to_i32(angle.get() * (0.5 * core::f32::consts::FRAC_1_PI)) as f32;
    let [first, second, third] = TURN;
    let rest = angle
        .plus(Sum::new(-turns * first))
        .plus(Sum::new(-turns * second));
    rest.get() - turns * third
}

/// Sine and cosine of `x` radians.
///
/// Error below 1.2e-7 for |x| ≤ 100 (angles in the control path are reduced in f64 and lie within ±2π). Taylor series on ±π/4, where the
/// first term left out is 2e-9. About 30 FPU instructions and no table: `libm`'s computes in f64, in software on the target.
#[must_use]
pub fn sin_cos(x: f32) -> (f32, f32) {
    if x.abs() < core::f32::consts::FRAC_PI_4 {
        return series(x);
    }
    // Beyond this there is no angle left in an f32; NaN comes here too.
    if x.is_nan() || x.abs() > 1e5 {
        return (0.0, 1.0);
    }
    let quadrant = round_to_i32(x * core::f32::consts::FRAC_2_PI);
    let n = quadrant as f32;
    let r = (x - n * HALF_PI_HEAD) - n * HALF_PI_TAIL;
    let (s, c) = series(r);
    match quadrant & 3 {
        0 => (s, c),
        1 => (c, -s),
        2 => (-s, -c),
        _ => (-c, s),
    }
}

/// Sine and cosine on ±π/4.
fn series(r: f32) -> (f32, f32) {
    let r2 = r * r;
    let s = r + r * r2 * (-1.0 / 6.0 + r2 * (1.0 / 120.0 + r2 * (-1.0 / 5040.0 + r2 / 362_880.0)));
    let c = 1.0 + r2 * (-0.5 + r2 * (1.0 / 24.0 + r2 * (-1.0 / 720.0 + r2 / 40_320.0)));
    (s, c)
}

/// sin x / x, 1 at 0. Error below 1.2e-7 for |x| ≤ 100.
#[must_use]
pub fn sinc(x: f32) -> f32 {
    sinc_cosc(x).0
}

/// sin x / x and (1 − cos x) / x: what an arc of angle `x` and unit length reaches ahead and to the side.
///
/// For |x| < 0.25 by series (the first term left out is 3e-9), beyond by [`sin_cos`].
#[inline]
#[must_use]
pub fn sinc_cosc(x: f32) -> (f32, f32) {
    if x > -0.25 && x < 0.25 {
        let x2 = x * x;
        let ahead = 1.0 + x2 * (-1.0 / 6.0 + x2 * (1.0 / 120.0 - x2 / 5040.0));
        let aside = x * (0.5 + x2 * (-1.0 / 24.0 + x2 * (1.0 / 720.0 - x2 / 40_320.0)));
        (ahead, aside)
    } else {
        let (s, c) = sin_cos(x);
        (s / x, (1.0 - c) / x)
    }
}

/// Nearest integer; saturates, 0 for NaN.
fn round_to_i32(x: f32) -> i32 {
    (if x < 0.0 { x - 0.5 } else { x + 0.5 }) as i32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_turns_are_taken_off() {
        for angle in [0.0, 3.1, -3.1, 3.2, 100.0, -12_345.678, 190_000.123_456] {
            let wide = Sum::from_f64(angle).to_f64();
            let off = crate::math::wrap(f64::from(reduced(Sum::from_f64(angle))) - wide);
            // Half an ulp of π, and the third part's 6e-8 of it.
            assert!(off.abs() < 3e-7, "{angle}: {off}");
            assert!(reduced(Sum::from_f64(angle)).abs() < 3.141_7);
        }
    }

    #[test]
    fn against_f64() {
        let mut x = -100.0_f32;
        while x < 100.0 {
            let (s, c) = sin_cos(x);
            let wide = f64::from(x);
            // 1.2e-7: one ulp of 1; at |x| near 100 the reduction adds 64 × 5e-11 of π/2's third part.
            assert!((f64::from(s) - libm::sin(wide)).abs() < 1.2e-7, "sin {x}");
            assert!((f64::from(c) - libm::cos(wide)).abs() < 1.2e-7, "cos {x}");
            if x != 0.0 {
                let (ahead, aside) = sinc_cosc(x);
                assert!((f64::from(ahead) - libm::sin(wide) / wide).abs() < 1.2e-7);
                let half = libm::sin(wide / 2.0);
                assert!(
                    (f64::from(aside) - 2.0 * half * half / wide).abs() < 2.4e-7,
                    "{x}"
                );
            }
            x += 0.003_7;
        }
        assert_eq!(sinc_cosc(0.0), (1.0, 0.0));
    }
}
