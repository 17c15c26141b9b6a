//! What the base has done since some instant: the bound, and what is likely.

use super::{Bounds, Gaussian, Recorder, Step};
use crate::controller::{Estimate, Estimator, Passage, Stretch};

/// A drive since some instant, its motions bounded, `MOTIONS` of them kept apart; and reckoned by the estimator's own increments.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Trail<const MOTIONS: usize> {
    pub(super) recorder: Recorder<MOTIONS>,
    pub(super) stretch: Stretch,
}

impl From<&Passage> for Step {
    fn from(passage: &Passage) -> Self {
        Self {
            travelled: passage.increment.translation.into(),
            turned: passage.increment.rotation.into(),
            path: passage.variation.translation.into(),
            swing: passage.variation.rotation.into(),
        }
    }
}

impl From<&Estimate> for Gaussian {
    fn from(estimate: &Estimate) -> Self {
        let (pose, c) = (&estimate.pose, &estimate.covariance);
        Self {
            mean: [pose.x, pose.y, crate::math::wrap(pose.theta)].map(|number| number as f32),
            covariance: [c.m11, c.m12, c.m13, c.m22, c.m23, c.m33].map(|number| number as f32),
        }
    }
}

impl<const MOTIONS: usize> Trail<MOTIONS> {
    /// Since start-up.
    pub(super) const fn new() -> Self {
        Self {
            recorder: Recorder::new(),
            stretch: Stretch::START,
        }
    }

    pub(super) fn begin(estimator: &Estimator) -> Self {
        Self {
            recorder: Recorder::new(),
            stretch: Stretch::begin(estimator),
        }
    }

    /// Takes in what has been done since, if it is a step's worth.
    pub(super) fn advance(&mut self, estimator: &Estimator, bounds: &Bounds) {
        if let Some(passage) = self.stretch.advance(estimator) {
            self.recorder.take(&Step::from(&passage), bounds);
        }
    }

    /// Takes in all that has been done.
    pub(super) fn read(&mut self, estimator: &Estimator, bounds: &Bounds) {
        if let Some(passage) = self.stretch.read(estimator) {
            self.recorder.take(&Step::from(&passage), bounds);
        }
    }

    pub(super) fn likely(&self, estimator: &Estimator) -> Gaussian {
        Gaussian::from(&self.stretch.estimate(estimator))
    }

    /// Goes on from where another one began.
    pub(super) fn resume<const OTHER: usize>(&mut self, other: &Trail<OTHER>) {
        self.recorder.resume(&other.recorder);
        self.stretch = other.stretch;
    }
}
