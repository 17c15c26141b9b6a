//! Where things are, seen from the vehicle.

use super::Vertex;
use crate::controller::Pose;
use crate::math::{sin_cos, wrap};

/// How far ahead and to the left of the pose a point lies, along a heading (rad); m. The difference is taken in f64: on a large floor an f32 has no
/// micrometres.
pub(super) fn offset(pose: &Pose, point: &Vertex, heading: f32) -> (f32, f32) {
    let (dx, dy) = ((point.x - pose.x) as f32, (point.y - pose.y) as f32);
    let (sin, cos) = sin_cos(heading);
    (dx * cos + dy * sin, dy * cos - dx * sin)
}

/// The turn from the pose's heading to another one, within ±π.
pub(super) fn turn_to(pose: &Pose, heading: f32) -> f32 {
    wrap(f64::from(heading) - pose.theta) as f32
}
