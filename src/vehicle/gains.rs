//! Gains: the constant errors of a vehicle's geometry, and what they do to its motions (theory section 6).

use super::Twist;
use crate::math::{product_transposed, sqrt};
use nalgebra::{SMatrix, SVector};

/// How many gains a vehicle can have.
///
/// In this order: k_r, of the right wheel's diameter, or of the only wheel's; k_l, of the left wheel's; k_b, of the base; and the offset. The first three
/// are ratios, the true over the nominal value of what odometry is made of. The offset is a difference, true less nominal: of a steering angle, rad; of a
/// synchro drive, which has none, its drift, rad/m. What a vehicle has no use for has no influence. A differential drive has the first three only: where
/// no other vehicle is wanted, there are no more.
pub const GAINS: usize = if cfg!(feature = "vehicles") { 4 } else { 3 };
/// Elements of a lower triangular matrix of that many rows.
pub const ROOT: usize = GAINS * (GAINS + 1) / 2;
/// Which of them is the offset, where there is one: `get` finds it, or nothing.
pub const OFFSET: usize = 3;
/// How many are offsets: one, or none.
pub const OFFSETS: usize = GAINS - OFFSET;

/// A number for each gain.
pub type GainVector = SVector<f64, GAINS>;
/// A number for each two gains: a covariance, or its root.
pub type GainMatrix = SMatrix<f64, GAINS, GAINS>;

/// Something of each gain: of the first three, and of the offset where there is one.
#[inline]
#[must_use]
pub fn of_each<T: Copy>(first: [T; OFFSET], offset: T) -> [T; GAINS] {
    let mut all = [offset; GAINS];
    for (one, first) in all.iter_mut().zip(first) {
        *one = first;
    }
    all
}

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
    /// L by rows: L₁₁; L₂₁ L₂₂; L₃₁ L₃₂ L₃₃ …
    pub root: [f32; ROOT],
}

impl Spread {
    /// The gains are known.
    pub const NONE: Self = Self { root: [0.0; ROOT] };

    /// The root of a covariance; what rounding has made slightly negative counts as 0.
    #[must_use]
    pub fn of(covariance: &GainMatrix) -> Self {
        /// Of a variance, so much may be rounding.
        const NOTHING: f64 = 1e-12;
        // An index that the compiler does not see through could panic.
        let at = |matrix: &GainMatrix, row: usize, column: usize| {
            let element: Option<&f64> = matrix.get((row, column));
            element.copied().unwrap_or_default()
        };
        let p = covariance;
        let mut l = GainMatrix::zeros();
        let mut spread = Self::NONE;
        let mut elements = spread.root.iter_mut();
        for row in 0..GAINS {
            for column in 0..=row {
                let mut left = at(p, row, column);
                for before in 0..column {
                    left -= at(&l, row, before) * at(&l, column, before);
                }
                let pivot = at(&l, column, column);
                let element = if row == column {
                    if left > NOTHING * at(p, row, row) {
                        libm::sqrt(left)
                    } else {
                        0.0
                    }
                } else if pivot > 0.0 {
                    left / pivot
                } else {
                    0.0
                };
                if let Some(place) = l.get_mut((row, column)) {
                    *place = element;
                }
                if let Some(slot) = elements.next() {
                    *slot = element as f32;
                }
            }
        }
        spread
    }

    /// The rows of L.
    #[must_use]
    pub fn rows(&self) -> [[f32; GAINS]; GAINS] {
        let mut elements = self.root.iter();
        let mut rows = [[0.0; GAINS]; GAINS];
        for (index, row) in rows.iter_mut().enumerate() {
            for (slot, element) in row.iter_mut().take(index + 1).zip(&mut elements) {
                *slot = *element;
            }
        }
        rows
    }

    /// L.
    #[must_use]
    pub fn matrix(&self) -> GainMatrix {
        GainMatrix::from(self.rows().map(|row| row.map(f64::from))).transpose()
    }

    /// P.
    #[must_use]
    pub fn covariance(&self) -> GainMatrix {
        let root = self.matrix();
        product_transposed(&root, &root)
    }

