//! The serial protocol: pose, covariance, and corrections, against closed forms.

mod common;

use common::{DEGREES, Random, Rig};
use nalgebra::{Matrix3, RowVector3, Vector3};

/// Pose (m, m, °) and covariance (m², m·°, °²) as GetEstPos prints them.
fn printed(rig: &mut Rig) -> (Vector3<f64>, Matrix3<f64>) {
    let n = rig.data("GetEstPos", "EstPos");
    let c = Matrix3::new(n[3], n[4], n[5], n[4], n[6], n[7], n[5], n[7], n[8]);
    (Vector3::new(n[0], n[1], n[2]), c)
}

fn words<'a>(numbers: impl IntoIterator<Item = &'a f64>) -> String {
    let words: Vec<String> = numbers.into_iter().map(|x| format!("{x:.12}")).collect();
    format!(" {}", words.join(" "))
}

/// Row by row.
fn gain(k: &Matrix3<f64>) -> String {
    words(k.transpose().iter())
}

fn upper(c: &Matrix3<f64>) -> String {
    words(&[c.m11, c.m12, c.m13, c.m22, c.m23, c.m33])
}

/// Positions print with 6 decimals, angles with 5, covariances with 6 digits: half a unit of each, and the same of an f32.
fn assert_close(got: &(Vector3<f64>, Matrix3<f64>), pose: &Vector3<f64>, c: &Matrix3<f64>) {
    for (i, tolerance) in [1e-6, 1e-6, 1e-5].into_iter().enumerate() {
        assert!(
            (got.0[i] - pose[i]).abs() < tolerance,
            "{} is not {pose}",
            got.0
        );
    }
    for i in 0..3 {
        for j in 0..3 {
            let scale = (c[(i, i)] * c[(j, j)]).sqrt();
            assert!(
                (got.1[(i, j)] - c[(i, j)]).abs() < 1e-5 * scale,
                "{} is not {c}",
                got.1
            );
        }
    }
}

/// An estimate with every correlation, in m and °.
const POSE: Vector3<f64> = Vector3::new(1.0, -2.0, 30.0);
#[rustfmt::skip]
const COVARIANCE: Matrix3<f64> = Matrix3::new(
    0.04, 0.01, 0.1,
    0.01, 0.09, -0.2,
    0.1, -0.2, 4.0,
);

fn correlated() -> Rig {
    let mut rig = Rig::noiseless();
    rig.ok(&format!(
        "ResetPos{}{}",
        words(POSE.iter()),
        upper(&COVARIANCE)
    ));
    rig
}

/// Φ in m and °: what a shift of (x, y, θ) becomes further on.
fn transport(dx: f64, dy: f64) -> Matrix3<f64> {
    let mut phi = Matrix3::identity();
    phi[(0, 2)] = -dy / DEGREES;
    phi[(1, 2)] = dx / DEGREES;
    phi
}

#[test]
fn positions_angles_and_covariances_have_their_digits() {
    let mut rig = Rig::new();
    rig.ok("ResetPos 1.5 -0.25 -90.5 0.01 0 0 2.5 -0.125 1234.567");
    assert_eq!(
        rig.ask("GetEstPos"),
        "EstPos 1.500000 -0.250000 -90.50000 1.00000e-2 0.00000e0 0.00000e0 2.50000e0 -1.25000e-1 1.23457e3"
    );
    rig.ok("ResetPos 1 2 3");
    assert_eq!(
        rig.ask("GetEstPos"),
        "EstPos 1.000000 2.000000 3.00000 0.00000e0 0.00000e0 0.00000e0 0.00000e0 0.00000e0 0.00000e0"
    );
}

#[test]
fn the_heading_is_wrapped_after_rounding() {
    let mut rig = Rig::new();
    for (sent, told) in [
        ("180", "180.00000"),
        ("-180", "180.00000"),
        ("-179.999999", "180.00000"),
        ("179.999999", "180.00000"),
        ("-179.99999", "-179.99999"),
        ("181", "-179.00000"),
        ("360", "0.00000"),
        ("-0.000001", "0.00000"),
        ("540", "180.00000"),
        ("-3645", "-45.00000"),
        ("1e7", "-80.00000"),
    ] {
        rig.ok(&format!("ResetPos 0 0 {sent}"));
        let reply = rig.ask("GetEstPos");
        assert_eq!(reply.split(' ').nth(3), Some(told), "{sent}");
    }
}

