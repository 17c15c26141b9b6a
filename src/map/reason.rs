//! Forward and backward reasoning [B §4.3].

use super::{Cylinder, Disc, Heading, Leg, Map, PlaceId};
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
    arcs: Vec<Leg, STOPS>,
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

    /// How many stops there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.bounds.len()
    }

    /// True if it has not begun.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.bounds.is_empty()
    }

    /// True if no further stop has room.
    #[must_use]
    pub fn is_full(&self) -> bool {
        self.bounds.is_full()
    }

    /// Begins to find out what would be known of a next stop, which lies within `arc` as seen from the last one.
    #[must_use]
    pub fn look(&self, arc: &Cylinder) -> Reach {
        Reach {
            since: *arc,
            bound: None,
            left: self.bounds.len() as u8,
            done: false,
        }
    }

    /// Finds out what one more stop tells; false if all have told.
    ///
    /// Each stop before, and the chain of arcs since, grouped from the right, gives a bound. What is reached lies in all of them.
    #[inline(never)]
    pub fn look_on(&self, reach: &mut Reach) -> bool {
        if reach.done {
            return false;
        }
        // The stop before the arcs of the chain; the first arc begins at the start.
        let before = usize::from(reach.left).checked_sub(1);
        let stop = before.and_then(|before| self.bounds.get(before));
        let bound = stop.map_or(reach.since, |stop| stop.then(&reach.since));
        // Nothing in common is for a confirmation to find out.
        reach.bound = Some(match reach.bound {
            Some(known) => known.common(&bound).unwrap_or(known),
            None => bound,
        });
        match before.and_then(|before| self.arcs.get(before)) {
            Some(arc) => {
                reach.since = arc.there.then(&reach.since);
                reach.left -= 1;
            }
            None => reach.done = true,
        }
        !reach.done
    }

    /// Goes on to a next stop, which lies within `arc` as seen from the one before.
    ///
    /// # Errors
    /// [`JourneyError::Full`]; the journey is as it was.
    pub fn go(&mut self, arc: &Cylinder) -> Result<(), JourneyError> {
        self.go_along(&(*arc).into())
    }

    /// The same, of an arc that is bounded both ways.
    ///
    /// # Errors
    /// [`JourneyError::Full`]; the journey is as it was.
    pub fn go_along(&mut self, arc: &Leg) -> Result<(), JourneyError> {
        let mut reach = self.look(&arc.there);
        while self.look_on(&mut reach) {}
        self.go_to(arc, &reach.bound())
    }

    /// The same, of what was [found out](Self::look) already.
    ///
    /// # Errors
    /// [`JourneyError::Full`]; the journey is as it was.
    pub fn go_to(&mut self, arc: &Leg, bound: &Cylinder) -> Result<(), JourneyError> {
        self.arcs.push(*arc).map_err(|_| JourneyError::Full)?;
        // There is as much room as for the arcs.
        self.bounds.push(*bound).map_err(|_| JourneyError::Full)
    }

    /// Begins anew: from the start, nowhere yet.
    pub fn restart(&mut self) {
        self.arcs.clear();
        self.bounds.clear();
    }

    /// Takes the last stop back.
    pub fn retreat(&mut self) {
        self.arcs.pop();
        self.bounds.pop();
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
        // What is refused changes nothing.
        let mut trial = self.look_back(bound);
        while self.back(&mut trial)?.is_some() {}
        let mut backward = self.look_back(bound);
        while let Some((stop, bound)) = self.back(&mut backward)? {
            self.tighten(stop, &bound);
        }
        Ok(backward.shrunk())
    }

    /// Begins backward reasoning, as in [`confirm`](Self::confirm), from the last stop.
    #[must_use]
    pub fn look_back(&self, bound: &Cylinder) -> Backward {
        Backward {
            known: *bound,
            since: None,
            left: self.bounds.len() as u8,
            shrunk: 0,
            done: false,
        }
    }

    /// Goes back by one stop: which it is, and what is known of it now. `None` if nothing shrinks any more, or the start is reached.
    ///
    /// # Errors
    /// [`Contradiction`] if no pose is left for it.
    #[inline(never)]
    pub fn back(
        &self,
        backward: &mut Backward,
    ) -> Result<Option<(usize, Cylinder)>, Contradiction> {
        if backward.done {
            return Ok(None);
        }
        let last = usize::from(backward.left).checked_sub(1);
        let known =
            last.and_then(|last| Some((last, self.bounds.get(last)?, self.arcs.get(last)?)));
        let Some((stop, bound, arc)) = known else {
            backward.done = true;
            // The start is where it is.
            let holds = backward.known.meets(&Cylinder::HERE);
            return if holds { Ok(None) } else { Err(Contradiction) };
        };
        let common = bound.common(&backward.known).ok_or(Contradiction)?;
        if !common.is_tighter_than(bound) {
            backward.done = true;
            return Ok(None);
        }
        backward.shrunk += 1;
        backward.left -= 1;
        backward.known = common.then(&arc.back);
        // The other grouping: all of the chain at once, from where it ends.
        let (end, chain) = match &backward.since {
            Some((end, since)) => {
                let chain = arc.there.then(since);
                let known = end.then(&chain.inverse());
                backward.known = backward.known.common(&known).unwrap_or(backward.known);
                (*end, chain)
            }
            None => (common, arc.there),
        };
        backward.since = Some((end, chain));
        Ok(Some((stop, common)))
    }

    /// Takes over what is known of a stop now.
    pub fn tighten(&mut self, stop: usize, bound: &Cylinder) {
        if let Some(known) = self.bounds.get_mut(stop) {
            *known = *bound;
        }
    }
}

/// Forward reasoning under way: see [`Journey::look`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reach {
    /// The chain of arcs since the stop.
    since: Cylinder,
    bound: Option<Cylinder>,
    left: u8,
    done: bool,
}

impl Reach {
    /// What is known so far.
    #[must_use]
    pub fn bound(&self) -> Cylinder {
        self.bound.unwrap_or(self.since)
    }
}

/// Backward reasoning under way: see [`Journey::look_back`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Backward {
    known: Cylinder,
    /// The present stop, and the chain of arcs that has led there since the one that is looked at.
    since: Option<(Cylinder, Cylinder)>,
    left: u8,
    shrunk: u8,
    done: bool,
}

impl Backward {
    /// How many stops have a tighter bound.
    #[must_use]
    pub fn shrunk(&self) -> usize {
        self.shrunk.into()
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
