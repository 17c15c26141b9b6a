//! A motor controller that takes position increments gets all of them: drive by drive, and under a whole base.

mod driven;

use driven::{BASE, Base, Motor, UNITS, Wire};
use proptest::prelude::*;
use std::f64::consts::FRAC_PI_2;
use std::rc::Rc;
use vehicle_controller::controller::{Action, Event};
use vehicle_controller::params::{Id, Params};
use vehicle_controller::supervisor::Fault;
use vehicle_controller::vehicle::{
    Drive, OutputError, PositionIncrement, WheelCommand, differential, servo,
};

/// What float64 itself rounds off in these tests' sums, units.
const ROUNDING: f64 = 1e-6;

fn config(reversed: bool) -> servo::Config {
    servo::Config {
        reversed,
        ..Params::default()
            .build::<differential::Config>(driven::PERIOD)
            .vehicle
            .servo[0]
    }
}

fn drive(units_per_metre: f64) -> (PositionIncrement<Wire>, Rc<Motor>) {
    let wire = Wire::default();
    let motor = Rc::clone(&wire.0);
    let drive = PositionIncrement::new(wire, units_per_metre, &config(false)).unwrap();
    (drive, motor)
}

fn command(drive: &mut impl Drive, speed: f32, dt: f32) -> Result<f32, OutputError> {
    let command = WheelCommand {
        speed,
        acceleration: 0.0,
        measured: 0.0,
    };
    drive.command(command, 12.0, dt)
}

/// A drive of one unit per metre that is asked for some units, in a second.
fn ask(drive: &mut impl Drive, units: f32) {
    assert_eq!(command(drive, units, 1.0), Ok(0.0));
}

#[test]
fn ten_million_cycles_of_a_steady_speed_stay_within_a_unit() {
    // 0.8 µm each, and nearly three hours: an f32 product is wrong by 6e-8 of it, which makes hundreds of units of 9e9.
    let (units, speed, dt) = (1_234_567.89, 0.712_34_f32, 1e-3_f32);
    for direction in [1.0, -1.0] {
        let (mut drive, motor) = drive(units);
        let each = f64::from(direction * speed) * f64::from(dt) * units;
        for k in 1..=10_000_000_u32 {
            command(&mut drive, direction * speed, dt).unwrap();
            let owed = f64::from(k) * each - motor.units.get() as f64;
            // The drive's two products have 46 bits: of 9e9 that is 1.3e-4 each.
            assert!(owed.abs() < 1.0 + 3e-4, "{owed} after {k}");
        }
        println!("sent {}", motor.units.get());
        assert!(motor.units.get().abs() > 8_000_000_000);
    }
}

#[test]
fn a_speed_that_makes_a_unit_in_eleven_days_makes_it() {
    // At a millisecond each: an f32 fraction near 1 does not see 1e-9 at all.
    let (mut drive, motor) = drive(1.0);
    let (start, step) = (0.999_f32, 1e-9_f32);
    ask(&mut drive, start);
    let expected = ((1.0 - f64::from(start)) / f64::from(step)).ceil() as i32;
    let mut cycles = 0;
    while motor.units.get() == 0 && cycles < 2_000_000 {
        ask(&mut drive, step);
        cycles += 1;
    }
    println!("{cycles} cycles, {expected} expected");
    // The whole part is that of the leading 24 bits, so 2⁻²⁵ early: 30 cycles. A million roundings of 2⁻⁴⁸ make four cycles at worst.
    assert!((cycles - expected).abs() <= 34, "{cycles} {expected}");
    assert_eq!(motor.units.get(), 1);
}

