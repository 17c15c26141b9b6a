//! Motors that have controllers of their own, which take speeds or position increments: the protocol's commands end where those of bridges do.

mod bench;
mod outside;

use bench::{Bench, Truth, max, rms};
use hil_sim::plant::BridgeInput;
use hil_sim::random::Random;
use hil_sim::robot::Drives;
use outside::robot;
use vehicle_controller::controller::State;
use vehicle_controller::params::Id;
use vehicle_controller::supervisor::Fault;

/// The robots, with what their motors' controllers take.
const DRIVEN: [(&str, &str); 8] = [
    ("default", "speed"),
    ("default", "increment"),
    ("increments", "increment"),
    ("synchro", "increment"),
    ("tricycle", "speed"),
    ("tricycle", "increment"),
    ("cycab", "speed"),
    ("cycab", "increment"),
];

fn bench(preset: &str, drive: &str, seed: u64) -> Bench {
    Bench::of(&robot(preset, drive), seed)
}

/// The same robot with bridges.
fn bridged(preset: &str, seed: u64) -> Bench {
    let preset = if preset == "increments" {
        "robuter"
    } else {
        preset
    };
    bench(preset, "bridge", seed)
}

fn distance(from: Truth, to: Truth) -> f64 {
    (to.x - from.x).hypot(to.y - from.y)
}

/// `m 1 0.3 0.5`: where it ends, and how.
fn assert_a_metre(bench: &mut Bench, name: &str) {
    bench.send("m 1 0.3 0.5");
    let mut ended = None;
    let mut path = Vec::new();
    while !bench
        .lines
        .iter()
        .any(|(_, line)| line.starts_with("! move done"))
    {
        path.push(bench.tick());
        let held = bench.rig.snapshot().translation.state == State::Hold;
        if held && path.len() > 1000 && ended.is_none() {
            ended = Some(bench.truth().t);
        }
        assert!(path.len() < 6000, "{name}: no end");
    }
    // As tests/motion.rs has it for bridges: settled within a quarter of a second, the end to 2 mm, no farther than that beyond it, and straight to 0.3°.
    let settling = bench.truth().t - ended.unwrap();
    assert!(settling < 0.25, "{name}: settled after {settling} s");
    path.extend(bench.run(2.0));
    let end = *path.last().unwrap();
    assert!((end.x - 1.0).abs() < 2e-3, "{name}: {end:?}");
    assert!(max(path.iter().map(|p| p.x)) < 1.002, "{name}");
    let swerve = max(path.iter().map(|p| p.heading.abs()));
    assert!(swerve < 0.3, "{name}: {swerve}°");
}

#[test]
fn a_metre_is_a_metre_and_a_quarter_turn_a_quarter_turn() {
    for (preset, drive) in DRIVEN {
        for seed in 0..5 {
            let name = format!("{preset} {drive} {seed}");
            let mut bench = bench(preset, drive, seed);
            assert_a_metre(&mut bench, &name);
            // A car cannot turn where it stands.
            if preset != "cycab" {
                let before = bench.truth().heading;
                bench.send("t 90 60 120");
                bench.wait_for("! turn done", 4.0);
                bench.run(2.0);
                let turned = bench.truth().heading - before;
                assert!((turned - 90.0).abs() < 0.3, "{name}: {turned}°");
            }
            assert_eq!(bench.rig.snapshot().fault, None, "{name}");
        }
    }
}

#[test]
fn a_move_and_a_turn_at_once_and_a_stop_end_where_a_bridge_takes_them() {
    /// The heading after both, and how far it goes after Stop.
    fn ends(mut bench: Bench) -> [f64; 2] {
        bench.send("m 2 0.3 0.5");
        bench.send("t -30 15 30");
        bench.wait_for("! move done", 9.0);
        bench.run(2.0);
        let heading = bench.truth().heading;
        bench.send("m inf 0.4 0.5");
        bench.run(3.0);
        let from = bench.truth();
        bench.send("Stop");
        bench.wait_for("! stop command", 4.0);
        bench.run(1.0);
        assert_eq!(bench.rig.snapshot().fault, None);
        [heading, distance(from, bench.truth())]
    }
    for (preset, drive) in DRIVEN {
        for seed in 0..3 {
            let [heading, stopped] = ends(bench(preset, drive, seed));
            let [bridge_heading, bridge_stopped] = ends(bridged(preset, seed));
            let name = format!("{preset} {drive} {seed}");
            // Each of the two may be 0.2° off and report it, and the tyres creep.
            let turned = heading - bridge_heading;
            assert!(turned.abs() < 0.3, "{name}: {turned}° from a bridge's");
            // A stop has no place to end at: it ends where it comes to rest, and what follows from the lag of two loops at 0.4 m/s is 10 ms.
            let gone = stopped - bridge_stopped;
            assert!(gone.abs() < 4e-3, "{name}: {gone} m from a bridge's");
        }
    }
}

