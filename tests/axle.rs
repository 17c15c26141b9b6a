//! The two wheels of a steered axle: the reference vectors, true circles, and the differential drive that it is with α = 0.

mod steered;

use proptest::prelude::*;
use steered::{bits, contacts, differences, exact, pair, printed, twist, worst};
use vehicle_controller::vehicle::differential::Geometry;
use vehicle_controller::vehicle::{
    Axle, Calibration, Gains, Observer, Relation, STEEPEST, Scaling, Twist,
};

const RELATIONS: [Relation; 2] = [Relation::Exact, Relation::Printed];

/// Rows of `vectors/bisteerable.csv`: B, α, `S_l`, `S_r`, ΔS, Δθ.
fn rows() -> Vec<[f64; 6]> {
    include_str!("vectors/bisteerable.csv")
        .lines()
        .filter(|line| !line.starts_with('#') && !line.starts_with('B'))
        .map(|line| {
            let mut row = [0.0; 6];
            assert_eq!(line.split(',').count(), row.len());
            for (value, word) in row.iter_mut().zip(line.split(',')) {
                *value = word.parse().unwrap();
            }
            row
        })
        .collect()
}

/// The largest errors of ΔS (m) and Δθ (rad) over the rows.
fn worst_of_the_rows(relation: Relation) -> [f64; 2] {
    let rows = rows();
    assert_eq!(rows.len(), 60);
    let mut worst = [0.0_f64; 2];
    for [track, alpha, left, right, moved, turned] in rows {
        let is = Axle::new(track as f32, relation).twist([left as f32, right as f32], alpha as f32);
        let [is_moved, is_turned] = pair(is);
        worst[0] = worst[0].max((is_moved - moved).abs());
        worst[1] = worst[1].max((is_turned - turned).abs());
    }
    println!("vectors, {relation:?}: {worst:?}");
    worst
}

#[test]
fn the_exact_relation_follows_the_vectors_to_a_micrometre_and_a_microradian() {
    // Displacements of 5 cm rounded to f32, by a track of at least 0.3 m: 3e-9 m and 1e-8 rad.
    let [moved, turned] = worst_of_the_rows(Relation::Exact);
    assert!(moved < 1e-7, "{moved} m");
    assert!(turned < 1e-7, "{turned} rad");
}

#[test]
fn the_printed_relation_does_not() {
    let [moved, turned] = worst_of_the_rows(Relation::Printed);
    assert!(moved > 1e-4 && turned > 1e-4, "{moved} m, {turned} rad");
}

#[test]
fn the_printed_relation_is_wrong_by_what_the_theory_says() {
    // Half of what is said last, in per cent.
    for (alpha, radius, wrong, half_a_digit) in [(0.35, 3.0, 0.24, 0.005), (0.5, 2.0, 1.1, 0.05)] {
        let [left, right] = contacts(1.0, 1.0 / radius, 1.2, alpha);
        let axle = Axle::new(1.2, Relation::Printed);
        let [moved, turned] = pair(axle.twist([left as f32, right as f32], alpha as f32));
        for is in [moved, turned * radius] {
            let per_cent = 100.0 * (is - 1.0).abs();
            assert!((per_cent - wrong).abs() < half_a_digit, "{per_cent} %");
        }
    }
}

/// Tracks, steering angles, and motions of a metre or so, that a car may have: no path turns about a point within 0.6 tracks of the axle's centre.
fn car() -> impl Strategy<Value = (f64, f64, [f64; 2])> {
    (
        0.3..1.6_f64,
        -0.6..0.6_f64,
        prop::bool::ANY,
        0.2..1.0_f64,
        -1.6..1.6_f64,
    )
        .prop_map(|(track, alpha, back, speed, bend)| {
            let speed = if back { -speed } else { speed };
            // As an f32 will have it.
            let track = f64::from(track as f32);
            let alpha = f64::from(alpha as f32);
            (track, alpha, [speed, bend * speed / track])
        })
}

/// Any number at all.
fn anything() -> impl Strategy<Value = f32> {
    prop_oneof![
        any::<f32>(),
        -2.0..2.0_f32,
        prop::sample::select(vec![0.0, -0.0, f32::NAN, f32::INFINITY, f32::MIN_POSITIVE]),
    ]
}

