//! Places marked and landmarks sighted: what they change in the map, and backward reasoning [B §4.3].

use super::atlas::{Atlas, Claim, Judged, Stage};
use super::{
    Answer, Backward, Cylinder, Disc, Gaussian, Heading, Leg, Map, MapError, Place, PlaceId,
    Question, Sighting,
};

/// The meadow of a place that is marked without one, m.
pub const MEADOW: f64 = 0.5;

/// Whoever is in a place's meadow, facing anywhere.
fn within(place: &Place) -> Cylinder {
    Cylinder {
        disc: Disc::about(place.meadow),
        heading: Heading::ANY,
    }
}

/// Certainly in a meadow of that radius, m.
fn is_inside(here: &Cylinder, meadow: f64) -> bool {
    here.disc.distance() + here.disc.radius <= meadow
}

impl<const PLACES: usize, const ARCS: usize, const STOPS: usize> Atlas<PLACES, ARCS, STOPS> {
    /// The last place where the journey stopped, or began, and what is known of the base as seen from there.
    fn last_place(&self) -> Option<(PlaceId, Cylinder, Gaussian)> {
        let asked = &self.asked;
        match self.stops.0.last() {
            Some((Some(place), _)) => Some((*place, asked.arc.there, asked.likely_arc)),
            _ => Some((self.anchor?, asked.here, asked.likely_here)),
        }
    }

    /// The base is at a place of that name.
    #[inline(never)]
    pub(super) fn mark(&mut self) -> Stage {
        let Question::Mark(name, meadow) = &self.asked.question else {
            return Stage::Done(Err(MapError::Place));
        };
        let Some(place) = self.map.find(name) else {
            let marked = self.map.mark(name, meadow.unwrap_or(MEADOW));
            return Stage::Done(marked.and_then(|place| self.stop_at(place)));
        };
        let meadow = *meadow;
        let Some(known) = self.map.place(place) else {
            return Stage::Done(Err(MapError::Place));
        };
        let mut seen = within(known);
        if let Some(radius) = meadow {
            seen.disc.radius = radius;
        }
        self.confirm(Claim { place, seen })
    }

    /// A new place, here.
    fn stop_at(&mut self, place: PlaceId) -> Result<Answer, MapError> {
        if let Some((from, bound, likely)) = self.last_place() {
            let connected = self.map.connect(from, place, &bound, &likely);
            if connected.is_err() {
                self.map.unmark();
            }
            connected?;
        }
        if self.anchor.is_some() {
            self.go_to_here();
            // There is as much room as in the journey.
            let _ = self.stops.0.push((Some(place), self.asked.likely_here));
            self.trail.resume(&self.asked.since);
        } else {
            self.start_at(place, &Cylinder::HERE);
        }
        self.relations.begin(None);
        see_all(&mut self.map, place);
        Ok(Answer::Marked(place))
    }

    /// The journey's next stop is where the base was. There is room: each of the others is a place, but for the last one, and none is there twice.
    fn go_to_here(&mut self) {
        let (arc, here) = (self.asked.arc, self.asked.here);
        let _ = self.journey.go_to(&arc, &here);
    }

    /// True if the journey has led to this place, and the base has certainly not left it.
    fn has_stayed_at(&self, place: PlaceId) -> bool {
        let is_stop = matches!(self.stops.0.last(), Some((Some(last), _)) if *last == place);
        let meadow = self.map.place(place).map_or(0.0, |known| known.meadow);
        is_stop && is_inside(&self.asked.arc.there, meadow)
    }

    /// The journey begins anew, in a place's frame.
    fn start_at(&mut self, place: PlaceId, here: &Cylinder) {
        self.anchor = Some(place);
        self.journey.restart();
        self.stops.0.clear();
        self.origin = Gaussian::about(here);
        if *here != Cylinder::HERE {
            // There is room: nothing is there.
            let _ = self.journey.go_to(&(*here).into(), here);
            let _ = self.stops.0.push((None, self.origin));
        }
        self.trail.resume(&self.asked.since);
        self.whole = self.asked.since.stretch;
        self.relations.begin(None);
    }

