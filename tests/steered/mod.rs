//! The steered vehicles in float64, for the tests of their geometries.
#![allow(dead_code, reason = "each test file uses its own part")]

use vehicle_controller::vehicle::{Jacobian, Twist};

/// ΔS and Δθ of an axle's centre by section 5 of the theory.
pub fn exact([left, right]: [f64; 2], track: f64, alpha: f64) -> [f64; 2] {
    let q = (right * right - left * left) * (1.0 / alpha.cos() - 1.0) / 2.0;
    let right = (right * right + q).max(0.0).sqrt().copysign(right);
    let left = (left * left - q).max(0.0).sqrt().copysign(left);
    [0.5 * (right + left), (right - left) / track]
}

/// The same as [H eq. 2] is printed.
pub fn printed([left, right]: [f64; 2], track: f64, alpha: f64) -> [f64; 2] {
    [0.5 * (right + left), (right - left) / (track * alpha.cos())]
}

/// How far the left and the right wheel's contact go while the axle's centre goes by `moved` along α and the car turns by `turned`: the speed of a point of a
/// rigid body, from nothing but that. Positive where the wheel of a differential drive would roll forward.
pub fn contacts(moved: f64, turned: f64, track: f64, alpha: f64) -> [f64; 2] {
    [0.5, -0.5].map(|side: f64| {
        let aside = side * track;
        let along = moved * alpha.cos() - turned * aside;
        let across = moved * alpha.sin();
        along.hypot(across).copysign(moved - turned * aside)
    })
}

/// Central differences of a motion by each of its inputs. The steps are so small that the third derivative of what is of order one does not show, and so
/// large that rounding does not: 1e-10 is left.
pub fn differences<const N: usize>(
    inputs: [f64; N],
    motion: impl Fn([f64; N]) -> [f64; 2],
) -> [[f64; 2]; N] {
    const STEP: f64 = 1e-5;
    std::array::from_fn(|k| {
        let at = |step: f64| {
            let mut inputs = inputs;
            inputs[k] += step;
            motion(inputs)
        };
        let (before, after) = (at(-STEP), at(STEP));
        [0, 1].map(|i| (after[i] - before[i]) / (2.0 * STEP))
    })
}

/// The largest difference of a Jacobian from those of its wheels and, last, its steering; each in units of 1 or of the wanted value, if that is larger.
pub fn worst<const N: usize>(jacobian: &Jacobian<N>, wanted: &[[f64; 2]]) -> f64 {
    assert_eq!(wanted.len(), N + 1);
    jacobian
        .by_wheel
        .iter()
        .chain([&jacobian.by_steering])
        .zip(wanted)
        .flat_map(|(is, wanted)| {
            pair(*is)
                .into_iter()
                .zip(*wanted)
                .map(|(is, wanted)| (is - wanted).abs() / wanted.abs().max(1.0))
        })
        .fold(0.0, f64::max)
}

/// A twist as two numbers.
pub fn pair(twist: Twist) -> [f64; 2] {
    [twist.translation.into(), twist.rotation.into()]
}

/// Two numbers as a twist.
pub fn twist([translation, rotation]: [f64; 2]) -> Twist {
    Twist {
        translation: translation as f32,
        rotation: rotation as f32,
    }
}

/// The bits of a twist.
pub fn bits(twist: Twist) -> [u32; 2] {
    [twist.translation.to_bits(), twist.rotation.to_bits()]
}
