//! Odometry of a car's rear axle as J. Hermosillo, C. Pradalier, S. Sekhavat, "Modeling Odometry and Uncertainty Propagation for a Bi-steerable Car" (2002) has
//! it, and without what it is about: the shortening of an axle that is steered about its middle.
//!
//! ```text
//!     ΔS = (S_r + S_l)/2     Δθ = (S_r − S_l)/(B cos α)     x += ΔS cos(θ + α + Δθ/2)     y += ΔS sin(θ + α + Δθ/2)     α = f(φ)
//! ```
//!
//! (eq. 2; their "Odometry 2" has B for B cos α.) Written from the equations, for the pictures; the controller has relations of its own.

use crate::replay::{Log, Replay, replay};
use crate::robot::Robot;
use anyhow::{Result, anyhow, ensure};
use std::f64::consts::PI;
use vehicle_controller::controller::{Estimate, Pose};
use vehicle_controller::params::{Id, Params};
use vehicle_controller::vehicle::Kind;

/// How the axle's wheels tell its turning.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Relation {
    /// By B, as if it were not steered.
    Unshortened,
    /// By B cos α, as printed.
    Shortened,
    /// The controller's: wheels on circles about the common centre.
    Exact,
}

impl Relation {
    /// All of them, as the paper's figure has them, and the controller's.
    pub const ALL: [Self; 3] = [Self::Unshortened, Self::Shortened, Self::Exact];

    /// For tables and legends.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Unshortened => "plain B",
            Self::Shortened => "B cos α",
            Self::Exact => "exact",
        }
    }
}

/// Odometry of a log by a relation, with the gains of these parameters, from the first row's truth.
///
/// # Errors
/// If the robot is no car, or the log has no steering angle.
pub fn odometry(log: &Log, robot: &Robot, params: &Params, relation: Relation) -> Result<Replay> {
    ensure!(
        params.vehicle() == Kind::BiSteerable,
        "only a car has axles that are steered"
    );
    let mut replayed = replay(log, robot, params)?;
    relation.name().clone_into(&mut replayed.name);
    let shortened = match relation {
        Relation::Exact => return Ok(replayed),
        Relation::Shortened => true,
        Relation::Unshortened => false,
    };
    let get = |id| f64::from(params.get(id));
    let per_count = |diameter| PI * get(diameter) / get(Id::CountsPerTurn);
    let left = get(Id::GainLeft) * per_count(Id::LeftDiameter);
    let right = get(Id::GainRight) * per_count(Id::RightDiameter);
    let track = get(Id::GainBase) * get(Id::Track);
    let offset = get(Id::SteerOffset).to_radians();
    // The rear axle lies behind the reference point of a car whose axles are steered against each other.
    let (slope, behind) = if params.is_on(Id::RearSteered) {
        (-1.0, 0.5 * get(Id::WheelBase))
    } else {
        (0.0, 0.0)
    };
    let [x, y, mut theta] = log.start();
    let (mut x, mut y) = (x - behind * theta.cos(), y - behind * theta.sin());
    for (row, estimate) in log.rows().iter().zip(&mut replayed.estimates).skip(1) {
        let steer = row
            .steer
            .ok_or_else(|| anyhow!("{}: there is no column `steer`", log.name))?;
        let alpha = slope * (steer + offset);
        let [s_left, s_right] = [row.counts[0] as f64 * left, row.counts[1] as f64 * right];
        let width = if shortened {
            track * alpha.cos()
        } else {
            track
        };
        let (ahead, turned) = (0.5 * (s_right + s_left), (s_right - s_left) / width);
        let (sin, cos) = (theta + alpha + 0.5 * turned).sin_cos();
        x += ahead * cos;
        y += ahead * sin;
        theta += turned;
        *estimate = Estimate::certain(Pose {
            x: x + behind * theta.cos(),
            y: y + behind * theta.sin(),
            theta,
        });
    }
    Ok(replayed)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::replay::Row;

    /// Two turns of a Cycab on a circle: its wheels' ways are known, as they lie on circles about the common centre.
    #[test]
    fn a_circle_tells_the_relations_apart() {
        let robot = Robot::load("cycab").unwrap();
        let (length, track, phi) = (1.2, 1.2, 0.35_f64);
        let radius = 0.5 * length / phi.tan();
        let metre = 4096.0 / (PI * 0.4);
        let ways = [-0.5, 0.5].map(|side| (radius + side * track).hypot(0.5 * length));
        let turned = 4.0 * PI;
        let rows = (0..=1000).map(|index| {
            let angle = turned * f64::from(index) * 1e-3;
            Row {
                t: f64::from(index) * 0.02,
                counts: ways.map(|way| (way * angle * metre).round() as i64),
                front: [0; 2],
                steer: Some(phi),
                truth: None,
            }
        });
        let log = Log::recorded("circle".into(), rows).unwrap();
        let end = |relation| {
            let replayed = odometry(&log, &robot, &robot.params, relation).unwrap();
            replayed.last().pose
        };
        // A count is 0.3 mm, and the base 1.2 m.
        let exact = end(Relation::Exact);
        assert!((exact.theta - turned).abs() < 1e-3, "{exact:?}");
        assert!(exact.x.hypot(exact.y) < 5e-3, "{exact:?}");
        // To the first order in B/ρ it is right to 1.0 % here.
        let (shortened, plain) = (end(Relation::Shortened), end(Relation::Unshortened));
        let printed = (ways[1] - ways[0]) / (track * phi.cos());
        assert!((shortened.theta / turned - printed).abs() < 1e-3);
        assert!((0.002..0.015).contains(&(printed - 1.0).abs()), "{printed}");
        assert!((plain.theta / shortened.theta - phi.cos()).abs() < 1e-9);
    }

    #[test]
    fn on_a_straight_way_they_are_one() {
        let robot = Robot::load("cycab").unwrap();
        let rows = [0, 4096].map(|count| Row {
            t: f64::from(count),
            counts: [i64::from(count); 2],
            front: [0; 2],
            steer: Some(0.0),
            truth: None,
        });
        let log = Log::recorded("straight".into(), rows).unwrap();
        for relation in Relation::ALL {
            let replayed = odometry(&log, &robot, &robot.params, relation).unwrap();
            let pose = replayed.last().pose;
            assert!((pose.x - 0.4 * PI).abs() < 1e-6, "{pose:?}");
            assert_eq!((pose.y, pose.theta), (0.0, 0.0));
        }
        let tricycle = Robot::load("tricycle").unwrap();
        assert!(odometry(&log, &tricycle, &tricycle.params, Relation::Exact).is_err());
    }
}