#[test]
fn what_get_est_pos_prints_reset_pos_takes() {
    let mut random = Random(1);
    let mut rig = Rig::new();
    for _ in 0..500 {
        // A regular covariance: A Aᵀ and something on the diagonal, in widely different scales.
        let a = Matrix3::from_fn(|_, _| random.between(-1.0, 1.0));
        let scale = Matrix3::from_diagonal(&Vector3::from_fn(|_, _| {
            10_f64.powf(random.between(-4.0, 3.0))
        }));
        let c = scale * (a * a.transpose() + Matrix3::identity() * 0.01) * scale;
        let pose = Vector3::from_fn(|_, _| random.between(-400.0, 400.0));
        rig.ok(&format!("ResetPos{}{}", words(pose.iter()), upper(&c)));
        let told = rig.ask("GetEstPos");
        rig.ok(&told.replace("EstPos", "ResetPos"));
        assert_eq!(rig.ask("GetEstPos"), told);
    }
}

#[test]
fn what_get_est_pos_prints_of_a_singular_covariance_reset_pos_takes_too() {
    let mut random = Random(2);
    let mut rig = Rig::new();
    // The worst of three million: rounding to six digits leaves an eigenvalue of -1.005e-5 in correlation scale.
    let worst = Vector3::new(1.000_302_450_604, 1.000_252_486_500, 1.000_952_265_481);
    for n in 0..20_000 {
        // One cause moves all three; near 1 a digit of the six counts most.
        let v = if n == 0 {
            worst
        } else {
            Vector3::from_fn(|_, _| random.between(1.0, 1.001))
        };
        let c = v * v.transpose();
        rig.ok(&format!("ResetPos 0 0 0{}", upper(&c)));
        let told = rig.ask("GetEstPos");
        rig.ok(&told.replace("EstPos", "ResetPos"));
    }
}

#[test]
fn correct_pos_adds_k_delta_p_and_takes_k_c_off() {
    let mut rig = correlated();
    // Of an observation with this covariance: any other K would leave C asymmetric.
    let observed = Matrix3::new(0.01, 0.0, 0.02, 0.0, 0.02, 0.0, 0.02, 0.0, 1.0);
    let k = COVARIANCE * (COVARIANCE + observed).try_inverse().unwrap();
    let shift = Vector3::new(0.1, -0.2, 3.0);
    rig.ask("GetEstPos");
    rig.ok(&format!("CorrectPos{}{}", words(shift.iter()), gain(&k)));
    let after = printed(&mut rig);
    assert_close(&after, &(POSE + k * shift), &(COVARIANCE - k * COVARIANCE));
}

#[test]
fn correct_pos_refers_to_the_last_get_est_pos_while_moving() {
    let drive = |rig: &mut Rig| {
        rig.ok("m inf 0.5 2");
        rig.ok("t inf 40 400");
        rig.run(0.7);
    };
    let (mut rig, mut other) = (correlated(), correlated());
    drive(&mut rig);
    drive(&mut other);
    let (then, c) = printed(&mut rig);
    printed(&mut other);
    rig.run(0.4);
    other.run(0.4);
    let observed = Matrix3::from_diagonal(&Vector3::new(0.01, 0.02, 1.0));
    let k = c * (c + observed).try_inverse().unwrap();
    let shift = Vector3::new(0.1, -0.2, 3.0);
    rig.ok(&format!("CorrectPos{}{}", words(shift.iter()), gain(&k)));
    other.ok("Stream 0");
    let (now, _) = printed(&mut other);
    let phi = transport(now.x - then.x, now.y - then.y);
    let (pose, covariance) = printed(&mut rig);
    // The last millisecond was driven at the corrected heading: 0.5 mm times the shift of 2°.
    let expected = now + phi * k * shift;
    assert!(
        (pose - expected).xy().norm() < 3e-5,
        "{pose} is not {expected}"
    );
    assert!((pose.z - expected.z).abs() < 2e-5);
    let expected = phi * (c - k * c) * phi.transpose();
    for i in 0..3 {
        for j in 0..3 {
            let scale = (expected[(i, i)] * expected[(j, j)]).sqrt();
            // 1e-3: that millisecond, and six digits of C in K.
            assert!(
                (covariance - expected)[(i, j)].abs() < 1e-3 * scale,
                "{covariance} is not {expected}"
            );
        }
    }
}

