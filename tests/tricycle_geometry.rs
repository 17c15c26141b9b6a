//! The tricycle's front wheel, there and back.

mod steered;

use proptest::prelude::*;
use std::f32::consts::FRAC_PI_2;
use steered::{differences, pair, twist, worst};
use vehicle_controller::vehicle::Twist;
use vehicle_controller::vehicle::tricycle::{Geometry, Steered};

/// The logged robot's.
const BASE: f32 = 0.15;

fn geometry() -> Geometry {
    Geometry::new(BASE)
}

/// Where the front wheel's contact goes, and how the car turns, from steps of 1e-5 of the way: no formula of the rear axle.
fn rolled(distance: f64, steering: f64) -> [f64; 2] {
    let (mut rear, mut heading) = (0.0, 0.0_f64);
    let base = f64::from(BASE);
    let mut front = [base, 0.0];
    let steps = 100_000;
    let step = distance / f64::from(steps);
    for _ in 0..steps {
        // The front contact goes where the wheel points; the rear axle's centre stays on the car's axis, at the distance of the base behind it.
        let (sin, cos) = (heading + steering).sin_cos();
        let centre = [
            front[0] - base * heading.cos(),
            front[1] - base * heading.sin(),
        ];
        front = [front[0] + step * cos, front[1] + step * sin];
        let along = (front[0] - centre[0]) * heading.cos() + (front[1] - centre[1]) * heading.sin();
        let across =
            (front[1] - centre[1]) * heading.cos() - (front[0] - centre[0]) * heading.sin();
        // Across the axis it cannot slide: to first order all of the sideways step turns the car about it.
        heading += (across / base).asin();
        rear += along - base;
    }
    [rear, heading]
}

#[test]
fn a_wheel_that_is_rolled_step_by_step() {
    for (distance, steering) in [(0.2, 0.4), (-0.2, 0.4), (0.1, -1.2), (0.3, 0.0)] {
        let wanted = rolled(distance, steering);
        let is = pair(geometry().twist(distance as f32, steering as f32));
        // The steps are of first order: 1e-5 of the way and of the turn.
        assert!((is[0] - wanted[0]).abs() < 1e-5, "{is:?} {wanted:?}");
        assert!((is[1] - wanted[1]).abs() < 5e-5, "{is:?} {wanted:?}");
    }
}

/// Speeds between creeping and fast, both ways, and curves down to a turn in place.
fn wanted() -> impl Strategy<Value = Twist> {
    prop_oneof![
        (-1.0..1.0_f64, -6.0..6.0_f64).prop_map(|(v, omega)| twist([v, omega])),
        (-1e-6..1e-6_f64, -6.0..6.0_f64).prop_map(|(v, omega)| twist([v, omega])),
        (-1.0..1.0_f64).prop_map(|v| twist([v, 0.0])),
        (-6.0..6.0_f64).prop_map(|omega| twist([0.0, omega])),
    ]
    .prop_filter("moves", |wanted| *wanted != Twist::ZERO)
}

