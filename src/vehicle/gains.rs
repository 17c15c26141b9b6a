//! Gains: the constant errors of a vehicle's geometry, and what they do to its motions (theory section 6).

use super::Twist;
use crate::math::{larger, product_transposed, sqrt};
use nalgebra::Matrix3;

/// How many gains a vehicle has.
///
/// A gain is the true over the nominal value of something that odometry is made of. A differential drive has k_r and k_l, of the right and the left wheel's
/// diameter, and k_b, of the wheel base.
pub const GAINS: usize = 3;

/// ∂ΔS/∂k and ∂Δα/∂k for each gain: linear in ΔS and Δα themselves.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Influence {
    /// For each gain: of ΔS by ΔS, of ΔS by Δα (m), of Δα by ΔS (1/m), of Δα by Δα.
    pub by_gain: [[f32; 4]; GAINS],
}

impl Influence {
    /// What a change of each gain by 1 does to a motion.
    #[inline]
    #[must_use]
    pub fn of(&self, motion: Twist) -> [Twist; GAINS] {
        let Twist {
            translation: s,
            rotation: a,
        } = motion;
        self.by_gain.map(|[ss, sa, as_, aa]| Twist {
            translation: ss * s + sa * a,
            rotation: as_ * s + aa * a,
        })
    }
}

/// The covariance P of the gains, as its root: P = L Lᵀ with L lower triangular. Whatever the numbers are, P is positive semi-definite.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Spread {
    /// L by rows: L₁₁; L₂₁ L₂₂; L₃₁ L₃₂ L₃₃.
    pub root: [f32; 6],
}

impl Spread {
    /// The gains are known.
    pub const NONE: Self = Self { root: [0.0; 6] };

    /// The root of a covariance; what rounding has made slightly negative counts as 0.
    #[must_use]
    pub fn of(covariance: &Matrix3<f64>) -> Self {
        /// Of a variance, so much may be rounding.
        const NOTHING: f64 = 1e-12;
        let p = covariance;
        let pivot = |left: f64, all: f64| {
            if left > NOTHING * all {
                libm::sqrt(left)
            } else {
                0.0
            }
        };
        let over = |value: f64, pivot: f64| if pivot > 0.0 { value / pivot } else { 0.0 };
        let l11 = pivot(p.m11, p.m11);
        let (l21, l31) = (over(p.m21, l11), over(p.m31, l11));
        let l22 = pivot(p.m22 - l21 * l21, p.m22);
        let l32 = over(p.m32 - l31 * l21, l22);
        let l33 = pivot(p.m33 - l31 * l31 - l32 * l32, p.m33);
        Self {
            root: [l11, l21, l22, l31, l32, l33].map(|element| element as f32),
        }
    }

    /// L.
    #[must_use]
    pub fn matrix(&self) -> Matrix3<f64> {
        let [l11, l21, l22, l31, l32, l33] = self.root.map(f64::from);
        Matrix3::new(l11, 0.0, 0.0, l21, l22, 0.0, l31, l32, l33)
    }

    /// P.
    #[must_use]
    pub fn covariance(&self) -> Matrix3<f64> {
        let root = self.matrix();
        product_transposed(&root, &root)
    }

    /// Standard deviations of the gains.
    #[must_use]
    pub fn deviations(&self) -> [f32; GAINS] {
        let [l11, l21, l22, l31, l32, l33] = self.root;
        [
            larger(l11, -l11),
            sqrt(l21 * l21 + l22 * l22),
            sqrt(l31 * l31 + l32 * l32 + l33 * l33),
        ]
    }
}

/// What is known of the gains.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Calibration {
    /// Their values.
    pub gains: [f32; GAINS],
    /// How well they are known.
    pub spread: Spread,
}

impl Calibration {
    /// The smallest and the largest gain that any vehicle can have.
    pub const RANGE: [f32; 2] = [0.8, 1.25];

    /// True if every gain is within reason.
    #[must_use]
    pub fn is_plausible(&self) -> bool {
        let [min, max] = Self::RANGE;
        self.gains.iter().all(|gain| (min..=max).contains(gain))
            && self.spread.root.iter().all(|element| element.is_finite())
    }
}

impl Default for Calibration {
    fn default() -> Self {
        Self {
            gains: [1.0; GAINS],
            spread: Spread::NONE,
        }
    }
}
