//! Corrections that are refused, and leave everything as it was.

mod counts;

use counts::base::{Base, pose, symmetric};
use counts::noise;
use nalgebra::{Matrix3, RowVector3, Vector3};
use vehicle_controller::controller::{CorrectionError, Noise, Observation, Pose, Refusal};

/// A covariance with correlations.
fn blurred() -> Matrix3<f64> {
    symmetric([0.01, 0.002, -0.003, 0.02, 0.004, 0.01])
}

/// An attempt that must be refused, and what must be said.
type Attempt = (
    &'static str,
    fn(&mut Base) -> Result<(), Refusal>,
    fn(&Refusal) -> bool,
);

const NOT_POSITIVE: fn(&Refusal) -> bool =
    |refusal| *refusal == Refusal::Correction(CorrectionError::NotPositive);
const AGE: fn(&Refusal) -> bool = |refusal| *refusal == Refusal::Age;
const ANY: fn(&Refusal) -> bool = |_| true;

fn diagonal(xx: f64, yy: f64, tt: f64) -> Matrix3<f64> {
    Matrix3::from_diagonal(&Vector3::new(xx, yy, tt))
}

fn fix(base: &mut Base, r: Matrix3<f64>, age: f32) -> Result<(), Refusal> {
    base.fix(Pose::default(), r, age).map(|_| ())
}

fn gain(base: &mut Base, k: &Matrix3<f64>) -> Result<(), Refusal> {
    base.desk.correct_pos(Vector3::new(0.1, 0.1, 0.1), k)
}

fn scalar(base: &mut Base, numbers: [f64; 2], row: [f64; 3]) -> Result<(), Refusal> {
    let observation = Observation::Scalar {
        innovation: numbers[0],
        variance: numbers[1],
        row: RowVector3::from(row),
    };
    base.desk.observe(&observation, 0.0, 0.0).map(|_| ())
}

const ATTEMPTS: [Attempt; 20] = [
    ("too old", |b| fix(b, diagonal(1.0, 1.0, 1.0), 1.51), AGE),
    (
        "from the future",
        |b| fix(b, diagonal(1.0, 1.0, 1.0), -0.01),
        AGE,
    ),
    (
        "age unknown",
        |b| fix(b, diagonal(1.0, 1.0, 1.0), f32::NAN),
        AGE,
    ),
    (
        "age infinite",
        |b| fix(b, diagonal(1.0, 1.0, 1.0), f32::INFINITY),
        AGE,
    ),
    (
        "R negative",
        |b| fix(b, diagonal(1.0, -1e-3, 1.0), 0.0),
        NOT_POSITIVE,
    ),
    (
        "R no number",
        |b| fix(b, diagonal(1.0, f64::NAN, 1.0), 0.0),
        ANY,
    ),
    (
        "R infinite",
        |b| fix(b, diagonal(1.0, f64::INFINITY, 1.0), 0.3),
        ANY,
    ),
    (
        "R asymmetric",
        |b| {
            fix(
                b,
                Matrix3::new(1.0, 0.1, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0),
                0.0,
            )
        },
        NOT_POSITIVE,
    ),
    (
        "R over-correlated",
        |b| fix(b, symmetric([1.0, 1.1, 0.0, 1.0, 0.0, 1.0]), 0.2),
        NOT_POSITIVE,
    ),
    (
        "z no number",
        |b| {
            b.fix(
                pose(Vector3::new(0.0, f64::NAN, 0.0)),
                diagonal(1.0, 1.0, 1.0),
                0.0,
            )
            .map(|_| ())
        },
        ANY,
    ),
    (
        "z infinite",
        |b| {
            b.fix(
                pose(Vector3::new(0.0, 0.0, f64::INFINITY)),
                diagonal(1.0, 1.0, 1.0),
                0.1,
            )
            .map(|_| ())
        },
        ANY,
    ),
    (
        "K of 2.5",
        |b| gain(b, &(Matrix3::identity() * 2.5)),
        NOT_POSITIVE,
    ),
    (
        "K asymmetric",
        |b| {
            gain(
                b,
                &Matrix3::new(0.5, 0.3, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0, 0.5),
            )
        },
        NOT_POSITIVE,
    ),
    (
        "K no number",
        |b| gain(b, &(Matrix3::identity() * f64::NAN)),
        ANY,
    ),
    (
        "shift infinite",
        |b| {
            b.desk.correct_pos(
                Vector3::new(f64::INFINITY, 0.0, 0.0),
                &(Matrix3::identity() * 0.5),
            )
        },
        ANY,
    ),
    (
        "variance negative",
        |b| scalar(b, [0.1, -1e-3], [1.0, 0.0, 0.0]),
        NOT_POSITIVE,
    ),
    (
        "row no number",
        |b| scalar(b, [0.1, 1e-3], [1.0, f64::NAN, 0.0]),
        ANY,
    ),
    (
        "innovation no number",
        |b| scalar(b, [f64::NAN, 1e-3], [1.0, 0.0, 0.0]),
        ANY,
    ),
    (
        "reset to no number",
        |b| {
            b.desk.reset_pos(
                pose(Vector3::new(f64::NAN, 0.0, 0.0)),
                &diagonal(1.0, 1.0, 1.0),
            )
        },
        ANY,
    ),
    (
        "reset with C negative",
        |b| b.desk.reset_pos(Pose::default(), &diagonal(1.0, 1.0, -1.0)),
        NOT_POSITIVE,
    ),
];

