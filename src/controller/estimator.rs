//! Pose and covariance by odometry (theory sections 2, 3 and 6).

use super::belief::Belief;
use super::compound::Play;
pub use super::compound::{Compound, Odometer, Passage};
use super::messages::Config;
use super::reckoning::{Reckoning, WidePose};
use crate::math::positive_part;
use crate::vehicle::gains::{OFFSET, OFFSETS};
use crate::vehicle::{Calibration, GAINS, Influence, Twist};
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
    /// κ_steer, where the gains have an offset: a random part of the steering angle, white along the path, rad²·m. Over a distance ΔS, ∫δφ dS has the
    /// variance κ_steer |ΔS|.
    pub steering: [f32; OFFSETS],
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

    /// Propagates over a compound motion of a vehicle whose gains are known [C §5].
    pub fn propagate(&mut self, motion: &Compound, noise: &Noise) {
        let mut reckoning = Reckoning::from(&Belief::from(*self));
        reckoning.propagate(motion, noise, &Influence::default());
        let belief = Belief::from(&reckoning);
        (self.pose, self.covariance) = (belief.pose, belief.own);
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
    /// What the odometer showed then.
    odometer: Odometer,
    /// What replaces the snapshot's estimate …
    after: Reckoning,
    /// … and what is known of the gains.
    calibration: Calibration,
}