#[test]
fn correct_pos_refers_to_the_present_when_the_last_reply_is_older_than_1_5_s() {
    let estimate = |wait: f64, asked: bool| {
        let mut rig = correlated();
        rig.ok("m inf 0.5 2");
        if asked {
            rig.ask("GetEstPos");
        }
        rig.run(wait);
        rig.ok("CorrectPos 0.1 0.2 3 0.5 0 0 0 0.5 0 0 0 0.5");
        rig.estimate()
    };
    assert_eq!(estimate(1.6, true), estimate(1.6, false));
    assert_ne!(estimate(1.4, true), estimate(1.4, false));
}

#[test]
fn a_gain_that_leaves_no_covariance_is_refused() {
    let mut rig = correlated();
    rig.ask("GetEstPos");
    for k in [
        "2 0 0 0 0 0 0 0 0",
        "0.5 0 0 0 0 0 0 0 0",
        "0 1 0 0 0 0 0 0 0",
        "0 0 0 0 0 0 0 0 1.01",
    ] {
        rig.refused(&format!("CorrectPos 0 0 0 {k}"), "not-psd");
    }
}

#[test]
fn a_matrix_that_is_no_covariance_is_refused() {
    let mut rig = correlated();
    for c in [
        "-1 0 0 1 0 1",
        "1 2 0 1 0 1",
        "1 0 0 1 2 1",
        "0 1 0 1 0 1",
        "1 0 0 1 0 -0.001",
        "1 0.9 0.9 1 -0.9 1",
    ] {
        rig.refused(&format!("ResetPos 0 0 0 {c}"), "not-psd");
        rig.refused(&format!("ObservePos 1 -2 30 {c}"), "not-psd");
    }
}

#[test]
fn observe_pos_is_the_kalman_update_with_the_angle_wrapped() {
    for (turns, age) in [("", ""), ("", " 0"), ("+360", "")] {
        let mut rig = correlated();
        let observed = Matrix3::new(0.01, 0.002, 0.0, 0.002, 0.02, 0.05, 0.0, 0.05, 1.0);
        let innovation = Vector3::new(0.1, 0.2, -2.0);
        let mut at = POSE + innovation;
        at.z += if turns.is_empty() { 0.0 } else { 360.0 };
        let s = (COVARIANCE + observed).try_inverse().unwrap();
        let k = COVARIANCE * s;
        let d2 = rig.data(
            &format!("ObservePos{}{}{age}", words(at.iter()), upper(&observed)),
            "Observed",
        )[0];
        // Printed with 6 decimals, from an f32.
        assert!(
            (d2 - innovation.dot(&(s * innovation))).abs() < 5e-6,
            "{d2}"
        );
        rig.tick();
        assert_close(
            &printed(&mut rig),
            &(POSE + k * innovation),
            &(COVARIANCE - k * COVARIANCE),
        );
    }
}

#[test]
fn observe_scalar_is_the_kalman_update_with_its_row_per_degree() {
    let mut rig = correlated();
    let row = RowVector3::new(0.6, -0.8, 0.05);
    let (innovation, variance) = (0.3, 0.04);
    let s = variance + (row * COVARIANCE * row.transpose()).x;
    let k = COVARIANCE * row.transpose() / s;
    let d2 = rig.data("ObserveScalar 0.3 0.04 0.6 -0.8 0.05", "Observed")[0];
    assert!((d2 - innovation * innovation / s).abs() < 1.5e-6, "{d2}");
    rig.tick();
    assert_close(
        &printed(&mut rig),
        &(POSE + k * innovation),
        &(COVARIANCE - k * row * COVARIANCE),
    );
}