proptest! {
    #[test]
    fn nothing_is_lost_whatever_is_asked(
        units in 1.0..1e6_f64,
        cycles in proptest::collection::vec(
            (
                prop_oneof![-2.0..2.0_f32, -1e-7..1e-7_f32, Just(0.0), Just(-0.0), Just(1e-42)],
                prop_oneof![Just(1e-3_f32), Just(0.0), 0.0..1e-2_f32, 0.0..200.0_f32],
            ),
            1..400,
        ),
    ) {
        let (mut drive, motor) = drive(units);
        let (mut owed, mut sent) = (0.0, 0);
        for (speed, dt) in cycles {
            prop_assert_eq!(command(&mut drive, speed, dt), Ok(0.0));
            // Not a large sum that rounds: what is left of it. 400 products of up to 4e8, each to 2⁻⁴⁵: 5e-3 at the very worst.
            owed += f64::from(speed) * f64::from(dt) * units;
            owed -= (motor.units.get() - sent) as f64;
            sent = motor.units.get();
            prop_assert!(owed.abs() < 1.005, "{owed}");
        }
    }
}

#[test]
fn a_speed_that_flickers_about_zero_moves_nothing_to_and_fro() {
    // Rounded, the fraction would make a unit of 0.7 and take it back; rounded down, one of −0.1.
    for (start, units) in [(-0.1, 0), (0.4, 0), (0.9, 1)] {
        let (mut drive, motor) = drive(1.0);
        ask(&mut drive, start);
        for _ in 0..10_000 {
            ask(&mut drive, 0.3);
            ask(&mut drive, -0.3);
        }
        let steps = u32::from(units != 0);
        assert_eq!((motor.units.get(), motor.steps.get()), (units, steps));
    }
}

#[test]
fn what_cannot_be_sent_is_refused_and_changes_nothing() {
    let (mut drive, motor) = drive(1.0);
    ask(&mut drive, 0.6);
    let (nan, infinity) = (f32::NAN, f32::INFINITY);
    for (speed, dt) in [
        (nan, 1e-3),
        (infinity, 1e-3),
        (-infinity, 1e-3),
        (infinity, 0.0),
        (0.3, nan),
        (0.3, infinity),
        (0.0, infinity),
        (0.3, -1e-3),
        (0.0, -1e-3),
        // 2³¹, and what no f32 holds.
        (2_147_483_648.0, 1.0),
        (-2_147_483_648.0, 1.0),
        (f32::MAX, f32::MAX),
    ] {
        let answer = command(&mut drive, speed, dt);
        assert_eq!(answer, Err(OutputError), "{speed} m/s for {dt} s");
    }
    assert_eq!(motor.units.get(), 0);
    ask(&mut drive, 0.5);
    assert_eq!(motor.units.get(), 1);
}

#[test]
fn the_largest_increments_are_sent_to_the_unit() {
    for (units, fraction) in [(2_147_483_520.0_f32, 0.75_f32), (16_777_216.0, 0.75)] {
        let (mut drive, motor) = drive(1.0);
        ask(&mut drive, fraction);
        ask(&mut drive, units);
        assert_eq!(motor.units.get(), units as i64);
        ask(&mut drive, 0.25);
        assert_eq!(motor.units.get(), units as i64 + 1);
        ask(&mut drive, -units);
        assert_eq!(motor.units.get(), 1);
    }
}

#[test]
fn what_the_output_refuses_is_not_asked_for_again() {
    let (mut drive, motor) = drive(1.0);
    ask(&mut drive, 0.6);
    motor.refuses.set(true);
    assert_eq!(command(&mut drive, 7.6, 1.0), Err(OutputError));
    motor.refuses.set(false);
    ask(&mut drive, 0.3);
    assert_eq!(motor.units.get(), 0);
    ask(&mut drive, 0.2);
    assert_eq!(motor.units.get(), 1);
}

#[test]
fn a_motor_that_was_off_starts_without_a_fraction() {
    let (mut drive, motor) = drive(1.0);
    for stop in [PositionIncrement::brake, PositionIncrement::off] {
        ask(&mut drive, 0.9);
        stop(&mut drive).unwrap();
        ask(&mut drive, 0.9);
        assert_eq!(motor.units.get(), 0);
        stop(&mut drive).unwrap();
    }
    // It is off from the beginning; and one that cannot brake is off then.
    assert_eq!(motor.stops.each_ref().map(std::cell::Cell::get), [0, 5]);
    assert!(!motor.on.get());
}