proptest! {
    #[test]
    fn without_steering_it_is_the_differential_drive_to_the_bit(
        track in 0.1..2.0_f32,
        left in prop_oneof![-1.0..1.0_f32, -1e-4..1e-4_f32, Just(0.0), Just(-0.0)],
        right in prop_oneof![-1.0..1.0_f32, -1e-4..1e-4_f32, Just(0.0), Just(-0.0)],
        zero in prop_oneof![Just(0.0_f32), Just(-0.0)],
    ) {
        let differential = Geometry::new(f64::from(track), 1e-4, 1e-4, Calibration::NOMINAL);
        let wanted = differential.twist([left, right]);
        let wheels = differential.wheel_speeds(wanted);
        for relation in RELATIONS {
            let axle = Axle::new(track, relation);
            prop_assert_eq!(bits(axle.twist([left, right], zero)), bits(wanted));
            let scaling = axle.scaling(wanted, zero);
            prop_assert_eq!(bits(scaling.twist([left, right])), bits(wanted));
            prop_assert_eq!(axle.wheels(wanted, zero).map(f32::to_bits), wheels.map(f32::to_bits));
        }
    }

    #[test]
    fn wheels_on_true_circles((track, alpha, [moved, turned]) in car()) {
        let axle = Axle::new(track as f32, Relation::Exact);
        let wanted = contacts(moved, turned, track, alpha);
        // Up to 2.2 m in f32, with an ulp of 2.4e-7; a few of them, by a track of 0.3 m or more for the angle.
        for (is, wanted) in axle.wheels(twist([moved, turned]), alpha as f32).into_iter().zip(wanted) {
            prop_assert!((f64::from(is) - wanted).abs() < 1e-6, "{} {}", is, wanted);
        }
        let [is_moved, is_turned] = pair(axle.twist(wanted.map(|wheel| wheel as f32), alpha as f32));
        prop_assert!((is_moved - moved).abs() < 1e-6, "{} {}", is_moved, moved);
        prop_assert!((is_turned - turned).abs() * track < 2e-6, "{} {}", is_turned, turned);
    }

    #[test]
    fn commands_and_odometry_are_inverse_to_each_other(
        track in 0.3..1.6_f32,
        alpha in -1.2..1.2_f32,
        moved in -1.0..1.0_f32,
        turned in -3.0..3.0_f32,
    ) {
        for relation in RELATIONS {
            let axle = Axle::new(track, relation);
            let wanted = twist([moved.into(), turned.into()]);
            let wheels = axle.wheels(wanted, alpha);
            // Where the inner wheel stands almost still, S* is the small difference of squares of 3 m: what is left is the root of their rounding. Only
            // a path that turns about a point close to the track's end comes there; the others keep 1e-5 of 3 m.
            let edge = (moved.abs() - 0.5 * turned.abs() * track).abs();
            let tolerance = if edge > 0.1 { 1e-5 } else { 2e-3 };
            // Scaled on the curve that it is, the wheels make up the same, also where it turns about a point within the track.
            for is in [axle.twist(wheels, alpha), axle.scaling(wanted, alpha).twist(wheels)] {
                prop_assert!((is.translation - moved).abs() < tolerance, "{:?} {:?} {:?}", relation, is, wanted);
                prop_assert!((is.rotation - turned).abs() * track < 2.0 * tolerance, "{:?} {:?} {:?}", relation, is, wanted);
            }
        }
    }

    #[test]
    fn jacobians_are_the_central_differences((track, alpha, [moved, turned]) in car()) {
        let [left, right] = contacts(moved, turned, track, alpha).map(|wheel| f64::from(wheel as f32));
        for relation in RELATIONS {
            let model = match relation {
                Relation::Exact => exact,
                Relation::Printed => printed,
            };
            let wanted = differences([left, right, alpha], |[left, right, alpha]| {
                model([left, right], track, alpha)
            });
            let axle = Axle::new(track as f32, relation);
            let is = axle.jacobian([left as f32, right as f32], alpha as f32);
            // f32: ratios of S to S*, which is at least a sixth of it, hence ten ulps of 1.2e-7; the differences are better.
            prop_assert!(worst(&is, &wanted) < 2e-6, "{:?} {:?} {:?}", relation, is, wanted);
            // They depend on the proportion of the wheels only: in a cycle of 1 kHz as well.
            let small = axle.jacobian([1e-3 * left as f32, 1e-3 * right as f32], alpha as f32);
            for (small, is) in small.by_wheel.into_iter().zip(is.by_wheel) {
                prop_assert!((small.translation - is.translation).abs() < 2e-6);
                prop_assert!((small.rotation - is.rotation).abs() < 2e-6 * is.rotation.abs().max(1.0));
            }
        }
    }

    #[test]
    fn scaling_is_the_relation_on_its_own_curve((track, alpha, [moved, turned]) in car()) {
        let wheels = contacts(moved, turned, track, alpha).map(|wheel| wheel as f32);
        for relation in RELATIONS {
            let axle = Axle::new(track as f32, relation);
            let curve = axle.twist(wheels, alpha as f32);
            let is = axle.scaling(curve, alpha as f32).twist(wheels);
            prop_assert!((is.translation - curve.translation).abs() < 1e-6, "{:?} {:?}", is, curve);
            prop_assert!((is.rotation - curve.rotation).abs() * (track as f32) < 2e-6, "{:?} {:?}", is, curve);
        }
    }

    #[test]
    fn whatever_comes_what_goes_is_finite(
        left in anything(),
        right in anything(),
        alpha in anything(),
        moved in anything(),
        turned in anything(),
    ) {
        for relation in RELATIONS {
            let axle = Axle::new(1.2, relation);
            let is = axle.twist([left, right], alpha);
            prop_assert!(is.translation.is_finite() && is.rotation.is_finite(), "{:?}", is);
            let curve = Twist { translation: moved, rotation: turned };
            let Scaling { wheels, curvature } = axle.scaling(curve, alpha);
            // 1/cos(α/2) at the steepest is the largest that there can be.
            prop_assert!(wheels.iter().all(|wheel| (0.0..1.31).contains(wheel)), "{:?}", wheels);
            prop_assert!(curvature > 0.0 && curvature < 6.0);
            let jacobian = axle.jacobian([left, right], alpha);
            for is in jacobian.by_wheel {
                prop_assert!(is.translation.abs() < 100.0 && is.rotation.abs() < 100.0, "{:?}", is);
            }
            let is = jacobian.by_steering;
            prop_assert!(is.translation.is_finite() && is.rotation.is_finite(), "{:?}", is);
            prop_assert!(axle.wheels(curve, alpha).iter().all(|wheel| wheel.is_finite()));
        }
    }
}

