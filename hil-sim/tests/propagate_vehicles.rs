//! Particles along a journey of each vehicle, and the estimator's linear covariance beside them (issue 6, 5).
//!
//! The priors are such as the linear propagation is for: after 10 m they leave some centimetres and degrees. The wheels differ by 0.2° per metre, sizes are known
//! to 1 %, a car's steering offset to 0.3°. A tricycle's, 0.15 m long, turns it by 0.4° per metre for each 0.06° already.

use hil_sim::propagation::{Plan, Propagation, Shape, propagate};
use hil_sim::replay::{Log, Row};
use hil_sim::robot::Robot;
use hil_sim::settings;
use std::f64::consts::{PI, TAU};

/// How far the journeys go, m, and how far in a row.
const WAY: f64 = 10.0;
const STEP: f64 = 0.1;

/// A vehicle's counts (left and right, or drive and turn; the front wheels') and its steering angle on a step of ΔS with a curvature.
struct Rolled {
    wheels: [f64; 2],
    front: [f64; 2],
    steer: Option<f64>,
}

/// The log of 10 m with this curvature (1/m) after so many metres, as whole counts.
fn recorded(
    name: &str,
    curvature: impl Fn(f64) -> f64,
    counts: impl Fn(f64, f64) -> Rolled,
) -> Log {
    let (mut wheels, mut front) = ([0.0; 2], [0.0; 2]);
    let mut rows = Vec::new();
    for index in 0..=(WAY / STEP).round() as u32 {
        let middle = (f64::from(index) - 0.5) * STEP;
        let ahead = if index == 0 { 0.0 } else { STEP };
        let rolled = counts(ahead, curvature(middle.max(0.0)));
        for wheel in 0..2 {
            wheels[wheel] += rolled.wheels[wheel];
            front[wheel] += rolled.front[wheel];
        }
        let whole = |sums: [f64; 2]| sums.map(|sum| sum.round() as i64);
        rows.push(Row {
            t: f64::from(index) * 0.2,
            counts: whole(wheels),
            front: whole(front),
            steer: rolled.steer,
            truth: None,
        });
    }
    Log::recorded(name.into(), rows).unwrap()
}

/// Ways of the left and the right wheel that lie `x` ahead of the normal from the common centre, on a step of ΔS along the car with this curvature.
fn ways(ahead: f64, curvature: f64, x: f64, track: f64) -> [f64; 2] {
    [-0.5, 0.5].map(|side| ahead * (1.0 + side * track * curvature).hypot(x * curvature))
}

fn propagated(log: &Log, robot: &str, set: &str) -> Propagation {
    let mut robot = Robot::load(robot).unwrap();
    let set: Vec<String> = set.split_whitespace().map(str::to_owned).collect();
    settings::apply(&mut robot.params, &set).unwrap();
    let plan = Plan {
        particles: 100_000,
        shape: Shape::Gaussian,
        seed: 1,
    };
    let propagation = propagate(log, &robot, plan, &|_| {}).unwrap();
    println!("{set:?}\n{propagation}");
    propagation
}

/// 0.45 % of a variance is one standard error of 10⁵ particles; the rest is what is not linear.
fn agree(propagation: &Propagation) {
    assert!((propagation.way - WAY).abs() < 0.02, "{propagation}");
    assert!(propagation.difference() < 0.05, "{propagation}");
}

#[test]
fn a_synchro_drive() {
    let metre = 2796.8 / (PI * 0.065);
    let radian = 8390.4 / TAU;
    let log = recorded(
        "synchro",
        |s| (0.7 * s).sin(),
        |ahead, curvature| Rolled {
            wheels: [ahead * metre, ahead * curvature * radian],
            front: [0.0; 2],
            steer: None,
        },
    );
    let propagation = propagated(
        &log,
        "synchro",
        "k_scale=1e-4 k_rot=1e-4 k_turn_drift=0.04 noise_s=5e-6 noise_drift=0.01 noise_rot=0.015",
    );
    agree(&propagation);
}

