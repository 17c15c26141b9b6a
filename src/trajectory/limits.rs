//! What a vehicle can do, as far as the shape of a path depends on it.

use crate::math::smaller;

/// Speeds, accelerations and curvatures that a path must not ask to exceed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct KinematicLimits {
    /// v_s, m/s.
    pub speed: f32,
    /// a_s, m/s².
    pub acceleration: f32,
    /// v_α, rad/s.
    pub turn_speed: f32,
    /// a_α, rad/s².
    pub turn_acceleration: f32,
    /// v_α/v_s, 1/m; infinite for a vehicle that turns in place.
    pub max_curvature: f32,
    /// By how much the curvature may change in a second, 1/(m s): the steering's speed. Infinite for a vehicle that does not steer.
    pub curvature_rate: f32,
    /// What the fastest wheel can roll, m/s.
    pub wheel_speed: f32,
    /// What a rotation adds to the fastest wheel, m: half the wheel base of a differential drive. |v_s| + |v_α| times this is at most the wheel speed.
    pub half_track: f32,
    /// No corner is driven more slowly than this, m/s: the wheels' stiction has the better of it.
    pub slowest: f32,
    /// The vehicle turns without moving, too.
    pub turns_in_place: bool,
}

impl KinematicLimits {
    /// True if there is something to go and to turn with.
    #[must_use]
    pub fn can_move(&self) -> bool {
        let Self {
            speed,
            acceleration,
            turn_speed,
            turn_acceleration,
            wheel_speed,
            ..
        } = *self;
        [
            speed,
            acceleration,
            turn_speed,
            turn_acceleration,
            wheel_speed,
        ]
        .iter()
        .all(|limit| *limit > 0.0)
    }

    /// The largest |v_α| that goes with v_s ≥ 0; 0 or less if there is none.
    #[must_use]
    pub fn turn_speed_at(&self, speed: f32) -> f32 {
        let left = self.wheel_speed - speed;
        // A vehicle that stands has no curvature: 0 times infinity.
        let steered = if self.max_curvature.is_finite() {
            smaller(self.max_curvature * speed, self.turn_speed)
        } else {
            self.turn_speed
        };
        // Without a track no rotation loads a wheel.
        if self.half_track > 0.0 {
            smaller(left / self.half_track, steered)
        } else if left >= 0.0 {
            steered
        } else {
            0.0
        }
    }

    /// The largest a_α that goes with v_s > 0, rad/s²: k v_s² with the steering's k.
    #[must_use]
    pub fn turn_acceleration_at(&self, speed: f32) -> f32 {
        smaller(self.curvature_rate * speed, self.turn_acceleration)
    }

    /// The largest v_s straight ahead, m/s.
    #[must_use]
    pub fn straight_speed(&self) -> f32 {
        smaller(self.speed, self.steerable_speed())
    }

    /// The largest v_s at which there is something left to turn with, m/s: as fast as its wheels go, a vehicle could not steer.
    #[must_use]
    pub fn steerable_speed(&self) -> f32 {
        /// Of the wheels' speed.
        const STRAIGHT: f32 = 0.9;
        if self.half_track > 0.0 {
            STRAIGHT * self.wheel_speed
        } else {
            self.wheel_speed
        }
    }
}