#[test]
fn an_old_observation_is_compared_with_the_pose_of_its_time() {
    let mut rig = correlated();
    rig.ok("m inf 0.5 2");
    rig.run(0.7);
    let (then, _) = printed(&mut rig);
    rig.run(0.5);
    let d2 = |rig: &mut Rig, age: &str| {
        rig.data(
            &format!("ObservePos{} 0.01 0 0 0.01 0 1{age}", words(then.iter())),
            "Observed",
        )[0]
    };
    assert!(d2(&mut correlated_like(&then), "") < 1e-9);
    assert!(
        d2(&mut rig, " 0.5") < 1e-5,
        "what was seen is what was there"
    );
    rig.tick();
    assert!(d2(&mut rig, "") > 0.5, "it is 0.25 m away now");
}

fn correlated_like(pose: &Vector3<f64>) -> Rig {
    let mut rig = Rig::noiseless();
    rig.ok(&format!(
        "ResetPos{}{}",
        words(pose.iter()),
        upper(&COVARIANCE)
    ));
    rig
}

#[test]
fn the_age_of_an_observation_is_0_to_1_5_s() {
    let mut rig = correlated();
    rig.run(2.0);
    for age in ["-0.001", "1.501", "100"] {
        for line in ["ObservePos 1 -2 30 1 0 0 1 0 1", "ObserveScalar 0 1 1 0 0"] {
            let reply = rig.refused(&format!("{line} {age}"), "range");
            assert!(reply.contains("age") && reply.contains("1.5"), "{reply}");
        }
    }
    for age in ["0", "1.5"] {
        assert!(
            rig.ask(&format!("ObservePos 1 -2 30 1 0 0 1 0 1 {age}"))
                .starts_with("Observed ")
        );
    }
    rig.tick();
    rig.refused("ObserveScalar 0 -1 1 0 0", "range");
}

#[test]
fn an_observation_beyond_the_gate_is_refused() {
    let mut rig = Rig::new();
    rig.ok("ResetPos 0 0 0 1 0 0 1 0 1");
    // S = 1 + 1 = 2: d² = ν²/2, and the gate is 25.
    rig.refused("ObserveScalar 7.08 1 1 0 0", "gate");
    rig.refused("ObservePos 7.08 0 0 1 0 0 1 0 1", "gate");
    rig.ok("SetParam gate 26");
    assert_eq!(rig.ask("ObserveScalar 7.08 1 1 0 0"), "Observed 25.063200");
    rig.ok("ResetPos 0 0 0 1 0 0 1 0 1");
    rig.ok("SetParam gate 0");
    assert!(
        rig.ask("ObserveScalar 1000 1 1 0 0")
            .starts_with("Observed 500000")
    );
}

#[test]
fn corrections_leave_the_axes_alone() {
    let mut rig = correlated();
    rig.ok("m 0.2 0.2 1");
    rig.run(2.0);
    let before = rig.data("GetState", "State");
    assert!(
        rig.ask("ObservePos 1.2 -1.9 32 0.01 0 0 0.01 0 1")
            .starts_with("Observed ")
    );
    rig.run(0.5);
    rig.ok("ResetPos 5 5 5");
    rig.run(0.5);
    assert_eq!(rig.data("GetState", "State")[1..], before[1..]);
}

#[test]
fn no_covariance_that_is_taken_becomes_infinite_by_driving() {
    let mut rig = Rig::new();
    for line in [
        "SetParam max_speed 20",
        "SetParam max_accel 50",
        "ResetPos 0 0 0 1e12 0 0 1e12 0 1e12",
        "m inf 20 50",
    ] {
        rig.ok(line);
    }
    rig.run(10.0);
    let c = rig.estimate().covariance;
    assert!(c.iter().all(|e| e.is_finite()), "{c}");
}