/// Where the curve comes from that counts are scaled on.
#[derive(Clone, Copy, Debug)]
enum Curve {
    /// None: the relation itself is used, on each cycle's counts.
    Counts,
    /// The observers' speeds, of this bandwidth in rad/s.
    Observers(f32),
    /// The steering angle.
    Steering,
}

/// 100 m at 0.1 m/s and 1 kHz on a circle of 3 m, with α = 0.35 and 0.3 mm a count: the relative errors of ΔS and Δθ.
fn quantised_circle(source: Curve) -> [f64; 2] {
    const ALPHA: f64 = 0.35;
    const COUNT: f64 = 3e-4;
    const CYCLES: i32 = 1_000_000;
    let axle = Axle::new(1.2, Relation::Exact);
    let bandwidth = if let Curve::Observers(bandwidth) = source {
        bandwidth
    } else {
        1.0
    };
    let gains = Gains::new(bandwidth, 1e-3);
    let mut observers = [Observer::default(); 2];
    let per_cycle = contacts(1e-4, 1e-4 / 3.0, 1.2, ALPHA);
    let mut sum = [0.0; 2];
    let mut last = [0.0; 2];
    for cycle in 1..=CYCLES {
        let totals = per_cycle.map(|metres| (f64::from(cycle) * metres / COUNT + 0.3).floor());
        let moved = [0, 1].map(|wheel| ((totals[wheel] - last[wheel]) * COUNT) as f32);
        last = totals;
        for (observer, moved) in observers.iter_mut().zip(moved) {
            observer.update(moved, &gains);
        }
        let scaled = |curve| axle.scaling(curve, ALPHA as f32).twist(moved);
        let motion = match source {
            Curve::Counts => axle.twist(moved, ALPHA as f32),
            Curve::Observers(_) => scaled(axle.twist(observers.map(|o| o.speed()), ALPHA as f32)),
            Curve::Steering => scaled(twist([1.0, 1.0 / 3.0])),
        };
        for (sum, part) in sum.iter_mut().zip(pair(motion)) {
            *sum += part;
        }
    }
    let errors = [sum[0] / 100.0 - 1.0, sum[1] / (100.0 / 3.0) - 1.0];
    println!("{source:?}: {errors:?}");
    errors
}

#[test]
fn the_relation_on_single_counts_is_wrong_by_per_cents() {
    // The theory: −4.8 % of Δθ.
    let [_, turned] = quantised_circle(Curve::Counts);
    assert!((turned + 0.048).abs() < 0.0005, "{turned}");
}

