//! Gains, through the desk: measured runs, and what observations make of them.

mod counts;

use counts::Random;
use counts::base::{Base, pose, symmetric};
use nalgebra::Vector3;
use vehicle_controller::controller::{
    AxisCommand, CorrectionError, Estimate, Noise, Pose, Refusal,
};
use vehicle_controller::interpreter::{Identity, Interpreter};
use vehicle_controller::map::Atlas;
use vehicle_controller::params::{Id, Params};
use vehicle_controller::time::Duration;
use vehicle_controller::vehicle::Calibration;

/// A straight move of so many metres, by the wheels' count, and a rest.
fn run(base: &mut Base, metres: u16) {
    let ahead = AxisCommand {
        distance: f32::from(metres),
        speed: 0.5,
        acceleration: 0.5,
    };
    // These wheels do not mind their motors, which the supervisor does not believe.
    if base.desk.snapshot().fault.is_some() {
        base.desk.clear_fault().unwrap();
        base.drive(2, 0.0, 0.0);
    }
    base.desk.move_by(ahead).unwrap();
    base.drive(2000 * u32::from(metres), 0.5, 0.0);
    base.drive(3000, 0.0, 0.0);
}

/// A base that has gone two metres straight on, and stands.
fn after_two_metres() -> Base {
    let mut base = Base::new(Noise::default());
    run(&mut base, 2);
    base
}

/// With these parameters, the others by default.
fn with(set: &[(Id, f32)]) -> Base {
    let mut params = Params::default();
    params.set_all(set).unwrap();
    Base::with(&params, Noise::default())
}

const GATE: f32 = 25.0;

#[test]
fn a_measured_run_scales_both_wheels() {
    let mut base = after_two_metres();
    let distance = base.desk.calibrate_straight(2.02, GATE).unwrap();
    base.drive(10, 0.0, 0.0);
    let calibration = *base.desk.calibration();
    let [right, left, base_gain, ..] = calibration.gains.map(f64::from);
    // The prior's deviation of two metres against a tape's 5 mm.
    let prior = f64::from(Params::default().get(Id::KScale)) * 4.0;
    let share = prior / (prior + 0.25e-4);
    for wheel in [right, left] {
        assert!((wheel - 1.0 - 0.01 * share).abs() < 2e-4, "{wheel}");
    }
    // The run's length is counted, 0.1 mm a count.
    assert!((f64::from(distance) * (prior + 0.25e-4) / 4e-4 - 1.0).abs() < 0.02);
    assert!((base_gain - 1.0).abs() < 1e-7);
    // The controller has them, too.
    let known = base.desk.snapshot().estimator.calibration();
    assert_eq!(*known, calibration);
    // The way that was gone is longer now.
    assert!((base.estimate().pose.x - 2.0 - 0.02 * share).abs() < 4e-4);
}

#[test]
fn a_run_is_measured_once() {
    let mut base = after_two_metres();
    base.desk.calibrate_straight(2.02, GATE).unwrap();
    base.drive(100, 0.0, 0.0);
    let before = format!("{:?}", base.desk);
    assert_eq!(base.desk.calibrate_straight(2.02, GATE), Err(Refusal::Run));
    assert_eq!(format!("{:?}", base.desk), before);
    // Nor is one that was counted with other gains.
    run(&mut base, 2);
    base.desk.learn(true);
    let z = Vector3::new(base.estimate().pose.x + 0.01, 0.0, 0.0);
    base.fix(pose(z), symmetric([1e-4, 0.0, 0.0, 1e-4, 0.0, 1e-4]), 0.0)
        .unwrap();
    base.drive(100, 0.0, 0.0);
    assert_eq!(base.desk.calibrate_straight(2.02, GATE), Err(Refusal::Run));
}

