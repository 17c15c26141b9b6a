//! Faults on the simulated base: what its counters and motors make of them.

mod bench;

use bench::Bench;
use hil_sim::faults::{EncoderFault, Fault, FaultSet, MotorFault, Side};
use hil_sim::plant::{BridgeInput, Input, Plant, Push};
use hil_sim::robot::Robot;

const SIDES: [Side; 3] = [Side::Left, Side::Right, Side::Both];

/// What the encoders of the controller count, and what they truly counted, in a second of driving. It does not look at what the base makes of it.
fn count(bench: &mut Bench) -> [(i64, i64); 2] {
    let seen = |bench: &Bench| {
        let row = bench.rig.row();
        [row.left_count, row.right_count]
    };
    let before = (seen(bench), bench.rig.plant().counts());
    bench.run(1.0);
    let after = (seen(bench), bench.rig.plant().counts());
    [0, 1].map(|wheel| {
        (
            after.0[wheel] - before.0[wheel],
            after.1[wheel] - before.1[wheel],
        )
    })
}

/// A robot that turns its wheels to one side and to the other, whatever its encoders say: as no controller does it, somebody pushes.
fn pushed(seed: u64) -> Bench {
    let mut bench = Bench::new("default", seed);
    bench.send("Disable");
    bench.run(0.1);
    bench.rig.push(14.0, 0.3, 100.0);
    bench.run(1.0);
    bench
}

fn expect(fault: EncoderFault, check: impl Fn(i64, i64)) {
    for seed in 0..3 {
        for side in SIDES {
            let mut bench = pushed(seed);
            bench.rig.inject(Fault::Encoder(side, fault)).unwrap();
            // A jump and the edge of a break are not part of what is counted.
            bench.run(0.002);
            let faulty = count(&mut bench);
            bench.rig.clear_faults();
            bench.run(0.002);
            let cleared = count(&mut bench);
            for wheel in [0, 1] {
                let (seen, truth) = faulty[wheel];
                assert!(truth > 2000, "the push turns the wheels: {truth}");
                if side.wheels().any(|other| other == wheel) {
                    check(seen, truth);
                } else {
                    assert_eq!(seen, truth, "the other wheel is sound");
                }
                assert_eq!(cleared[wheel].0, cleared[wheel].1, "{fault} is gone");
            }
        }
    }
}

#[test]
fn a_stuck_encoder_counts_nothing() {
    expect(EncoderFault::Stuck, |seen, _| assert_eq!(seen, 0));
}

#[test]
fn an_open_channel_leaves_one_count() {
    for fault in [EncoderFault::OpenA, EncoderFault::OpenB] {
        expect(fault, |seen, _| assert!(seen.abs() <= 1, "{seen}"));
    }
}

#[test]
fn exchanged_channels_count_backward() {
    expect(EncoderFault::Swapped, |seen, truth| {
        assert_eq!(seen, -truth);
    });
}

#[test]
fn another_disc_counts_in_proportion() {
    expect(EncoderFault::Scale(2.0), |seen, truth| {
        assert_eq!(seen, 2 * truth);
    });
    expect(EncoderFault::Scale(0.5), |seen, truth| {
        assert!((2 * seen - truth).abs() <= 1);
    });
}

#[test]
fn half_of_the_counts_are_lost() {
    expect(EncoderFault::Drop(0.5), |seen, truth| {
        // Binomial: four standard deviations of √(n/4).
        let (seen, truth) = (seen as f64, truth as f64);
        assert!(
            (seen - 0.5 * truth).abs() < 4.0 * (0.25 * truth).sqrt(),
            "{seen} {truth}"
        );
    });
}

/// At the clearing and at the jump itself: what the controller sees is what the encoder moved, and the jump.
#[test]
fn a_jump_is_there_at_once_and_stays() {
    for jump in [500, -500] {
        let mut bench = pushed(1);
        let seen = bench.rig.row().left_count;
        let truth = bench.rig.plant().counts()[0];
        let fault = Fault::Encoder(Side::Left, EncoderFault::Jump(jump));
        bench.rig.inject(fault).unwrap();
        for _ in 0..10 {
            bench.run(0.001);
            let moved = bench.rig.plant().counts()[0] - truth;
            assert_eq!(bench.rig.row().left_count - seen, moved + jump);
        }
        bench.rig.clear_faults();
        bench.run(0.1);
        let moved = bench.rig.plant().counts()[0] - truth;
        assert_eq!(bench.rig.row().left_count - seen, moved + jump);
    }
}

