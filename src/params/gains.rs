//! The parameters that calibration learns.

use super::{Id, Params, gains_of, prior};
use crate::vehicle::gains::{GAINS, OFFSET, ROOT};
use crate::vehicle::{Calibration, Spread};

/// The gain of a vehicle in each place of [`Calibration`]; nothing where it has none.
pub(super) type GainIds = [Option<Id>; GAINS];

/// The root of the gains' covariance, in the order of [`Spread`]: by rows.
const SPREAD: [Id; ROOT] = [
    Id::SpreadRr,
    Id::SpreadLr,
    Id::SpreadLl,
    Id::SpreadBr,
    Id::SpreadBl,
    Id::SpreadBb,
    #[cfg(feature = "vehicles")]
    Id::SpreadOr,
    #[cfg(feature = "vehicles")]
    Id::SpreadOl,
    #[cfg(feature = "vehicles")]
    Id::SpreadOb,
    #[cfg(feature = "vehicles")]
    Id::SpreadOo,
];

impl Params {
    /// The parameters that are gains, in the order of [`Calibration`]; nothing where this vehicle has none.
    #[must_use]
    pub fn gains(&self) -> [Option<Id>; GAINS] {
        gains_of(self.vehicle)
    }

    /// The parameters that are the root of the gains' covariance, in the order of [`Spread`].
    #[must_use]
    pub fn spread() -> [Id; ROOT] {
        SPREAD
    }

    /// The gains' values: ratios, and an angle or a curvature in radians.
    pub(super) fn gain_values(&self) -> [f32; GAINS] {
        let mut values = Calibration::NOMINAL;
        for (place, (value, id)) in values.iter_mut().zip(self.gains()).enumerate() {
            if let Some(id) = id {
                *value = if place == OFFSET {
                    super::radians(self.get(id))
                } else {
                    self.get(id)
                };
            }
        }
        values
    }

    /// What is known of the gains: what was learned, or the prior (theory section 6).
    pub(crate) fn calibration(&self) -> Calibration {
        let root = SPREAD.map(|id| self.get(id));
        let spread = if root == [0.0; ROOT] {
            prior(self)
        } else {
            Spread { root }
        };
        Calibration {
            gains: self.gain_values(),
            spread,
        }
    }

    /// Takes over what has been learned of the gains.
    pub fn learn(&mut self, calibration: &Calibration) {
        let learned = self.gains().into_iter().zip(calibration.gains);
        for (place, (id, gain)) in learned.enumerate() {
            let value = if place == OFFSET {
                super::degrees(gain)
            } else {
                gain
            };
            if let Some(id) = id {
                self.put(id, value);
            }
        }
        for (id, element) in SPREAD.into_iter().zip(calibration.spread.root) {
            self.put(id, element);
        }
    }

    /// Forgets it.
    pub fn unlearn(&mut self) {
        self.learn(&Calibration::default());
    }

    /// The gains are what they are, but as uncertain as if nothing had been learned.
    pub fn doubt_gains(&mut self) {
        for id in SPREAD {
            self.put(id, 0.0);
        }
    }
}
