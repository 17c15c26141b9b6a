//! The relational map of Brooks (*Visual Map Making for a Mobile Robot*, 1985): places, and between them uncertain motions with bounds that are guarantees
//! (theory section 9).
//!
//! There are no global coordinates. Each place has a frame of its own, the pose in which it was marked; an arc bounds where one place's frame lies as seen
//! from another's. What follows from several arcs follows from bounds alone, so that nothing is ever excluded that may be true.
//!
//! * [`Disc`], [`Heading`]: bounds of a position and of a heading; [`Cylinder`]: of both; [`Motion`]: what a turn and a straight run are known to have been.
//! * [`Map`]: the graph of places and arcs, in fixed memory.
//! * [`Journey`], [`Map::is_plausible`], [`Map::identify`]: forward and backward reasoning; [`Sighting`]: what a landmark tells.
//! * [`Map::route`]: through freeways that are wide enough; [`Relations`]: the tightest chains of arcs; [`Map::crosses`]: whether two straight ways cross.
//! * [`Recorder`]: from what the base does to motions with bounds. [`Gaussian`]: beside each bound, what is likely.
//! * [`Atlas`]: all of it at work, piece by piece.
//!
//! All of it is pure: nothing here reads a clock or moves anything; only the atlas and its trail know an estimator. Lengths are metres, angles radians.

mod arrival;
mod atlas;
mod crossing;
mod cylinder;
mod disc;
mod gaussian;
mod graph;
mod heading;
mod leg;
mod name;
mod question;
mod real;
mod reason;
mod recorder;
mod relations;
mod route;
mod sighting;
mod trail;

pub use arrival::MEADOW;
pub use atlas::Atlas;
pub use crossing::{Crossing, crossing};
pub use cylinder::{Cylinder, Improper, Motion};
pub use disc::{Disc, FARTHEST};
pub use gaussian::Gaussian;
pub use graph::{Arc, LANDMARKS, Landmark, Map, MapError, Place, PlaceId};
pub use heading::Heading;
pub use leg::Leg;
pub use name::{Name, TooLong};
pub use question::{Answer, Presence, Question, There};
pub use reason::{Backward, Contradiction, Journey, JourneyError, Reach};
pub use recorder::{Bounds, Recorder, Step};
pub use relations::Relations;
pub use route::Route;
pub use sighting::Sighting;

/// What every computed bound is widened by, so that it holds though f64 rounds: 2⁻⁴⁰ of the lengths that went into it, a picometre a metre; and as many radians.
///
/// A sine or a cosine is good to 1e-14, and no result takes more than a dozen roundings of 1e-16 besides.
const ROUNDING: f64 = 9.094_947_017_729_282e-13;

/// What every computed radius is widened by besides, m: it is no less than that of a disc without size whose centre is rounded.
const GRAIN: f64 = 1e-12;
