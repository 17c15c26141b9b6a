//! The promise: a base that steers points its wheels before it moves, turns no tighter than they let it, turns only as far as it moves, and stops when its
//! steering does not follow.

mod wheeled;

use vehicle_controller::controller::State;
use vehicle_controller::params::{Id, Params};
use vehicle_controller::vehicle::{Kind, VirtualVehicle};
use wheeled::base::Base;
use wheeled::{Car, car, params, tricycle};

/// tan of the steering's limit, 30°, over half of the wheel base: the tightest curve of a car that steers both axles, 1/m.
const TIGHTEST: f64 = 0.577_350_27 / 0.6;

fn cycab_params() -> Params {
    params(
        Kind::BiSteerable,
        &[
            (Id::WheelBase, 1.2),
            (Id::Track, 1.2),
            (Id::LeftDiameter, 0.4),
            (Id::RightDiameter, 0.4),
            (Id::SteerMax, 30.0),
            (Id::SteerRate, 60.0),
            (Id::RearSteered, 1.0),
            (Id::CountsPerTurn, 1e6),
        ],
    )
}

fn cycab() -> Base<Car> {
    let params = cycab_params();
    let mut base = Base::new(car(&params), &params);
    base.rate = 2.0;
    base
}

/// Degrees of the heading.
fn heading<V: VirtualVehicle<Config: vehicle_controller::params::Blueprint>>(
    base: &Base<V>,
) -> f64 {
    base.snapshot().estimator.present().pose.theta.to_degrees()
}

#[test]
fn the_wheels_are_pointed_before_the_base_moves() {
    let mut base = cycab();
    base.wires().pointer.is.set(0.4);
    assert_eq!(base.ask("m 1 0.5 0.5"), "OK");
    let mut waited = 0;
    while base.snapshot().translation.reference_speed == 0.0 {
        assert_eq!(
            base.snapshot().translation.state,
            State::Accel,
            "it has set out"
        );
        assert_eq!(base.snapshot().wheels[0].count, 0, "and has not moved");
        base.tick();
        waited += 1;
        assert!(waited < 1000);
    }
    // 0.4 rad at 60 °/s are 0.38 s; the steering itself is faster than that.
    assert!((360..=400).contains(&waited), "{waited} ms");
    assert!(base.wires().pointer.is.get().abs() < 0.036);
    base.run(5.0);
    assert!(heading(&base).abs() < 0.05, "{}", heading(&base));
    assert!(
        base.lines()
            .iter()
            .any(|line| line.starts_with("! move done"))
    );
}

#[test]
fn both_from_rest_set_out_on_the_curve_that_their_ramps_make() {
    let mut base = cycab();
    base.ask("m 3 1 0.5");
    // 20 °/s² over 0.5 m/s²: 0.698 /m, for which φ is atan(0.698 · 0.6) = 22.7°.
    assert_eq!(base.ask("t 60 30 20"), "OK");
    while base.snapshot().translation.reference_speed == 0.0 {
        base.tick();
    }
    let angle = base.wires().pointer.is.get().to_degrees();
    assert!((angle - 22.7).abs() < 2.1, "{angle}");
    base.run(8.0);
    assert!((heading(&base) - 60.0).abs() < 0.3, "{}", heading(&base));
}

#[test]
fn a_car_that_stands_turns_not_and_says_so() {
    let mut base = cycab();
    for line in ["t 30", "t -30 10", "turn inf"] {
        assert_eq!(base.ask(line), "ERR standing turns only while it moves");
    }
    // An axis may be stopped, and what is no number is told first.
    assert_eq!(base.ask("t 0 0"), "OK");
    assert!(base.ask("t 30 1e9").starts_with("ERR range"));
    base.run(1.0);
    assert_eq!(base.wires().pointer.is.get(), 0.0);
    assert_eq!(base.snapshot().wheels[0].count, 0);
    // While it moves it may, also in the very next line.
    base.ask("m 2");
    assert_eq!(base.ask("t 30"), "OK");
}

#[test]
fn a_turn_ends_where_the_car_comes_to_rest() {
    let mut base = cycab();
    base.ask("m 1 0.5 0.5");
    base.ask("t 180 90");
    base.run(6.0);
    let lines = base.lines();
    let done = lines
        .iter()
        .find_map(|line| line.strip_prefix("! turn done "));
    let residual: f64 = done.expect("the turn is done").parse().unwrap();
    // What was turned and what is missing is what was asked for, but for the last digit that is printed.
    assert!(
        (residual + heading(&base) - 180.0).abs() < 0.01,
        "{residual} and {}",
        heading(&base)
    );
    // Not farther than a metre takes it on the tightest circle, and nearly so.
    let most = TIGHTEST.to_degrees();
    assert!(
        heading(&base) < 1.01 * most && heading(&base) > 0.9 * most,
        "{}",
        heading(&base)
    );
    // It is over: the next move is straight from here.
    let before = heading(&base);
    base.ask("m 1");
    base.run(5.0);
    assert!(
        (heading(&base) - before).abs() < 0.2,
        "{}",
        heading(&base) - before
    );
}

