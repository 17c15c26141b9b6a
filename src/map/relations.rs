//! Where every place lies as seen from one of them: the tightest chains of arcs, a place at a time.

use super::{Arc, Cylinder, Gaussian, Map, PlaceId};
use heapless::Vec;

/// The best chain of arcs to a place that is known so far.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Way {
    /// What all chains that were looked at have in common.
    bound: Cylinder,
    /// The circle of this one, m.
    radius: f64,
    /// The place before the last arc. The root's is itself.
    before: PlaceId,
    /// The last arc, by its place in the map.
    arc: u8,
    state: State,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    /// No chain of arcs leads there, as far as is known.
    Unknown,
    /// One does.
    Open,
    /// And there is none better.
    Settled,
}

impl Way {
    /// Another chain says that it lies within this bound. If rounding leaves nothing in common, either holds.
    fn keep(&mut self, bound: &Cylinder) {
        self.bound = self.bound.common(bound).unwrap_or(self.bound);
    }

    const NONE: Self = Self {
        bound: Cylinder::HERE,
        radius: 0.0,
        before: PlaceId::FIRST,
        arc: 0,
        state: State::Unknown,
    };
}

/// Where the frames of places lie as seen from the `root`, by Dijkstra's algorithm with the radius of the bound as length.
///
/// [`step`](Self::step) does a piece of the work: a small processor has not the time for all at once. The memory is that of one chain to each place.
#[derive(Clone, Debug, PartialEq)]
pub struct Relations<const PLACES: usize = 32> {
    root: Option<PlaceId>,
    /// Those of the first places; nothing is known of others.
    ways: Vec<Way, PLACES>,
    complete: bool,
    piece: Piece,
}

/// What is under way.
#[derive(Clone, Copy, Debug, PartialEq)]
// So that the first one is all zeros.
#[repr(u8)]
enum Piece {
    Nothing,
    /// The chain to a place is grouped from the right, so far from its end.
    Fold {
        here: PlaceId,
        before: PlaceId,
        right: Option<Cylinder>,
    },
    /// The chains that lead on from a place, by its arcs from this one on.
    Relax {
        here: PlaceId,
        next: usize,
    },
}

/// So many arcs are looked at in a piece.
const ARCS_AT_ONCE: usize = 12;

impl<const PLACES: usize> Default for Relations<PLACES> {
    fn default() -> Self {
        Self::new()
    }
}

/// The arc from a place to a neighbour, in either direction.
fn neighbour(arc: &Arc, here: PlaceId) -> Option<PlaceId> {
    if arc.from == here {
        Some(arc.to)
    } else if arc.to == here {
        Some(arc.from)
    } else {
        None
    }
}

/// The arc as it is seen from one of its ends.
fn seen_from(arc: &Arc, here: PlaceId) -> Cylinder {
    if arc.from == here {
        arc.bound
    } else {
        arc.bound.inverse()
    }
}

