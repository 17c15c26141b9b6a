//! A car whose rear axle may be steered along with the front one [H §II.B].

mod geometry;

pub use geometry::{Geometry, RearSteering, Wheels};
