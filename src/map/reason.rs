//! Forward and backward reasoning [B §4.3].

use super::{Cylinder, Disc, Heading, Map, PlaceId};
use heapless::Vec;

/// Two bounds that exclude each other: one of them did not hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Contradiction;

impl core::fmt::Display for Contradiction {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("no pose satisfies all bounds")
    }
}
impl core::error::Error for Contradiction {}

/// Why a journey does not go on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum JourneyError {
    /// No room for one more stop.
    Full,
}

impl core::fmt::Display for JourneyError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("no room for one more stop")
    }
}
impl core::error::Error for JourneyError {}

/// The stops since the journey began, each with the motion that led there and its bound as seen from the start: `STOPS` of them at most.
///
/// ```text
///     start ──arc──▶ stop ──arc──▶ stop ──arc──▶ here        forward: the bound of a stop is that of the chain of arcs
///       ◀─────────────◀─────────────◀───── confirmed         backward: and what is left of it after the inverse of the next arc
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Journey<const STOPS: usize = 32> {
    arcs: Vec<Cylinder, STOPS>,
    bounds: Vec<Cylinder, STOPS>,
}

impl<const STOPS: usize> Journey<STOPS> {
    /// A journey that has not begun.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            arcs: Vec::new(),
            bounds: Vec::new(),
        }
    }

    /// The bounds of all stops as seen from the start, the first one's first.
    #[must_use]
    pub fn bounds(&self) -> &[Cylinder] {
        &self.bounds
    }

    /// The bound of where the journey is now, as seen from its start.
    #[must_use]
    pub fn here(&self) -> Cylinder {
        self.bounds.last().copied().unwrap_or(Cylinder::HERE)
    }

    /// Goes on to a next stop, which lies within `arc` as seen from the one before.
    ///
    /// Each stop before, and the chain of arcs since, grouped from the right, gives a bound. This one's is what all of them have in common.
    ///
    /// # Errors
    /// [`JourneyError::Full`]; the journey is as it was.
    pub fn go(&mut self, arc: &Cylinder) -> Result<(), JourneyError> {
        self.arcs.push(*arc).map_err(|_| JourneyError::Full)?;
        let bound = self.reached();
        // There is as much room as for the arcs.
        self.bounds.push(bound).map_err(|_| JourneyError::Full)
    }

    /// The bound of where the last arc ends.
    fn reached(&self) -> Cylinder {
        // The stop before each arc, the last one first; the first arc begins at the start.
        let stops = self.bounds.iter().rev().map(Some).chain([None]);
        let mut since: Option<Cylinder> = None;
        let mut reached: Option<Cylinder> = None;
        for (arc, stop) in self.arcs.iter().rev().zip(stops) {
            let chain = since.map_or(*arc, |since| arc.then(&since));
            let bound = stop.map_or(chain, |stop| stop.then(&chain));
            // Nothing in common is for a confirmation to find out.
            reached = Some(reached.map_or(bound, |known| known.common(&bound).unwrap_or(known)));
            since = Some(chain);
        }
        reached.unwrap_or(Cylinder::HERE)
    }

    /// Backward reasoning. Of the present stop it is known besides that it lies within `bound`, as seen from the start: intersects, cascades the inverse of the
    /// arc that led there, intersects at the stop before, and so on until nothing shrinks or the start is reached. A stop is visited once at most.
    ///
    /// A place that is found again is within its meadow: [`Cylinder`] with [`Disc::about`] its radius, and any heading, or what was seen of it.
    ///
    /// Returns how many stops have a tighter bound now.
    ///
    /// # Errors
    /// [`Contradiction`] if a stop is left with no pose at all; no bound has changed then.
    pub fn confirm(&mut self, bound: &Cylinder) -> Result<usize, Contradiction> {
        // On a copy: what is refused changes nothing.
        let mut bounds = self.bounds.clone();
        let shrunk = backward(&mut bounds, &self.arcs, bound)?;
        self.bounds = bounds;
        Ok(shrunk)
    }
}

fn backward(
    bounds: &mut [Cylinder],
    arcs: &[Cylinder],
    confirmed: &Cylinder,
) -> Result<usize, Contradiction> {
    let mut known = *confirmed;
    let mut shrunk = 0;
    for (bound, arc) in bounds.iter_mut().zip(arcs).rev() {
        let common = bound.common(&known).ok_or(Contradiction)?;
        if !common.is_tighter_than(bound) {
            return Ok(shrunk);
        }
        *bound = common;
        shrunk += 1;
        known = common.then(&arc.inverse());
    }
    // The start is where it is.
    if known.meets(&Cylinder::HERE) {
        Ok(shrunk)
    } else {
        Err(Contradiction)
    }
}

impl<const PLACES: usize, const ARCS: usize> Map<PLACES, ARCS> {
    /// The bound of who is at a place, as seen from the place `from`: anywhere in its meadow, with what is known of the heading as seen from there. `None` if
    /// no chain of arcs leads there.
    #[must_use]
    pub fn presence(&self, from: PlaceId, place: PlaceId, facing: Heading) -> Option<Cylinder> {
        let there = Cylinder {
            disc: Disc::about(self.place(place)?.meadow),
            heading: facing,
        };
        Some(self.relation(from, place)?.then(&there))
    }

    /// Forward reasoning: am I there yet? `here` bounds where I am as seen from the place `from`; `facing` is what would be known of my heading there.
    ///
    /// False only if it is impossible: my disc and the meadow, wherever the place is, have no point in common, or the headings none. A place that no arc leads
    /// to may be anywhere, and so may one that does not exist.
    #[must_use]
    pub fn is_plausible(
        &self,
        from: PlaceId,
        here: &Cylinder,
        place: PlaceId,
        facing: Heading,
    ) -> bool {
        let presence = self.presence(from, place, facing);
        presence.is_none_or(|presence| presence.meets(here))
    }

    /// The place where a landmark is seen: the only one with that label that is plausible. `None` if there is none or more than one.
    #[must_use]
    pub fn identify(&self, from: PlaceId, here: &Cylinder, landmark: &str) -> Option<PlaceId> {
        let mut fitting = self
            .places()
            .filter(|(_, place)| place.has_landmark(landmark))
            .map(|(id, _)| id)
            .filter(|id| self.is_plausible(from, here, *id, Heading::ANY));
        let first = fitting.next()?;
        match fitting.next() {
            None => Some(first),
            Some(_) => None,
        }
    }
}
