//! The bi-steerable car's axles and steering, there and back.

mod steered;

use proptest::prelude::*;
use std::f32::consts::FRAC_PI_2;
use steered::{contacts, differences, exact, pair, printed, twist, worst};
use vehicle_controller::vehicle::bisteerable::{Geometry, RearSteering, Wheels};
use vehicle_controller::vehicle::{Calibration, Relation, STEEPEST, Twist};

/// Wheel base, rear and front track of a Cycab with unequal axles, so that nothing can be exchanged unseen, m.
const BASE: f32 = 1.2;
const TRACKS: [f32; 2] = [1.2, 1.1];
const CARS: [RearSteering; 2] = [RearSteering::Fixed, RearSteering::Opposite];

fn geometry(rear: RearSteering) -> Geometry {
    Geometry::new(BASE, TRACKS, rear, Relation::Exact)
}

/// f in float64.
fn f(rear: RearSteering, angle: f64) -> f64 {
    match rear {
        RearSteering::Fixed => 0.0,
        RearSteering::Opposite => -angle,
    }
}

/// Yaw rate and all four wheels for a rear axle that goes at `speed`: from where the axles' normals meet.
fn circles(rear: RearSteering, speed: f64, angle: f64) -> (f64, [[f64; 2]; 2]) {
    let base = f64::from(BASE);
    let rear_angle = f(rear, angle);
    // Velocities of the axles' centres: the same along the car, and across it they differ by ω L.
    let along = speed * rear_angle.cos();
    let turned = along * (angle.tan() - rear_angle.tan()) / base;
    let front = along / angle.cos();
    let [rear_track, front_track] = TRACKS.map(f64::from);
    (
        turned,
        [
            contacts(speed, turned, rear_track, rear_angle),
            contacts(front, turned, front_track, angle),
        ],
    )
}

fn rounded(wheels: [[f64; 2]; 2]) -> Wheels {
    let [rear, front] = wheels.map(|axle| axle.map(|wheel| wheel as f32));
    Wheels { rear, front }
}

/// A car, a speed either way, and a steering angle that cars have.
fn state() -> impl Strategy<Value = (RearSteering, f64, f64)> {
    (
        prop::sample::select(CARS.to_vec()),
        prop_oneof![-1.0..-0.01_f32, 0.01..1.0_f32],
        -0.6..0.6_f32,
    )
        .prop_map(|(rear, speed, angle)| (rear, speed.into(), angle.into()))
}

