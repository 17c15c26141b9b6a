//! Gains, through the desk: measured runs, and what observations make of them.

mod counts;

use counts::base::{Base, pose, symmetric};
use nalgebra::Vector3;
use vehicle_controller::controller::{AxisCommand, CorrectionError, Noise, Pose, Refusal};
use vehicle_controller::params::{Id, Params};

const AHEAD: AxisCommand = AxisCommand {
    distance: 1.0,
    speed: 0.5,
    acceleration: 0.5,
};

/// A base that has gone two metres straight on, and stands.
fn after_two_metres() -> Base {
    let mut base = Base::new(Noise::default());
    base.drive(4000, 0.5, 0.0);
    base.drive(1000, 0.0, 0.0);
    base
}

#[test]
fn a_measured_run_scales_both_wheels() {
    let mut base = after_two_metres();
    base.desk.calibrate_straight(2.02).unwrap();
    base.drive(10, 0.0, 0.0);
    let calibration = *base.desk.calibration();
    let [right, left, base_gain] = calibration.gains.map(f64::from);
    // The prior's 0.5 % of two metres against a tape's 5 mm: four fifths of it.
    let share = 1e-4 / (1e-4 + 0.25e-4);
    for wheel in [right, left] {
        assert!((wheel - 1.0 - 0.01 * share).abs() < 2e-4, "{wheel}");
    }
    assert!((base_gain - 1.0).abs() < 1e-7);
    // The controller has them, too.
    let known = base.desk.snapshot().estimator.calibration();
    assert_eq!(*known, calibration);
    // The way that was gone is longer now.
    assert!((base.estimate().pose.x - 2.016).abs() < 4e-4);
}

#[test]
fn a_short_run_does_not_overrule_a_long_one() {
    let mut base = Base::new(Noise::default());
    base.drive(40_000, 0.5, 0.0);
    base.drive(1000, 0.0, 0.0);
    base.desk.calibrate_straight(20.1).unwrap();
    base.drive(10, 0.0, 0.0);
    let long = base.desk.calibration().gains[0];
    // The next run begins where it is commanded.
    base.desk.move_by(AHEAD).unwrap();
    base.drive(2000, 0.5, 0.0);
    base.drive(1000, 0.0, 0.0);
    let travelled = 1.0 * f64::from(long);
    base.desk.calibrate_straight(travelled + 0.02).unwrap();
    // Over 20 m 5 mm are 2.5e-4, over 1 m 5e-3: of the 2 % that it says, a four-hundredth.
    let change = base.desk.calibration().gains[0] - long;
    assert!((0.0..1e-4).contains(&change), "{change}");
}

#[test]
fn a_run_is_believed_where_the_gains_were_said_to_be_known() {
    let known = [(Id::KDrift, 0.0), (Id::KRot, 0.0), (Id::KScale, 0.0)];
    let mut params = Params::default();
    params.set_all(&known).unwrap();
    let mut base = Base::with(&params, Noise::default());
    base.drive(10_000, 0.5, 0.0);
    base.drive(1000, 0.0, 0.0);
    base.desk.calibrate_straight(5.05).unwrap();
    let [right, left, base_gain] = base.desk.calibration().gains;
    for wheel in [right, left] {
        assert!((wheel - 1.01).abs() < 1e-4, "{wheel}");
    }
    assert!((base_gain - 1.0).abs() < 1e-6);
}

#[test]
fn a_run_that_would_make_a_gain_absurd_is_refused() {
    let mut base = after_two_metres();
    let before = format!("{:?}", base.desk);
    let refusal = base.desk.calibrate_straight(4.0);
    assert_eq!(refusal, Err(Refusal::Correction(CorrectionError::Gains)));
    assert_eq!(format!("{:?}", base.desk), before);
    let mut base = Base::new(Noise::default());
    assert_eq!(base.desk.calibrate_straight(1.0), Err(Refusal::Distance));
    base.drive(500, 0.5, 0.0);
    assert_eq!(base.desk.calibrate_straight(1.0), Err(Refusal::Moving));
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
    assert_ne!(learning.desk.calibration().gains, [1.0; 3]);
    assert_eq!(considering.desk.calibration().gains, [1.0; 3]);
}
