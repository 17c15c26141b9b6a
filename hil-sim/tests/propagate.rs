//! Particles along a journey, and the estimator's linear covariance beside them.

mod desk;

use desk::Desk;
use hil_sim::propagation::{Plan, Propagation, Shape, propagate};
use hil_sim::replay::{Log, Row};
use hil_sim::robot::Robot;
use hil_sim::settings;
use std::f64::consts::PI;
use std::fmt::Write;

/// Metres per count and wheel base of the robot `default`.
const COUNT: f64 = PI * 0.084 / 2796.8;
const BASE: f64 = 0.2;

/// What the encoders count at 20 Hz while a base drives `way` m at 0.4 m/s, with this curvature (1/m) after so many metres.
fn journey(way: f64, curvature: impl Fn(f64) -> f64) -> Vec<(f64, [i64; 2])> {
    let (dt, step) = (0.05, 0.02);
    let mut rolled = [0.0; 2];
    let mut counts = vec![(0.0, [0, 0])];
    for index in 0..(way / step).round() as u32 {
        let aside = 0.5 * BASE * curvature((f64::from(index) + 0.5) * step);
        rolled[0] += step * (1.0 - aside);
        rolled[1] += step * (1.0 + aside);
        let shown = rolled.map(|metres: f64| (metres / COUNT).round() as i64);
        counts.push((f64::from(index + 1) * dt, shown));
    }
    counts
}

/// The log of that.
fn recorded(name: &str, counts: &[(f64, [i64; 2])]) -> Log {
    let rows = counts.iter().map(|(t, counts)| Row {
        front: [0; 2],
        steer: None,
        t: *t,
        counts: *counts,
        truth: None,
    });
    Log::recorded(name.into(), rows).unwrap()
}

/// 10 m: to the left, to the right and to the left again.
fn bends() -> Log {
    recorded("bends", &journey(10.0, |s| (0.7 * s).sin()))
}

fn propagated(log: &Log, set: &str, particles: usize, shape: Shape, seed: u64) -> Propagation {
    let mut robot = Robot::load("default").unwrap();
    let set: Vec<String> = set.split_whitespace().map(str::to_owned).collect();
    settings::apply(&mut robot.params, &set).unwrap();
    let plan = Plan {
        particles,
        shape,
        seed,
    };
    let propagation = propagate(log, &robot, plan, &|_| {}).unwrap();
    println!("{set:?}\n{propagation}");
    propagation
}

/// A wheel imbalance of 0.2°/m, and a rotation scale of 1 %.
const GOOD: &str = "k_drift=0.04 k_rot=1e-4";

#[test]
fn the_linear_covariance_is_that_of_the_particles_within_a_twentieth() {
    for shape in [Shape::Gaussian, Shape::Uniform] {
        let propagation = propagated(&bends(), GOOD, 100_000, shape, 1);
        assert!((propagation.way - 10.0).abs() < 0.01);
        // 0.45 % of a variance is one standard error.
        assert!(propagation.difference() < 0.05, "{propagation}");
        // The mean falls short by half the variance of the heading; less than a tenth of a standard deviation.
        let pose = propagation.linear.pose;
        let shift = [
            propagation.mean.x - pose.x,
            propagation.mean.y - pose.y,
            propagation.mean.z - pose.theta,
        ];
        for (shift, variance) in shift.iter().zip(&propagation.covariance.diagonal()) {
            assert!(shift.abs() < 0.1 * variance.sqrt(), "{propagation}");
        }
    }
}

#[test]
fn particles_on_a_straight_way_have_the_closed_forms_covariance() {
    // Var θ = κL + KL², Var y = κL³/3 + KL⁴/4, Var x = κ_S L + σ_d² L², all in the small.
    let log = recorded("straight", &journey(5.0, |_| 0.0));
    let set = "k_drift=0.04 k_rot=1e-4 k_scale=1e-4 noise_s=1e-5 noise_drift=0.01 noise_rot=0";
    let propagation = propagated(&log, set, 50_000, Shape::Gaussian, 3);
    let (way, degree) = (5.0_f64, 1.0_f64.to_radians());
    let (kappa, k) = (0.01 * degree * degree, 0.04 * degree * degree);
    let c = &propagation.covariance;
    for (is, should) in [
        (c.m33, kappa * way + k * way.powi(2)),
        (c.m22, kappa * way.powi(3) / 3.0 + k * way.powi(4) / 4.0),
        (c.m23, kappa * way.powi(2) / 2.0 + k * way.powi(3) / 2.0),
        (c.m11, 1e-5 * way + 1e-4 * way * way),
    ] {
        // 0.6 % is one standard error.
        assert!((is / should - 1.0).abs() < 0.025, "{is} {should}");
    }
}

