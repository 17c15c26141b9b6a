//! Corrections of the pose through the desk: the reference vectors, the closed form of one number, and states that are known exactly.

mod counts;

use counts::base::{Base, difference, pose, symmetric, vector, wide};
use counts::{Random, noise, smallest_eigenvalue};
use nalgebra::{Matrix3, RowVector3, Vector3};
use vehicle_controller::controller::{CorrectionError, Noise, Observation, Pose, Refusal};
use vehicle_controller::math::wrap;
use vehicle_controller::vehicle::gains::OFFSETS;

/// Nothing grows by itself: what is seen is the correction alone.
const SILENT: Noise = Noise {
    translation: 0.0,
    drift: 0.0,
    rotation: 0.0,
    steering: [0.0; OFFSETS],
};

/// A covariance with correlations.
fn blurred() -> Matrix3<f64> {
    symmetric([0.01, 0.002, -0.003, 0.02, 0.004, 0.01])
}

/// Rows of `vectors/corrections.csv`, all of them full observations: pose, C, z, R, corrected pose, corrected C.
fn rows() -> Vec<[f64; 27]> {
    include_str!("vectors/corrections.csv")
        .lines()
        .filter(|line| !line.starts_with('#') && !line.starts_with('x'))
        .map(|line| {
            let mut row = [0.0; 27];
            assert_eq!(line.split(',').count(), row.len());
            for (value, word) in row.iter_mut().zip(line.split(',')) {
                *value = word.parse().unwrap();
            }
            row
        })
        .collect()
}

fn split(row: &[f64]) -> (Pose, Matrix3<f64>) {
    let mut triangle = [0.0; 6];
    triangle.copy_from_slice(&row[3..9]);
    let v = Vector3::new(row[0], row[1], row[2]);
    (pose(v), symmetric(triangle))
}

#[test]
fn full_observations_agree_with_the_vectors_to_1e_5() {
    let rows = rows();
    assert_eq!(rows.len(), 40);
    let mut worst = [0.0_f64; 2];
    for row in rows {
        let (start, c) = split(&row[0..9]);
        let (z, r) = split(&row[9..18]);
        let (wanted, c_wanted) = split(&row[18..27]);
        let mut base = Base::at(start, &c, SILENT);
        base.fix(z, r, 0.0).unwrap();
        base.drive(1, 0.0, 0.0);
        let estimate = base.estimate();
        let mut error = vector(&estimate.pose) - vector(&wanted);
        // The file's angles are wrapped, the estimate's are not.
        error.z = wrap(error.z);
        worst[0] = worst[0].max(error.abs().max());
        worst[1] = worst[1].max(difference(&wide(&estimate), &c_wanted));
    }
    println!("vectors: {worst:?}");
    // C comes and goes as f32: 6e-8 each, some tens of times as much where C is nearly singular. In m and rad, and of √(C_ii C_jj).
    assert!(worst[0] < 1e-5 && worst[1] < 1e-5, "{worst:?}");
}

#[test]
fn one_number_corrects_by_the_closed_form() {
    let mut random = Random(3);
    for _ in 0..200 {
        let start = Pose {
            x: random.between(-3.0, 3.0),
            y: random.between(-3.0, 3.0),
            theta: random.between(-3.0, 3.0),
        };
        let mut base = Base::at(start, &blurred(), SILENT);
        let h = RowVector3::from_fn(|_, _| random.between(-1.0, 1.0));
        let (nu, r) = (random.between(-0.1, 0.1), random.between(1e-5, 1e-2));
        let c = wide(&base.estimate());
        // K' = C Hᵀ / (R + H C Hᵀ), P := P + K' ν, C := C − K' H C
        let s = r + (h * c * h.transpose()).x;
        let k = c * h.transpose() / s;
        let observation = Observation::Scalar {
            innovation: nu,
            variance: r,
            row: h,
        };
        let distance = base.desk.observe(&observation, 0.0, 0.0).unwrap();
        assert!((f64::from(distance) / (nu * nu / s) - 1.0).abs() < 1e-6);
        base.drive(1, 0.0, 0.0);
        let estimate = base.estimate();
        let shift = vector(&estimate.pose) - vector(&start);
        assert!((shift - k * nu).abs().max() < 1e-9, "{shift} {h}");
        // f32: 6e-8 of the C before, which may be some ten times that after.
        assert!(difference(&wide(&estimate), &(c - k * h * c)) < 1e-5);
    }
}

#[test]
fn three_numbers_one_after_another_are_one_full_observation() {
    let z = Vector3::new(0.05, -0.08, 0.06);
    let variances = Vector3::new(1e-3, 4e-3, 2e-3);
    let mut at_once = Base::at(Pose::default(), &blurred(), SILENT);
    let r = Matrix3::from_diagonal(&variances);
    at_once.fix(pose(z), r, 0.0).unwrap();
    at_once.drive(1, 0.0, 0.0);
    let mut singly = Base::at(Pose::default(), &blurred(), SILENT);
    for i in 0..3 {
        let observation = Observation::Scalar {
            innovation: z[i] - vector(&singly.estimate().pose)[i],
            variance: variances[i],
            row: Matrix3::identity().row(i).into(),
        };
        singly.desk.observe(&observation, 0.0, 0.0).unwrap();
        singly.drive(1, 0.0, 0.0);
    }
    let (a, b) = (singly.estimate(), at_once.estimate());
    // C is rounded to f32 three times instead of once.
    assert!((vector(&a.pose) - vector(&b.pose)).abs().max() < 1e-7);
    assert!(difference(&wide(&a), &wide(&b)) < 1e-6);
}