proptest! {
    #[test]
    fn wheels_are_on_circles_about_one_point((rear, speed, angle) in state()) {
        let (turned, wanted) = circles(rear, speed, angle);
        let geometry = geometry(rear);
        let (speed, angle) = (speed as f32, angle as f32);
        // Roundings of f32, of what is up to 1.6 m/s.
        let is = f64::from(speed * geometry.curvature(angle));
        prop_assert!((is - turned).abs() < 1e-6, "{} {}", is, turned);
        let is = geometry.wheel_speeds(speed, angle);
        for (is, wanted) in is.rear.into_iter().chain(is.front).zip(wanted.into_iter().flatten()) {
            prop_assert!((f64::from(is) - wanted).abs() < 1e-6, "{} {}", is, wanted);
        }
    }

    #[test]
    fn every_view_sees_the_same_motion_of_the_rear_axle((rear, speed, angle) in state()) {
        let (turned, wheels) = circles(rear, speed, angle);
        let geometry = geometry(rear);
        let wheels = rounded(wheels);
        let angle = angle as f32;
        for is in [
            geometry.rear(wheels.rear, angle),
            geometry.front(wheels.front, angle),
            geometry.four(&wheels, angle),
        ] {
            // Wheels are up to 1.9 m and rounded to 1.2e-7; by the track, twice.
            prop_assert!((f64::from(is.translation) - speed).abs() < 1e-6, "{:?} {}", is, speed);
            prop_assert!((f64::from(is.rotation) - turned).abs() < 2e-6, "{:?} {}", is, turned);
        }
    }

    #[test]
    fn commands_and_odometry_are_inverse_to_each_other((rear, speed, angle) in state()) {
        let geometry = geometry(rear);
        let wanted = twist([speed, circles(rear, speed, angle).0]);
        let steering = geometry.steering_for(wanted).unwrap();
        // A rounding of the wanted rate, of an angle of up to 0.6, and of its sine.
        prop_assert!((f64::from(steering) - angle).abs() < 1e-6, "{} {}", steering, angle);
        let wheels = geometry.wheel_speeds(wanted.translation, steering);
        for is in [
            geometry.rear(wheels.rear, steering),
            geometry.front(wheels.front, steering),
            geometry.four(&wheels, steering),
        ] {
            prop_assert!((is.translation - wanted.translation).abs() < 1e-6, "{:?} {:?}", is, wanted);
            prop_assert!((is.rotation - wanted.rotation).abs() < 2e-6, "{:?} {:?}", is, wanted);
        }
    }

    #[test]
    fn jacobians_are_the_central_differences((rear, speed, angle) in state(), relation in prop::sample::select(vec![Relation::Exact, Relation::Printed])) {
        let geometry = Geometry::new(BASE, TRACKS, rear, relation);
        let model = match relation {
            Relation::Exact => exact,
            Relation::Printed => printed,
        };
        let [rear_track, front_track] = TRACKS.map(f64::from);
        let by_rear = |[left, right, angle]: [f64; 3]| model([left, right], rear_track, f(rear, angle));
        let by_front = |[left, right, angle]: [f64; 3]| {
            let [moved, turned] = model([left, right], front_track, angle);
            [moved * angle.cos() / f(rear, angle).cos(), turned]
        };
        let wheels = rounded(circles(rear, speed / speed.abs(), angle).1);
        let steering = angle as f32;
        let [rl, rr] = wheels.rear.map(f64::from);
        let [fl, fr] = wheels.front.map(f64::from);
        let (rear_wanted, front_wanted) = (differences([rl, rr, angle], by_rear), differences([fl, fr, angle], by_front));
        // Ratios of S to S* in f32: a few ulps of 1.2e-7.
        let is = geometry.rear_jacobian(wheels.rear, steering);
        prop_assert!(worst(&is, &rear_wanted) < 2e-6, "{:?} {:?}", is, rear_wanted);
        let is = geometry.front_jacobian(wheels.front, steering);
        prop_assert!(worst(&is, &front_wanted) < 2e-6, "{:?} {:?}", is, front_wanted);

        let is = geometry.four_jacobian(&wheels, steering);
        let (front_cos, rear_cos) = (angle.cos(), f(rear, angle).cos());
        // Reciprocal variances of the two axles' ΔS and Δα.
        let weights = [
            1.0 / (1.0 + (front_cos / rear_cos).powi(2)),
            1.0 / (1.0 + (rear_track * rear_cos / (front_track * front_cos)).powi(2)),
        ];
        let by_four = |[rl, rr, fl, fr, angle]: [f64; 5]| {
            let (rear, front) = (by_rear([rl, rr, angle]), by_front([fl, fr, angle]));
            [0, 1].map(|k| rear[k] + weights[k] * (front[k] - rear[k]))
        };
        let wanted = differences([rl, rr, fl, fr, angle], by_four);
        prop_assert!(worst(&is, &wanted) < 2e-6, "{:?} {:?}", is, wanted);
    }

    #[test]
    fn four_wheels_are_fused_with_the_least_variance((rear, _, angle) in state()) {
        // Straight on, where the relation is linear: any other mixture of the axles has a larger sum of squares of its derivatives.
        let geometry = geometry(rear);
        let angle = angle as f32;
        let variances = |by_wheel: &[Twist]| {
            by_wheel.iter().fold([0.0; 2], |[s, a], wheel| {
                let [moved, turned] = pair(*wheel);
                [s + moved * moved, a + turned * turned]
            })
        };
        let wheels = Wheels { rear: [1.0; 2], front: [1.0; 2] };
        let by_rear = variances(&geometry.rear_jacobian(wheels.rear, angle).by_wheel);
        let by_front = variances(&geometry.front_jacobian(wheels.front, angle).by_wheel);
        let by_four = variances(&geometry.four_jacobian(&wheels, angle).by_wheel);
        for ((rear, front), four) in by_rear.into_iter().zip(by_front).zip(by_four) {
            let least = rear * front / (rear + front);
            // Squares of f32.
            prop_assert!((four / least - 1.0).abs() < 1e-6, "{} {}", four, least);
        }
    }

    #[test]
    fn whatever_comes_what_goes_is_finite(left: f32, right: f32, angle: f32, other: f32) {
        for rear in CARS {
            let geometry = geometry(rear);
            let wheels = Wheels { rear: [left, right], front: [right, other] };
            for is in [
                geometry.rear(wheels.rear, angle),
                geometry.front(wheels.front, angle),
                geometry.four(&wheels, angle),
            ] {
                prop_assert!(is.translation.is_finite() && is.rotation.is_finite(), "{:?}", is);
            }
            prop_assert!(geometry.curvature(angle).is_finite());
            let is = geometry.wheel_speeds(left, angle);
            prop_assert!(is.rear.into_iter().chain(is.front).all(f32::is_finite), "{:?}", is);
            if let Some(is) = geometry.steering_for(Twist { translation: left, rotation: right }) {
                prop_assert!(is.abs() <= FRAC_PI_2, "{}", is);
            }
        }
    }
}

