//! Discs of the plane, and what two of them have in common.

use super::real::{larger, length, smaller, sqrt};
use super::{GRAIN, ROUNDING};

/// The longest length in a map, m. Its square is far from the end of an f64's range.
pub const FARTHEST: f64 = 1e6;

/// A bound of a position: it lies in this disc. All finite.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Disc {
    /// The centre, ahead of the frame that the disc is seen from, m.
    pub x: f64,
    /// The centre, to the left of it, m.
    pub y: f64,
    /// The radius, m, 0 or more.
    pub radius: f64,
}

impl Disc {
    /// A disc about the frame itself.
    #[must_use]
    pub const fn about(radius: f64) -> Self {
        Self {
            x: 0.0,
            y: 0.0,
            radius,
        }
    }

    /// d, the distance of the centre from the frame, m.
    #[must_use]
    pub fn distance(&self) -> f64 {
        length(self.x, self.y)
    }

    /// β, the bearing of the centre from the frame, rad in ±π; 0 if the centre is there.
    #[must_use]
    pub fn bearing(&self) -> f64 {
        libm::atan2(self.y, self.x)
    }

    /// The square of the distance of the two centres, m².
    fn apart(&self, other: &Self) -> f64 {
        let (dx, dy) = (other.x - self.x, other.y - self.y);
        dx * dx + dy * dy
    }

    /// False only if the two have no point in common.
    #[must_use]
    pub fn meets(&self, other: &Self) -> bool {
        let reach = self.radius + other.radius + GRAIN;
        // What is no number excludes nothing.
        let excluded = self.apart(other) > reach * reach * (1.0 + ROUNDING);
        !excluded
    }

    /// The disc with the smaller radius.
    #[must_use]
    pub fn tighter(&self, other: &Self) -> Self {
        if other.radius < self.radius {
            *other
        } else {
            *self
        }
    }

    /// A disc about all that the two have in common, never larger than either; `None` if that is nothing.
    ///
    /// With D the distance of the centres, the points x of both satisfy every weighted mean of the two inequalities |x − c|² ≤ r²:
    ///
    /// ```text
    ///     p = c₁ + λ (c₂ − c₁)     |x − p|² ≤ (1 − λ) r₁² + λ r₂² − λ (1 − λ) D²     for any λ from 0 to 1
    /// ```
    ///
    /// and the right side is smallest for λ = ½ + (r₁² − r₂²)/(2D²), where the chord of the two circles is its diameter. However λ is rounded, it is a bound.
    #[must_use]
    pub fn common(&self, other: &Self) -> Option<Self> {
        if !self.meets(other) {
            return None;
        }
        let (apart, first, second) = (
            self.apart(other),
            self.radius * self.radius,
            other.radius * other.radius,
        );
        // Of concentric ones it is infinite or NaN, which becomes 1 or 0.
        let share = 0.5 + 0.5 * (first - second) / apart;
        let share = smaller(larger(share, 0.0), 1.0);
        let rest = 1.0 - share;
        let square =
            rest * first + share * second - share * rest * apart + ROUNDING * (first + second);
        let common = Self {
            x: self.x + share * (other.x - self.x),
            y: self.y + share * (other.y - self.y),
            radius: sqrt(square) * (1.0 + ROUNDING)
                + ROUNDING * (self.distance() + other.distance())
                + GRAIN,
        };
        let smallest = self.tighter(other);
        Some(if common.radius < smallest.radius {
            common
        } else {
            smallest
        })
    }
}
