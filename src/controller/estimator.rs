//! Pose and covariance by odometry (theory sections 2 and 3).

use super::reckoning::{Reckoning, WidePose};
use crate::math::{Sum, limit, positive_part, reduced, sin_cos, sinc};
use crate::vehicle::Twist;
use nalgebra::Matrix3;

/// Position and heading of the virtual vehicle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Pose {
    /// Ahead of the origin, m.
    pub x: f64,
    /// To the left of the origin, m.
    pub y: f64,
    /// Counter-clockwise, rad, unwrapped: whole turns are kept.
    pub theta: f64,
}

/// The random part of the odometric error (theory section 3).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Noise {
    /// κ_S: variance of a displacement per distance, m²/m.
    pub translation: f32,
    /// κ_drift: variance of the heading per distance, rad²/m.
    pub drift: f32,
    /// κ_rot: variance of the heading per rotation, rad²/rad.
    pub rotation: f32,
}

/// A compound motion: what the vehicle did over several cycles, in the frame of its first pose.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Compound {
    ahead: Sum,
    aside: Sum,
    turned: Sum,
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

    /// A motion by what it amounts to: ahead and aside (m) and turned (rad), and its variations.
    #[must_use]
    pub fn of([ahead, aside, turned]: [f64; 3], variation: Twist) -> Self {
        Self {
            ahead: Sum::from_f64(ahead),
            aside: Sum::from_f64(aside),
            turned: Sum::from_f64(turned),
            variation,
        }
    }

    fn append(&mut self, increment: Twist, variation: Twist) {
        let half = 0.5 * increment.rotation;
        let chord = increment.translation * sinc(half);
        let (sin, cos) = sin_cos(self.turned.get() + half);
        self.ahead.add(chord * cos);
        self.aside.add(chord * sin);
        self.turned.add(increment.rotation);
        self.variation.translation += variation.translation;
        self.variation.rotation += variation.rotation;
    }

    /// The motion from one pose to another.
    fn between(from: &WidePose, to: &WidePose, variation: Twist) -> Self {
        let dx = to.x.minus(from.x).get();
        let dy = to.y.minus(from.y).get();
        let (sin, cos) = sin_cos(reduced(from.theta));
        Self {
            ahead: Sum::new(dx * cos + dy * sin),
            aside: Sum::new(dy * cos - dx * sin),
            turned: to.theta.minus(from.theta),
            variation,
        }
    }

    /// Ahead and aside (m), turned (rad).
    pub(super) fn reached(&self) -> (f32, f32, Sum) {
        (self.ahead.get(), self.aside.get(), self.turned)
    }

    pub(super) fn variation(&self) -> Twist {
        self.variation
    }
}

/// The play (hysteresis) operator: a shadow that is dragged along only when the value leaves it by more than the half-width.
///
/// The total variation of the shadow is that of the motion, without the flicker of encoder counts (theory section 3).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Play {
    /// Value minus shadow.
    offset: f32,
}

impl Play {
    /// Moves the value; returns how far the shadow was dragged, ≥ 0.
    fn advance(&mut self, increment: f32, half_width: f32) -> f32 {
        let offset = self.offset + increment;
        self.offset = limit(offset, half_width);
        (offset - self.offset).abs()
    }
}

/// An estimate of the pose with its covariance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// x, y (m), θ (rad).
    pub pose: Pose,
    /// Covariance of (x, y, θ): m², m·rad, rad². In f64: after a kilometre straight on, the variance along the path is a millionth of that across it,
    /// and at any heading but the axes' an f32 would lose it.
    pub covariance: Matrix3<f64>,
}

impl Estimate {
    /// A pose known exactly.
    #[must_use]
    pub fn certain(pose: Pose) -> Self {
        Self {
            pose,
            covariance: Matrix3::zeros(),
        }
    }

