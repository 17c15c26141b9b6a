//! Uncertainty cylinders [B §4.3], as theory section 9 corrects them.

use super::real::{sin_cos, sqrt};
use super::{Disc, FARTHEST, GRAIN, Heading, ROUNDING};
use core::f64::consts::{FRAC_PI_2, FRAC_PI_3};

/// What a motion is known to have been: a turn in place by η ± α, then a straight run of d_l to d_h.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Motion {
    /// η, counter-clockwise, rad.
    pub turn: f64,
    /// α, rad. Beyond 180° the heading may be any.
    pub turn_bound: f64,
    /// d_l, m; below 0 is backwards.
    pub nearest: f64,
    /// d_h ≥ d_l, m.
    pub farthest: f64,
}

/// No bound of a motion: not finite, longer than [`FARTHEST`], or its ends in the wrong order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Improper;

impl core::fmt::Display for Improper {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("this bounds no motion")
    }
}
impl core::error::Error for Improper {}

/// A bound of a pose as seen from another one: (d, β, r, η, α). The position lies in the disc of radius r about the point at the distance d and the bearing β,
/// the heading within η ± α.
///
/// Every operation gives a bound of all that its arguments admit, in f64 too: results are widened by 2⁻⁴⁰ of the lengths and of the radians.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Cylinder {
    /// d, β and r.
    pub disc: Disc,
    /// η and α.
    pub heading: Heading,
}

impl Cylinder {
    /// The pose itself: no motion.
    pub const HERE: Self = Self {
        disc: Disc::about(0.0),
        heading: Heading::AHEAD,
    };

    /// The bound of one motion.
    ///
    /// ```text
    ///     d = (d_l + d_h)/(2 cos α)     β = η     r = √(d² − d_l d_h) = √((d_h − d_l)²/4 + d_l d_h sin²α)/cos α
    /// ```
    ///
    /// or, where it is less, the disc of radius d_h about the start. A run that may have gone either way is bounded by its middle, (d_l + d_h)/2, and
    /// r = (d_h − d_l)/2 + α |d_l + d_h|/2.
    ///
    /// # Errors
    /// [`Improper`] if it is none.
    pub fn of_motion(motion: &Motion) -> Result<Self, Improper> {
        let Motion {
            turn,
            turn_bound,
            nearest,
            farthest,
        } = *motion;
        let proper = nearest <= farthest && nearest >= -FARTHEST && farthest <= FARTHEST;
        if !(proper && turn.is_finite() && turn_bound.is_finite()) {
            return Err(Improper);
        }
        let heading = Heading::new(turn, turn_bound);
        // Backwards is the same the other way round.
        let (direction, near, far) = if nearest + farthest < 0.0 {
            (-1.0, -farthest, -nearest)
        } else {
            (1.0, nearest, farthest)
        };
        let (ahead, radius) = reach(near, far, heading);
        let (sin, cos) = sin_cos(heading.centre());
        let disc = Disc {
            x: direction * ahead * cos,
            y: direction * ahead * sin,
            // The direction is rounded once more if it had to be reduced.
            radius: if heading.centre() == turn {
                radius
            } else {
                radius + ROUNDING * ahead
            },
        };
        Ok(Self {
            disc: Disc::about(far).tighter(&disc),
            heading,
        })
    }

    /// The bound of this motion and then another one.
    ///
    /// ```text
    ///     c₁₂ = c₁ + cos α₁ R(η₁) c₂     r₁₂ = r₁ + r₂ + d₂ sin α₁     η₁₂ = η₁ + η₂     α₁₂ = α₁ + α₂
    /// ```
    ///
    /// From α₁ = 90° on c₁₂ = c₁ and r₁₂ = r₁ + r₂ + d₂; from α₁₂ = 180° on the heading is any. (\[B\] prints α₂ for α₁, which is no bound.)
    #[must_use]
    pub fn then(&self, next: &Self) -> Self {
        let (sin, cos) = sin_cos(self.heading.centre());
        let (aside, along) = spread(self.heading);
        let Disc { x, y, radius } = next.disc;
        let length = next.disc.distance();
        let radius = self.disc.radius + radius + length * aside;
        Self {
            disc: Disc {
                x: self.disc.x + along * (cos * x - sin * y),
                y: self.disc.y + along * (sin * x + cos * y),
                radius: radius + ROUNDING * (self.disc.distance() + length + radius) + GRAIN,
            },
            heading: self.heading.turned(&next.heading),
        }
    }