    /// A landmark is in sight. Where the base is certainly at a place, it is that place's; else the places that have such a landmark are judged.
    #[inline(never)]
    pub(super) fn sight(&mut self) -> Stage {
        let Question::Sight(landmark, sighting) = &self.asked.question else {
            return Stage::Done(Err(MapError::Place));
        };
        let at = self.last_place().and_then(|(place, here, _)| {
            let known = self.map.place(place)?;
            is_inside(&here, known.meadow).then_some((place, here, known))
        });
        let Some((place, here, known)) = at else {
            return Stage::Judge(Judged::default());
        };
        let spot = sighting.and_then(|sighting| sighting.spot());
        let spot = spot.map(|spot| here.then(&spot).disc);
        if let Some(known) = known.landmark(landmark) {
            let refined = match (sighting, &known.spot) {
                (Some(sighting), Some(spot)) => sighting.refine(&here, spot),
                _ => Some(here),
            };
            let Some(seen) = refined else {
                return Stage::Done(Err(MapError::Contradiction));
            };
            if seen.is_tighter_than(&here) {
                return self.confirm(Claim { place, seen });
            }
        }
        // It tells nothing new of the base; of the landmark it may.
        let answer = match known.landmark(landmark) {
            Some(_) => Answer::Confirmed(place, 0),
            None => Answer::Added(place),
        };
        // What was seen before has its freeway, or had it taken back.
        let is_new = known
            .landmark(landmark)
            .is_none_or(|known| known.spot.is_none());
        let labelled = self.map.label(place, landmark, spot);
        if labelled.is_ok()
            && is_new
            && let Some((there, spot)) = self.map.find(landmark).zip(spot)
        {
            see(&mut self.map, place, there, &spot);
            self.relations.begin(None);
        }
        Stage::Done(labelled.map(|()| answer))
    }

    /// Judges the next place: can the landmark be the one that is seen from there?
    #[inline(never)]
    pub(super) fn judge(&mut self, mut judged: Judged) -> Stage {
        let Question::Sight(landmark, sighting) = &self.asked.question else {
            return Stage::Done(Err(MapError::Place));
        };
        let Some((place, known)) = self.map.places().nth(judged.next) else {
            return match (judged.found, judged.fitting) {
                (Some(claim), 1) => self.confirm(claim),
                (Some(_), fitting) => Stage::Done(Ok(Answer::Unsure(fitting))),
                (None, _) => Stage::Done(Err(MapError::Landmark)),
            };
        };
        judged.next += 1;
        if let Some(seen) = self.fits(place, known, landmark, sighting.as_ref()) {
            judged.fitting += 1;
            judged.found = judged.found.or(Some(Claim { place, seen }));
        }
        Stage::Judge(judged)
    }

    /// What is known of the base in the frame of a place from which it sees a landmark. `None` if it cannot be there.
    fn fits(
        &self,
        place: PlaceId,
        known: &Place,
        landmark: &str,
        sighting: Option<&Sighting>,
    ) -> Option<Cylinder> {
        let landmark = known.landmark(landmark)?;
        let mut seen = within(known);
        if let Some(relation) = self.relations.to(place) {
            let here = &self.asked.here;
            if !relation.then(&seen).meets(here) {
                return None;
            }
            seen = seen.common(&relation.inverse().then(here))?;
        }
        match (sighting, &landmark.spot) {
            (Some(sighting), Some(spot)) => sighting.refine(&seen, spot),
            _ => Some(seen),
        }
    }

    /// The base is at a place: backward reasoning, if what is known of it reaches so far.
    #[inline(never)]
    fn confirm(&mut self, claim: Claim) -> Stage {
        let Some(relation) = self.relations.to(claim.place) else {
            return self.arrive(claim, 0);
        };
        let presence = relation.then(&claim.seen);
        if !presence.meets(&self.asked.here) {
            return Stage::Done(Err(MapError::Contradiction));
        }
        if !self.agrees(&claim) {
            return Stage::Done(Err(MapError::Contradiction));
        }
        self.go_to_here();
        let backward = self.journey.look_back(&presence);
        Stage::Check(claim, backward)
    }

    /// Looks whether there is a contradiction, before anything is changed.
    pub(super) fn check(&mut self, claim: Claim, mut backward: Backward) -> Stage {
        match self.journey.back(&mut backward) {
            Ok(Some((stop, bound))) if self.agrees_on(stop, &bound) => {
                Stage::Check(claim, backward)
            }
            Ok(None) => {
                let relation = self.relations.to(claim.place).unwrap_or(Cylinder::HERE);
                let presence = relation.then(&claim.seen);
                Stage::Apply(claim, self.journey.look_back(&presence))
            }
            Ok(Some(_)) | Err(_) => {
                self.journey.retreat();
                Stage::Done(Err(MapError::Contradiction))
            }
        }
    }

    /// The place of a stop, if it is another one than the journey's first.
    fn stop(&self, stop: usize) -> Option<(PlaceId, PlaceId, Gaussian)> {
        let (Some((Some(place), likely)), Some(anchor)) = (self.stops.0.get(stop), self.anchor)
        else {
            return None;
        };
        (*place != anchor).then_some((anchor, *place, *likely))
    }

    /// False if the map excludes what is known of a stop now.
    fn agrees_on(&self, stop: usize, bound: &Cylinder) -> bool {
        let stop = self.stop(stop);
        stop.is_none_or(|(anchor, place, _)| self.map.agrees(anchor, place, bound))
    }

