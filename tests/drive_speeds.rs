//! A motor controller that takes speeds: drive by drive, and under a whole base.

mod driven;

use driven::{BASE, Base, Motor, Wire};
use std::f64::consts::FRAC_PI_2;
use std::rc::Rc;
use vehicle_controller::controller::{Action, Event};
use vehicle_controller::params::{Id, Params};
use vehicle_controller::vehicle::{
    Drive, OutputError, WheelCommand, WheelSpeed, differential, servo,
};

fn config(reversed: bool) -> servo::Config {
    servo::Config {
        reversed,
        ..Params::default()
            .build::<differential::Config>(driven::PERIOD)
            .vehicle
            .servo[0]
    }
}

fn drive(reversed: bool) -> (WheelSpeed<Wire>, Rc<Motor>) {
    let wire = Wire::default();
    let motor = Rc::clone(&wire.0);
    (WheelSpeed::new(wire, &config(reversed)).unwrap(), motor)
}

/// Neither of what the drive does not know matters.
fn command(drive: &mut impl Drive, speed: f32) -> Result<f32, OutputError> {
    let command = WheelCommand {
        speed,
        acceleration: f32::NAN,
        measured: f32::NAN,
    };
    drive.command(command, f32::NAN, f32::NAN)
}

#[test]
fn speeds_are_handed_over_as_they_are() {
    for (reversed, sign) in [(false, 1.0), (true, -1.0)] {
        let (mut drive, motor) = drive(reversed);
        for speed in [0.3, -0.71, 1e-9, 0.0, f32::MAX] {
            assert_eq!(command(&mut drive, speed), Ok(0.0));
            assert_eq!(motor.speed.get(), sign * speed);
            assert!(motor.on.get());
        }
        drive.configure(&config(!reversed));
        command(&mut drive, 0.3).unwrap();
        assert_eq!(motor.speed.get(), -sign * 0.3);
    }
}

#[test]
fn what_is_no_speed_is_refused_and_changes_nothing() {
    let (mut drive, motor) = drive(false);
    command(&mut drive, 0.3).unwrap();
    for speed in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        assert_eq!(command(&mut drive, speed), Err(OutputError));
        assert_eq!(motor.speed.get(), 0.3);
    }
    motor.refuses.set(true);
    assert_eq!(command(&mut drive, 0.2), Err(OutputError));
}

#[test]
fn it_starts_switched_off_and_brakes_as_the_output_can() {
    let (mut drive, motor) = drive(false);
    let told = || motor.stops.each_ref().map(std::cell::Cell::get);
    assert_eq!(told(), [0, 1]);
    command(&mut drive, 0.3).unwrap();
    drive.brake().unwrap();
    assert_eq!(told(), [1, 1]);
    drive.off().unwrap();
    assert_eq!(told(), [1, 2]);
    assert!(!motor.on.get());
}

fn base(changed: &[(Id, f32)]) -> Base<WheelSpeed<Wire>> {
    Base::new(WheelSpeed::new, changed)
}

/// The wheels stand where the translation and the rotation take them: to a count (6 µm), and what the axis's f32 error does not see of a metre (0.1 µm).
fn assert_stands(base: &Base<WheelSpeed<Wire>>, translation: f64, rotation: f64) {
    for (motor, side) in base.motors.iter().zip([-0.5, 0.5]) {
        let wanted = translation + side * BASE * rotation;
        let difference = motor.rolled.get() - wanted;
        assert!(
            difference.abs() < 2.0 / driven::COUNTS,
            "{difference} of {wanted}"
        );
    }
}

#[test]
fn a_metre_and_a_quarter_turn_are_what_the_speeds_add_up_to() {
    let mut base = base(&[]);
    base.go(1.0);
    // 1 m at 0.3 m/s takes 3.93 s, a quarter turn at 1.5 rad/s 1.55 s; then the axes' errors decay, by e in an eighth of a second.
    let events = base.run(5_000, |_| {});
    assert!(matches!(events[..], [Event::MoveDone(_)]), "{events:?}");
    assert_stands(&base, 1.0, 0.0);
    base.turn(FRAC_PI_2 as f32);
    let events = base.run(2_600, |_| {});
    assert!(matches!(events[..], [Event::TurnDone(_)]), "{events:?}");
    assert_stands(&base, 1.0, FRAC_PI_2);
    // Both at once, and back.
    base.go(-1.0);
    base.turn(-FRAC_PI_2 as f32);
    let events = base.run(5_000, |_| {});
    assert_eq!(events.len(), 2, "{events:?}");
    assert_stands(&base, 0.0, 0.0);
}

#[test]
fn an_emergency_stop_brakes_for_half_a_second_and_lets_go() {
    let mut base = base(&[]);
    base.go(1.0);
    base.run(1_000, |_| {});
    let told = |base: &Base<_>| {
        let [left, right] = base
            .motors
            .each_ref()
            .map(|motor| motor.stops.each_ref().map(std::cell::Cell::get));
        assert_eq!(left, right);
        left
    };
    let [_, off] = told(&base);
    base.request(Action::EStop);
    base.run(500, |base| {
        assert!(base.motors.iter().all(|motor| !motor.on.get()));
    });
    assert_eq!(told(&base), [500, off]);
    base.run(100, |base| {
        assert!(base.motors.iter().all(|motor| !motor.on.get()));
    });
    let [braked, off] = told(&base);
    // Half a second, to a tick: it is added up in f32.
    assert!((500..=501).contains(&braked), "{braked}");
    assert!(off >= 99, "{off}");
}