/// The robot's counters have 16 bits: at twice the counts they wrap within seconds, and the controller's count does not.
#[test]
fn counters_wrap_under_a_fault() {
    let mut bench = pushed(1);
    let fault = Fault::Encoder(Side::Both, EncoderFault::Scale(-2.0));
    bench.rig.inject(fault).unwrap();
    let row = bench.rig.row();
    let truth = bench.rig.plant().counts();
    bench.rig.push(14.0, 0.0, 100.0);
    bench.run(8.0);
    let moved = bench.rig.plant().counts()[0] - truth[0];
    assert!(moved > 40_000, "twice it is more than 16 bits: {moved}");
    assert_eq!(bench.rig.row().left_count - row.left_count, -2 * moved);
}

/// Two runs with the same seed, and one with another.
#[test]
fn faults_repeat_by_their_seed() {
    let run = |seed| {
        let mut bench = pushed(seed);
        let fault = Fault::Encoder(Side::Both, EncoderFault::Drop(0.5));
        bench.rig.inject(fault).unwrap();
        bench.run(1.0);
        (bench.rig.row(), bench.rig.plant().clone())
    };
    let bits = |(row, plant): (hil_sim::trace::Row, Plant)| (row, plant.pose().map(f64::to_bits));
    assert_eq!(bits(run(1)), bits(run(1)));
    assert_ne!(bits(run(1)).0.left_count, bits(run(2)).0.left_count);
}

/// Blocked motors at full duty: currents and bus voltage.
fn stall(plant: &mut Plant, faults: &FaultSet) -> ([f64; 2], f64) {
    let input = Input {
        command: faults.bridges([BridgeInput::Duty(1.0); 2]),
        push: Push::default(),
        steering: None,
    };
    plant.step(250e-6, &input);
    (plant.current(), plant.bus_voltage())
}

/// The robot `default` with motors that are alike.
fn exact_robot() -> Robot {
    let mut robot = Robot::load("default").unwrap();
    robot.physics.motor.spread = 0.0;
    robot
}

#[test]
fn a_weak_motor_is_as_weak_as_it_was_and_weaker() {
    let physics = exact_robot().physics;
    let resistance = physics.motor.resistance;
    let mut plant = Plant::new(&physics, 1);
    let mut faults = FaultSet::new(&plant, 1);
    plant.set_strength(0, 0.8);
    for wheel in [0, 1] {
        plant.set_blocked(wheel, true);
    }
    // i = s·V_bus/R: rounding apart.
    let expect = |(current, bus): ([f64; 2], f64), strengths: [f64; 2]| {
        for wheel in [0, 1] {
            let exact = strengths[wheel] * bus / resistance;
            assert!((current[wheel] - exact).abs() < 1e-9, "{current:?} {exact}");
        }
    };
    expect(stall(&mut plant, &faults), [0.8, 1.0]);
    let weak = Fault::Motor(Side::Both, MotorFault::Weak(0.5));
    faults.inject(weak, &mut plant).unwrap();
    expect(stall(&mut plant, &faults), [0.4, 0.5]);
    let open = Fault::Motor(Side::Left, MotorFault::Open);
    faults.inject(open, &mut plant).unwrap();
    expect(stall(&mut plant, &faults), [0.0, 0.5]);
    let short = Fault::Motor(Side::Right, MotorFault::Short);
    faults.inject(short, &mut plant).unwrap();
    expect(stall(&mut plant, &faults), [0.0, 0.0]);
    faults.clear(&mut plant);
    expect(stall(&mut plant, &faults), [0.8, 1.0]);
}

