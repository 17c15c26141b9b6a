//! What the vehicle did over several cycles: compound motions, and what they add up to.

use super::reckoning::WidePose;
use crate::math::{Sum, limit, reduced, sin_cos, sinc};
use crate::vehicle::Twist;

/// A compound motion: what the vehicle did over several cycles, in the frame of its first pose.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Compound {
    ahead: Sum,
    aside: Sum,
    turned: Sum,
    /// ΔS: the length of the path, signed.
    travelled: f32,
    /// Total variation of S (m) and of α (rad).
    variation: Twist,
}

impl Compound {
    /// One arc: ΔS, Δα and their variations (theory section 2; the chord is ΔS sinc(Δα/2) long, at half the angle).
    #[must_use]
    pub fn arc(increment: Twist, variation: Twist) -> Self {
        let mut compound = Self::default();
        compound.append(increment, variation);
        compound
    }

    /// A motion by what it amounts to: ahead and aside (m) and turned (rad), ΔS (m), and its variations.
    #[must_use]
    pub fn of([ahead, aside, turned]: [f64; 3], travelled: f32, variation: Twist) -> Self {
        Self {
            ahead: Sum::from_f64(ahead),
            aside: Sum::from_f64(aside),
            turned: Sum::from_f64(turned),
            travelled,
            variation,
        }
    }

    pub(super) fn append(&mut self, increment: Twist, variation: Twist) {
        let half = 0.5 * increment.rotation;
        let chord = increment.translation * sinc(half);
        let (sin, cos) = sin_cos(self.turned.get() + half);
        self.ahead.add(chord * cos);
        self.aside.add(chord * sin);
        self.turned.add(increment.rotation);
        self.travelled += increment.translation;
        self.variation.translation += variation.translation;
        self.variation.rotation += variation.rotation;
    }

    /// The motion from one pose to another, with what the odometer says of it.
    pub(super) fn between(
        from: &WidePose,
        to: &WidePose,
        (travelled, variation): (f32, Twist),
    ) -> Self {
        let dx = to.x.minus(from.x).get();
        let dy = to.y.minus(from.y).get();
        let (sin, cos) = sin_cos(reduced(from.theta));
        Self {
            ahead: Sum::new(dx * cos + dy * sin),
            aside: Sum::new(dy * cos - dx * sin),
            turned: to.theta.minus(from.theta),
            travelled,
            variation,
        }
    }

    /// Ahead and aside (m), turned (rad).
    pub(super) fn reached(&self) -> (f32, f32, Sum) {
        (self.ahead.get(), self.aside.get(), self.turned)
    }

    /// ΔS (m) and Δα (rad).
    pub(super) fn increment(&self) -> Twist {
        Twist {
            translation: self.travelled,
            rotation: self.turned.get(),
        }
    }

    pub(super) fn variation(&self) -> Twist {
        self.variation
    }
}

/// The play (hysteresis) operator: a shadow that is dragged along only when the value leaves it by more than the half-width.
///
/// The total variation of the shadow is that of the motion, without the flicker of encoder counts (theory section 3).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Play {
    /// Value minus shadow.
    offset: f32,
}

impl Play {
    /// Moves the value; returns how far the shadow was dragged, ≥ 0.
    pub(super) fn advance(&mut self, increment: f32, half_width: f32) -> f32 {
        let offset = self.offset + increment;
        self.offset = limit(offset, half_width);
        (offset - self.offset).abs()
    }
}

/// What the vehicle did between two readings of its odometer.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Passage {
    /// ΔS (m) and Δα (rad).
    pub increment: Twist,
    /// Total variation of S (m) and of α (rad), without the encoders' flicker.
    pub variation: Twist,
}

/// ΔS (m), Δα (rad), and the total variations of S (m) and α (rad), since start-up. No correction changes it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Odometer {
    travelled: Sum,
    turned: Sum,
    translation: Sum,
    rotation: Sum,
}

impl Odometer {
    /// Nothing yet.
    pub(super) const START: Self = Self {
        travelled: Sum::new(0.0),
        turned: Sum::new(0.0),
        translation: Sum::new(0.0),
        rotation: Sum::new(0.0),
    };

    pub(super) fn add(&mut self, motion: &Compound) {
        self.travelled.add(motion.travelled);
        self.turned = self.turned.plus(motion.turned);
        self.translation.add(motion.variation.translation);
        self.rotation.add(motion.variation.rotation);
    }

    pub(super) fn is_finite(&self) -> bool {
        (self.travelled.get() + self.translation.get() + self.rotation.get()).is_finite()
    }

    /// ΔS since start-up, m.
    pub(super) fn travelled(&self) -> f64 {
        self.travelled.to_f64()
    }

    /// ΔS and the variations since an earlier state of it.
    pub(super) fn since(&self, earlier: &Self) -> (f32, Twist) {
        let difference = |a: Sum, b: Sum| a.minus(b).get();
        let variation = Twist {
            translation: difference(self.translation, earlier.translation),
            rotation: difference(self.rotation, earlier.rotation),
        };
        (difference(self.travelled, earlier.travelled), variation)
    }

    /// What the vehicle has done since an earlier state of it.
    #[must_use]
    pub fn passage_since(&self, earlier: &Self) -> Passage {
        let (travelled, variation) = self.since(earlier);
        Passage {
            increment: Twist {
                translation: travelled,
                rotation: self.turned.minus(earlier.turned).get(),
            },
            variation,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn play_ignores_flicker() {
        let mut play = Play::default();
        let mut total = 0.0;
        for k in 0..1000 {
            total += play.advance(if k % 2 == 0 { 1.0 } else { -1.0 }, 1.0);
        }
        assert_eq!(total, 0.0);
        for _ in 0..10 {
            total += play.advance(-1.0, 1.0);
        }
        assert_eq!(total, 9.0);
    }
}