#[test]
fn a_uniform_prior_has_its_bounds() {
    // Nothing random, and the base alone unknown: a turn is off by √3 standard deviations at most, and evenly.
    let mut counts = vec![(0.0, [0, 0])];
    let turn = (PI * BASE / 2.0 / COUNT).round() as i64;
    for part in 1..=40 {
        counts.push((0.05 * part as f64, [-turn * part / 40, turn * part / 40]));
    }
    let log = recorded("turn", &counts);
    let set = "k_drift=0 k_rot=1e-4 k_scale=0 noise_s=0 noise_drift=0 noise_rot=0";
    let propagation = propagated(&log, set, 20_000, Shape::Uniform, 5);
    let deviation = propagation.covariance.m33.sqrt();
    // π of a turn times 1 %; 20 000 draws tell a uniform deviation to 0.3 %.
    assert!((deviation / (0.01 * PI) - 1.0).abs() < 0.015, "{deviation}");
}

#[test]
fn what_is_uncertain_beyond_the_linear_shows() {
    // A heading that is unknown by 40° after 10 m: the particles lie on a banana, and the linear covariance is not theirs.
    let propagation = propagated(&bends(), "k_drift=16", 20_000, Shape::Gaussian, 1);
    assert!(propagation.difference() > 0.05, "{propagation}");
}

#[test]
fn the_same_seed_gives_the_same_particles() {
    let log = bends();
    let run = |seed| propagated(&log, GOOD, 2500, Shape::Gaussian, seed).covariance;
    assert_eq!(run(1), run(1));
    assert_ne!(run(1), run(2));
}

/// The log as a file.
fn csv(counts: &[(f64, [i64; 2])]) -> String {
    let mut text = String::from("t,left,right\n");
    let mut last = [0; 2];
    for (t, [left, right]) in counts {
        writeln!(text, "{t:.2},{},{}", left - last[0], right - last[1]).unwrap();
        last = [*left, *right];
    }
    text
}

#[test]
fn the_command_takes_logs_and_scripts_and_draws() {
    let desk = Desk::new("0 m 1 0.3\n0.5 t 90\n");
    desk.put("bends.csv", &csv(&journey(2.0, f64::sin)));
    let command = "propagate bends.csv a.script --particles 2000 --prior uniform";
    let told = desk.prints(command);
    let heads: Vec<_> = told.lines().filter(|line| !line.starts_with(' ')).collect();
    assert_eq!(heads.len(), 2, "{told}");
    assert!(
        heads[0].starts_with("on default, bends: 2.00 m, 2000 particles, uniform priors, seed 1"),
        "{told}"
    );
    assert!(heads[1].starts_with("on default, a: 1.00 m, "), "{told}");
    assert_eq!(told, desk.prints(command));
    desk.prints("propagate bends.csv --particles 2000 --plot p.svg");
    let picture = desk::text(&desk.read("p.svg"));
    assert!(picture.starts_with("<svg ") && picture.contains("particles"));
}

#[test]
fn a_base_that_stands_or_only_turns_has_numbers_all_the_same() {
    let desk = Desk::new("0 GetTime\n");
    desk.put("b.script", "0 t 90\n");
    let told = desk.prints("propagate a.script b.script --particles 200");
    assert!(
        told.contains("xy 0.0000") && !told.contains("NaN"),
        "{told}"
    );
}

#[test]
fn the_command_refuses_what_makes_no_sense() {
    let desk = Desk::new("0 m 0.1\n");
    for (arguments, why) in [
        ("none.csv", "none.csv"),
        ("none.script", "none.script"),
        ("a.script --particles 1", "hundred"),
        ("a.script --prior square", "square"),
        ("a.script --set k_drift=x", "not a number"),
        ("a.script a.script --plot p.svg", "one journey"),
        ("a.script --plot p.gif", "p.gif"),
    ] {
        let told = desk.refuses(&format!("propagate {arguments}"));
        assert!(told.contains(why), "{arguments}: {told}");
    }
}