    /// The bound of the start as seen from the end.
    ///
    /// ```text
    ///     d' = d cos α     β' = β + π − η     r' = r + d sin α     η' = −η     α' = α
    /// ```
    ///
    /// From α = 90° on d' = 0 and r' = r + d.
    #[must_use]
    pub fn inverse(&self) -> Self {
        let (sin, cos) = sin_cos(self.heading.centre());
        let (aside, along) = spread(self.heading);
        let Disc { x, y, radius } = self.disc;
        let length = self.disc.distance();
        let radius = radius + length * aside;
        Self {
            disc: Disc {
                x: -along * (cos * x + sin * y),
                y: -along * (cos * y - sin * x),
                radius: radius + ROUNDING * (length + radius) + GRAIN,
            },
            heading: self.heading.reversed(),
        }
    }

    /// The bound of a chain of motions, grouped from the left or from the right, whichever is tighter. From the right it is where a path turns back on itself.
    #[must_use]
    pub fn of_chain(chain: &[Self]) -> Self {
        Self::from_left(chain).tighter(&Self::from_right(chain))
    }

    /// The bound of a chain of motions: ((1 then 2) then 3) …
    #[must_use]
    pub fn from_left(chain: &[Self]) -> Self {
        fold(chain.iter(), Self::then)
    }

    /// The bound of a chain of motions: … (n−2 then (n−1 then n)).
    #[must_use]
    pub fn from_right(chain: &[Self]) -> Self {
        fold(chain.iter().rev(), |all, one| one.then(all))
    }

    /// The one with the smaller disc.
    #[must_use]
    pub fn tighter(&self, other: &Self) -> Self {
        if other.disc.radius < self.disc.radius {
            *other
        } else {
            *self
        }
    }

    /// False only if no pose is in both.
    #[must_use]
    pub fn meets(&self, other: &Self) -> bool {
        self.disc.meets(&other.disc) && self.heading.meets(&other.heading)
    }

    /// A cylinder about all that the two have in common, never larger than either; `None` if that is nothing.
    #[must_use]
    pub fn common(&self, other: &Self) -> Option<Self> {
        Some(Self {
            disc: self.disc.common(&other.disc)?,
            heading: self.heading.common(&other.heading)?,
        })
    }

    /// True if it says more than the other one, of position or of heading.
    #[must_use]
    pub fn is_tighter_than(&self, other: &Self) -> bool {
        self.disc.radius < other.disc.radius || self.heading.half() < other.heading.half()
    }
}

/// The chain of motions, taken together one after the other; none is no motion, and one stays as it is.
pub(super) fn fold<'a>(
    chain: impl Iterator<Item = &'a Cylinder>,
    together: impl Fn(&Cylinder, &Cylinder) -> Cylinder,
) -> Cylinder {
    let take = |all: Option<Cylinder>, next: &Cylinder| {
        Some(all.map_or(*next, |all| together(&all, next)))
    };
    chain.fold(None, take).unwrap_or(Cylinder::HERE)
}

/// d and r of a straight run of near to far ≥ |near|, whose direction is as uncertain as the heading.
fn reach(near: f64, far: f64, heading: Heading) -> (f64, f64) {
    let alpha = heading.half();
    let (middle, half) = (0.5 * (near + far), 0.5 * (far - near));
    if near < 0.0 {
        let radius = half + middle * alpha;
        (middle, radius + ROUNDING * (middle + radius) + GRAIN)
    } else if alpha < FRAC_PI_3 {
        let (sin, cos) = sin_cos(alpha);
        let ahead = middle / cos;
        let radius = sqrt(half * half + near * far * (sin * sin)) / cos;
        // What the cosine is rounded by is divided by it.
        let rounding = ROUNDING * (ahead + radius) / cos;
        (ahead, radius + rounding + GRAIN)
    } else {
        // r ≥ d_h from here on, so the disc about the start is no larger.
        (0.0, far)
    }
}

/// sin α and cos α, for α ≥ 90° those of 90°: how far to the side a point may lie, and how far ahead the middle of where it may.
fn spread(heading: Heading) -> (f64, f64) {
    if heading.half() < FRAC_PI_2 {
        sin_cos(heading.half())
    } else {
        (1.0, 0.0)
    }
}