fn on_the_way() -> Base {
    let mut base = Base::at(Pose::default(), &blurred(), noise());
    base.drive(1000, 0.4, 0.3);
    base.desk.get_est_pos();
    base.drive(100, 0.4, 0.3);
    base
}

#[test]
fn a_refusal_changes_no_bit_of_anything() {
    // What comes after is the same too: a delayed fix looks at the past, and a CorrectPos at what was answered.
    let afterwards = |base: &mut Base| {
        base.fix(pose(Vector3::new(0.3, 0.1, 0.3)), blurred(), 0.7)
            .unwrap();
        base.drive(1, 0.4, 0.3);
        gain(base, &(Matrix3::identity() * 0.1)).unwrap();
        base.drive(1, 0.4, 0.3);
        format!("{:?}", base.desk.snapshot())
    };
    let wanted = afterwards(&mut on_the_way());
    for (what, attempt, expected) in ATTEMPTS {
        let mut base = on_the_way();
        // Debug shows every bit of a float, the sign of a zero too.
        let before = format!("{:?}", base.desk);
        let refusal = attempt(&mut base).expect_err(what);
        assert!(expected(&refusal), "{what}: {refusal:?}");
        assert_eq!(format!("{:?}", base.desk), before, "{what}");
        assert!(base.desk.take_request().is_none(), "{what}");
        assert_eq!(afterwards(&mut base), wanted, "{what}");
    }
}

#[test]
fn an_observation_beyond_the_gate_is_refused_with_its_distance() {
    let mut base = Base::at(
        Pose::default(),
        &diagonal(0.01, 0.01, 0.01),
        Noise::default(),
    );
    let before = format!("{:?}", base.desk);
    // 0.5² / (0.01 + 0.03) = 6.25
    let observation = Observation::Pose {
        pose: pose(Vector3::new(0.5, 0.0, 0.0)),
        covariance: diagonal(0.03, 0.03, 0.03),
    };
    let refusal = base.desk.observe(&observation, 0.0, 6.2).unwrap_err();
    let Refusal::Correction(CorrectionError::Gate(distance)) = refusal else {
        panic!("{refusal:?}");
    };
    // C is an f32: 0.01 has 8 digits.
    assert!((distance - 6.25).abs() < 1e-5, "{distance}");
    assert_eq!(format!("{:?}", base.desk), before);
    assert!(base.desk.observe(&observation, 0.0, 6.3).is_ok());
}