#[test]
fn the_gain_of_an_observation_sent_as_correct_pos_does_the_same() {
    let z = Vector3::new(0.3, 0.1, 2.0) + Vector3::new(0.04, 0.07, -0.05);
    let r = symmetric([2e-3, 5e-4, 0.0, 1e-3, -2e-4, 3e-3]);
    let start = pose(Vector3::new(0.3, 0.1, 2.0));
    let mut observed = Base::at(start, &blurred(), SILENT);
    observed.fix(pose(z), r, 0.0).unwrap();
    observed.drive(1, 0.0, 0.0);
    let mut corrected = Base::at(start, &blurred(), SILENT);
    let read = corrected.desk.get_est_pos();
    let c = wide(&read);
    let gain = c * (c + r).try_inverse().unwrap();
    let shift = z - vector(&read.pose);
    corrected.desk.correct_pos(shift, &gain).unwrap();
    corrected.drive(1, 0.0, 0.0);
    let (a, b) = (observed.estimate(), corrected.estimate());
    assert!((vector(&a.pose) - vector(&b.pose)).abs().max() < 1e-9);
    // Both are rounded to f32 once.
    assert!(difference(&wide(&a), &wide(&b)) < 2e-7);
}

fn diagonal(xx: f64, yy: f64, tt: f64) -> Matrix3<f64> {
    Matrix3::from_diagonal(&Vector3::new(xx, yy, tt))
}

fn gain(base: &mut Base, k: &Matrix3<f64>) -> Result<(), Refusal> {
    base.desk.correct_pos(Vector3::new(0.1, 0.1, 0.1), k)
}

#[test]
fn a_state_of_zero_covariance_is_believed_against_any_observation() {
    let start = pose(Vector3::new(1.0, 2.0, 0.5));
    let z = pose(Vector3::new(1.5, 1.0, 0.1));
    for age in [0.0, 0.2] {
        let mut base = Base::at(start, &Matrix3::zeros(), noise());
        base.drive(300, 0.0, 0.0);
        let before = base.estimate();
        base.fix(z, diagonal(0.01, 0.01, 0.01), age).unwrap();
        base.drive(1, 0.0, 0.0);
        assert_eq!(base.estimate(), before);
        // Two claims to be exact at odds with each other cannot both be right.
        let refusal = base.fix(z, Matrix3::zeros(), age).unwrap_err();
        let wanted = Refusal::Correction(CorrectionError::NotPositive);
        assert_eq!(refusal, wanted);
    }
}

#[test]
fn an_exact_heading_stays_while_the_position_is_corrected() {
    let start = pose(Vector3::new(1.0, 2.0, 0.5));
    let mut base = Base::at(start, &diagonal(0.01, 0.01, 0.0), SILENT);
    let z = pose(Vector3::new(1.1, 1.8, 0.9));
    base.fix(z, diagonal(0.01, 0.01, 0.01), 0.0).unwrap();
    base.drive(1, 0.0, 0.0);
    let estimate = base.estimate();
    // Half-way between two that are equally good; f32 knows 0.01 to 6e-8.
    let wanted = Vector3::new(1.05, 1.9, 0.5);
    assert!((vector(&estimate.pose) - wanted).abs().max() < 1e-7);
    assert_eq!(estimate.covariance.m33, 0.0);
    assert!((estimate.covariance.m11 - 0.005).abs() < 1e-8);
}

#[test]
fn an_exact_observation_is_taken_over_whole() {
    let mut base = Base::at(Pose::default(), &blurred(), SILENT);
    let z = Vector3::new(0.1, -0.2, 0.05);
    base.fix(pose(z), Matrix3::zeros(), 0.0).unwrap();
    base.drive(1, 0.0, 0.0);
    let estimate = base.estimate();
    assert!((vector(&estimate.pose) - z).abs().max() < 1e-12);
    assert!(estimate.covariance.abs().max() < 1e-12);
}

#[test]
fn a_second_correct_pos_before_the_first_is_carried_out_is_busy() {
    let mut base = Base::at(Pose::default(), &blurred(), SILENT);
    let k = Matrix3::identity() * 0.25;
    gain(&mut base, &k).unwrap();
    let before = format!("{:?}", base.desk);
    assert_eq!(gain(&mut base, &k), Err(Refusal::Busy));
    assert_eq!(format!("{:?}", base.desk), before);
}

#[test]
fn a_duplicate_correct_pos_is_one_more_correction_and_keeps_c_positive() {
    let mut base = Base::at(Pose::default(), &blurred(), SILENT);
    let c = wide(&base.desk.get_est_pos());
    let r = diagonal(0.01, 0.02, 0.01);
    let k = c * (c + r).try_inverse().unwrap();
    let shift = Vector3::new(0.1, 0.1, 0.1);
    let mut rest = c;
    for n in 1..=3 {
        gain(&mut base, &k).unwrap();
        base.drive(20, 0.0, 0.0);
        let estimate = base.estimate();
        rest -= k * rest;
        let moved = vector(&estimate.pose) - k * shift * f64::from(n);
        assert!(moved.abs().max() < 1e-9, "{n}: {moved}");
        // f32: n roundings of C.
        assert!(difference(&wide(&estimate), &rest) < 1e-6, "{n}");
        assert!(smallest_eigenvalue(&wide(&estimate)) > -1e-6, "{n}");
    }
}
