//! A stretch of a drive: where it has led as seen from its start, by odometry alone.
//!
//! The estimate's covariances at both ends do not tell that: their errors are correlated, and corrections on the way change one and not the other. So the pose is
//! reckoned once more, from the stretch's start, certain of it, over the same increments and with the same noise; the gains' leverage goes along, so what
//! is constant over the stretch counts as constant.

use super::belief::Belief;
use super::compound::{Compound, Odometer, Passage};
use super::estimator::{Estimate, Estimator};
use super::reckoning::Reckoning;
use crate::math::sin_cos;
use crate::vehicle::Twist;

/// The pose since some instant; by default, since start-up.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stretch {
    reckoning: Reckoning,
    read: Odometer,
}

/// The arc that a passage is taken for. A reading apart it is small: sinc by its series is good to 1e-7 for 10°. ([`Compound::arc`] is the tick's, which has it
/// inlined as long as nobody else calls it.)
fn arc(passage: &Passage) -> Compound {
    let Twist {
        translation,
        rotation,
    } = passage.increment;
    let half = 0.5 * rotation;
    let chord = translation * (1.0 - half * half * (1.0 / 6.0 - half * half / 120.0));
    let (sin, cos) = sin_cos(half);
    let reached = [chord * cos, chord * sin, rotation].map(f64::from);
    Compound::of(reached, translation, passage.variation)
}

/// The odometer is read when S has varied by this much, m …
const WINDOW_DISTANCE: f32 = 0.005;
/// … or α by this much, rad (1°).
const WINDOW_ANGLE: f32 = 0.017_453_293;

impl Stretch {
    /// Since start-up.
    pub const START: Self = Self {
        reckoning: Reckoning::START,
        read: Odometer::START,
    };

    /// Begins where the vehicle is.
    #[must_use]
    pub fn begin(estimator: &Estimator) -> Self {
        Self {
            reckoning: Reckoning::default(),
            read: estimator.present_odometer(),
        }
    }

    /// Takes in what the vehicle has done since the last reading, once that is 5 mm or 1°: this is returned then. Call it after each tick, or as often as there is
    /// time for.
    #[inline(never)]
    pub fn advance(&mut self, estimator: &Estimator) -> Option<Passage> {
        let passage = estimator.present_odometer().passage_since(&self.read);
        let variation = passage.variation;
        let is_small = variation.translation < WINDOW_DISTANCE && variation.rotation < WINDOW_ANGLE;
        if is_small { None } else { self.read(estimator) }
    }

    /// Takes in whatever the vehicle has done since the last reading. `None` if that is nothing.
    #[inline(never)]
    pub fn read(&mut self, estimator: &Estimator) -> Option<Passage> {
        let odometer = estimator.present_odometer();
        if odometer == self.read {
            return None;
        }
        let passage = odometer.passage_since(&self.read);
        self.read = odometer;
        estimator.carry(&mut self.reckoning, &arc(&passage));
        Some(passage)
    }

    /// Where the vehicle was at the last reading as seen from the start, with the covariance that odometry alone has gathered since.
    #[must_use]
    #[inline(never)]
    pub fn estimate(&self, estimator: &Estimator) -> Estimate {
        Belief::from(&self.reckoning).estimate(&estimator.calibration().spread)
    }
}
