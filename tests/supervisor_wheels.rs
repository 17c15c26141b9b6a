//! The supervisor alone: wheels against the model of their motors.

#[path = "supervised/wheels.rs"]
mod wheels;

use vehicle_controller::supervisor::{Fault, MotorModel, Place};
use vehicle_controller::vehicle::Wheel;
use wheels::{Bench, DT, LOOK, MOTOR, PLACES, SUPPLY, VERDICT, excess, slip, wheel};

#[test]
fn wheels_that_do_as_their_motors_are_never_suspected() {
    for speed in [0.0, 0.125, -0.125, 0.5, -0.5, 2.0] {
        for other in [0.0, 0.5, -1.0] {
            assert_eq!(Bench::at([speed, other]).run(10.0), None);
        }
    }
}

#[test]
fn a_difference_within_the_tolerance_is_none_and_one_beyond_it_adds_up() {
    for expected in [0.5_f32, 1.0, -0.5, -1.0] {
        let slower = expected.abs() - (MOTOR.floor + MOTOR.tolerance * expected.abs());
        // measured − expected = floor + tolerance · measured
        let faster = (expected.abs() + MOTOR.floor) / (1.0 - MOTOR.tolerance);
        for (speed, inside) in [(slower, 1.0), (faster, -1.0)] {
            for (place, which) in PLACES {
                let at = |nearer: f32| (speed + inside * nearer).copysign(expected);
                let mut fine = slip(expected, at(1e-5), which);
                assert_eq!(fine.run(60.0), None);
                let beyond = at(-0.02);
                let e = excess(expected, beyond);
                assert!(e > 0.01 && e < 0.5);
                slip(expected, beyond, which).finds(VERDICT / e, Fault::Mismatch, place);
            }
        }
    }
}

#[test]
fn at_rest_the_tolerance_is_what_holds_a_load() {
    for sign in [1.0, -1.0] {
        for (place, which) in PLACES {
            let held = |speed: f32| {
                let speed = speed * sign;
                let mut bench = Bench::at([0.0; 2]);
                let loaded = wheel(speed, 0.0);
                bench.cycle.wheels = which.map(|held| if held { loaded } else { wheel(0.0, 0.0) });
                bench
            };
            assert_eq!(held(0.125).run(60.0), None);
            // The model takes some time to get there: five time constants are e^-5, 0.7 % of the way, from there.
            let found = held(0.15).run(2.0);
            let (at, fault, its_place) = found.expect("more than it may hold");
            assert_eq!((fault, its_place), (Fault::NoMotion, place));
            let steady = VERDICT / excess(0.15, 0.0);
            assert!((steady..steady + 5.0 / 16.0).contains(&at), "{at} {steady}");
        }
    }
}

#[test]
fn how_wrong_a_wheel_is_makes_it_no_faster_than_80_ms_but_for_one_that_runs_away() {
    for sign in [1.0_f32, -1.0] {
        for (place, which) in PLACES {
            for (measured, rate, fault) in [
                // A quarter of what is expected is not yet standing.
                (0.125, 0.5, Fault::Mismatch),
                (0.125_f32.next_down(), 0.5, Fault::NoMotion),
                (0.0, 0.5, Fault::NoMotion),
                (-0.125_f32.next_down(), 0.5, Fault::NoMotion),
                (-0.125, 1.5, Fault::EncoderSign),
                (-0.5, 1.5, Fault::EncoderSign),
                (-1.5, 1.5, Fault::EncoderSign),
                (1.5, 0.5, Fault::Mismatch),
            ] {
                let mut bench = slip(0.5 * sign, measured * sign, which);
                bench.finds(VERDICT / rate, fault, place);
            }
        }
    }
}

#[test]
fn excess_up_to_the_cap_counts_as_it_is() {
    // Below 0.5 of a threshold, and between that and 1.5 for a wheel that runs away: it is slow, so its threshold is that at rest.
    let slow = 0.3;
    let e = excess(0.5, slow);
    assert!((0.2..0.5).contains(&e));
    slip(0.5, slow, [true, false]).finds(VERDICT / e, Fault::Mismatch, Place::Left);
    let (expected, backward) = (0.15, -0.1);
    let e = excess(expected, backward);
    assert!((0.6..1.4).contains(&e), "{e}");
    slip(expected, backward, [false, true]).finds(VERDICT / e, Fault::EncoderSign, Place::Right);
}

