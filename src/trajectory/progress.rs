//! What is looked at on the way, and what comes of it.

use crate::controller::{AxisCommand, AxisSnapshot, Pose, State};

/// What the follower looks at. A command that it has given must be in it, and a tick must have passed since: wait until
/// [`Interface::is_idle`](crate::controller::Interface::is_idle).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// The estimate.
    pub pose: Pose,
    /// The translation, m.
    pub translation: AxisSnapshot,
    /// The rotation, rad.
    pub rotation: AxisSnapshot,
    /// Time since the last update, s: what is due by half of it is done now.
    pub interval: f32,
    /// Time from the estimate to where an order takes effect, s: the next tick.
    pub delay: f32,
}

impl Progress {
    /// What the translation goes on by until an order takes effect, m.
    pub(super) fn moves(&self) -> f32 {
        self.translation.reference_speed * self.delay
    }

    /// What the rotation goes on by, rad.
    pub(super) fn turns(&self) -> f32 {
        self.rotation.reference_speed * self.delay
    }
}

/// A command to give.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Order {
    /// To the translation.
    Move(AxisCommand),
    /// To the rotation.
    Turn(AxisCommand),
}

/// What has happened on a path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum PathEvent {
    /// This posture, counted from 1, is behind the vehicle.
    Posture(u32),
    /// So is the last one: the vehicle stands there.
    Done,
}

/// How near to a posture the vehicle has to stop.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Tolerance {
    /// m.
    pub distance: f32,
    /// rad.
    pub heading: f32,
}

/// True if the reference stands.
pub(super) fn rests(axis: &AxisSnapshot) -> bool {
    axis.state == State::Hold && axis.reference_speed == 0.0
}
