//! The graph: places, and the arcs between them [B §3].

use super::real::{larger, smaller};
use super::{Cylinder, Disc, FARTHEST, Gaussian, Name};
use heapless::Vec;

/// How many landmarks a place remembers.
pub const LANDMARKS: usize = 4;

/// Which place of a map. It stays the same until the map is forgotten.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct PlaceId(u8);

impl PlaceId {
    pub(super) const FIRST: Self = Self(0);

    pub(super) fn index(self) -> usize {
        self.0.into()
    }

    pub(super) fn at(index: usize) -> Self {
        Self(index as u8)
    }
}

/// Why the map stayed as it was.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum MapError {
    /// No room for one more, or the name is longer than 15 bytes.
    Full,
    /// No such place.
    Place,
    /// No arc between the two places.
    Arc,
    /// No place with such a landmark is possible.
    Landmark,
    /// No way through freeways that are wide enough.
    Route,
    /// The base does not know any more where it is, and so not what was asked.
    Lost,
    /// Not what the map already knows of these two places: no pose satisfies both, so one of the bounds did not hold.
    Contradiction,
}

impl MapError {
    /// For people.
    #[must_use]
    pub const fn text(self) -> &'static str {
        match self {
            Self::Full => "no room in the map",
            Self::Place => "no such place",
            Self::Arc => "no arc between the two",
            Self::Landmark => "no place with that landmark is possible",
            Self::Route => "no way that is wide enough",
            Self::Lost => "the base has lost where it is",
            Self::Contradiction => "the bounds exclude it",
        }
    }
}

impl core::fmt::Display for MapError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(self.text())
    }
}
impl core::error::Error for MapError {}

/// A place. Its frame is the pose in which it was marked.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Place {
    /// What it is called.
    pub name: Name,
    /// The radius of its meadow, a disc of free space about its frame, m: who is there is in that disc.
    pub meadow: f64,
    /// The landmarks that are seen from it.
    pub landmarks: Vec<Landmark, LANDMARKS, u8>,
}

/// A landmark, as it is seen from a place.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Landmark {
    /// What it is called. Others may be called so, too.
    pub name: Name,
    /// Where it stands, in the place's frame. `None` if that is not known.
    pub spot: Option<Disc>,
}

impl Place {
    /// True if that landmark is seen from here.
    #[must_use]
    pub fn has_landmark(&self, landmark: &str) -> bool {
        self.landmark(landmark).is_some()
    }

    /// What is known of that landmark, if it is seen from here.
    #[must_use]
    pub fn landmark(&self, landmark: &str) -> Option<&Landmark> {
        self.landmarks.iter().find(|known| *known.name == *landmark)
    }
}

/// What is known of the way from one place to another.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Arc {
    /// Where it begins.
    pub from: PlaceId,
    /// Where it ends.
    pub to: PlaceId,
    /// Where the frame of `to` lies, as seen from that of `from`.
    pub bound: Cylinder,
    /// Where it most likely lies.
    pub likely: Gaussian,
    /// The smallest width of the freeway between the two, a straight corridor, m. `None` if none is known.
    pub freeway: Option<f32>,
    /// Without it others still connect its places: it makes room for one that is needed.
    pub is_reasoned: bool,
}

impl Arc {
    fn new(
        (from, to): (PlaceId, PlaceId),
        bound: &Cylinder,
        likely: &Gaussian,
        is_reasoned: bool,
    ) -> Self {
        Self {
            from,
            to,
            bound: *bound,
            likely: *likely,
            freeway: None,
            is_reasoned,
        }
    }

    /// Keeps what two bounds have in common, and the surer compound.
    fn refine(&mut self, bound: &Cylinder, likely: &Gaussian) -> Result<(), MapError> {
        self.bound = self.bound.common(bound).ok_or(MapError::Contradiction)?;
        if likely.variance() < self.likely.variance() {
            self.likely = *likely;
        }
        Ok(())
    }
}

