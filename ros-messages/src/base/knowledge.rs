//! The base's parameters.

use std::collections::BTreeMap;

/// What kind of a vehicle it is, by the parameters that it has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Vehicle {
    /// Two wheels on one axle.
    #[default]
    Differential,
    /// Wheels that all point the same way.
    Synchro,
    /// One wheel in front, driven and steered.
    Tricycle,
    /// Two axles.
    Car,
}

/// The base's parameters by name, in the protocol's units.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Knowledge {
    values: BTreeMap<String, f64>,
}

impl Knowledge {
    /// Takes what follows `Param`: `name value unit`. False if it is none.
    pub fn note(&mut self, row: &str) -> bool {
        let mut words = row.split_ascii_whitespace();
        let (Some(name), Some(value)) = (words.next(), words.next()) else {
            return false;
        };
        let is_name = name.starts_with(|c: char| c.is_ascii_lowercase());
        match value.parse() {
            Ok(value) if is_name => {
                self.values.insert(name.to_owned(), value);
                true
            }
            _ => false,
        }
    }

    /// Takes a parameter, in the protocol's units.
    pub fn insert(&mut self, name: &str, value: f64) {
        self.values.insert(name.to_owned(), value);
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.values.len()
    }

    /// There are none.
    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    /// A parameter, if this base has it.
    pub fn get(&self, name: &str) -> Option<f64> {
        self.values.get(name).copied()
    }

    /// A parameter, or 0 of a base that does not have it.
    pub fn or_zero(&self, name: &str) -> f64 {
        self.get(name).unwrap_or(0.0)
    }

    /// What kind of a vehicle it is.
    pub fn vehicle(&self) -> Vehicle {
        if self.get("track").is_some() {
            Vehicle::Car
        } else if self.get("steer_max").is_some() {
            Vehicle::Tricycle
        } else if self.get("turn_counts").is_some() {
            Vehicle::Synchro
        } else {
            Vehicle::Differential
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vehicles_are_told_by_their_parameters() {
        let of = |names: &[&str]| {
            let mut knowledge = Knowledge::default();
            for name in names {
                assert!(knowledge.note(&format!("{name} 1 m")));
            }
            knowledge.vehicle()
        };
        assert_eq!(of(&["left_diameter"]), Vehicle::Differential);
        assert_eq!(of(&["turn_counts", "turn_lever"]), Vehicle::Synchro);
        assert_eq!(of(&["steer_max", "wheel_diameter"]), Vehicle::Tricycle);
        assert_eq!(of(&["steer_max", "track"]), Vehicle::Car);
    }

    #[test]
    fn what_is_no_parameter_is_none() {
        let mut knowledge = Knowledge::default();
        assert!(!knowledge.note("0.477 0.000000 0.000000"));
        assert!(!knowledge.note("wheel_base"));
        assert!(!knowledge.note("wheel_base x"));
        assert!(knowledge.is_empty());
        assert!(knowledge.note("wheel_base 0.2 m"));
        assert_eq!(knowledge.get("wheel_base"), Some(0.2));
        assert_eq!(knowledge.len(), 1);
        assert_eq!(knowledge.or_zero("track"), 0.0);
    }
}
