//! The base's parameters, and its estimate.

use crate::frames::Pose;
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

/// What `GetEstPos` answers, in SI units.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Estimate {
    /// Where it is.
    pub pose: Pose,
    /// Covariance of x, y and θ: m², m·rad, rad².
    pub covariance: [[f64; 3]; 3],
}

impl Estimate {
    /// Reads `EstPos x y θ Cxx Cxy Cxθ Cyy Cyθ Cθθ`.
    pub fn parse(reply: &str) -> Option<Self> {
        let numbers = reply.strip_prefix("EstPos ")?;
        let numbers: Result<Vec<f64>, _> = numbers
            .split_ascii_whitespace()
            .map(str::parse::<f64>)
            .collect();
        let [x, y, theta, xx, xy, xt, yy, yt, tt] = numbers.ok()?[..] else {
            return None;
        };
        let [xt, yt] = [xt, yt].map(f64::to_radians);
        let tt = tt.to_radians().to_radians();
        Some(Self {
            pose: Pose::new(x, y, theta.to_radians()),
            covariance: [[xx, xy, xt], [xy, yy, yt], [xt, yt, tt]],
        })
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

    #[test]
    fn degrees_become_radians_in_each_place() {
        let text = "EstPos 1 -2 90 1.0e-4 2.0e-5 3.0e-3 4.0e-4 5.0e-3 6.0e-1";
        let estimate = Estimate::parse(text).unwrap();
        let d = std::f64::consts::PI / 180.0;
        assert!((estimate.pose.theta - 90.0 * d).abs() < 1e-15);
        let expected = [
            [1e-4, 2e-5, 3e-3 * d],
            [2e-5, 4e-4, 5e-3 * d],
            [3e-3 * d, 5e-3 * d, 0.6 * d * d],
        ];
        for (row, expected) in estimate.covariance.iter().zip(expected) {
            for (value, expected) in row.iter().zip(expected) {
                assert!((value - expected).abs() <= expected * 1e-14);
            }
        }
        assert_eq!(Estimate::parse("EstPos 1 2 3"), None);
    }
}
