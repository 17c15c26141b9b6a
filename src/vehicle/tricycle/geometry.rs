//! From the front wheel to the middle of the rear axle and back.

use super::super::{Jacobian, Twist};
use crate::math::{sign, sin_cos, sqrt};

/// The steered wheel: where it points and how fast it rolls.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Steered {
    /// φ, rad: positive to the left.
    pub angle: f32,
    /// Speed of the circumference, m/s. Negative in reverse: the wheel is never turned round by more than 90° for it.
    pub speed: f32,
}

/// The geometry: the distance L from the rear axle to the front wheel's contact. The reference point is the middle of the rear axle, which moves along θ.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Geometry {
    wheel_base: f32,
    /// 1/L.
    curvature: f32,
}

impl Geometry {
    /// A geometry of the wheel base L (m), above 0.
    #[must_use]
    pub fn new(wheel_base: f32) -> Self {
        Self {
            wheel_base,
            curvature: 1.0 / wheel_base,
        }
    }

    /// L, m.
    #[must_use]
    pub fn wheel_base(&self) -> f32 {
        self.wheel_base
    }

    /// ΔS = d cos φ and Δα = d sin φ/L from the front wheel's displacement d (m), or speeds from a speed. Exact as long as φ (rad) stays; any φ will do,
    /// ±90° included. What is not finite counts as no motion, and as no steering.
    #[must_use]
    pub fn twist(&self, displacement: f32, steering: f32) -> Twist {
        let (sin, cos) = sin_cos(steering);
        Twist {
            translation: displacement * cos,
            rotation: displacement * sin * self.curvature,
        }
        .or_none()
    }

    /// Derivatives of [`Self::twist`] by d and φ.
    #[must_use]
    pub fn jacobian(&self, displacement: f32, steering: f32) -> Jacobian<1> {
        let (sin, cos) = sin_cos(steering);
        Jacobian {
            by_wheel: [Twist {
                translation: cos,
                rotation: sin * self.curvature,
            }],
            by_steering: Twist {
                translation: -displacement * sin,
                rotation: displacement * cos * self.curvature,
            }
            .or_none(),
        }
    }

    /// The inverse of [`Self::twist`]: what the front wheel must do for v_s and v_α.
    ///
    /// ```text
    ///     φ = atan(v_α L / v_s)     v_front = sign(v_s) √(v_s² + v_α² L²)
    /// ```
    ///
    /// with φ within ±90°: in reverse the wheel keeps pointing ahead and rolls back. Where v_s is 0, of either sign, φ is 90° to the side that v_α says, and
    /// the wheel rolls ahead. None if neither is wanted (then any angle will do: leave it as it is and stop), or what is wanted is not finite.
    #[must_use]
    pub fn command(&self, wanted: Twist) -> Option<Steered> {
        let ahead = wanted.translation;
        let aside = wanted.rotation * self.wheel_base;
        let direction = sign(ahead);
        let speed = sqrt(ahead * ahead + aside * aside);
        // Also false for a NaN, whose root is 0.
        (speed > 0.0 && speed.is_finite()).then(|| Steered {
            angle: libm::atan2f(direction * aside, ahead.abs()),
            speed: direction * speed,
        })
    }

    /// How fast the wheel is to roll while it stands at φ, whether φ is right for what is wanted or not yet: the part of the wanted velocity of its
    /// contact, (v_s, v_α L), that is along it. Nothing while it is 90° off, so a wheel that is far from its angle turns first; all of it in the end.
    #[must_use]
    pub fn speed_at(&self, wanted: Twist, steering: f32) -> f32 {
        let wanted = wanted.or_none();
        let (sin, cos) = sin_cos(steering);
        wanted.translation * cos + wanted.rotation * self.wheel_base * sin
    }
}
