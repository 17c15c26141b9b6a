//! A drive from one pose to another, bounded both ways.

use super::{Cylinder, Disc, Improper, Motion};

/// A bound of where a drive ends as seen from where it began, and of where it began as seen from where it ends.
///
/// Of a turn and a straight run the inverse of the one is a poor bound of the other: whatever the turn was wrong by, who looks back along a straight run
/// sees its beginning straight behind.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Leg {
    /// The end, from the beginning.
    pub there: Cylinder,
    /// The beginning, from the end.
    pub back: Cylinder,
}

impl From<Cylinder> for Leg {
    /// Of which no more is known than where it ends.
    fn from(there: Cylinder) -> Self {
        Self {
            there,
            back: there.inverse(),
        }
    }
}

impl Leg {
    /// No drive.
    pub const HERE: Self = Self {
        there: Cylinder::HERE,
        back: Cylinder::HERE,
    };

    /// The bound of one motion. Its beginning is seen straight behind, as far away as it has run.
    ///
    /// # Errors
    /// [`Improper`] if it is none.
    pub fn of_motion(motion: &Motion) -> Result<Self, Improper> {
        let there = Cylinder::of_motion(motion)?;
        let behind = Motion {
            turn: 0.0,
            turn_bound: 0.0,
            nearest: -motion.farthest,
            farthest: -motion.nearest,
        };
        let inverse = there.inverse();
        let disc: Disc = Cylinder::of_motion(&behind)?.disc;
        Ok(Self {
            there,
            back: Cylinder {
                disc: inverse.disc.tighter(&disc),
                ..inverse
            },
        })
    }

    /// This drive and then another one.
    #[must_use]
    pub fn then(&self, next: &Self) -> Self {
        Self {
            there: self.there.then(&next.there),
            back: next.back.then(&self.back),
        }
    }

    /// What two bounds of the same drive have in common. If rounding leaves nothing, either holds.
    #[must_use]
    pub fn common(&self, other: &Self) -> Self {
        Self {
            there: self.there.common(&other.there).unwrap_or(self.there),
            back: self.back.common(&other.back).unwrap_or(self.back),
        }
    }
}