#[test]
fn an_open_motor_has_no_current_and_a_shorted_one_brakes() {
    let robot = exact_robot();
    for fault in [MotorFault::Open, MotorFault::Short] {
        let mut bench = Bench::of(&robot, 1);
        bench.send("m inf 0.5 1");
        bench.run(1.5);
        bench.rig.inject(Fault::Motor(Side::Left, fault)).unwrap();
        // Until the gear has swung out.
        bench.run(0.02);
        for _ in 0..30 {
            bench.tick();
            let current = bench.rig.plant().current()[0];
            // i = −K·ω/R; the motor's speed is the wheel's but for what the backlash and the gear let through.
            let omega = bench.rig.plant().wheel_speed()[0] / 0.042;
            let exact = match fault {
                MotorFault::Short => -0.545 * omega / 2.2,
                _ => 0.0,
            };
            let gear = 0.15 * exact.abs();
            assert!((current - exact).abs() <= gear, "{current} {exact}");
        }
    }
}

#[test]
fn a_battery_is_replaced_and_comes_back() {
    let mut bench = Bench::new("default", 1);
    for (volts, fault) in [(8.5, true), (12.4, false)] {
        if fault {
            bench.rig.inject(Fault::Battery(volts)).unwrap();
        } else {
            bench.rig.clear_faults();
        }
        bench.run(3.0);
        assert!((bench.rig.plant().bus_voltage() - volts).abs() < 1e-9);
        // A code of the converter behind the divider is 8.9 mV, the millivolt that it sees 11 mV.
        let seen = bench.rig.row().battery;
        assert!((seen - volts).abs() < 0.02, "{seen}");
    }
}

#[test]
fn an_ideal_base_has_no_motors_that_could_fail() {
    let mut bench = Bench::new("ideal", 1);
    for fault in [
        Fault::Motor(Side::Left, MotorFault::Open),
        Fault::Battery(8.0),
    ] {
        assert!(bench.rig.inject(fault).is_err(), "{fault}");
    }
    bench.send("m inf 0.3");
    bench.run(1.0);
    let stuck = Fault::Encoder(Side::Left, EncoderFault::Stuck);
    bench.rig.inject(stuck).unwrap();
    let before = bench.rig.row().left_count;
    bench.run(1.0);
    assert_eq!(bench.rig.row().left_count, before);
}

#[test]
fn a_cut_link_carries_nothing_either_way_and_forgets_what_was_on_it() {
    let mut bench = Bench::new("default", 1);
    bench.send("SetParam deadman 0");
    bench.send("m 1 0.1");
    bench.send("Stream 0.01");
    bench.run(0.5);
    bench.rig.inject(Fault::LinkCut).unwrap();
    bench.run(0.1);
    let heard = bench.lines.len();
    bench.send("Stop");
    bench.run(0.5);
    assert_eq!(bench.lines.len(), heard, "nothing is heard");
    assert!(bench.truth().speed > 0.05, "nothing was said");
    bench.rig.clear_faults();
    bench.run(0.1);
    assert!(bench.truth().speed > 0.05, "what was said is forgotten");
    // A line of telemetry may have lost its beginning.
    assert!(bench.lines.len() > heard + 5);
    bench.send("Stop");
    bench.run(1.0);
    assert!(bench.truth().speed.abs() < 0.01);
}

/// The base has the beginning of one line, and gets the end of another.
#[test]
fn what_is_left_of_two_lines_does_no_harm() {
    let mut rig = hil_sim::rig::Rig::new(&exact_robot(), 1).unwrap();
    let run = |rig: &mut hil_sim::rig::Rig| {
        for _ in 0..100 {
            rig.tick();
        }
        String::from_utf8(rig.receive()).unwrap()
    };
    run(&mut rig);
    rig.send(b"m 0.");
    run(&mut rig);
    rig.inject(Fault::LinkCut).unwrap();
    rig.send(b"5 0.3\nGetSt");
    assert_eq!(run(&mut rig), "");
    rig.clear_faults();
    rig.send(b"atus\nGetTime\n");
    let said = run(&mut rig);
    assert!(said.starts_with("ERR syntax"), "{said}");
    assert_eq!(said.matches("\nTime ").count(), 1, "{said}");
    assert!(rig.plant().counts() == [0, 0], "nothing moves");
}