    /// True if every number is finite and none is beyond use: 10 000 km, some 30 000 turns, a variance of 10¹³.
    #[must_use]
    pub fn is_plausible(&self) -> bool {
        let Pose { x, y, theta } = self.pose;
        x.abs() <= 1.01e7
            && y.abs() <= 1.01e7
            && theta.abs() <= 2e5
            && self.covariance.iter().all(|e| e.abs() <= 1e13)
    }

    /// Propagates over a compound motion [C §5].
    pub fn propagate(&mut self, motion: &Compound, noise: &Noise) {
        let mut reckoning = Reckoning::from(&*self);
        reckoning.propagate(motion, noise);
        *self = Self::from(&reckoning);
    }
}

/// F, the derivative of a pose with respect to an earlier one that lies (Δx, Δy) behind.
pub(super) fn transport(dx: f64, dy: f64) -> Matrix3<f64> {
    Matrix3::new(1.0, 0.0, -dy, 0.0, 1.0, dx, 0.0, 0.0, 1.0)
}

/// A correction that was computed from a snapshot: it replaces what the snapshot said, and what the vehicle has done since is put on top.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Correction {
    /// The pose that the snapshot held.
    before: WidePose,
    /// Variation of S and α since start-up that the snapshot held.
    variation: VariationTotal,
    /// The estimate that replaces the snapshot's.
    after: Reckoning,
}

/// Total variations of S (m) and α (rad) since start-up.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct VariationTotal {
    translation: Sum,
    rotation: Sum,
}

impl VariationTotal {
    fn add(&mut self, variation: Twist) {
        self.translation.add(variation.translation);
        self.rotation.add(variation.rotation);
    }

    fn is_finite(&self) -> bool {
        (self.translation.get() + self.rotation.get()).is_finite()
    }

    fn since(&self, earlier: &Self) -> Twist {
        let difference = |a: Sum, b: Sum| a.minus(b).get();
        Twist {
            translation: difference(self.translation, earlier.translation),
            rotation: difference(self.rotation, earlier.rotation),
        }
    }
}

/// Dead reckoning: the estimate as of some centimetres ago, and the motion since.
///
/// F is exact for a compound motion, so the covariance is propagated by distance, not by time: it grows by what was travelled, and most ticks are
/// spared the work.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimator {
    reckoning: Reckoning,
    since: Compound,
    plays: [Play; 2],
    /// Up to the estimate; `since` has the rest.
    total: VariationTotal,
    noise: Noise,
    /// Every number of the estimate is one.
    is_finite: bool,
    /// Counts the changes of what changes seldom.
    edition: u32,
}

/// The covariance is propagated each time S has varied by this much, m …
const WINDOW_DISTANCE: f32 = 0.01;
/// … or α by this much, rad (2°).
const WINDOW_ANGLE: f32 = 0.034_906_585;

impl Estimator {
    /// Starts at the origin, certain of it.
    #[must_use]
    pub fn new(noise: Noise) -> Self {
        Self {
            reckoning: Reckoning::default(),
            since: Compound::default(),
            plays: [Play::default(); 2],
            total: VariationTotal::default(),
            noise,
            is_finite: true,
            edition: 0,
        }
    }

    /// Goes on from an estimate and the motion since: an estimator as its parts were written down elsewhere.
    #[must_use]
    pub fn resume(estimate: Estimate, since: Compound, noise: Noise) -> Self {
        Self {
            reckoning: Reckoning::from(&estimate),
            since,
            ..Self::new(noise)
        }
    }

    /// Takes new noise parameters over; what was travelled keeps its old ones.
    pub fn set_noise(&mut self, noise: Noise) {
        self.fold();
        self.noise = noise;
    }

    /// Takes in an increment; `resolution` is what one encoder count amounts to.
    pub fn advance(&mut self, increment: Twist, resolution: Twist) {
        if increment == Twist::ZERO {
            return;
        }
        let [translation, rotation] = &mut self.plays;
        let variation = Twist {
            translation: translation.advance(increment.translation, resolution.translation),
            rotation: rotation.advance(increment.rotation, resolution.rotation),
        };
        self.since.append(increment, variation);
        let travelled = &self.since.variation;
        // Written so that a NaN is folded, and found, at once.
        if !(travelled.translation < WINDOW_DISTANCE && travelled.rotation < WINDOW_ANGLE) {
            self.fold();
        }
    }