#[test]
fn in_hold_a_push_and_a_twist_are_undone_and_nothing_hunts() {
    for (preset, drive) in DRIVEN {
        for seed in 0..5 {
            let name = format!("{preset} {drive} {seed}");
            let mut bench = bench(preset, drive, seed);
            bench.send("m 0.3");
            bench.wait_for("! move done", 5.0);
            bench.run(1.0);
            // As tests/hold.rs has it for bridges.
            let truths = bench.run(5.0);
            let speeds: Vec<f64> = truths.iter().map(|t| t.speed).collect();
            assert!(rms(&speeds) < 0.5e-3, "{name}: {} m/s", rms(&speeds));
            let before = bench.truth();
            bench.rig.push(5.0, 0.0, 1.0);
            bench.run(3.0);
            bench.rig.push(0.0, 0.3, 1.0);
            bench.run(3.0);
            let after = bench.truth();
            assert!(distance(before, after) < 1e-3, "{name}: {after:?}");
            let angle = (after.heading - before.heading).abs();
            assert!(angle < 0.2, "{name}: {angle}°");
            assert_eq!(bench.rig.snapshot().fault, None, "{name}");
        }
    }
}

#[test]
fn an_emergency_stop_takes_the_supply_from_the_motors_in_the_same_tick() {
    let is_driven = |bench: &Bench| {
        let driven =
            |bridge: &BridgeInput| matches!(bridge, BridgeInput::Duty(duty) if *duty != 0.0);
        bench.rig.bridges().iter().any(driven)
    };
    for (preset, drive) in DRIVEN {
        for circuit in [true, false] {
            let mut robot = robot(preset, drive);
            robot.params.set(Id::EstopInput, 1.0).unwrap();
            let mut bench = Bench::of(&robot, 1);
            bench.send("m inf 0.3 0.5");
            bench.run(2.0);
            assert!(is_driven(&bench));
            if circuit {
                bench.rig.set_estop(true);
            } else {
                bench.send("EStop");
            }
            let found = |bench: &Bench| bench.rig.snapshot().fault.is_some();
            let ticks = (0..100).take_while(|_| {
                bench.tick();
                !found(&bench)
            });
            // A line takes half a millisecond on the wire.
            assert!(ticks.count() <= 2, "{preset} {drive}");
            assert_eq!(bench.rig.snapshot().fault, Some(Fault::Estop));
            for _ in 0..3000 {
                assert!(!is_driven(&bench), "{preset} {drive}");
                bench.tick();
            }
            // They braked for half a second, and are free.
            assert_eq!(bench.rig.bridges(), [BridgeInput::Open; 2]);
            assert!(bench.truth().speed.abs() < 1e-3);
        }
    }
}

#[test]
fn a_wheel_that_was_turned_by_hand_does_not_leap_back() {
    for (preset, drive, force) in [
        ("default", "increment", 8.0),
        ("default", "speed", 8.0),
        ("increments", "increment", 160.0),
        ("tricycle", "increment", 6.0),
    ] {
        for stop in ["Disable", "EStop"] {
            let mut bench = bench(preset, drive, 1);
            bench.send("m 0.3");
            bench.wait_for("! move done", 5.0);
            bench.send(stop);
            bench.run(1.0);
            let before = bench.truth();
            bench.rig.push(force, 0.0, 1.0);
            bench.run(4.0);
            let pushed = bench.truth();
            let name = format!("{preset} {drive} {stop}");
            assert!(distance(before, pushed) > 0.1, "{name}: {pushed:?}");
            bench.send(if stop == "Disable" {
                "Enable"
            } else {
                "ClearFault"
            });
            bench.run(1.0);
            assert!(distance(pushed, bench.truth()) < 1e-4, "{name}");
            bench.send("m 0.1 0.1 0.5");
            let truths = bench.run(3.0);
            // Not back at any time, not faster than it should, and a tenth of a metre from where it was left.
            let back = max(truths.iter().map(|t| pushed.x - t.x));
            assert!(back < 1e-3, "{name}: {back} m");
            let fastest = max(truths.iter().map(|t| t.speed.abs()));
            assert!(fastest < 0.13, "{name}: {fastest} m/s");
            let gone = distance(pushed, bench.truth());
            assert!((gone - 0.1).abs() < 2e-3, "{name}: {gone} m");
        }
    }
}