#[test]
fn a_short_run_does_not_overrule_a_long_one() {
    let mut base = Base::new(Noise::default());
    run(&mut base, 20);
    base.desk.calibrate_straight(20.1, GATE).unwrap();
    base.drive(10, 0.0, 0.0);
    let long = base.desk.calibration().gains[0];
    run(&mut base, 1);
    let travelled = f64::from(long);
    base.desk
        .calibrate_straight(travelled + 0.02, GATE)
        .unwrap();
    // Over 20 m 5 mm are 2.5e-4, over 1 m 5e-3: of the 2 % that it says, a four-hundredth.
    let change = base.desk.calibration().gains[0] - long;
    assert!((0.0..1e-4).contains(&change), "{change}");
}

#[test]
fn a_run_is_believed_where_the_common_gain_was_said_to_be_known() {
    let unequal = [(Id::GainRight, 1.003), (Id::GainLeft, 0.997)];
    let priors = |drift| [(Id::KDrift, drift), (Id::KScale, 0.0)];
    for (gains, drift) in [(None, 0.0), (None, 1.0), (Some(unequal), 1.0)] {
        let mut set = priors(drift).to_vec();
        set.extend(gains.into_iter().flatten());
        let mut base = with(&set);
        let [right, left, base_gain, ..] = base.desk.calibration().gains;
        run(&mut base, 5);
        base.desk.calibrate_straight(5.05, GATE).unwrap();
        let learned = base.desk.calibration().gains;
        // Both wheels alike, whatever is not known of their difference.
        assert!((learned[0] - right - 0.01).abs() < 3e-4, "{learned:?}");
        assert!((learned[1] - left - 0.01).abs() < 3e-4, "{learned:?}");
        assert!((learned[2] - base_gain).abs() < 1e-6);
    }
}

#[test]
fn a_run_that_cannot_be_is_refused() {
    let mut base = after_two_metres();
    let before = format!("{:?}", base.desk);
    // What the prior and a tape say of two metres: 1.5 cm, of which 25 cm are 17.
    let variance = 4.0 * Params::default().get(Id::KScale) + 0.25e-4;
    for (length, gate, error) in [
        (4.0, 0.0, CorrectionError::Gains),
        (2.25, GATE, CorrectionError::Gate(0.0625 / variance)),
    ] {
        match (base.desk.calibrate_straight(length, gate), error) {
            (Err(Refusal::Correction(CorrectionError::Gate(d2))), CorrectionError::Gate(about)) => {
                assert!((d2 / about - 1.0).abs() < 0.01, "{d2}");
            }
            (is, error) => assert_eq!(is, Err(Refusal::Correction(error))),
        }
        assert_eq!(format!("{:?}", base.desk), before);
    }
    let mut base = Base::new(Noise::default());
    assert_eq!(base.desk.calibrate_straight(1.0, GATE), Err(Refusal::Run));
    base.drive(500, 0.5, 0.0);
    assert_eq!(
        base.desk.calibrate_straight(1.0, GATE),
        Err(Refusal::Moving)
    );
}

#[test]
fn the_whole_covariance_is_the_same_whether_the_gains_are_learned_or_considered_but_for_the_gains()
{
    let fix = |learns: bool| {
        let mut base = Base::new(Noise::default());
        base.drive(4000, 0.5, 0.3);
        base.desk.learn(learns);
        let before = base.estimate();
        let z = Vector3::new(0.01, -0.02, 0.01);
        let z = Vector3::new(before.pose.x, before.pose.y, before.pose.theta) + z;
        let r = symmetric([1e-4, 0.0, 0.0, 1e-4, 0.0, 1e-4]);
        let distance = base.fix(pose(z), r, 0.0).unwrap();
        base.drive(2, 0.0, 0.0);
        (base, distance)
    };
    let ((learning, d), (considering, same_d)) = (fix(true), fix(false));
    assert!((d - same_d).abs() < 1e-6 * d);
    // The same Kalman gain of the pose in both: the same pose, and the same covariance of it.
    let (a, b) = (learning.estimate(), considering.estimate());
    let apart =
        |a: &Pose, b: &Pose| (a.x - b.x).abs() + (a.y - b.y).abs() + (a.theta - b.theta).abs();
    assert!(apart(&a.pose, &b.pose) < 1e-6, "{a:?} {b:?}");
    assert!((a.covariance - b.covariance).abs().max() < 1e-6 * b.covariance.abs().max());
    assert_ne!(learning.desk.calibration().gains, Calibration::NOMINAL);
    assert_eq!(considering.desk.calibration().gains, Calibration::NOMINAL);
}

