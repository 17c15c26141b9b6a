//! The supervisor alone: wheels that stand although their motors push, and what currents and flickering counts tell of them.

#[path = "supervised/wheels.rs"]
mod wheels;

use vehicle_controller::supervisor::{Fault, Following, Place};
use vehicle_controller::vehicle::Wheel;
use wheels::{Bench, MOTOR, PLACES, SUPPLY, VERDICT, slip, standing, ticks, voltage};

#[test]
fn a_count_that_flickers_is_a_lost_channel() {
    for speed in [0.5, -0.5] {
        for (place, which) in PLACES {
            for flicker in [1, -1] {
                let mut bench = slip(speed, 0.0, which);
                bench.flicker = which.map(|lost| if lost { flicker } else { 0 });
                bench.finds(0.08, Fault::EncoderChannel, place);
            }
        }
    }
}

#[test]
fn reversals_are_counted_in_a_row_up_to_the_verdict() {
    // The verdict comes at the 22nd look: what turns round at the last four of them flickers, at the last three not yet. Before, it goes on slowly.
    for (from, fault) in [(19, Fault::EncoderChannel), (20, Fault::NoMotion)] {
        let mut bench = slip(0.5, 0.0, [true, false]);
        let mut count = 0;
        let found = (1..100).find_map(|look| {
            let back = look >= from && (look - from) % 2 == 0;
            count += if back { -1 } else { 1 };
            bench.cycle.wheels[0].count = count;
            let found = (0..4).find_map(|_| {
                bench
                    .supervisor
                    .watch(&bench.config, &bench.cycle, || [Following::Closely; 2])
            });
            found.map(|found| (look, found))
        });
        assert_eq!(found, Some((22, (fault, Place::Left))));
    }
}

#[test]
fn the_current_tells_a_stall_from_an_encoder_and_from_a_motor_without_power() {
    for expected in [0.5_f32, -0.5] {
        let u = voltage(expected);
        let resistance = MOTOR.resistance;
        for (place, which) in PLACES {
            // All the voltage is across the winding: no back-EMF, the motor stands. A bump may be longer than 80 ms.
            standing(expected, Some(u / resistance), which).finds(0.5, Fault::Stall, place);
            // What friction takes: it turns, and its encoder does not see it.
            let turns = (u - MOTOR.speed_gain * expected) / resistance;
            standing(expected, Some(turns), which).finds(0.08, Fault::EncoderStuck, place);
            // At a bit more than half the speed it turns, at a bit less it does not.
            let at = |share: f32| (u - MOTOR.speed_gain * share * expected) / resistance;
            standing(expected, Some(at(0.51)), which).finds(0.08, Fault::EncoderStuck, place);
            standing(expected, Some(at(0.49)), which).finds(0.5, Fault::Stall, place);
            // Hardly any: no power, or a broken wire. 5 % of the stall current is the limit.
            for current in [0.0, 0.049 * u / resistance, -0.049 * u / resistance] {
                let mut bench = standing(expected, Some(current), which);
                bench.finds(0.08, Fault::NoMotion, place);
            }
            standing(expected, Some(0.051 * u / resistance), which).finds(
                0.08,
                Fault::EncoderStuck,
                place,
            );
            // Not measured, or nothing known of the winding.
            standing(expected, None, which).finds(0.08, Fault::NoMotion, place);
            let mut bench = standing(expected, Some(u / resistance), which);
            bench.config.motor.resistance = 0.0;
            bench.finds(0.08, Fault::NoMotion, place);
        }
    }
}

#[test]
fn a_current_that_says_for_long_enough_that_the_motor_turns_is_needed_for_an_encoder() {
    // The wheel is blocked for 60 ms of the 80, then its current says that it turns: 40 ms of that are the verdict.
    let u = voltage(0.5);
    let mut bench = standing(0.5, Some(u / 2.0), [true, false]);
    assert_eq!(bench.run(0.06), None);
    bench.cycle.currents[0] = Some(0.25);
    bench.finds(0.04, Fault::EncoderStuck, Place::Left);
    // Now and then is not enough: half of the time is taken off again.
    let mut bench = standing(0.5, Some(u / 2.0), [true, false]);
    let mut found = None;
    for _ in 0..9 {
        for current in [u / 2.0, 0.25] {
            bench.cycle.currents[0] = Some(current);
            found = found.or(bench.run(0.032));
        }
    }
    assert!(
        matches!(found, Some((_, Fault::Stall, Place::Left))),
        "{found:?}"
    );
}

