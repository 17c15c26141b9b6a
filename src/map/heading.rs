//! Intervals of headings, modulo 360°.

use super::ROUNDING;
use super::real::{larger, smaller};
use crate::math::wrap;
use core::f64::consts::{PI, TAU};

/// Beyond this an f64 rounds an angle by more than 1e-13, rad.
const MOST: f64 = 1e3;

/// A bound of a heading: η ± α, modulo 360°. With α ≥ 180° it is any heading.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Heading {
    /// η, within ±π but for rounding.
    centre: f64,
    /// α, from 0 to π.
    half: f64,
}

impl Heading {
    /// Any heading.
    pub const ANY: Self = Self {
        centre: 0.0,
        half: PI,
    };

    /// Straight ahead, exactly.
    pub const AHEAD: Self = Self {
        centre: 0.0,
        half: 0.0,
    };

    /// η ± α, rad. α ≥ π and what is not finite mean any heading; the sign of α does not count.
    #[must_use]
    pub fn new(centre: f64, half: f64) -> Self {
        if centre.abs() <= PI {
            Self::bounded(centre, half.abs())
        } else if centre.abs() <= MOST {
            Self::bounded(wrap(centre), half.abs() + ROUNDING)
        } else {
            Self::ANY
        }
    }

    /// For an η within ±π but for rounding.
    fn bounded(centre: f64, half: f64) -> Self {
        if half < PI {
            Self { centre, half }
        } else {
            Self::ANY
        }
    }

    /// η, rad, within ±π but for rounding.
    #[must_use]
    pub fn centre(&self) -> f64 {
        self.centre
    }

    /// α, rad, from 0 to π.
    #[must_use]
    pub fn half(&self) -> f64 {
        self.half
    }

    /// True if it bounds nothing.
    #[must_use]
    pub fn is_any(&self) -> bool {
        self.half >= PI
    }

    /// The heading after a turn by another one: η₁ + η₂ ± (α₁ + α₂).
    #[must_use]
    pub fn turned(&self, by: &Self) -> Self {
        let centre = self.centre + by.centre;
        Self::bounded(wrap(centre), self.half + by.half + ROUNDING)
    }

    /// Of the frame that the heading is seen from, as seen from it: −η ± α.
    #[must_use]
    pub fn reversed(&self) -> Self {
        Self {
            centre: -self.centre,
            half: self.half,
        }
    }

    /// By how much the other one's η is further to the left, rad, within ±π but for rounding.
    fn offset(self, other: Self) -> f64 {
        wrap(other.centre - self.centre)
    }

    /// False only if the two have no heading in common.
    #[must_use]
    pub fn meets(&self, other: &Self) -> bool {
        let reach = self.half + other.half + ROUNDING;
        self.is_any() || other.is_any() || self.offset(*other).abs() <= reach
    }

    /// An interval about all that the two have in common, never wider than either; `None` if that is nothing.
    ///
    /// Two wide ones may meet at both ends. Then all that the wider one leaves out lies within the narrower one, which is the interval about both parts.
    #[must_use]
    pub fn common(&self, other: &Self) -> Option<Self> {
        if !self.meets(other) {
            return None;
        }
        let (narrow, wide) = if other.half < self.half {
            (other, self)
        } else {
            (self, other)
        };
        let offset = narrow.offset(*wide);
        if wide.is_any() || TAU - offset.abs() <= narrow.half + wide.half + ROUNDING {
            return Some(*narrow);
        }
        let low = larger(-narrow.half, offset - wide.half);
        let high = smaller(narrow.half, offset + wide.half);
        // The offset is rounded, the ends, and the new centre: together some 1e-15.
        let half = 0.5 * (high - low) + 2.0 * ROUNDING;
        if half < narrow.half {
            let centre = narrow.centre + 0.5 * (high + low);
            Some(Self::bounded(wrap(centre), half))
        } else {
            Some(*narrow)
        }
    }
}
