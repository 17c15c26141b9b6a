//! HOLD: what disturbs the base is undone, and at rest it rests.

mod bench;

use bench::{Bench, max, rms};
use hil_sim::plant::CURRENT_ZERO;
use hil_sim::robot::Robot;
use vehicle_controller::params::Id;
use vehicle_controller::vehicle::Kind;

/// A base that has moved and turned, and holds.
fn holding(robot: &str, seed: u64) -> Bench {
    let mut bench = Bench::new(robot, seed);
    bench.send("m 0.3");
    bench.wait_for("! move done", 5.0);
    bench.send("t 20");
    bench.wait_for("! turn done", 5.0);
    bench.run(1.0);
    bench
}

/// The presets that hold their heading at rest by two wheels.
fn differential_drives() -> impl Iterator<Item = &'static str> {
    Robot::presets().filter(|name| {
        let robot = Robot::load(name).expect("a preset loads");
        robot.params.vehicle() == Kind::Differential
    })
}

#[test]
fn a_push_and_a_twist_are_undone() {
    for robot in differential_drives() {
        for seed in 0..10 {
            let mut bench = holding(robot, seed);
            let before = bench.truth();
            bench.rig.push(5.0, 0.0, 1.0);
            bench.run(3.0);
            bench.rig.push(0.0, 0.3, 1.0);
            bench.run(3.0);
            let after = bench.truth();
            let distance = (after.x - before.x).hypot(after.y - before.y);
            assert!(distance < 1e-3, "{robot} {seed}: {distance} m");
            let angle = (after.heading - before.heading).abs();
            assert!(angle < 0.2, "{robot} {seed}: {angle}°");
        }
    }
}

#[test]
fn a_push_that_moves_the_base_is_undone_too() {
    // 10 N is twice what the default robot's gears hold, and two thirds of what its tyres do: what slips, no encoder sees.
    let mut bench = holding("default", 3);
    let before = bench.truth();
    bench.rig.push(10.0, 0.0, 1.0);
    let pushed = bench.run(1.0);
    let farthest = max(pushed
        .iter()
        .map(|p| (p.x - before.x).hypot(p.y - before.y)));
    assert!(farthest > 0.5e-3, "the push did not move it: {farthest} m");
    bench.run(3.0);
    let after = bench.truth();
    assert!((after.x - before.x).hypot(after.y - before.y) < 1e-3);
}

#[test]
fn at_rest_it_does_not_hunt() {
    for robot in differential_drives() {
        for seed in 0..10 {
            let mut bench = holding(robot, seed);
            let truths = bench.run(10.0);
            let speeds: Vec<f64> = truths.iter().map(|t| t.speed).collect();
            assert!(
                rms(&speeds) < 0.5e-3,
                "{robot} {seed}: {} m/s",
                rms(&speeds)
            );
            // Wheels at 0.5 mm/s turn the default robot by 0.3 °/s.
            let turns: Vec<f64> = truths.iter().map(|t| t.turn_speed).collect();
            assert!(rms(&turns) < 0.3, "{robot} {seed}: {} °/s", rms(&turns));
            // No slow limit cycle either: the last 8 s lie within a count or two.
            let x: Vec<f64> = truths[2000..].iter().map(|t| t.x).collect();
            let range = max(x.iter().copied()) + max(x.iter().map(|x| -x));
            assert!(range < 0.3e-3, "{robot} {seed}: {range} m");
        }
    }
}

/// A base that can tell a blocked motor from a dead encoder, and is patient with the former.
fn with_current_sensors(robot: &str, seed: u64) -> Bench {
    let mut robot = Robot::load(robot).unwrap();
    let resistance = robot.physics.motor.resistance as f32;
    let sensitivity = robot.physics.bridge.current_sensitivity;
    let values = [
        (Id::CurrentScale, (1.0 / sensitivity) as f32),
        (Id::CurrentZero, CURRENT_ZERO as f32),
        (Id::MotorResistance, resistance),
    ];
    robot.params.set_all(&values).unwrap();
    Bench::of(&robot, seed)
}

#[test]
fn a_wheel_that_was_blocked_does_not_lunge() {
    for robot in ["default", "uncalibrated", "robuter"] {
        for blocked in [&[0][..], &[1], &[0, 1]] {
            for v in [0.1, 0.3, 0.6] {
                for seed in 0..3 {
                    let mut bench = with_current_sensors(robot, seed);
                    bench.send(&format!("m inf {v} 0.5"));
                    bench.run(3.0);
                    for wheel in blocked {
                        bench.rig.plant_mut().set_blocked(*wheel, true);
                    }
                    bench.run(0.4);
                    for wheel in blocked {
                        bench.rig.plant_mut().set_blocked(*wheel, false);
                    }
                    let truths = bench.run(3.0);
                    let fastest = max(truths.iter().map(|t| t.speed));
                    assert!(fastest < 1.1 * v, "{robot} {blocked:?} {v}: {fastest} m/s");
                    let last = truths[2999].speed;
                    assert!(
                        (last - v).abs() < 0.02 * v,
                        "{robot} {blocked:?} {v}: {last} m/s"
                    );
                }
            }
        }
    }
}

#[test]
fn a_wheel_that_is_held_for_a_moment_is_no_fault() {
    for held in [0.02, 0.04, 0.06] {
        for v in [0.3, 0.5, 0.65] {
            for wheels in [&[0][..], &[1], &[0, 1]] {
                let mut bench = Bench::new("default", 1);
                bench.send(&format!("m inf {v} 1"));
                bench.run(2.0);
                for blocked in [true, false] {
                    for wheel in wheels {
                        bench.rig.plant_mut().set_blocked(*wheel, blocked);
                    }
                    bench.run(held);
                }
                bench.run(0.5);
                let fault = bench.rig.snapshot().fault;
                assert_eq!(fault, None, "{wheels:?} held for {held} s at {v} m/s");
            }
        }
    }
}

#[test]
fn heading_is_held_while_a_move_starts() {
    // The right motor is weaker, so that the start turns the base.
    let mut bench = Bench::new("default", 5);
    bench.rig.plant_mut().set_strength(1, 0.8);
    bench.send("m 2 0.5 1");
    let truths = bench.run(6.0);
    assert!(max(truths.iter().map(|t| t.heading.abs())) < 1.0);
    assert!(truths[5999].heading.abs() < 0.2);
}

#[test]
fn a_steady_force_is_held_without_nudging() {
    let mut bench = holding("default", 2);
    let before = bench.truth();
    bench.rig.push(8.0, 0.0, 12.0);
    bench.run(2.0);
    let truths = bench.run(10.0);
    let speeds: Vec<f64> = truths.iter().map(|t| t.speed).collect();
    assert!(rms(&speeds) < 0.5e-3, "{} m/s", rms(&speeds));
    let range = max(truths.iter().map(|t| t.x)) + max(truths.iter().map(|t| -t.x));
    assert!(range < 0.3e-3, "{range} m");
    bench.run(3.0);
    let after = bench.truth();
    assert!((after.x - before.x).hypot(after.y - before.y) < 1e-3);
}

#[test]
fn it_rests_even_if_it_is_told_of_no_friction() {
    let mut bench = Bench::new("default", 1);
    bench.send("SetParam motor_friction 0");
    bench.send("m 0.3");
    bench.wait_for("! move done", 5.0);
    bench.run(2.0);
    bench.run(2.0);
    assert!(bench.rig.snapshot().wheels.iter().all(|w| w.duty == 0.0));
}