#[test]
fn a_reversed_motor_goes_the_other_way_and_owes_the_same() {
    let (mut drive, motor) = drive(1.0);
    ask(&mut drive, 2.75);
    drive.configure(&config(true));
    ask(&mut drive, 3.5);
    // 6.25 forward in all.
    assert_eq!(motor.units.get(), 2 - 4);
    drive.configure(&config(false));
    ask(&mut drive, 0.75);
    assert_eq!(motor.units.get(), 2 - 4 + 1);
}

fn base(changed: &[(Id, f32)]) -> Base<PositionIncrement<Wire>> {
    Base::new(
        |wire, config| PositionIncrement::new(wire, UNITS, config),
        changed,
    )
}

/// What was sent is the integral of the commanded speed to a unit.
fn assert_all_sent(base: &Base<PositionIncrement<Wire>>) {
    for motor in &base.motors {
        let owed = UNITS * motor.integral.get() - motor.units.get() as f64;
        assert!(owed.abs() < 1.0 + ROUNDING, "{owed}");
    }
}

/// The wheels stand where the translation and the rotation take them, to a unit.
fn assert_stands(base: &Base<PositionIncrement<Wire>>, translation: f64, rotation: f64) {
    assert_rests(base, translation, rotation, 1.0);
}

/// The same to so many units.
fn assert_rests(
    base: &Base<PositionIncrement<Wire>>,
    translation: f64,
    rotation: f64,
    tolerance: f64,
) {
    for (motor, side) in base.motors.iter().zip([-0.5, 0.5]) {
        let wanted = UNITS * (translation + side * BASE * rotation);
        let difference = motor.units.get() as f64 - wanted;
        assert!(difference.abs() <= tolerance, "{difference} of {wanted}");
    }
}

fn done(events: &[Event]) -> [usize; 2] {
    let count = |is: fn(&Event) -> bool| events.iter().filter(|event| is(event)).count();
    let known = [
        count(|event| matches!(event, Event::MoveDone(_))),
        count(|event| matches!(event, Event::TurnDone(_))),
    ];
    assert_eq!(events.len(), known[0] + known[1], "{events:?}");
    known
}

#[test]
fn a_metre_and_a_quarter_turn_are_their_increments() {
    let mut base = base(&[]);
    base.go(1.0);
    // 1 m at 0.3 m/s takes 3.93 s, a quarter turn at 1.5 rad/s 1.55 s.
    assert_eq!(done(&base.run(4_100, assert_all_sent)), [1, 0]);
    assert_stands(&base, 1.0, 0.0);
    base.turn(FRAC_PI_2 as f32);
    assert_eq!(done(&base.run(1_700, assert_all_sent)), [0, 1]);
    assert_stands(&base, 1.0, FRAC_PI_2);
    // It rests: nothing steps to and fro.
    let before = base.motors.each_ref().map(|motor| motor.steps.get());
    base.run(10_000, |base| {
        assert_all_sent(base);
        assert_stands(base, 1.0, FRAC_PI_2);
    });
    let after = base.motors.each_ref().map(|motor| motor.steps.get());
    assert_eq!(after, before);
    // Both at once, and back.
    base.go(-1.0);
    base.turn(-FRAC_PI_2 as f32);
    assert_eq!(done(&base.run(4_100, assert_all_sent)), [1, 1]);
    assert_stands(&base, 0.0, 0.0);
}

#[test]
fn ticks_that_come_twice_or_not_at_all_cost_no_increments_in_the_end() {
    let mut base = base(&[]);
    base.go(1.0);
    let mut events = Vec::new();
    for k in 0..5_000 {
        let is_double = matches!(k % 50, 10 | 20);
        match k % 50 {
            10 | 20 => base.delay(-1),
            40 => base.delay(2),
            _ => {}
        }
        let before = base.motors.each_ref().map(|motor| motor.units.get());
        events.extend(base.tick());
        assert_all_sent(&base);
        for (motor, before) in base.motors.iter().zip(before) {
            let sent = motor.units.get() - before;
            // At 0.3 m/s and a correction of 3 % at most, 3.1 units are due. What was missed is not sent in one.
            assert!((0..=4).contains(&sent), "{sent}");
            assert!(!is_double || sent == 0, "{sent}");
        }
    }
    assert_eq!(done(&events), [1, 0]);
    // The last tick that was missed is made up for as an error is, and a base rests within 0.3 mm, which are three units. The ticks that came twice would be
    // hundreds.
    assert_rests(&base, 1.0, 0.0, 4.0);
}