/// To the left and to the right, the wheel pointing up to 24° aside.
#[test]
fn a_tricycle() {
    let (length, metre) = (0.15, 1600.0 / (PI * 0.065));
    let log = recorded(
        "tricycle",
        |s| 3.0 * (2.0 * s).sin(),
        |ahead, curvature| {
            let steer = (length * curvature).atan();
            Rolled {
                wheels: [ahead / steer.cos() * metre, 0.0],
                front: [0.0; 2],
                steer: Some(steer),
            }
        },
    );
    let quiet = "k_scale=1e-4 k_rot=1e-4 noise_s=5e-6 noise_drift=0.01 noise_rot=0.001";
    // Both of the steering's errors, and each alone.
    for steering in [
        "k_steer=0.0036 noise_steer=0.0025",
        "k_steer=0.0036 noise_steer=0",
        "k_steer=0 noise_steer=0.01",
    ] {
        let propagation = propagated(&log, "tricycle", &format!("{quiet} {steering}"));
        agree(&propagation);
    }
}

/// A Cycab's journey, steered up to 20°, by its rear wheels, its front ones, and all four; then that of a car with a fixed rear axle.
#[test]
fn cars_with_two_and_four_encoders() {
    let (length, track, metre) = (1.2, 1.2, 4096.0 / (PI * 0.4));
    for (rear_steered, behind) in [(1, 0.6), (0, 0.0)] {
        let ahead_of = length - behind;
        let log = recorded(
            if rear_steered == 1 { "cycab" } else { "car" },
            |s| 0.36 / ahead_of * (0.7 * s).sin(),
            |ahead, curvature| Rolled {
                wheels: ways(ahead, curvature, -behind, track).map(|way| way * metre),
                front: ways(ahead, curvature, ahead_of, track).map(|way| way * metre),
                steer: Some((ahead_of * curvature).atan()),
            },
        );
        for odometry in 0..3 {
            let set = format!(
                "rear_steered={rear_steered} odometry={odometry} k_drift=0.04 k_scale=1e-4 k_rot=1e-4 k_steer=0.09 \
                 noise_s=5e-6 noise_drift=0.01 noise_rot=0.015 noise_steer=0.0025"
            );
            agree(&propagated(&log, "cycab", &set));
        }
    }
}

/// What the steering's errors alone do to a car: its wheels say how far it turns, so there is little; it is the same nevertheless.
#[test]
fn a_car_whose_steering_alone_is_uncertain() {
    let (length, track, metre) = (1.2, 1.2, 4096.0 / (PI * 0.4));
    let log = recorded(
        "car",
        |s| 0.3 * (0.35 * s).sin(),
        |ahead, curvature| Rolled {
            wheels: ways(ahead, curvature, 0.0, track).map(|way| way * metre),
            front: ways(ahead, curvature, length, track).map(|way| way * metre),
            steer: Some((length * curvature).atan()),
        },
    );
    // By the front wheels, which point where the steering says; of which a part is the wheel's circle.
    let set =
        "rear_steered=0 odometry=1 k_drift=0 k_scale=0 k_rot=0 noise_s=0 noise_drift=0 noise_rot=0";
    for steering in ["k_steer=0.09 noise_steer=0", "k_steer=0 noise_steer=0.01"] {
        agree(&propagated(&log, "cycab", &format!("{set} {steering}")));
    }
}

#[test]
fn a_log_without_steering_is_not_for_a_vehicle_that_steers() {
    let rows = [0.0, 1.0].map(|t| Row {
        t,
        counts: [0; 2],
        front: [0; 2],
        steer: None,
        truth: None,
    });
    let log = Log::new("straight".into(), rows.into()).unwrap();
    let plan = Plan {
        particles: 100,
        shape: Shape::Gaussian,
        seed: 1,
    };
    let robot = Robot::load("tricycle").unwrap();
    let error = propagate(&log, &robot, plan, &|_| {}).unwrap_err();
    assert!(error.to_string().contains("`steer`"), "{error}");
}