impl<const PLACES: usize> Relations<PLACES> {
    /// Of no place.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            root: None,
            ways: Vec::new(),
            complete: false,
            piece: Piece::Nothing,
        }
    }

    /// Begins anew, as seen from this place; of none, nothing is known.
    pub fn begin(&mut self, root: Option<PlaceId>) {
        self.root = root;
        self.ways.clear();
        // As many as there is room for.
        while root.is_some() && self.ways.push(Way::NONE).is_ok() {}
        self.complete = false;
        self.piece = Piece::Nothing;
        if let Some(root) = root
            && let Some(way) = self.ways.get_mut(root.index())
        {
            way.before = root;
            way.state = State::Open;
        }
    }

    /// The place that all is seen from.
    #[must_use]
    pub fn root(&self) -> Option<PlaceId> {
        self.root
    }

    /// True if every place is settled that a chain of arcs leads to.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        self.complete || self.root.is_none()
    }

    /// Does a piece of the work; false if all is done.
    ///
    /// Of a place's chain both groupings are bounds, and so are other chains: what they have in common is kept.
    #[inline(never)]
    pub fn step<const ARCS: usize>(&mut self, map: &Map<PLACES, ARCS>) -> bool {
        if self.is_complete() {
            return false;
        }
        self.piece = match self.piece {
            Piece::Nothing => {
                let Some(here) = self.nearest() else {
                    self.complete = true;
                    return false;
                };
                Piece::Fold {
                    here,
                    before: here,
                    right: None,
                }
            }
            Piece::Fold {
                here,
                before,
                right,
            } => self.fold(here, before, right, map),
            Piece::Relax { here, next } => self.relax(here, next, map),
        };
        true
    }

    /// Groups some more arcs of a chain from the right; at the root the place is settled.
    fn fold<const ARCS: usize>(
        &mut self,
        here: PlaceId,
        mut before: PlaceId,
        mut right: Option<Cylinder>,
        map: &Map<PLACES, ARCS>,
    ) -> Piece {
        for (place, arc) in self.chain(before).take(ARCS_AT_ONCE) {
            if let Some(arc) = map.arcs().get(usize::from(arc)) {
                let step = seen_from(arc, place);
                right = Some(right.map_or(step, |rest| step.then(&rest)));
            }
            before = place;
        }
        if Some(before) != self.root {
            return Piece::Fold {
                here,
                before,
                right,
            };
        }
        if let Some(way) = self.ways.get_mut(here.index()) {
            way.state = State::Settled;
            if let Some(right) = right {
                way.keep(&right);
            }
        }
        Piece::Relax { here, next: 0 }
    }

    /// Takes over the chains that lead on from a place by some more of its arcs.
    fn relax<const ARCS: usize>(
        &mut self,
        here: PlaceId,
        next: usize,
        map: &Map<PLACES, ARCS>,
    ) -> Piece {
        let Some(bound) = self.to(here) else {
            return Piece::Nothing;
        };
        let mut left = ARCS_AT_ONCE;
        for (index, arc) in map.arcs().iter().enumerate().skip(next) {
            let Some(end) = neighbour(arc, here) else {
                continue;
            };
            if left == 0 {
                return Piece::Relax { here, next: index };
            }
            left -= 1;
            if Some(end) == self.root {
                continue;
            }
            let Some(known) = self.ways.get_mut(end.index()) else {
                continue;
            };
            let step = seen_from(arc, here);
            let reached = if Some(here) == self.root {
                step
            } else {
                bound.then(&step)
            };
            let radius = reached.disc.radius;
            if known.state == State::Unknown {
                known.bound = reached;
            } else {
                known.keep(&reached);
            }
            let is_better = known.state == State::Open && radius < known.radius;
            if known.state == State::Unknown || is_better {
                *known = Way {
                    bound: known.bound,
                    radius,
                    before: here,
                    arc: index as u8,
                    state: State::Open,
                };
            }
        }
        Piece::Nothing
    }

    /// The place with the smallest radius that is not settled yet.
    fn nearest(&self) -> Option<PlaceId> {
        let open = self.ways.iter().enumerate();
        let (index, _) = open
            .filter(|(_, way)| way.state == State::Open)
            .min_by(|(_, a), (_, b)| a.bound.disc.radius.total_cmp(&b.bound.disc.radius))?;
        Some(PlaceId::at(index))
    }

    /// The arcs from a place back to the root, each with the place before it: the last one first.
    fn chain(&self, to: PlaceId) -> impl Iterator<Item = (PlaceId, u8)> {
        let mut place = to;
        // No longer than there are places: a way leads through none twice.
        (0..PLACES).map_while(move |_| {
            if Some(place) == self.root {
                return None;
            }
            let way = self.ways.get(place.index())?;
            place = way.before;
            Some((way.before, way.arc))
        })
    }

    /// Where a place's frame lies as seen from the root's. `None` if no chain of arcs leads there, or it is not settled yet.
    #[must_use]
    pub fn to(&self, place: PlaceId) -> Option<Cylinder> {
        let way = self.ways.get(place.index())?;
        (way.state == State::Settled).then_some(way.bound)
    }

    /// The most likely place of it, by the compounds of the same chain.
    #[must_use]
    #[inline(never)]
    pub fn likely<const ARCS: usize>(
        &self,
        place: PlaceId,
        map: &Map<PLACES, ARCS>,
    ) -> Option<Gaussian> {
        self.to(place)?;
        let mut all = Gaussian::HERE;
        for (before, arc) in self.chain(place) {
            let arc = map.arcs().get(usize::from(arc))?;
            let step = if arc.from == before {
                arc.likely
            } else {
                arc.likely.inverse()
            };
            all = step.then(&all);
        }
        Some(all)
    }
}

impl<const PLACES: usize, const ARCS: usize> Map<PLACES, ARCS> {
    /// Where a place's frame lies as seen from another's, by the tightest chain of arcs that was found, grouped from the left or from the right. `None` if no
    /// chain connects them.
    #[must_use]
    pub fn relation(&self, from: PlaceId, to: PlaceId) -> Option<Cylinder> {
        self.place(from)?;
        let mut relations = Relations::<PLACES>::default();
        relations.begin(Some(from));
        while relations.to(to).is_none() && relations.step(self) {}
        relations.to(to)
    }
}