/// Places and arcs, in fixed memory: by default 32 and 96.
///
/// ```
/// use vehicle_controller::map::{Cylinder, Gaussian, Map, Motion};
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let mut map: Map = Map::new();
/// let door = map.mark("door", 0.3)?;
/// let desk = map.mark("desk", 0.5)?;
/// // 2 m straight ahead, within 5° and 15 cm.
/// let run = Motion { turn: 0.0, turn_bound: 0.0873, nearest: 1.85, farthest: 2.15 };
/// let bound = Cylinder::of_motion(&run)?;
/// map.connect(door, desk, &bound, &Gaussian::about(&bound))?;
/// map.set_freeway(door, desk, Some(0.8))?;
/// assert!(map.route(desk, door, 0.6).is_some());
/// assert!(map.route(desk, door, 0.9).is_none());
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Map<const PLACES: usize = 32, const ARCS: usize = 96> {
    places: Vec<Place, PLACES>,
    arcs: Vec<Arc, ARCS>,
}

impl<const PLACES: usize, const ARCS: usize> Map<PLACES, ARCS> {
    /// A map of nothing.
    #[must_use]
    pub const fn new() -> Self {
        const { assert!(PLACES <= 256 && ARCS <= 256, "each is known by a byte") };
        Self {
            places: Vec::new(),
            arcs: Vec::new(),
        }
    }

    /// Forgets all of it.
    pub fn forget(&mut self) {
        self.places.clear();
        self.arcs.clear();
    }

    /// Remembers a place with a meadow of that radius (m), or changes the meadow of one that is known by this name.
    ///
    /// # Errors
    /// [`MapError::Full`].
    pub fn mark(&mut self, name: &str, meadow: f64) -> Result<PlaceId, MapError> {
        // A NaN becomes 0.
        let meadow = smaller(larger(meadow, 0.0), FARTHEST);
        if let Some(id) = self.find(name) {
            self.place_mut(id)?.meadow = meadow;
            return Ok(id);
        }
        let id = PlaceId::at(self.places.len());
        let place = Place {
            name: written(name)?,
            meadow,
            landmarks: Vec::new(),
        };
        self.places.push(place).map_err(|_| MapError::Full)?;
        Ok(id)
    }

    /// Remembers that a landmark is seen from a place, and where it stands in its frame, if that is known and was not.
    ///
    /// # Errors
    /// [`MapError::Place`], and [`MapError::Full`] if there are four others.
    pub fn label(
        &mut self,
        place: PlaceId,
        landmark: &str,
        spot: Option<Disc>,
    ) -> Result<(), MapError> {
        let place = self.place_mut(place)?;
        let known = |known: &&mut Landmark| *known.name == *landmark;
        if let Some(known) = place.landmarks.iter_mut().find(known) {
            known.spot = known.spot.or(spot);
            return Ok(());
        }
        let landmark = Landmark {
            name: written(landmark)?,
            spot,
        };
        place.landmarks.push(landmark).map_err(|_| MapError::Full)
    }

    /// Remembers where the frame of `to` lies as seen from that of `from`. If that was known already, what both bounds have in common, and the surer compound.
    /// Without room for it, the widest of those that only [add to others](Self::reason) is forgotten.
    ///
    /// # Errors
    /// [`MapError::Place`], [`MapError::Full`], [`MapError::Contradiction`].
    pub fn connect(
        &mut self,
        from: PlaceId,
        to: PlaceId,
        bound: &Cylinder,
        likely: &Gaussian,
    ) -> Result<(), MapError> {
        self.place_mut(from)?;
        self.place_mut(to)?;
        if let Some(arc) = self.arc_mut(from, to) {
            arc.refine(bound, likely)?;
            arc.is_reasoned = false;
            return Ok(());
        }
        let arc = Arc::new((from, to), bound, likely, false);
        if self.arcs.is_full() {
            let known = self.widest_reasoned().ok_or(MapError::Full)?;
            *known = arc;
            return Ok(());
        }
        self.arcs.push(arc).map_err(|_| MapError::Full)
    }

    /// Remembers an arc between places that others connect already. Without room for it, the widest one of its kind is forgotten, be it this one.
    ///
    /// # Errors
    /// [`MapError::Place`], [`MapError::Contradiction`].
    pub fn reason(
        &mut self,
        from: PlaceId,
        to: PlaceId,
        bound: &Cylinder,
        likely: &Gaussian,
    ) -> Result<(), MapError> {
        self.place_mut(from)?;
        self.place_mut(to)?;
        if let Some(arc) = self.arc_mut(from, to) {
            return arc.refine(bound, likely);
        }
        let arc = Arc::new((from, to), bound, likely, true);
        if self.arcs.push(arc).is_err()
            && let Some(known) = self.widest_reasoned()
            && bound.disc.radius < known.bound.disc.radius
        {
            *known = arc;
        }
        Ok(())
    }

