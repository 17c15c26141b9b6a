//! A target that moves, chased through protocol lines.

mod bench;

use bench::{Bench, max};
use hil_sim::random::Random;
use std::f64::consts::{PI, TAU};

/// A chase of a target on a circle, after it has come to be steady.
struct Chase {
    bench: Bench,
    /// When the last target was sent, s.
    sent: f64,
    /// Distance of the base from the target, m, at each tick.
    distances: Vec<f64>,
    /// The references of both axes, m/s and rad/s.
    references: Vec<[f64; 2]>,
}

const RADIUS: f64 = 1.0;
const SPEED: f64 = 0.3;

/// Where the target is at a time.
fn target(t: f64) -> [f64; 2] {
    let (sin, cos) = (SPEED / RADIUS * t).sin_cos();
    [RADIUS * sin, RADIUS * (1.0 - cos)]
}

fn references(bench: &Bench) -> [f64; 2] {
    let snapshot = bench.rig.snapshot();
    [&snapshot.translation, &snapshot.rotation].map(|axis| f64::from(axis.reference_speed))
}

/// A lap, after a third of one. The target is seen with noise, m.
fn chase(updates: u32, seed: u64, noise: f64) -> Chase {
    let mut random = Random::new(seed, 3);
    let lap = TAU * RADIUS / SPEED;
    let every = 1000 / updates;
    let mut chase = Chase {
        bench: Bench::new("default", seed),
        sent: 0.0,
        distances: Vec::new(),
        references: Vec::new(),
    };
    let bench = &mut chase.bench;
    let from = bench.truth().t;
    for tick in 0..(1.34 * lap * 1000.0) as u32 {
        let t = bench.truth().t - from;
        if tick % every == 0 {
            chase.sent = bench.truth().t;
            let [x, y] = target(t).map(|place| place + noise * random.normal());
            bench.send(&format!("Chase {x:.4} {y:.4}"));
        }
        let before = references(bench);
        let truth = bench.tick();
        check_steps(before, references(bench));
        if t > 0.34 * lap {
            let [x, y] = target(truth.t - from);
            chase.distances.push((truth.x - x).hypot(truth.y - y));
            chase.references.push(references(bench));
        }
    }
    chase
}

/// References change by no more than the accelerations allow. What landing on a target adds is 0.2 %, and a speed's ulp is 1e-7.
fn check_steps(before: [f64; 2], after: [f64; 2]) {
    // The defaults: 0.5 m/s² and 180 °/s².
    for ((before, after), acceleration) in before.iter().zip(after).zip([0.5, PI]) {
        let most = 1.002e-3 * acceleration + 2e-7;
        assert!((after - before).abs() <= most, "{before} to {after}");
    }
}

impl Chase {
    /// The largest distance, and the ranges of both references.
    fn summary(&self) -> (f64, [[f64; 2]; 2]) {
        let range = |i: usize| {
            let values = || self.references.iter().map(|reference| reference[i]);
            [-max(values().map(|value| -value)), max(values())]
        };
        let summary = (max(self.distances.iter().copied()), [range(0), range(1)]);
        println!("{summary:.4?}");
        summary
    }

    /// No more targets come: the last one is gone to, the base stands, and then it is told.
    fn check_end(mut self) {
        let bench = &mut self.bench;
        while !bench.lines.last().unwrap().1.starts_with("! chase") {
            let before = references(bench);
            bench.tick();
            check_steps(before, references(bench));
            assert!(bench.truth().t < self.sent + 4.0, "no end");
        }
        let (t, line) = bench.lines.last().unwrap();
        assert_eq!(line, "! chase end timeout");
        // 1.5 s without a target, and no more than it takes to stop.
        let waited = t - self.sent;
        assert!((1.5..2.5).contains(&waited), "{waited}");
        let place = bench.truth();
        for truth in bench.run(2.0) {
            assert!((truth.x - place.x).hypot(truth.y - place.y) < 2e-3);
        }
    }
}

#[test]
fn a_target_on_a_circle_is_kept_up_with() {
    // At 1 Hz the target is 30 cm farther with every update.
    for (updates, most) in [(1, 0.2), (5, 0.05), (20, 0.05), (50, 0.05)] {
        for seed in 0..3 {
            let chase = chase(updates, seed, 0.0);
            let (distance, [speed, turn_speed]) = chase.summary();
            assert!(distance < most, "{updates} Hz: {distance}");
            // No stop and go, and no swerving: it always turns the circle's way.
            assert!(
                speed[0] > 0.9 * SPEED && speed[1] < 1.2 * SPEED,
                "{speed:?}"
            );
            assert!(turn_speed[0] > 0.0 && turn_speed[1] < 1.0, "{turn_speed:?}");
            chase.check_end();
        }
    }
}

#[test]
fn so_it_is_where_it_is_seen_with_noise() {
    for seed in 0..5 {
        let (distance, [speed, _]) = chase(20, seed, 0.01).summary();
        // 1 cm each time; the target's speed is known to 5 cm/s by them.
        assert!(distance < 0.08, "{distance}");
        assert!(
            speed[0] > 0.5 * SPEED && speed[1] < 1.5 * SPEED,
            "{speed:?}"
        );
    }
}

#[test]
fn a_target_that_stands_is_gone_to_and_its_heading_taken() {
    let mut bench = Bench::new("default", 1);
    for _ in 0..120 {
        bench.send("Chase 0.8 0.6 -90");
        bench.run(0.1);
    }
    let truth = bench.truth();
    assert!((truth.x - 0.8).hypot(truth.y - 0.6) < 0.025, "{truth:?}");
    assert!((truth.heading + 90.0).abs() < 1.0, "{truth:?}");
    bench.wait_for("! chase end timeout", 2.0);
}