    /// Standard deviations of the gains.
    #[must_use]
    pub fn deviations(&self) -> [f32; GAINS] {
        self.rows()
            .map(|row| sqrt(row.iter().map(|element| element * element).sum()))
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
    /// Nothing is off.
    pub const NOMINAL: [f32; GAINS] = {
        let mut gains = [1.0; GAINS];
        if OFFSETS == 1 {
            gains[GAINS - 1] = 0.0;
        }
        gains
    };
    /// The smallest and the largest gain that any vehicle can have …
    pub const RANGE: [f32; 2] = [0.8, 1.25];
    /// … and the largest offset, either way: rad, or rad/m. A little less than the 14° that its parameter can hold.
    pub const MAX_OFFSET: f32 = 0.2443;

    /// True if it is another one by no more than what an offset loses on its way to degrees and back.
    #[must_use]
    pub fn is_same(&self, other: &Self) -> bool {
        if OFFSETS == 0 {
            return self == other;
        }
        let mut alike = *other;
        for (offset, exact) in alike.gains.iter_mut().zip(self.gains).skip(OFFSET) {
            if (*offset - exact).abs() <= 1e-6 {
                *offset = exact;
            }
        }
        alike == *self
    }

    /// True if every gain is within reason.
    #[must_use]
    pub fn is_plausible(&self) -> bool {
        let ranges = of_each([Self::RANGE; 3], [-Self::MAX_OFFSET, Self::MAX_OFFSET]);
        self.gains
            .iter()
            .zip(ranges)
            .all(|(gain, [min, max])| (min..=max).contains(gain))
            && self.spread.root.iter().all(|element| element.is_finite())
    }
}

impl Default for Calibration {
    fn default() -> Self {
        Self {
            gains: Self::NOMINAL,
            spread: Spread::NONE,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A root with this on its diagonal, and below it numbers of any sign.
    fn root(diagonal: f64) -> GainMatrix {
        GainMatrix::from_fn(|row, column| match row.cmp(&column) {
            core::cmp::Ordering::Less => 0.0,
            core::cmp::Ordering::Equal => diagonal,
            core::cmp::Ordering::Greater => 0.3 - 0.2 * (row + 2 * column) as f64,
        })
    }

    #[test]
    fn a_root_is_cholesky_s() {
        let p = root(0.7) * root(0.7).transpose();
        let spread = Spread::of(&p);
        // It has the digits of an f32.
        assert!((spread.matrix() - root(0.7)).abs().max() < 1e-7);
        assert!((spread.covariance() - p).abs().max() < 3e-7);
        let mut elements = spread.root.iter();
        for (index, row) in spread.rows().iter().enumerate() {
            let (left, right) = row.split_at(index + 1);
            assert!(left.iter().eq(elements.by_ref().take(index + 1)));
            assert!(right.iter().all(|element| *element == 0.0));
        }
        assert_eq!(elements.next(), None);
        for (deviation, variance) in spread.deviations().iter().zip(&p.diagonal()) {
            assert!((f64::from(*deviation) - variance.sqrt()).abs() < 1e-7);
        }
    }

    #[test]
    fn what_is_known_leaves_zeros_and_no_nan() {
        assert_eq!(Spread::of(&GainMatrix::zeros()), Spread::NONE);
        // All gains are one, and rounding has left less than nothing of the second.
        let mut p = GainMatrix::from_element(0.25);
        p[(1, 1)] -= 1e-14;
        let spread = Spread::of(&p);
        let first = GainMatrix::from_fn(|_, column| if column == 0 { 0.5 } else { 0.0 });
        assert_eq!(spread.matrix(), first);
        // One that is known among others.
        let mut p = root(0.7) * root(0.7).transpose();
        p.column_mut(1).fill(0.0);
        p.row_mut(1).fill(0.0);
        assert!((Spread::of(&p).covariance() - p).abs().max() < 3e-7);
    }

    #[test]
    fn gains_are_ratios_and_the_offset_a_difference() {
        let plausible = |gains| {
            let spread = Spread::NONE;
            Calibration { gains, spread }.is_plausible()
        };
        assert!(plausible(Calibration::NOMINAL));
        assert_eq!(Calibration::NOMINAL, of_each([1.0; 3], 0.0));
        for index in 0..GAINS {
            let (low, high) = if index < OFFSET {
                (0.8, 1.25)
            } else {
                (-Calibration::MAX_OFFSET, Calibration::MAX_OFFSET)
            };
            for (value, within) in [
                (low, true),
                (high, true),
                (low - 0.01, false),
                (high + 0.01, false),
                (f32::NAN, false),
            ] {
                let mut gains = Calibration::NOMINAL;
                gains[index] = value;
                assert_eq!(plausible(gains), within, "{index} {value}");
            }
        }
        let mut unknown = Calibration::default();
        unknown.spread.root[ROOT - 1] = f32::INFINITY;
        assert!(!unknown.is_plausible());
    }
}