#[test]
fn a_reversed_motor_is_fed_backward() {
    let mut base = base(&[(Id::RightMotorReversed, 1.0)]);
    base.go(0.05);
    base.run(100, |_| {});
    let [left, right] = base.motors.each_ref().map(|motor| motor.units.get());
    assert!(left > 0 && right < 0, "{left} {right}");
}

#[test]
fn after_an_emergency_stop_it_starts_gently_from_where_it_is() {
    let mut base = base(&[]);
    base.go(1.0);
    base.run(1_234, assert_all_sent);
    base.request(Action::EStop);
    base.tick();
    let units = |base: &Base<_>| base.motors.each_ref().map(|motor| motor.units.get());
    let stopped = units(&base);
    base.run(2_000, |base| {
        assert_eq!(units(base), stopped);
        assert!(base.motors.iter().all(|motor| !motor.on.get()));
    });
    base.request(Action::ClearFault);
    for motor in &base.motors {
        motor.integral.set(0.0);
    }
    base.go(1.0);
    let events = base.run(4_100, |base| {
        for (motor, stopped) in base.motors.iter().zip(stopped) {
            let owed = UNITS * motor.integral.get() - (motor.units.get() - stopped) as f64;
            assert!(owed.abs() < 1.0 + ROUNDING, "{owed}");
        }
    });
    assert_eq!(done(&events), [1, 0]);
    for (motor, stopped) in base.motors.iter().zip(stopped) {
        assert!((motor.units.get() - stopped - 10_000).abs() <= 1);
    }
}

/// The cycles until the base was found not to follow.
fn cycles_until_found(base: &mut Base<PositionIncrement<Wire>>) -> u32 {
    for cycle in 0..3_000 {
        let events = base.tick();
        if let [event, ..] = events[..] {
            assert!(
                matches!(event, Event::Fault(Fault::Following, _)),
                "{events:?}"
            );
            return cycle;
        }
    }
    panic!("nothing was found");
}

#[test]
fn a_wheel_that_is_held_is_found_without_a_motor_model() {
    let mut base = base(&[]);
    base.go(1.0);
    assert_eq!(done(&base.run(1_000, |_| {})), [0, 0]);
    base.motors[0].held.set(true);
    let cycles = cycles_until_found(&mut base);
    println!("found after {cycles} ms");
    // A second that the axis waits, and a tenth for its error to grow.
    assert!(cycles < 1_100, "{cycles}");
}

#[test]
fn an_encoder_the_wrong_way_round_is_found_without_a_motor_model() {
    let mut base = base(&[(Id::LeftEncoderReversed, 1.0)]);
    base.go(1.0);
    let cycles = cycles_until_found(&mut base);
    let units = base.motors.each_ref().map(|motor| motor.units.get());
    println!("found after {cycles} ms and {units:?} units");
    assert!(units.iter().all(|units| units.abs() < 2_000), "{units:?}");
}

#[test]
fn a_motor_model_is_not_held_against_duties_that_nobody_knows() {
    // The default parameters have one, and with it a motion at 0.3 m/s and no duty would be a fault within a twentieth of a second.
    let mut base = base(&[]);
    assert!(base.config.supervision.motor.speed_gain > 0.0);
    base.go(1.0);
    assert_eq!(done(&base.run(1_000, |_| {})), [0, 0]);
    let config = base.config;
    base.request(Action::Configure(config));
    assert_eq!(done(&base.run(3_100, assert_all_sent)), [1, 0]);
}

#[test]
fn a_motor_controller_that_refuses_stops_the_base() {
    let mut base = base(&[]);
    base.go(1.0);
    assert_eq!(done(&base.run(500, |_| {})), [0, 0]);
    base.motors[1].refuses.set(true);
    let events = base.tick();
    assert!(
        matches!(events[..], [Event::Fault(Fault::Output, _), ..]),
        "{events:?}"
    );
    assert!(base.motors.iter().all(|motor| !motor.on.get()));
}