    /// False once a number of the estimate is infinite or none. Only a new estimate mends that: see [`apply`](Self::apply).
    #[inline]
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.is_finite
    }

    /// Makes `copy` a copy; what changes seldom is copied when it has changed.
    pub(super) fn update_copy(&self, copy: &mut Self) {
        if copy.edition != self.edition {
            *copy = *self;
            return;
        }
        copy.since = self.since;
        copy.plays = self.plays;
    }

    fn fold(&mut self) {
        self.edition = self.edition.wrapping_add(1);
        self.reckoning.propagate(&self.since, &self.noise);
        self.total.add(self.since.variation);
        self.since = Compound::default();
        self.is_finite = self.reckoning.is_finite() && self.total.is_finite();
    }

    /// The estimate as of now: the remainder is added on a copy, and what rounding did to the covariance is projected away.
    #[must_use]
    pub fn present(&self) -> Estimate {
        let mut reckoning = self.reckoning;
        reckoning.propagate(&self.since, &self.noise);
        let mut estimate = Estimate::from(&reckoning);
        estimate.covariance = positive_part(&estimate.covariance);
        estimate
    }

    /// The pose as of now, without the covariance's cost.
    fn present_pose(&self) -> WidePose {
        let mut pose = self.reckoning.pose;
        pose.advance(&self.since);
        pose
    }

    /// Total variations as of now.
    fn present_total(&self) -> VariationTotal {
        let mut total = self.total;
        total.add(self.since.variation);
        total
    }

    /// A correction that makes `after` of the present estimate.
    #[must_use]
    pub fn correction(&self, after: Estimate) -> Correction {
        Correction {
            before: self.present_pose(),
            variation: self.present_total(),
            after: Reckoning::from(&after),
        }
    }

    /// Applies a correction that was computed from an earlier copy of this estimator.
    pub fn apply(&mut self, correction: &Correction) {
        // Where nobody knows any more what it has done since, nothing is put on top.
        let since = if self.is_finite {
            let variation = self.present_total().since(&correction.variation);
            Compound::between(&correction.before, &self.present_pose(), variation)
        } else {
            Compound::default()
        };
        self.since = since;
        self.total = if self.is_finite {
            correction.variation
        } else {
            VariationTotal::default()
        };
        self.reckoning = correction.after;
        self.is_finite = true;
        self.edition = self.edition.wrapping_add(1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOISE: Noise = Noise {
        translation: 1e-5,
        drift: 2.7e-5,
        rotation: 2e-4,
    };

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

    #[test]
    fn a_late_correction_keeps_the_motion_since() {
        let resolution = Twist {
            translation: 1e-4,
            rotation: 5e-4,
        };
        let increment = Twist {
            translation: 3e-4,
            rotation: 1e-4,
        };
        let mut late = Estimator::new(NOISE);
        for _ in 0..1000 {
            late.advance(increment, resolution);
        }
        let mut prompt = late;
        let mut after = late.present();
        after.pose.x += 0.05;
        after.pose.theta += 0.1;
        after.covariance *= 0.5;
        let correction = late.correction(after);
        prompt.apply(&correction);
        for _ in 0..200 {
            late.advance(increment, resolution);
            prompt.advance(increment, resolution);
        }
        late.apply(&correction);
        let (a, b) = (late.present(), prompt.present());
        // The window in between is propagated in one step or in several: both are exact in the mean.
        assert!((a.pose.x - b.pose.x).abs() < 1e-7);
        assert!((a.pose.y - b.pose.y).abs() < 1e-7);
        assert!((a.pose.theta - b.pose.theta).abs() < 1e-7);
        assert!((a.covariance - b.covariance).abs().max() < 1e-3 * b.covariance.abs().max());
    }
}