    /// False if an arc says that `to` cannot lie within this bound as seen from `from`.
    #[must_use]
    pub fn agrees(&self, from: PlaceId, to: PlaceId, bound: &Cylinder) -> bool {
        let mut arcs = self.arcs.iter();
        let known = arcs.find(|arc| (arc.from, arc.to) == (from, to));
        known.is_none_or(|arc| arc.bound.meets(bound))
    }

    fn arc_mut(&mut self, from: PlaceId, to: PlaceId) -> Option<&mut Arc> {
        let mut arcs = self.arcs.iter_mut();
        arcs.find(|arc| (arc.from, arc.to) == (from, to))
    }

    /// Of the arcs that only add to others, and along which there is no freeway, the one with the largest circle.
    fn widest_reasoned(&mut self) -> Option<&mut Arc> {
        let arcs = self.arcs.iter_mut();
        arcs.filter(|arc| arc.is_reasoned && arc.freeway.is_none())
            .max_by(|a, b| a.bound.disc.radius.total_cmp(&b.bound.disc.radius))
    }

    /// Remembers that a straight corridor of at least that width (m) leads from one place to the other and back, along the arc between them; or that none does.
    ///
    /// # Errors
    /// [`MapError::Arc`] if there is no arc between the two.
    pub fn set_freeway(
        &mut self,
        a: PlaceId,
        b: PlaceId,
        width: Option<f32>,
    ) -> Result<(), MapError> {
        // A NaN, or less than nothing, is none.
        let freeway = width.filter(|width| *width >= 0.0);
        let mut found = Err(MapError::Arc);
        for arc in &mut self.arcs {
            if (arc.from, arc.to) == (a, b) || (arc.from, arc.to) == (b, a) {
                arc.freeway = freeway;
                found = Ok(());
            }
        }
        found
    }

    /// The width of the freeway between two places, m.
    #[must_use]
    pub fn freeway(&self, a: PlaceId, b: PlaceId) -> Option<f32> {
        let mut arcs = self.arcs.iter();
        let between = |arc: &&Arc| (arc.from, arc.to) == (a, b) || (arc.from, arc.to) == (b, a);
        arcs.find(between)?.freeway
    }

    /// Forgets the last place that was marked, and what leads there.
    pub fn unmark(&mut self) {
        if self.places.pop().is_some() {
            let gone = PlaceId::at(self.places.len());
            self.arcs.retain(|arc| arc.from != gone && arc.to != gone);
        }
    }

    /// True if there is an arc between two places, in this direction.
    #[must_use]
    pub fn has_arc(&self, from: PlaceId, to: PlaceId) -> bool {
        let mut arcs = self.arcs.iter();
        arcs.any(|arc| arc.from == from && arc.to == to)
    }

    /// The place of that name.
    #[must_use]
    pub fn find(&self, name: &str) -> Option<PlaceId> {
        let found = self.places.iter().position(|place| *place.name == *name);
        found.map(PlaceId::at)
    }

    /// What is known of a place.
    #[must_use]
    pub fn place(&self, id: PlaceId) -> Option<&Place> {
        self.places.get(id.index())
    }

    fn place_mut(&mut self, id: PlaceId) -> Result<&mut Place, MapError> {
        self.places.get_mut(id.index()).ok_or(MapError::Place)
    }

    /// All places, as they were marked.
    pub fn places(&self) -> impl Iterator<Item = (PlaceId, &Place)> {
        let ids = (0..).map(PlaceId::at);
        ids.zip(&self.places)
    }

    /// All arcs.
    #[must_use]
    pub fn arcs(&self) -> &[Arc] {
        &self.arcs
    }
}

/// A name, if it is short enough.
fn written(name: &str) -> Result<Name, MapError> {
    Name::try_from(name).map_err(|_| MapError::Full)
}
