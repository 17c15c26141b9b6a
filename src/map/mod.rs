//! The relational map of Brooks (*Visual Map Making for a Mobile Robot*, 1985): places, and between them uncertain motions with bounds that are guarantees
//! (theory section 9).
//!
//! There are no global coordinates. Each place has a frame of its own, the pose in which it was marked; an arc bounds where one place's frame lies as seen
//! from another's. What follows from several arcs follows from bounds alone, so that nothing is ever excluded that may be true.
//!
//! * [`Disc`], [`Heading`]: bounds of a position and of a heading; [`Cylinder`]: of both; [`Motion`]: what a turn and a straight run are known to have been.
//! * [`Map`]: the graph of places and arcs, in fixed memory.
//! * [`Journey`], [`Map::is_plausible`], [`Map::identify`]: forward and backward reasoning.
//! * [`Map::route`]: through freeways that are wide enough; [`Map::relation`]: the tightest chain of arcs; [`Map::crosses`]: whether two straight ways cross.
//!
//! All of it is pure: nothing here reads a clock, moves anything or knows the controller. Lengths are metres, angles radians.

mod crossing;
mod cylinder;
mod disc;
mod graph;
mod heading;
mod reason;
mod route;

pub use crossing::{Crossing, crossing};
pub use cylinder::{Cylinder, Improper, Motion};
pub use disc::{Disc, FARTHEST};
pub use graph::{Arc, LANDMARKS, Map, MapError, Name, Place, PlaceId};
pub use heading::Heading;
pub use reason::{Contradiction, Journey, JourneyError};
pub use route::Route;

/// What every computed bound is widened by, so that it holds in f32 too: 2⁻²⁰ of the lengths that went into it, a micrometre a metre; and as many radians.
///
/// It is 16 roundings. Turning a length and scaling it by a cosine takes 9 at most: sine and cosine are good to 2 each ([`sin_cos`](crate::math::sin_cos)),
/// the cosine of the scale to 2, products and sums to ½ each. A radius that grows by a length times a sine takes 5 more.
const ROUNDING: f32 = 9.536_743e-7;

/// What every computed radius is widened by besides, m: squares below an f32's range are of less.
const GRAIN: f32 = 1e-9;
