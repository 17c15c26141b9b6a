//! Ways through the graph: Dijkstra's, in fixed memory.

use super::{Arc, Cylinder, Map, PlaceId};
use heapless::Vec;

/// The places of a route, from the first to the last.
pub type Route<const PLACES: usize> = Vec<PlaceId, PLACES>;

/// What is to be least.
#[derive(Clone, Copy)]
enum Least {
    /// The length, through freeways of at least this width, m.
    Length(f64),
    /// The radius of the bound.
    Radius,
}

/// The best way to a place that is known so far.
#[derive(Clone, Copy)]
struct Way {
    cost: f64,
    bound: Cylinder,
    /// The place before the last one. The first place's is itself.
    before: PlaceId,
    /// There is none better.
    settled: bool,
}

/// The arc from a place to a neighbour, in either direction, as it is seen from the place.
fn from_here(arc: &Arc, here: PlaceId) -> Option<(PlaceId, Cylinder)> {
    if arc.from == here {
        Some((arc.to, arc.bound))
    } else if arc.to == here {
        Some((arc.from, arc.bound.inverse()))
    } else {
        None
    }
}

impl<const PLACES: usize, const ARCS: usize> Map<PLACES, ARCS> {
    /// The shortest route from one place to another through freeways of at least `width` (m); the two alone, or the one, if there is nothing between. `None`
    /// if there is none. An arc counts with the distance of its disc's centre.
    #[must_use]
    pub fn route(&self, from: PlaceId, to: PlaceId, width: f64) -> Option<Route<PLACES>> {
        let ways = self.search(from, to, Least::Length(width))?;
        let mut route = Route::new();
        let mut place = to;
        route.push(place).ok()?;
        while place != from {
            // No longer than there are places: a way leads through none twice.
            place = ways.get(place.index())?.as_ref()?.before;
            route.push(place).ok()?;
        }
        route.reverse();
        Some(route)
    }

    /// Where a place's frame lies as seen from another's, by the tightest chain of arcs that was found, grouped from the left or from the right. `None` if no
    /// chain connects them.
    ///
    /// Of two chains to a place on the way the one with the smaller radius is kept, though the other's heading may be better known: a bound it is in any case.
    #[must_use]
    pub fn relation(&self, from: PlaceId, to: PlaceId) -> Option<Cylinder> {
        let ways = self.search(from, to, Least::Radius)?;
        let left = ways.get(to.index())?.as_ref()?.bound;
        // Backwards along the way, which is the order of the other grouping.
        let mut right: Option<Cylinder> = None;
        let mut place = to;
        for _ in 0..PLACES {
            if place == from {
                break;
            }
            let before = ways.get(place.index())?.as_ref()?.before;
            let step = self.step(before, place)?;
            right = Some(right.map_or(step, |rest| step.then(&rest)));
            place = before;
        }
        Some(right.map_or(left, |right| left.tighter(&right)))
    }

    /// The tightest arc between two places.
    fn step(&self, from: PlaceId, to: PlaceId) -> Option<Cylinder> {
        let steps = self.arcs().iter().filter_map(|arc| from_here(arc, from));
        let steps = steps.filter(|(end, _)| *end == to).map(|(_, step)| step);
        steps.reduce(|best, step| best.tighter(&step))
    }

    /// Dijkstra's algorithm. The ways to all places that had to be settled; `None` if `to` is not among them.
    fn search(&self, from: PlaceId, to: PlaceId, least: Least) -> Option<[Option<Way>; PLACES]> {
        self.place(to)?;
        let mut ways = [None; PLACES];
        *ways.get_mut(from.index())? = Some(Way {
            cost: 0.0,
            bound: Cylinder::HERE,
            before: from,
            settled: false,
        });
        for _ in 0..PLACES {
            let (here, way) = cheapest(&mut ways)?;
            if here == to {
                return Some(ways);
            }
            for arc in self.arcs() {
                let Some((end, step)) = from_here(arc, here) else {
                    continue;
                };
                let bound = if here == from {
                    step
                } else {
                    way.bound.then(&step)
                };
                let cost = match least {
                    Least::Length(width) if arc.freeway.is_some_and(|wide| wide >= width) => {
                        way.cost + arc.bound.disc.distance()
                    }
                    Least::Length(_) => continue,
                    Least::Radius => bound.disc.radius,
                };
                if let Some(known) = ways.get_mut(end.index())
                    && known.is_none_or(|known| !known.settled && cost < known.cost)
                {
                    *known = Some(Way {
                        cost,
                        bound,
                        before: here,
                        settled: false,
                    });
                }
            }
        }
        None
    }
}

/// The cheapest way that is not settled yet. It is by now.
fn cheapest(ways: &mut [Option<Way>]) -> Option<(PlaceId, Way)> {
    let open = ways
        .iter_mut()
        .enumerate()
        .filter_map(|(index, way)| Some((index, way.as_mut()?)));
    let (index, way) = open
        .filter(|(_, way)| !way.settled)
        .min_by(|(_, a), (_, b)| a.cost.total_cmp(&b.cost))?;
    way.settled = true;
    Some((PlaceId::at(index), *way))
}