/// The increments that a motor was sent since it was last off, and what they should be: the integral of the commanded speed, units.
fn sent(bench: &Bench, units_per_metre: f64) -> [(i64, f64); 2] {
    bench.rig.wires().map(|wires| {
        let asked = units_per_metre * wires.asked.get();
        (wires.controller.sent(), asked)
    })
}

#[test]
fn in_ten_minutes_of_random_commands_no_increment_is_lost() {
    const SECONDS: u32 = 600;
    let robot = robot("default", "increment");
    let Drives::Increment(params) = &robot.drives else {
        panic!("not this robot");
    };
    let [units_per_metre, _] = params.units_per_metre;
    let mut bench = Bench::of(&robot, 1);
    let mut random = Random::new(1, 0);
    let (mut until, mut periods, mut rests, mut largest) = (0, 0, 0, 0);
    // Counts and increments when it last rested, unless its motors have been off since.
    let mut rested: Option<([i64; 2], [i64; 2])> = None;
    for k in 0..SECONDS * 1000 {
        if k == until {
            // Lines of commands are told at intervals of up to 4 s, so that some motions end and some do not.
            until += 1 + (4000.0 * random.fraction()) as u32;
            let d = 0.6 * random.uniform();
            let v = 0.05 + 0.4 * random.fraction();
            match (12.0 * random.fraction()) as u32 {
                0..4 => bench.send(&format!("m {d:.3} {v:.3}")),
                4..8 => bench.send(&format!("t {:.1} {:.1}", 100.0 * d, 200.0 * v)),
                8 => bench.send(&format!("m {}inf {v:.3}", if d < 0.0 { "-" } else { "" })),
                9 => bench.send("Stop"),
                10 => {
                    bench.send("Disable");
                    bench.run(0.01);
                    bench.send("Enable");
                }
                _ => {
                    bench.send("EStop");
                    bench.run(0.8);
                    bench.send("ClearFault");
                    periods += 1;
                    rested = None;
                }
            }
        }
        bench.tick();
        let now = sent(&bench, units_per_metre);
        for (sent, asked) in now {
            // The fraction that is carried; the products have 46 bits, which is nothing of so few.
            assert!((asked - sent as f64).abs() < 1.0 + 1e-3, "{asked} {sent}");
            largest = largest.max(sent.abs());
        }
        if now.iter().all(|(sent, asked)| *sent == 0 && *asked == 0.0) {
            rested = None;
        }
        let snapshot = bench.rig.snapshot();
        let holds = snapshot.translation.state == State::Hold
            && snapshot.rotation.state == State::Hold
            && bench
                .rig
                .plant()
                .wheel_speed()
                .iter()
                .all(|speed| speed.abs() < 1e-4);
        if holds {
            let counts = bench.rig.plant().counts();
            let sent = now.map(|(sent, _)| sent);
            if let Some((counts_then, sent_then)) = rested {
                for wheel in [0, 1] {
                    let rolled = counts[wheel] - counts_then[wheel];
                    let told = sent[wheel] - sent_then[wheel];
                    // At either rest the wheel may be off by the controller's dead zone of a count, a count's width, and what friction holds of a
                    // loop whose integral is slow: 8 counts, 0.75 mm.
                    assert!((rolled - told).abs() <= 8, "{rolled} {told} at {k}");
                }
                rests += 1;
            }
            if rested.is_none() {
                rested = Some((counts, sent));
            }
        }
    }
    println!("{periods} emergency stops, {rests} ticks at rest, up to {largest} units");
    assert!(periods > 10 && rests > 20_000 && largest > 20_000);
    assert_eq!(bench.rig.snapshot().fault, None);
}