#[test]
fn what_fits_takes_the_suspicion_away_again() {
    // 0.5 for 64 ms is 32 ms of suspicion; a wheel that fits takes 1 for each second.
    let differs = [0.2, 0.5];
    let mut bench = Bench::at([0.5; 2]);
    assert_eq!(bench.measure(differs).run(0.064), None);
    assert_eq!(bench.measure([0.5; 2]).run(0.016), None);
    let left = 0.032 - 0.016;
    let (at, fault, place) = bench.measure(differs).run(1.0).expect("found");
    assert_eq!((fault, place), (Fault::Mismatch, Place::Left));
    let expected = (VERDICT - left) / 0.5;
    assert!((at - expected).abs() < 3.0 * LOOK, "{at} {expected}");
    // Wrong for a third of the time, it never adds up; and what is forgotten is not owed.
    let mut bench = Bench::at([0.5; 2]);
    for _ in 0..100 {
        assert_eq!(bench.measure(differs).run(0.06), None);
        assert_eq!(bench.measure([0.5; 2]).run(0.06), None);
    }
    assert_eq!(bench.run(10.0), None);
    bench
        .measure(differs)
        .finds(0.08, Fault::Mismatch, Place::Left);
}

#[test]
fn running_the_other_way_is_suspected_anew() {
    let mut bench = Bench::at([0.5; 2]);
    for _ in 0..20 {
        // 15 ms at 1.5, 60 ms at 0.5: neither lasts.
        for (measured, seconds) in [(-0.5, 0.015), (0.0, 0.06)] {
            bench.measure([measured, 0.5]);
            assert_eq!(bench.run(seconds), None, "{measured}");
        }
    }
}

#[test]
fn a_wheel_that_now_stands_and_now_turns_too_slowly_is_found_as_one_that_does_either() {
    let mut bench = Bench::at([0.5; 2]);
    let mut seconds = 0.0_f32;
    while bench.measure([0.0, 0.5]).run(0.008).is_none()
        && bench.measure([0.2, 0.5]).run(0.008).is_none()
    {
        seconds += 0.016;
        assert!(seconds < 0.2, "not found");
    }
    // 0.5 for each second, and 40 ms are a verdict.
    assert!((seconds - 0.08).abs() < 0.02, "{seconds} s");
}

#[test]
fn a_wheel_that_is_held_for_a_moment_may_catch_up() {
    for held in [0.02, 0.04, 0.06, 0.07] {
        let mut bench = Bench::at([0.5; 2]);
        assert_eq!(bench.measure([0.0, 0.5]).run(held), None);
        assert_eq!(bench.measure([0.2, 0.5]).run(0.06), None, "{held}");
        assert_eq!(bench.measure([0.5; 2]).run(1.0), None, "{held}");
        // What is over is forgotten: the verdicts are what they were.
        for (measured, fault) in [(0.0, Fault::NoMotion), (0.2, Fault::Mismatch)] {
            let mut bench = bench.clone();
            bench
                .measure([measured, 0.5])
                .finds(0.08, fault, Place::Left);
        }
    }
}

#[test]
fn a_wheel_that_ran_the_other_way_has_nothing_to_catch_up() {
    let mut bench = Bench::at([0.5; 2]);
    assert_eq!(bench.measure([-0.5, 0.5]).run(0.015), None);
    bench
        .measure([0.2, 0.5])
        .finds(0.08, Fault::Mismatch, Place::Left);
}

#[test]
fn a_wheel_that_is_well_on_the_way_shares_the_others_fault() {
    let found = |ahead: f32, left: f32, right: f32| {
        let mut bench = Bench::at([0.5; 2]);
        assert_eq!(bench.measure([left, 0.5]).run(ahead), None);
        let (_, fault, place) = bench.measure([left, right]).run(1.0).expect("found");
        (fault, place)
    };
    // 80 ms are a verdict, and half of it is enough for the other one.
    assert_eq!(found(0.03, 0.0, 0.0), (Fault::NoMotion, Place::Both));
    assert_eq!(found(0.05, 0.0, 0.0), (Fault::NoMotion, Place::Left));
    // Two faults: the one that is suspected more.
    assert_eq!(found(0.03, 0.0, 0.2), (Fault::NoMotion, Place::Left));
    assert_eq!(found(0.05, 0.0, -0.5), (Fault::EncoderSign, Place::Right));
    // Alike in suspicion and not in kind: the left one, if it comes to that.
    for (left, right, fault) in [(0.0, 0.2, Fault::NoMotion), (0.2, 0.0, Fault::Mismatch)] {
        let mut bench = Bench::at([0.5; 2]);
        bench.measure([left, right]).cycle.dt = 0.1;
        assert_eq!(bench.tick(), Some((fault, Place::Left)));
        bench.cycle.dt = 0.0;
        bench.tick();
        assert_eq!(bench.tick(), Some((fault, Place::Left)));
    }
}

#[test]
fn without_a_model_nothing_is_compared() {
    for measured in [0.0, -2.0, 2.0] {
        let mut bench = slip(0.5, measured, [true, true]);
        bench.config.motor.speed_gain = 0.0;
        assert_eq!(bench.run(10.0), None);
    }
}

#[test]
fn a_start_forgets_what_wheels_were_suspected_of() {
    let mut bench = Bench::at([0.5; 2]);
    bench.measure([0.2, -0.5]);
    for _ in 0..20 {
        assert_eq!(bench.run(0.02), None);
        bench.supervisor.start(&[wheel(0.5, 0.5); 2]);
    }
    // And it starts from the speed that a wheel has: one that rolls is not expected to stand.
    bench.supervisor.start(&[wheel(0.5, 0.5); 2]);
    assert_eq!(bench.measure([0.5; 2]).run(1.0), None);
}

