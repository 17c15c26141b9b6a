//! Ways through freeways: Dijkstra's, in fixed memory.

use super::{Map, PlaceId};
use heapless::Vec;

/// The places of a route, from the first to the last.
pub type Route<const PLACES: usize> = Vec<PlaceId, PLACES, u8>;

/// The shortest way from a place that is known so far.
#[derive(Clone, Copy)]
struct Way {
    length: f32,
    /// The place after the first one. The last place's is itself.
    next: PlaceId,
    /// There is none better.
    settled: bool,
}

impl<const PLACES: usize, const ARCS: usize> Map<PLACES, ARCS> {
    /// The shortest route from one place to another through freeways of at least `width` (m); the two alone, or the one, if there is nothing between. `None`
    /// if there is none. An arc counts with the distance of its disc's centre.
    #[must_use]
    #[inline(never)]
    pub fn route(&self, from: PlaceId, to: PlaceId, width: f32) -> Option<Route<PLACES>> {
        self.place(from)?;
        // From the end, since a way is found from where it ends: so the route begins at its beginning.
        let mut ways = [None; PLACES];
        *ways.get_mut(to.index())? = Some(Way {
            length: 0.0,
            next: to,
            settled: false,
        });
        loop {
            let (here, length) = nearest(&mut ways)?;
            if here == from {
                break;
            }
            for arc in self.arcs() {
                let end = match here {
                    here if arc.from == here => arc.to,
                    here if arc.to == here => arc.from,
                    _ => continue,
                };
                if arc.freeway.is_none_or(|wide| wide < width) {
                    continue;
                }
                let length = length + arc.bound.disc.distance() as f32;
                if let Some(known) = ways.get_mut(end.index())
                    && known.is_none_or(|known: Way| !known.settled && length < known.length)
                {
                    *known = Some(Way {
                        length,
                        next: here,
                        settled: false,
                    });
                }
            }
        }
        let mut route = Route::new();
        let mut place = from;
        route.push(place).ok()?;
        while place != to {
            // No longer than there are places: a way leads through none twice.
            place = ways.get(place.index())?.as_ref()?.next;
            route.push(place).ok()?;
        }
        Some(route)
    }
}

/// The nearest place that is not settled yet, and how far it is. It is settled by now.
fn nearest(ways: &mut [Option<Way>]) -> Option<(PlaceId, f32)> {
    let open = ways
        .iter_mut()
        .enumerate()
        .filter_map(|(index, way)| Some((index, way.as_mut()?)));
    let (index, way) = open
        .filter(|(_, way)| !way.settled)
        .min_by(|(_, a), (_, b)| a.length.total_cmp(&b.length))?;
    way.settled = true;
    Some((PlaceId::at(index), way.length))
}
