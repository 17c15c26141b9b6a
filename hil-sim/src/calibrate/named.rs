//! What the gains of a vehicle are called.

use vehicle_controller::params::{Id, Params, degrees};
use vehicle_controller::vehicle::gains::OFFSET;

/// A gain that a vehicle has.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NamedGain {
    /// Its place in a [`Calibration`](vehicle_controller::vehicle::Calibration).
    pub place: usize,
    /// Its parameter.
    pub id: Id,
    /// The theory's name; of an offset, its parameter's.
    pub name: &'static str,
    /// What 1 of it is in the parameter's unit.
    pub unit: f64,
}

/// The gains that a vehicle with these parameters has.
#[must_use]
pub fn named_gains(params: &Params) -> Vec<NamedGain> {
    let ids = params.gains().into_iter().enumerate();
    ids.filter_map(|(place, id)| {
        let id = id?;
        Some(NamedGain {
            place,
            id,
            name: match id {
                Id::GainRight => "k_r",
                Id::GainLeft => "k_l",
                Id::GainBase => "k_b",
                Id::GainDrive => "k_d",
                other => other.spec().name,
            },
            unit: if place == OFFSET {
                f64::from(degrees(1.0))
            } else {
                1.0
            },
        })
    })
    .collect()
}