impl Correction {
    /// The gains from here on.
    #[must_use]
    pub fn gains(&self) -> [f32; GAINS] {
        self.calibration.gains
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
    odometer: Odometer,
    noise: Noise,
    calibration: Calibration,
    influence: Influence,
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
    /// Starts at the origin, certain of it and of its gains.
    #[must_use]
    pub fn new(noise: Noise) -> Self {
        Self {
            reckoning: Reckoning::default(),
            since: Compound::default(),
            plays: [Play::default(); 2],
            odometer: Odometer::default(),
            noise,
            calibration: Calibration::default(),
            influence: Influence::default(),
            is_finite: true,
            edition: 0,
        }
    }

    /// Goes on from what was known and the motion since: an estimator as its parts were written down elsewhere.
    #[must_use]
    pub fn resume(
        belief: &Belief,
        since: Compound,
        noise: Noise,
        calibration: Calibration,
        influence: Influence,
    ) -> Self {
        Self {
            reckoning: Reckoning::from(belief),
            since,
            calibration,
            influence,
            ..Self::new(noise)
        }
    }

    /// Takes other parameters over; what was travelled keeps its old ones. `influence` is that of its gains.
    pub fn configure<C>(&mut self, config: &Config<C>, influence: Influence) {
        self.fold();
        if config.anew || !config.calibration.is_same(&self.calibration) {
            self.reckoning.absorb(&self.calibration.spread);
        }
        self.noise = config.noise;
        self.calibration = config.calibration;
        self.influence = influence;
    }

    /// ΔS since start-up, m.
    #[must_use]
    pub fn travelled(&self) -> f64 {
        self.present_odometer().travelled()
    }

    /// By how much a straight motion of ΔS (m) is longer for each gain, m; and the random part of its variance, m².
    #[must_use]
    pub fn straight(&self, travelled: f32) -> ([f32; GAINS], f32) {
        let motion = Twist {
            translation: travelled,
            rotation: 0.0,
        };
        let mut effects = self.influence.of(motion).map(|effect| effect.translation);
        // Going straight, the wheels point straight ahead, wherever they point now: an offset that is small makes the run no longer.
        if let Some(offset) = effects.get_mut(OFFSET) {
            *offset = 0.0;
        }
        (effects, self.noise.translation * travelled.abs())
    }

    /// What is known of the gains.
    #[must_use]
    pub fn calibration(&self) -> &Calibration {
        &self.calibration
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
        let travelled = self.since.variation();
        // Written so that a NaN is folded, and found, at once.
        if !(travelled.translation < WINDOW_DISTANCE && travelled.rotation < WINDOW_ANGLE) {
            self.fold();
        }
    }

    /// What the gains do to the motion from here on: of a vehicle that steers it is another in each tick. What has moved by less than the window since the
    /// covariance was last propagated (10 mm or 2°) takes it, too.
    #[inline]
    pub fn set_influence(&mut self, influence: Influence) {
        self.influence = influence;
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
        // Of vehicles without an offset it changes seldom.
        if OFFSETS == 1 {
            copy.influence = self.influence;
        }
    }

    fn fold(&mut self) {
        self.edition = self.edition.wrapping_add(1);
        self.reckoning
            .propagate(&self.since, &self.noise, &self.influence);
        self.odometer.add(&self.since);
        self.since = Compound::default();
        self.is_finite = self.reckoning.is_finite() && self.odometer.is_finite();
    }

    /// The estimate as of now.
    #[must_use]
    pub fn present(&self) -> Estimate {
        self.belief().estimate(&self.calibration.spread)
    }

    /// What is known of the pose now, apart from the gains: the remainder is added on a copy, and what rounding did to the covariance is projected away.
    #[must_use]
    pub fn belief(&self) -> Belief {
        let mut reckoning = self.reckoning;
        reckoning.propagate(&self.since, &self.noise, &self.influence);
        let mut belief = Belief::from(&reckoning);
        belief.own = positive_part(&belief.own);
        belief
    }

    /// The pose as of now, without the covariance's cost.
    #[must_use]
    pub fn pose(&self) -> Pose {
        let WidePose { x, y, theta } = self.present_pose();
        Pose {
            x: x.to_f64(),
            y: y.to_f64(),
            theta: theta.to_f64(),
        }
    }

    fn present_pose(&self) -> WidePose {
        let mut pose = self.reckoning.pose;
        pose.advance(&self.since);
        pose
    }

    /// The odometer as of now.
    #[must_use]
    pub fn present_odometer(&self) -> Odometer {
        let mut odometer = self.odometer;
        odometer.add(&self.since);
        odometer
    }

    /// Propagates something else over a motion, with the same noise and gains.
    pub(super) fn carry(&self, reckoning: &mut Reckoning, motion: &Compound) {
        reckoning.propagate(motion, &self.noise, &self.influence);
    }

    /// A correction that makes `after` of what is known now of the pose, and `calibration` of what is known of the gains.
    #[must_use]
    pub fn correction(&self, after: &Belief, calibration: Calibration) -> Correction {
        Correction {
            before: self.present_pose(),
            odometer: self.present_odometer(),
            after: Reckoning::from(after),
            calibration,
        }
    }

    /// Applies a correction that was computed from an earlier copy of this estimator. `influence` is that of its gains.
    pub fn apply(&mut self, correction: &Correction, influence: Influence) {
        // Where nobody knows any more what it has done since, nothing is put on top.
        let since = if self.is_finite {
            let odometer = self.present_odometer().since(&correction.odometer);
            Compound::between(&correction.before, &self.present_pose(), odometer)
        } else {
            Compound::default()
        };
        self.since = since;
        self.odometer = if self.is_finite {
            correction.odometer
        } else {
            Odometer::default()
        };
        self.reckoning = correction.after;
        self.calibration = correction.calibration;
        self.influence = influence;
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
        steering: [0.0; OFFSETS],
    };

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
        let mut after = late.belief();
        after.pose.x += 0.05;
        after.pose.theta += 0.1;
        after.own *= 0.5;
        let correction = late.correction(&after, Calibration::default());
        prompt.apply(&correction, Influence::default());
        for _ in 0..200 {
            late.advance(increment, resolution);
            prompt.advance(increment, resolution);
        }
        late.apply(&correction, Influence::default());
        let (a, b) = (late.present(), prompt.present());
        // The window in between is propagated in one step or in several: both are exact in the mean.
        assert!((a.pose.x - b.pose.x).abs() < 1e-7);
        assert!((a.pose.y - b.pose.y).abs() < 1e-7);
        assert!((a.pose.theta - b.pose.theta).abs() < 1e-7);
        assert!((a.covariance - b.covariance).abs().max() < 1e-3 * b.covariance.abs().max());
    }

    #[cfg(feature = "vehicles")]
    #[test]
    fn a_copy_knows_how_the_wheels_are_steered_now() {
        let mut estimator = Estimator::new(Noise {
            steering: [1e-4],
            ..NOISE
        });
        let mut copy = estimator;
        let increment = Twist {
            translation: 1e-3,
            rotation: 1e-4,
        };
        for tick in 0..1000 {
            let mut influence = Influence::default();
            influence.by_gain[OFFSET] = [0.1, 0.2, 0.8, 0.001 * tick as f32];
            estimator.set_influence(influence);
            estimator.advance(increment, Twist::ZERO);
            estimator.update_copy(&mut copy);
            assert_eq!(copy.belief(), estimator.belief());
        }
    }
}