#[test]
fn gains_that_something_on_board_has_taught_survive_a_set_param() {
    let identity = Identity {
        target: "test",
        reset_cause: "power-on",
        period: Duration::millis(1),
    };
    let mut interpreter = Interpreter::new(identity, Params::default());
    let mut atlas = Atlas::new();
    let mut base = Base::new(Noise::default());
    base.drive(4000, 0.5, 0.3);
    base.desk.learn(true);
    let estimate = base.estimate().pose;
    let z = pose(Vector3::new(estimate.x + 0.01, estimate.y, estimate.theta));
    let sharp = symmetric([1e-4, 0.0, 0.0, 1e-4, 0.0, 1e-4]);
    base.fix(z, sharp, 0.0).unwrap();
    base.drive(1000, 0.0, 0.0);
    base.desk.learn(false);
    let learned = *base.desk.calibration();
    assert_ne!(learned.gains, Calibration::NOMINAL);
    for byte in *b"SetParam gate 9\n" {
        interpreter.receive(byte);
    }
    interpreter.poll(&mut base.desk, &mut atlas);
    base.drive(100, 0.0, 0.0);
    assert_eq!(*base.desk.calibration(), learned);
    assert_eq!(*base.desk.snapshot().estimator.calibration(), learned);
    let kept = interpreter.params();
    assert_eq!(kept.get(Id::GainRight), learned.gains[0]);
    assert_eq!(kept.get(Id::Gate), 9.0);
}

/// What a differential drive knows after a tour with fixes of all kinds, in a number (FNV-1a): each bit counts.
fn digest_of_a_tour() -> u64 {
    let mut base = with(&[(Id::KDrift, 2.0), (Id::KScale, 1e-4), (Id::KRot, 2e-4)]);
    let mut random = Random(23);
    let mut digest = 0xcbf2_9ce4_8422_2325_u64;
    for leg in 0..40 {
        base.drive(500, 0.5, random.between(-1.0, 1.0));
        base.desk.learn(leg % 3 != 0);
        let estimate = base.estimate().pose;
        let off = Vector3::from_fn(|_, _| random.between(-0.01, 0.01));
        let z = Vector3::new(estimate.x, estimate.y, estimate.theta) + off;
        let r = symmetric([1e-4, 2e-5, 0.0, 2e-4, -1e-5, 1e-4]);
        base.fix(pose(z), r, 0.1 * (leg % 4) as f32).unwrap();
        base.drive(100, 0.0, 0.0);
        let Estimate { pose, covariance } = base.estimate();
        let Calibration { gains, spread } = base.desk.calibration();
        let (gains, offset) = gains.split_at(3);
        let (root, of_the_offset) = spread.root.split_at(6);
        assert!(offset.iter().chain(of_the_offset).all(|e| *e == 0.0));
        let single = gains.iter().chain(root).copied().map(f64::from);
        let numbers = [pose.x, pose.y, pose.theta].into_iter();
        for number in numbers.chain(covariance.iter().copied()).chain(single) {
            // Plus zero: of a zero the sign tells nothing.
            for byte in (number + 0.0).to_le_bytes() {
                digest = (digest ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
            }
        }
    }
    digest
}

#[test]
fn a_differential_drive_has_the_same_estimate_however_many_gains_there_could_be() {
    // As it was with three gains and no others. Where the estimator is meant to change, so is this: alike with and without the other vehicles.
    assert_eq!(digest_of_a_tour(), 0x7cea_0000_c6da_3e51);
}