#[test]
fn counts_scaled_on_a_steady_curve_are_right() {
    // The theory: 0.001 %; and a count at either end of 100 m is 0.0003 % of ΔS, by the track 0.0015 % of Δθ.
    for source in [Curve::Steering, Curve::Observers(10.0)] {
        let errors = quantised_circle(source);
        assert!(
            errors.iter().all(|error| error.abs() < 2.5e-5),
            "{errors:?}"
        );
    }
}

#[test]
fn counts_scaled_on_a_curve_that_follows_single_counts_are_wrong_by_what_it_follows() {
    // A count raises its wheel's speed in the same cycle by up to 1.5 × 125² × 1 ms × 0.3 mm = 7 mm/s of 100 mm/s, which bends the curve; of that
    // 1 − cos α = 6 % are in the scaling: 0.4 % at most, of either sign.
    let errors = quantised_circle(Curve::Observers(125.0));
    let worst = errors[0].abs().max(errors[1].abs());
    assert!(worst > 1e-3 && worst < 4e-3, "{errors:?}");
}

#[test]
fn beyond_the_steepest_angle_it_is_taken_for_that() {
    let axle = Axle::new(1.2, Relation::Exact);
    for relation in RELATIONS {
        let axle = Axle::new(1.2, relation);
        let wheels = [0.9, 1.0];
        let right_angle = std::f32::consts::FRAC_PI_2;
        for steep in [right_angle, 3.0, f32::INFINITY] {
            assert_eq!(axle.twist(wheels, steep), axle.twist(wheels, STEEPEST));
            assert_eq!(axle.twist(wheels, -steep), axle.twist(wheels, -STEEPEST));
        }
        // No angle: straight ahead.
        assert_eq!(axle.twist(wheels, f32::NAN), axle.twist(wheels, 0.0));
    }
    // Wheels that roll alike do not turn, however they are steered.
    assert_eq!(
        axle.twist([0.7, 0.7], 1.3),
        twist([f64::from(0.7_f32), 0.0])
    );
}

#[test]
fn rest_is_rest_and_has_the_jacobian_of_a_straight_path() {
    for relation in RELATIONS {
        let axle = Axle::new(1.2, relation);
        assert_eq!(axle.twist([0.0, 0.0], 0.5), Twist::ZERO);
        assert_eq!(axle.wheels(Twist::ZERO, 0.5), [0.0, 0.0]);
        let wanted = [0.5, 1.0 / (1.2 * 0.5_f64.cos())];
        let is = axle.jacobian([0.0, 0.0], 0.5);
        // A few roundings of f32.
        let expected = [[wanted[0], -wanted[1]], wanted, [0.0, 0.0]];
        assert!(worst(&is, &expected) < 3e-7, "{is:?}");
        assert_eq!(is.by_steering, Twist::ZERO);
    }
    let axle = Axle::new(1.2, Relation::Exact);
    assert_eq!(axle.scaling(Twist::ZERO, 0.5).wheels, [1.0, 1.0]);
}

#[test]
fn no_number_is_no_motion() {
    let axle = Axle::new(1.2, Relation::Exact);
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        assert_eq!(axle.twist([bad, 1.0], 0.3), Twist::ZERO);
        assert_eq!(axle.twist([1.0, bad], 0.3), Twist::ZERO);
        let curve = Twist {
            translation: bad,
            rotation: 1.0,
        };
        assert_eq!(axle.wheels(curve, 0.3), [0.0, 0.0]);
        let scaling = axle.scaling(curve, 0.3);
        assert_eq!(scaling.wheels, [1.0, 1.0]);
        assert_eq!(scaling.twist([bad, 1.0]), Twist::ZERO);
    }
}

#[test]
fn wheels_that_no_motion_has_are_clamped() {
    // Steered, the inner wheel cannot roll so little while the outer one rolls: S_r*² would be 0.01 − 0.069.
    let (alpha, track) = (0.5_f64, 1.2_f64);
    let axle = Axle::new(track as f32, Relation::Exact);
    for inner in [0.1_f32, -0.1, 0.0] {
        let is = pair(axle.twist([1.0, inner], alpha as f32));
        let square = f64::from(inner).powi(2);
        let starred = (1.0 + 0.5 * (1.0 - square) * (1.0 / alpha.cos() - 1.0)).sqrt();
        // Three roundings of f32.
        assert!((is[0] - 0.5 * starred).abs() < 2e-7, "{is:?}");
        assert!((is[1] + starred / track).abs() < 2e-7, "{is:?}");
    }
}