/// What the motor's differential equation says of a speed, `t` seconds after a step of the voltage: K_a dv/dt = u − V_s sign v − K_v v.
fn step_response(from: f32, u: f32, t: f32) -> f32 {
    let tau = MOTOR.acceleration_gain / MOTOR.speed_gain;
    let end = (u - MOTOR
        .static_friction
        .copysign(if from == 0.0 { u } else { from }))
        / MOTOR.speed_gain;
    let speed = end + (from - end) * (-t / tau).exp();
    // Friction alone reverses nothing.
    if u == 0.0 && speed * from <= 0.0 {
        0.0
    } else {
        speed
    }
}

#[test]
fn wheels_that_follow_the_equation_are_sound_and_those_a_third_off_are_not() {
    for sign in [1.0, -1.0] {
        for (from, u) in [(0.0, 12.5), (0.0, 4.5), (0.5, 12.5), (1.5, 0.0), (0.5, 0.0)] {
            let (from, u) = (from * sign, u * sign);
            for (gain, sound) in [
                (1.0, true),
                (0.9, true),
                (1.1, true),
                (0.5, false),
                (1.8, false),
            ] {
                let mut bench = Bench::at([from; 2]);
                let mut found = None;
                for tick in 1..=400 {
                    let speed = gain * step_response(from, u, tick as f32 * DT);
                    bench.cycle.wheels = [Wheel {
                        count: 0,
                        speed,
                        duty: u / SUPPLY,
                    }; 2];
                    found = found.or(bench.tick());
                }
                // What has come to rest is sound again, and may have been so fast that nothing was made of it.
                if sound {
                    assert_eq!(found, None, "{from} {u} {gain}");
                } else if u != 0.0 {
                    assert_eq!(
                        found,
                        Some((Fault::Mismatch, Place::Both)),
                        "{from} {u} {gain}"
                    );
                }
            }
        }
    }
}

#[test]
fn a_blocked_wheel_is_found_100_ms_after_the_step_that_was_to_turn_it() {
    // v̂ reaches the rest floor of 1/8 after τ ln(4/3) = 18 ms and 3/2 of it after τ ln(8/5) = 29.4 ms; between them the suspicion grows with
    // v̂/floor − 1, 2.8 ms in all, from there with 1/2: 29.4 + (40 − 2.8)/0.5 = 103.8 ms. The model's steps of 4 ms are implicit, and 1.5 ms late.
    let mut bench = Bench::at([0.0; 2]);
    bench.cycle.wheels = [wheel(0.5, 0.0); 2];
    let (at, fault, place) = bench.run(1.0).expect("found");
    assert_eq!((fault, place), (Fault::NoMotion, Place::Both));
    assert!((0.102..0.112).contains(&at), "{at}");
}

#[test]
fn friction_holds_what_it_can_hold() {
    // Below V_s nothing turns: at 0.49 V a wheel that stands is right, and one that runs away is not.
    let mut bench = Bench::at([0.0; 2]);
    let held = Wheel {
        count: 0,
        speed: 0.0,
        duty: 0.49 / SUPPLY,
    };
    bench.cycle.wheels = [held; 2];
    assert_eq!(bench.run(10.0), None);
    for speed in [0.3, -0.3] {
        let mut bench = bench.clone();
        bench.measure([speed, 0.0]);
        // Against a model at rest, 0.3 is 1.4 thresholds beyond.
        bench.finds(0.08, Fault::Mismatch, Place::Left);
    }
}

#[test]
fn the_verdict_is_beyond_its_limit_not_at_it() {
    // One look of 80 ms at the cap is 40 ms of suspicion to the bit.
    let mut bench = slip(0.5, 0.2, [true, false]);
    bench.cycle.dt = 2.0 * VERDICT;
    assert_eq!(bench.tick(), None);
    bench.cycle.dt = 0.0;
    for _ in 0..100 {
        assert_eq!(bench.tick(), None);
    }
    bench.cycle.dt = DT;
    bench.finds(0.0, Fault::Mismatch, Place::Left);
}

#[test]
fn floors_are_shares_of_the_free_speed() {
    // 16 V over 8 V/(m/s) is 2 m/s: 4 % and 11 % of that.
    let model = MotorModel::new([0.5, 8.0, 0.25], 1.5, 0.3, 16.0);
    let expected = MotorModel {
        static_friction: 0.5,
        speed_gain: 8.0,
        acceleration_gain: 0.25,
        resistance: 1.5,
        tolerance: 0.3,
        floor: 0.08,
        rest_floor: 0.22,
    };
    assert_eq!(model, expected);
    let none = MotorModel::new([0.5, 0.0, 0.25], 1.5, 0.3, 16.0);
    assert_eq!((none.floor, none.rest_floor), (0.0, 0.0));
}