#[test]
fn a_cycab_turns_on_half_the_radius_of_an_ordinary_car_at_small_angles() {
    // tan φ/L and 2 sin φ/L.
    let angle = 0.3_f64;
    for (rear, wanted) in [
        (RearSteering::Fixed, angle.tan() / f64::from(BASE)),
        (RearSteering::Opposite, 2.0 * angle.sin() / f64::from(BASE)),
    ] {
        let is = f64::from(geometry(rear).curvature(angle as f32));
        assert!((is - wanted).abs() < 1e-7, "{is} {wanted}");
    }
}

#[test]
fn steering_is_the_same_ahead_and_back() {
    for rear in CARS {
        let geometry = geometry(rear);
        let ahead = geometry.steering_for(twist([0.5, 0.2])).unwrap();
        assert!(ahead > 0.0);
        assert_eq!(geometry.steering_for(twist([-0.5, -0.2])), Some(ahead));
        assert_eq!(geometry.steering_for(twist([-0.5, 0.2])), Some(-ahead));
    }
}

#[test]
fn what_is_too_tight_is_a_right_angle_and_what_is_nothing_is_none() {
    for rear in CARS {
        let geometry = geometry(rear);
        for zero in [0.0, -0.0] {
            for rotation in [1.0, -1.0] {
                let wanted = Twist {
                    translation: zero,
                    rotation,
                };
                assert_eq!(
                    geometry.steering_for(wanted),
                    Some(FRAC_PI_2.copysign(rotation))
                );
            }
            let rest = Twist {
                translation: zero,
                rotation: zero,
            };
            assert_eq!(geometry.steering_for(rest), None);
        }
        for bad in [f32::NAN, f32::INFINITY] {
            assert_eq!(
                geometry.steering_for(Twist {
                    translation: bad,
                    rotation: 1.0
                }),
                None
            );
            assert_eq!(
                geometry.steering_for(Twist {
                    translation: 1.0,
                    rotation: bad
                }),
                None
            );
            let wheels = Wheels {
                rear: [bad, 1.0],
                front: [1.0, bad],
            };
            assert_eq!(geometry.four(&wheels, 0.3), Twist::ZERO);
            assert_eq!(geometry.wheel_speeds(bad, 0.3), Wheels::default());
        }
    }
    // The tightest circle of a Cycab is about its own middle: κ = 2/L.
    let wanted = twist([0.3, 0.3 * 2.1 / f64::from(BASE)]);
    assert_eq!(
        geometry(RearSteering::Opposite).steering_for(wanted),
        Some(FRAC_PI_2)
    );
}

#[test]
fn steering_beyond_the_steepest_is_that_and_none_is_straight() {
    for rear in CARS {
        let geometry = geometry(rear);
        for steep in [FRAC_PI_2, 2.0, f32::INFINITY] {
            assert_eq!(geometry.curvature(steep), geometry.curvature(STEEPEST));
            assert_eq!(
                geometry.wheel_speeds(0.3, -steep),
                geometry.wheel_speeds(0.3, -STEEPEST)
            );
        }
        assert_eq!(geometry.curvature(f32::NAN), 0.0);
        assert_eq!(geometry.direction(f32::NAN), 0.0);
    }
}

#[test]
fn without_steering_the_rear_axle_is_a_differential_drive_to_the_bit() {
    use vehicle_controller::vehicle::differential;
    let differential =
        differential::Geometry::new(f64::from(TRACKS[0]), 1e-4, 1e-4, Calibration::NOMINAL);
    for rear in CARS {
        for wheels in [[0.3, 0.4], [-0.1, 0.123_456_7], [1e-4, -3e-5]] {
            let wanted = differential.twist(wheels);
            assert_eq!(
                steered::bits(geometry(rear).rear(wheels, 0.0)),
                steered::bits(wanted)
            );
        }
    }
}