    /// Takes over what is known of one stop more.
    pub(super) fn apply(&mut self, claim: Claim, mut backward: Backward) -> Stage {
        let Ok(Some((stop, bound))) = self.journey.back(&mut backward) else {
            self.journey.retreat();
            return self.arrive(claim, backward.shrunk());
        };
        self.journey.tighten(stop, &bound);
        if let Some((anchor, place, likely)) = self.stop(stop) {
            // It ties down the rubbery map; that it agrees with it was seen before.
            let _ = self.map.reason(anchor, place, &bound, &likely);
        }
        Stage::Apply(claim, backward)
    }

    /// What is known of the base in the frame of the place where it is.
    fn seen_from(&self, claim: &Claim) -> Cylinder {
        let seen = claim.seen;
        let Some(relation) = self.relations.to(claim.place) else {
            return seen;
        };
        let known = relation.inverse().then(&self.asked.here);
        seen.common(&known).unwrap_or(seen)
    }

    /// The arc from the last place to the one where the base is.
    fn arrival(&self, claim: &Claim) -> Option<(PlaceId, Cylinder, Gaussian)> {
        let here = self.seen_from(claim);
        let (from, bound, likely) = self.last_place()?;
        (from != claim.place).then(|| {
            let bound = bound.then(&here.inverse());
            let likely = likely.then(&Gaussian::about(&here).inverse());
            (from, bound, likely)
        })
    }

    /// False if the map excludes that arc.
    fn agrees(&self, claim: &Claim) -> bool {
        let arrival = self.arrival(claim);
        arrival.is_none_or(|(from, bound, _)| self.map.agrees(from, claim.place, &bound))
    }

    /// The base is at a place: it is known as seen from the last one, and the journey begins anew. Where it has stayed, it goes on: what was seen before may be
    /// seen again without an end to it.
    #[inline(never)]
    fn arrive(&mut self, claim: Claim, shrunk: usize) -> Stage {
        let place = claim.place;
        let here = self.seen_from(&claim);
        let has_stayed = self.has_stayed_at(place);
        if let Some((from, bound, likely)) = self.arrival(&claim) {
            // Of what was connected before this is one way more. Without room for it, nothing that was known is lost.
            let _ = if self.relations.to(place).is_some() {
                self.map.reason(from, place, &bound, &likely)
            } else {
                self.map.connect(from, place, &bound, &likely)
            };
        }
        if let Question::Mark(name, Some(meadow)) = &self.asked.question {
            // It is known, so there is room.
            let _ = self.map.mark(name, *meadow);
        }
        if has_stayed {
            let seen = here.common(&self.asked.arc.there).unwrap_or(here);
            let leg = Leg::from(seen).common(&Leg {
                there: seen,
                back: self.asked.arc.back,
            });
            let since = &self.asked.since.recorder;
            self.trail.recorder.resume_after(&leg, since);
            // The first of them is where it is.
            if shrunk > 1 {
                self.relations.begin(None);
            }
        } else {
            self.start_at(place, &here);
        }
        Stage::Done(Ok(Answer::Confirmed(place, shrunk)))
    }
}

/// The visibility constraint [B §3.2]: what is seen in a straight line is reachable in a straight line. A landmark with a place's name stands in its meadow: so
/// where it stands is where the place is, and the line of sight a freeway. How wide, nobody has seen. Without room for it, it is left out.
fn see<const PLACES: usize, const ARCS: usize>(
    map: &mut Map<PLACES, ARCS>,
    from: PlaceId,
    to: PlaceId,
    spot: &Disc,
) {
    let Some(meadow) = map.place(to).map(|place| place.meadow) else {
        return;
    };
    if from == to {
        return;
    }
    let bound = Cylinder {
        disc: Disc {
            radius: spot.radius + meadow,
            ..*spot
        },
        heading: Heading::ANY,
    };
    let known = map.has_arc(from, to) || map.has_arc(to, from);
    if !known {
        let _ = map.reason(from, to, &bound, &Gaussian::about(&bound));
    }
    if map.freeway(from, to).is_none() {
        let _ = map.set_freeway(from, to, Some(0.0));
    }
}

/// The same, from all places where a landmark with this place's name is seen.
fn see_all<const PLACES: usize, const ARCS: usize>(map: &mut Map<PLACES, ARCS>, to: PlaceId) {
    for index in 0..PLACES {
        let from = PlaceId::at(index);
        let seen = map
            .place(to)
            .zip(map.place(from))
            .and_then(|(to, from)| from.landmark(&to.name)?.spot);
        if let Some(spot) = seen {
            see(map, from, to, &spot);
        }
    }
}
