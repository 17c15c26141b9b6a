//! What a map is asked and told, and what it says.

use super::{Crossing, Cylinder, Gaussian, Name, PlaceId, Sighting};

/// A question, or what is told.
#[derive(Clone, Copy, Debug, PartialEq)]
// So that the first one is all zeros.
#[repr(u8)]
pub enum Question {
    /// Where may the base be?
    Where,
    /// This is a place of that name, with a meadow of that radius, m. If it is known, the base is back in it.
    Mark(Name, Option<f64>),
    /// That landmark is in sight.
    Sight(Name, Option<Sighting>),
    /// Do the straight ways from the first place to the second and from the third to the fourth cross?
    Crosses([PlaceId; 4]),
}

/// What there is to say.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Answer {
    /// The place is new, or its meadow is.
    Marked(PlaceId),
    /// The base is in this place; so many circles have shrunk.
    Confirmed(PlaceId, usize),
    /// The landmark is a new one of this place.
    Added(PlaceId),
    /// So many places fit, which is more than one.
    Unsure(usize),
    /// What [`Atlas::there`](super::Atlas::there) needs.
    Here(Presence),
    /// Whether they do.
    Crosses(Crossing),
}

/// Where the base was when it was asked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Presence {
    /// As seen from the start of the journey; `None` if it is anywhere.
    pub(super) known: Option<(Cylinder, Gaussian)>,
}

/// Whether the base is at some place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct There {
    /// False only if it is impossible.
    pub is_plausible: bool,
    /// How probable it is. `None` if nothing is known of the way there.
    pub probability: Option<f32>,
}