proptest! {
    #[test]
    fn commands_and_odometry_are_inverse_to_each_other(wanted in wanted()) {
        let Steered { angle, speed } = geometry().command(wanted).unwrap();
        let is = geometry().twist(speed, angle);
        // An angle to an ulp of 1.2e-7, sines likewise: 4e-7 of the wheel's speed, along and across.
        prop_assert!((is.translation - wanted.translation).abs() <= 4e-7 * speed.abs(), "{:?} {:?}", is, wanted);
        prop_assert!((is.rotation - wanted.rotation).abs() * BASE <= 4e-7 * speed.abs(), "{:?} {:?}", is, wanted);
        // The wheel keeps pointing ahead, and rolls the way the vehicle goes.
        prop_assert!(angle.abs() <= FRAC_PI_2);
        prop_assert!(wanted.translation == 0.0 || (speed < 0.0) == (wanted.translation < 0.0));
        // At its angle it rolls at its speed; a quarter turn off, not at all.
        prop_assert!((geometry().speed_at(wanted, angle) - speed).abs() <= 4e-7 * speed.abs());
        prop_assert!(geometry().speed_at(wanted, angle + FRAC_PI_2).abs() <= 6e-7 * speed.abs());
    }

    #[test]
    fn odometry_and_commands_are_inverse_to_each_other(
        speed in prop_oneof![-1.0..-1e-3_f32, 1e-3..1.0_f32],
        angle in -1.57..1.57_f32,
    ) {
        let is = geometry().command(geometry().twist(speed, angle)).unwrap();
        prop_assert!((is.angle - angle).abs() < 6e-7, "{:?}", is);
        prop_assert!((is.speed - speed).abs() < 4e-7 * speed.abs(), "{:?}", is);
    }

    #[test]
    fn jacobians_are_the_central_differences(displacement in -1.0..1.0_f32, angle in -1.6..1.6_f32) {
        let base = f64::from(BASE);
        let wanted = differences([displacement.into(), angle.into()], |[d, angle]| {
            [d * angle.cos(), d * angle.sin() / base]
        });
        // Three roundings of f32.
        let is = geometry().jacobian(displacement, angle);
        prop_assert!(worst(&is, &wanted) < 4e-7, "{:?} {:?}", is, wanted);
    }

    #[test]
    fn whatever_comes_what_goes_is_finite(a: f32, b: f32) {
        let is = geometry().twist(a, b);
        prop_assert!(is.translation.is_finite() && is.rotation.is_finite());
        let jacobian = geometry().jacobian(a, b);
        for is in jacobian.by_wheel.into_iter().chain([jacobian.by_steering]) {
            prop_assert!(is.translation.is_finite() && is.rotation.is_finite());
        }
        if let Some(Steered { angle, speed }) = geometry().command(Twist { translation: a, rotation: b }) {
            prop_assert!(angle.abs() <= FRAC_PI_2 && speed.is_finite());
        }
    }
}

#[test]
fn in_reverse_the_wheel_rolls_back_and_points_as_ahead() {
    let ahead = geometry().command(twist([0.3, 0.5])).unwrap();
    let back = geometry().command(twist([-0.3, -0.5])).unwrap();
    assert_eq!(back.angle, ahead.angle);
    assert_eq!(back.speed, -ahead.speed);
    // The other way round it would be turned to the other side.
    assert_eq!(
        geometry().command(twist([-0.3, 0.5])).unwrap().angle,
        -ahead.angle
    );
}

#[test]
fn a_turn_in_place_is_a_right_angle_to_its_side() {
    for zero in [0.0, -0.0] {
        for rotation in [2.0, -2.0] {
            let is = geometry()
                .command(Twist {
                    translation: zero,
                    rotation,
                })
                .unwrap();
            assert_eq!(is.angle, FRAC_PI_2.copysign(rotation));
            assert!((is.speed - 2.0 * BASE).abs() < 1e-7, "{is:?}");
        }
    }
}

#[test]
fn without_a_motion_there_is_no_angle() {
    assert_eq!(geometry().command(Twist::ZERO), None);
    for bad in [f32::NAN, f32::INFINITY] {
        assert_eq!(
            geometry().command(Twist {
                translation: bad,
                rotation: 1.0
            }),
            None
        );
        assert_eq!(
            geometry().command(Twist {
                translation: 1.0,
                rotation: bad
            }),
            None
        );
        assert_eq!(geometry().twist(bad, 0.3), Twist::ZERO);
        assert_eq!(
            geometry().speed_at(
                Twist {
                    translation: bad,
                    rotation: 1.0
                },
                0.3
            ),
            0.0
        );
        // No angle: straight ahead.
        assert_eq!(geometry().twist(1.0, bad), geometry().twist(1.0, 0.0));
    }
}
