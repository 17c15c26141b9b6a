//! Joints: what turns, by its counts.

use super::knowledge::{Knowledge, Vehicle};
use super::names::Names;
use std::f64::consts::TAU;

/// A joint.
#[derive(Clone, Debug, PartialEq)]
pub struct Joint {
    /// Its name in the robot's description.
    pub name: String,
    /// rad, since the base was switched on.
    pub position: f64,
    /// rad/s; NaN where nobody measures it.
    pub velocity: f64,
}

/// What a base says of what turns: what a vehicle does not have is not looked at.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Turned {
    /// Counts of the left (or only) wheel, and of the right one or of a synchro drive's steering.
    pub counts: [i64; 2],
    /// Of the same wheels at the ground, m/s.
    pub wheel_speeds: [f64; 2],
    /// Of the base, counterclockwise, rad/s.
    pub omega: f64,
    /// The angle of what steers, rad.
    pub steer: f64,
}

/// The joints of a base.
pub fn joints(names: &Names, base: &Knowledge, told: &Turned) -> Vec<Joint> {
    let wheel = |name: &str, side: usize, diameter: &str| -> Option<Joint> {
        let radius = base.get(diameter).filter(|d| *d > 0.0)? / 2.0;
        let counts = base.get("counts_per_turn").filter(|counts| *counts > 0.0)?;
        Some(Joint {
            name: name.to_owned(),
            position: told.counts[side] as f64 / counts * TAU,
            velocity: told.wheel_speeds[side] / radius,
        })
    };
    let steer = || Joint {
        name: names.joint_steer.clone(),
        position: told.steer,
        velocity: f64::NAN,
    };
    let pair = || {
        [
            wheel(&names.joint_left, 0, "left_diameter"),
            wheel(&names.joint_right, 1, "right_diameter"),
        ]
    };
    let drive = || wheel(&names.joint_drive, 0, "wheel_diameter");
    let all: Vec<Option<Joint>> = match base.vehicle() {
        Vehicle::Differential => pair().into(),
        Vehicle::Car => pair().into_iter().chain([Some(steer())]).collect(),
        Vehicle::Tricycle => vec![drive(), Some(steer())],
        Vehicle::Synchro => {
            let turn = base.get("turn_counts").filter(|counts| *counts > 0.0);
            let turn = turn.map(|counts| Joint {
                name: names.joint_steer.clone(),
                position: told.counts[1] as f64 / counts * TAU,
                velocity: told.omega,
            });
            vec![drive(), turn]
        }
    };
    all.into_iter().flatten().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn base(rows: &[&str]) -> Knowledge {
        let mut base = Knowledge::default();
        for row in rows {
            assert!(base.note(row));
        }
        base
    }

    fn told() -> Turned {
        Turned {
            counts: [500, -2000],
            wheel_speeds: [0.1, -0.2],
            omega: 0.5,
            steer: 0.25,
        }
    }

    #[test]
    fn each_vehicle_has_its_own() {
        let pair = [
            "counts_per_turn 1000",
            "left_diameter 0.1",
            "right_diameter 0.08",
        ];
        let names = Names::default();
        let of = |rows: &[&str]| joints(&names, &base(rows), &told());
        let wheels = of(&pair);
        assert_eq!(wheels[0].name, "left_wheel_joint");
        assert_eq!((wheels[0].position, wheels[0].velocity), (TAU / 2.0, 2.0));
        assert_eq!((wheels[1].position, wheels[1].velocity), (-2.0 * TAU, -5.0));
        let [cpt, left, right] = pair;
        let car = of(&[cpt, left, right, "track 1", "steer_max 20"]);
        assert_eq!(car.len(), 3);
        assert_eq!(
            (car[2].name.as_str(), car[2].position),
            ("steering_joint", 0.25)
        );
        let tricycle = of(&[cpt, "wheel_diameter 0.1", "steer_max 90"]);
        assert_eq!(tricycle[0].name, "drive_wheel_joint");
        assert!(tricycle[1].velocity.is_nan());
        let synchro = of(&[cpt, "wheel_diameter 0.1", "turn_counts 8000"]);
        assert_eq!(
            (synchro[1].position, synchro[1].velocity),
            (-TAU / 4.0, 0.5)
        );
    }
}
