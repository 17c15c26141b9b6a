//! What a landmark in sight tells of the pose it is seen from [B §4.3].

use super::real::{length, sqrt};
use super::{Cylinder, Disc, Heading, Motion, ROUNDING};
use core::f64::consts::PI;

/// The direction in which a landmark is seen, and how far away it is.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Sighting {
    /// Counter-clockwise from the heading, rad.
    pub bearing: f64,
    /// By how much it may be wrong, rad.
    pub bearing_bound: f64,
    /// The distance lies between these two, m. `None` if it is not known.
    pub range: Option<[f64; 2]>,
}

impl Sighting {
    /// Where the landmark stands, as seen from the pose it was seen from. `None` if the range is not known.
    #[must_use]
    pub fn spot(&self) -> Option<Cylinder> {
        let [nearest, farthest] = self.range?;
        let motion = Motion {
            turn: self.bearing,
            turn_bound: self.bearing_bound,
            nearest,
            farthest,
        };
        let sight = Cylinder::of_motion(&motion).ok()?;
        Some(Cylinder {
            heading: Heading::ANY,
            ..sight
        })
    }

    /// What is left of `known`, a bound of the pose, if the landmark stands in `spot`; both in the same frame. `None` if nothing is: it is another landmark.
    ///
    /// From wherever the position is, the landmark is seen in a direction: that less the bearing is the heading. And from the landmark, the position lies in the
    /// opposite direction at the known range. Each makes the other tighter, so both are asked twice.
    #[must_use]
    #[inline(never)]
    pub fn refine(&self, known: &Cylinder, spot: &Disc) -> Option<Cylinder> {
        let mut known = *known;
        for _ in 0..2 {
            if let Some(heading) = self.heading(&known.disc, spot) {
                known.heading = known.heading.common(&heading)?;
            }
            if let Some(disc) = self.position(known.heading, spot) {
                known.disc = known.disc.common(&disc)?;
            }
        }
        Some(known)
    }

    /// The heading of who sees the spot from the disc: seen from anywhere in the one, the other lies within asin((r + s)/D) of the direction of its centre.
    fn heading(&self, from: &Disc, spot: &Disc) -> Option<Heading> {
        let (dx, dy) = (spot.x - from.x, spot.y - from.y);
        let (apart, reach) = (length(dx, dy), from.radius + spot.radius);
        if reach.is_nan() || reach >= apart {
            return None;
        }
        let half = libm::atan2(reach, sqrt((apart - reach) * (apart + reach)));
        let direction = libm::atan2(dy, dx);
        let bound = half + self.bearing_bound + 4.0 * ROUNDING;
        Some(Heading::new(direction - self.bearing, bound))
    }

    /// The position of who sees the spot, heading so.
    fn position(&self, heading: Heading, spot: &Disc) -> Option<Disc> {
        let [nearest, farthest] = self.range?;
        let away = Motion {
            turn: heading.centre() + self.bearing + PI,
            turn_bound: heading.half() + self.bearing_bound,
            nearest,
            farthest,
        };
        let Disc { x, y, radius } = Cylinder::of_motion(&away).ok()?.disc;
        Some(Disc {
            x: spot.x + x,
            y: spot.y + y,
            radius: radius + spot.radius + ROUNDING * (spot.distance() + length(x, y)),
        })
    }
}