#[test]
fn motors_against_each_other_are_told_from_a_turn_and_from_one_wheel() {
    let both = [true, true];
    let opposed = |left: f32| {
        let mut bench = Bench::at([left, -left]);
        bench.measure([0.0; 2]);
        bench
    };
    for left in [0.5, -0.5] {
        opposed(left).finds(0.08, Fault::WheelsFighting, Place::Both);
        // They are to turn the base: it is blocked.
        let mut turn = opposed(left);
        turn.cycle.turns = true;
        turn.finds(0.08, Fault::NoMotion, Place::Both);
        // One turns.
        let mut one = opposed(left);
        one.measure([0.0, -left]);
        one.finds(0.08, Fault::NoMotion, Place::Left);
        // One turns the wrong way, and is found first.
        let mut one = opposed(left);
        one.measure([0.0, left]);
        one.finds(VERDICT / 1.5, Fault::EncoderSign, Place::Right);
        // By current, both stand …
        let mut stall = opposed(left);
        let current = voltage(left) / MOTOR.resistance;
        stall.cycle.currents = [Some(current), Some(-current)];
        stall.finds(0.5, Fault::WheelsFighting, Place::Both);
        // … or both turn.
        let mut stuck = opposed(left);
        let current = 0.25_f32.copysign(left);
        stuck.cycle.currents = [Some(current), Some(-current)];
        stuck.finds(0.08, Fault::EncoderStuck, Place::Both);
    }
    // In the same direction they push together.
    slip(0.5, 0.0, both).finds(0.08, Fault::NoMotion, Place::Both);
}

#[test]
fn half_a_verdict_is_enough_to_share_the_fault() {
    // The right wheel has 20 ms to the bit, half a verdict; the left one gets on to 60 ms.
    let mut bench = slip(0.5, 0.2, [true, true]);
    let found = ticks(&mut bench, &[VERDICT, 0.0, 0.0, 0.0, 0.08]);
    assert_eq!(found, Some((Fault::Mismatch, Place::Both)));
    let mut bench = slip(0.5, 0.2, [true, true]);
    let found = ticks(&mut bench, &[VERDICT.next_down(), 0.0, 0.0, 0.0, 0.09]);
    assert_eq!(found, Some((Fault::Mismatch, Place::Left)));
}

#[test]
fn a_stall_is_one_beyond_half_a_second_not_at_it() {
    let stall = || standing(0.5, Some(voltage(0.5) / MOTOR.resistance), [true, false]);
    assert_eq!(ticks(&mut stall(), &[0.5]), None);
    assert_eq!(
        ticks(&mut stall(), &[0.5_f32.next_up()]),
        Some((Fault::Stall, Place::Left))
    );
}

#[test]
fn a_current_has_to_say_for_longer_than_40_ms_that_the_motor_turns() {
    // The wheel stands for 40.1 ms and, by its current, turns for the next ones: suspicion enough in both cases.
    for (length, found) in [
        (VERDICT, None),
        (VERDICT.next_up(), Some((Fault::EncoderStuck, Place::Left))),
    ] {
        let mut bench = standing(0.5, Some(voltage(0.5) / MOTOR.resistance), [true, false]);
        assert_eq!(ticks(&mut bench, &[0.0401, 0.0, 0.0, 0.0]), None);
        bench.cycle.currents[0] = Some(0.25);
        assert_eq!(ticks(&mut bench, &[length]), found);
    }
}

#[test]
fn limits_of_the_current_to_the_bit() {
    let u = voltage(0.5);
    // Half the speed is not more than half the speed.
    let half = (u - MOTOR.speed_gain * 0.25) / MOTOR.resistance;
    standing(0.5, Some(half), [true, false]).finds(0.5, Fault::Stall, Place::Left);
    // 5 % of the stall current is not less than that.
    let least = 0.05 * u / MOTOR.resistance;
    standing(0.5, Some(least), [true, false]).finds(0.08, Fault::EncoderStuck, Place::Left);
}

/// A wheel that is driven at 2 m/s, and then by this voltage only; its encoder is stuck at the same time.
fn coasting(u: f32) -> Bench {
    let mut bench = Bench::at([2.0, 2.0]);
    bench.cycle.wheels[0] = Wheel {
        count: 0,
        speed: 0.0,
        duty: u / SUPPLY,
    };
    bench.cycle.currents = [Some(0.0), Some(0.25)];
    bench
}

#[test]
fn no_current_at_little_voltage_is_no_lack_of_power() {
    // K_v times the rest floor is 1 V. Beyond it a motor that takes nothing has no power.
    coasting(1.0_f32.next_up()).finds(0.08, Fault::NoMotion, Place::Left);
    // Up to it that says that the motor turns at u/K_v, 1/8 m/s; and that is half of v̂ = 1/16 + 31/16 e^(−t/τ) from τ ln(31/3) = 146 ms on. The
    // implicit model is some 4 ms late.
    let (at, fault, place) = coasting(1.0).run(1.0).expect("found");
    assert_eq!((fault, place), (Fault::EncoderStuck, Place::Left));
    assert!((0.186..0.202).contains(&at), "{at}");
    // Without a resistance a current says nothing at all.
    let mut bench = coasting(0.0);
    bench.config.motor.resistance = 0.0;
    bench.finds(0.08, Fault::NoMotion, Place::Left);
}