#[test]
fn no_reference_is_tighter_than_the_steering_lets_it_be() {
    let mut base = cycab();
    base.ask("m inf 0.6 0.5");
    base.ask("t inf 180 720");
    for step in 0..8000 {
        if step == 3000 {
            base.ask("m -4 0.4 0.5");
        }
        base.tick();
        let (v, w) = (
            base.snapshot().translation.reference_speed,
            base.snapshot().rotation.reference_speed,
        );
        // One period behind, at 720 °/s².
        let slack = 720_f64.to_radians() * 2e-3;
        assert!(
            f64::from(w.abs()) <= TIGHTEST * f64::from(v.abs()) + slack,
            "{v} {w}"
        );
        if step % 500 == 0 {
            // Somebody is there.
            base.ask("GetTime");
        }
    }
}

#[test]
fn it_holds_its_heading_while_it_moves_and_not_at_rest() {
    let mut base = cycab();
    base.run(0.1);
    // Turned by hand at rest, by 2.9° for a wheel base of the track's 1.2 m: the wheels roll against each other.
    let [left, right] = &base.wires().wheels;
    left.roll(-0.03);
    right.roll(0.03);
    base.run(2.0);
    assert!(
        base.snapshot()
            .wheels
            .iter()
            .all(|wheel| wheel.speed.abs() < 1e-3)
    );
    assert_eq!(base.wires().pointer.is.get(), 0.0, "nothing steers back");
    let turned = heading(&base);
    assert!((turned - 2.86).abs() < 0.02, "{turned}");
    // It sets out from where it is, and what disturbs it on the way is undone.
    base.ask("m 6 0.5");
    base.run(3.0);
    base.wires().wheels[1].roll(0.03);
    base.run(12.0);
    assert!(
        (heading(&base) - turned).abs() < 0.1,
        "{} {turned}",
        heading(&base)
    );
}

#[test]
fn a_tricycle_whose_wheel_can_be_turned_aside_turns_in_place() {
    let params = params(
        Kind::Tricycle,
        &[
            (Id::SteerMax, 90.0),
            (Id::SteerRate, 360.0),
            (Id::WheelBase, 0.3),
            (Id::WheelDiameter, 0.1),
        ],
    );
    let mut base = Base::new(tricycle(&params), &params);
    base.rate = 7.0;
    for (line, wanted) in [("t 90", 90.0), ("t -30", 60.0)] {
        assert_eq!(base.ask(line), "OK");
        base.run(4.0);
        assert!((heading(&base) - wanted).abs() < 0.2, "{}", heading(&base));
        let pose = base.snapshot().estimator.present().pose;
        // The wheel rolls a little before it is quite aside: 2° of it for 10 mm/s.
        assert!(pose.x.hypot(pose.y) < 2e-3, "{pose:?}");
    }
    // One that cannot is a car.
    let narrow = wheeled::params(Kind::Tricycle, &[(Id::SteerMax, 60.0)]);
    let mut base = Base::new(tricycle(&narrow), &narrow);
    assert!(base.ask("t 90").starts_with("ERR standing"));
}

#[test]
fn a_steering_that_does_not_follow_stops_the_base() {
    let mut base = cycab();
    base.ask("m 9 0.5 0.5");
    base.run(2.0);
    base.rate = 0.0;
    base.ask("t 60 30 60");
    base.run(3.0);
    let lines = base.lines();
    assert!(
        lines.iter().any(|line| line == "! fault steering"),
        "{lines:?}"
    );
    assert!(base.wires().pointer.off.get());
    assert_eq!(base.ask("m 1"), "ERR fault steering");
    assert_eq!(base.ask("ClearFault"), "OK");
    // It was jammed at the start: nothing has moved when that is known.
    base.wires().pointer.is.set(0.4);
    let before = base.snapshot().wheels[0].count;
    base.ask("m 1");
    base.run(1.0);
    assert!(base.lines().iter().any(|line| line == "! fault steering"));
    assert_eq!(base.snapshot().wheels[0].count, before);
}

/// A potentiometer's torn wire reads as far beyond the end of its way, where the cosine has the other sign; a number that is none is no angle either.
#[test]
fn a_sensor_that_says_what_cannot_be_stops_the_base_at_once() {
    for reading in [-2.6, 2.6, f32::NAN, f32::INFINITY] {
        let params = params(Kind::Tricycle, &[(Id::SteerMax, 90.0)]);
        let mut base = Base::new(tricycle(&params), &params);
        base.ask("m 9 0.3");
        base.run(2.0);
        let before = base.snapshot().wheels[0].count;
        base.wires().pointer.is.set(reading);
        // It points there whatever it is told.
        base.rate = 0.0;
        let mut farthest_back = 0;
        for _ in 0..20 {
            base.tick();
            farthest_back = farthest_back.min(base.snapshot().wheels[0].count - before);
        }
        assert!(
            base.lines().iter().any(|line| line == "! fault steering"),
            "{reading}"
        );
        assert_eq!(farthest_back, 0, "{reading}: it has driven backward");
    }
}

#[test]
fn the_steering_is_told() {
    let mut base = cycab();
    base.wires().pointer.is.set(0.25);
    base.run(0.01);
    assert_eq!(base.ask("GetSteering"), "Steering 14.3239");
    base.ask("Stream 0.01 steer");
    base.run(0.05);
    assert!(base.lines().iter().any(|line| line == "~ 14.3239"));
}
