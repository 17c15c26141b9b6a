//! The closed forms of the odometric error, from quantised counts, at any speed and tick rate.

mod counts;

use counts::{BASE, COUNT, Odometry, geometry, noise, quantised, smallest_eigenvalue};
use nalgebra::{Matrix3, Rotation2, Vector3};
use vehicle_controller::controller::correction::{Terms, Update};
use vehicle_controller::controller::{Estimate, Noise};
use vehicle_controller::vehicle::Spread;
use vehicle_controller::vehicle::gains::OFFSETS;

/// The two encoders' edges lie apart, so that ΔS and Δα flicker: with equal ones Δα would be exactly zero.
const PHASES: [f64; 2] = [0.05, 0.55];

/// The covariance in a frame whose x axis points from the origin to the estimate: half a count of flicker turns a straight path by 0.01°, which
/// at 1 km already shows in Cxx.
fn along_the_path(estimate: &Estimate) -> Matrix3<f64> {
    let pose = &estimate.pose;
    let back = Rotation2::new(-pose.y.atan2(pose.x));
    let mut frame = Matrix3::identity();
    frame.fixed_view_mut::<2, 2>(0, 0).copy_from(back.matrix());
    frame * estimate.covariance.cast::<f64>() * frame.transpose()
}

fn assert_within_1_percent(what: &str, is: f64, wanted: f64, worst: &mut f64) {
    let error = is / wanted - 1.0;
    *worst = worst.max(error.abs());
    assert!(error.abs() < 0.01, "{what}: {is} instead of {wanted}");
}

/// Straight on at `speed` and 1 kHz, looked at after each of the distances.
fn straight(speed: f64, distances: &[f64]) {
    let dt = 1e-3;
    let (kappa_s, kappa) = (f64::from(noise().translation), f64::from(noise().drift));
    let mut odometry = Odometry::new(geometry(), noise());
    let mut ticks = 0_u64;
    for length in distances {
        let end = (length / (speed * dt)).round() as u64;
        while ticks < end {
            ticks += 1;
            let counts = ticks as f64 * (speed * dt) / COUNT;
            let totals = PHASES.map(|phase| quantised(counts, phase));
            odometry.tick(totals, dt as f32);
        }
        let estimate = odometry.estimator.present();
        let c = along_the_path(&estimate);
        let what = |name| format!("{name} after {length} m at {speed} m/s");
        let mut worst = 0.0;
        let mut check = |name, is, wanted| {
            assert_within_1_percent(&what(name), is, wanted, &mut worst);
        };
        check("Var θ", c.m33, kappa * length);
        check("Cov(y, θ)", c.m23, kappa * length.powi(2) / 2.0);
        check("Var y", c.m22, kappa * length.powi(3) / 3.0);
        check("Cxx", c.m11, kappa_s * length);
        println!("{length} m at {speed} m/s: {:.3} %", 100.0 * worst);
    }
}

/// 1 % everywhere: the play operator's lag of one count is 0.01 % of the first metre, and the window of 10 mm that the covariance is propagated by is
/// 1 % of the first metre in Var y's third power at the most.
#[test]
fn straight_at_1_m_per_s_grows_by_the_closed_forms() {
    straight(1.0, &[1.0, 10.0, 100.0, 1000.0]);
}

#[test]
fn straight_at_30_cm_per_s_grows_by_the_closed_forms() {
    straight(0.3, &[1.0, 10.0, 100.0, 1000.0]);
}

#[test]
fn straight_at_1_cm_per_s_grows_by_the_closed_forms() {
    straight(0.01, &[1.0, 10.0, 100.0, 1000.0]);
}

/// Turns in place by `angle` at a rate in rad/s, at 1 kHz.
fn turned(angle: f64, rate: f64, noise: Noise) -> Estimate {
    let dt = 1e-3;
    let mut odometry = Odometry::new(geometry(), noise);
    let ticks = (angle.abs() / (rate * dt)).round() as u64;
    for k in 1..=ticks {
        let counts = angle * k as f64 / ticks as f64 * 0.5 * BASE / COUNT;
        let totals = [quantised(-counts, PHASES[0]), quantised(counts, PHASES[1])];
        odometry.tick(totals, dt as f32);
    }
    odometry.estimator.present()
}

#[test]
fn turning_in_place_grows_the_heading_variance_by_the_angle_and_leaves_x_and_y() {
    for rate in [0.05, 1.0, 5.0] {
        for turns in [0.25, -0.25, 1.0, 10.0, -100.0] {
            let angle = turns * std::f64::consts::TAU;
            let estimate = turned(angle, rate, noise());
            let c = &estimate.covariance;
            let wanted = f64::from(noise().rotation) * angle.abs();
            // A quarter turn loses one to two counts of 3330 to the play.
            assert_within_1_percent("Var θ", c.m33, wanted, &mut 0.0);
            // Untouched: less than half a count, which is as far as the flicker of ΔS moves the pose itself.
            let half = 0.5 * COUNT;
            assert!(c.m11.max(c.m22).sqrt() < half, "{turns} {rate}: {c}");
            assert!(
                estimate.pose.x.hypot(estimate.pose.y) < 2.0 * half,
                "{estimate:?}"
            );
        }
    }
}

/// With `κ_S` = 1 and nothing else, Cxx + Cyy is the total variation of S.
const ONLY_TRANSLATION: Noise = Noise {
    translation: 1.0,
    drift: 0.0,
    rotation: 0.0,
    steering: [0.0; OFFSETS],
};
/// With `κ_rot` = 1 and nothing else, Cθθ is that of α.
const ONLY_ROTATION: Noise = Noise {
    translation: 0.0,
    drift: 0.0,
    rotation: 1.0,
    steering: [0.0; OFFSETS],
};

/// The variations of S and α that a run of 1 m at 1 cm/s is taken for.
fn variations_of_a_metre(phases: [f64; 2]) -> [f64; 2] {
    [ONLY_TRANSLATION, ONLY_ROTATION].map(|noise| {
        let mut odometry = Odometry::new(geometry(), noise);
        for k in 1..=100_000_u32 {
            let counts = f64::from(k) * 1e-5 / COUNT;
            odometry.tick(phases.map(|phase| quantised(counts, phase)), 1e-3);
        }
        let c = odometry.estimator.present().covariance.cast::<f64>();
        if noise.rotation == 0.0 {
            c.m11 + c.m22
        } else {
            c.m33
        }
    })
}

#[test]
fn a_metre_at_1_cm_per_s_varies_s_by_a_metre_and_alpha_not_at_all() {
    for phases in [PHASES, [0.9, 0.1], [0.0, 0.999], [0.3, 0.3]] {
        let [s, alpha] = variations_of_a_metre(phases);
        println!("{phases:?}: {s} m, {alpha} rad");
        // 0.9999: a count less (the play), and where in a count the encoders began. Rounding of f32: 100 windows × 6e-8.
        assert!((s - 0.9999).abs() < COUNT, "{phases:?}: {s} m");
        assert_eq!(alpha, 0.0, "{phases:?}");
    }
}

#[test]
fn a_quarter_turn_varies_alpha_by_itself_and_s_not_at_all() {
    let quarter = std::f64::consts::FRAC_PI_2;
    let count = COUNT / BASE;
    for (angle, rate) in [(quarter, 0.1), (-quarter, 0.1), (quarter, 3.0)] {
        let c = turned(angle, rate, ONLY_TRANSLATION).covariance;
        assert_eq!(c.m11 + c.m22, 0.0, "S was said to vary");
        let alpha = turned(angle, rate, ONLY_ROTATION).covariance.m33;
        println!("{angle} at {rate}: {alpha} rad");
        // A count less (the play), and each encoder began somewhere in a count.
        assert!((alpha - (quarter - count)).abs() < count, "{alpha} rad");
    }
}

#[test]
fn a_quarter_turn_that_starts_in_the_middle_of_both_counts_varies_alpha_by_1_5696() {
    let mut odometry = Odometry::new(geometry(), ONLY_ROTATION);
    for k in 1..=1000 {
        let angle = std::f64::consts::FRAC_PI_2 * f64::from(k) / 1000.0;
        let counts = (angle * 0.5 * BASE / COUNT).floor() as i64;
        odometry.tick([-counts, counts], 1e-3);
    }
    let alpha = odometry.estimator.present().covariance.m33;
    // The theory's number has four decimals.
    assert!((alpha - 1.5696).abs() < 5e-5, "{alpha} rad");
}

/// 100 s of a winding drive with stops and a reversal, 31 m and several turns; what the wheels have rolled by `t`, m.
fn winding(t: f64) -> [f64; 2] {
    // v = 0.35 + 0.4 sin 0.3t, ω = 0.2 + 0.7 sin 0.21t
    let s = 0.35 * t + 0.4 / 0.3 * (1.0 - (0.3 * t).cos());
    let alpha = 0.2 * t + 0.7 / 0.21 * (1.0 - (0.21 * t).cos());
    [s - 0.5 * BASE * alpha, s + 0.5 * BASE * alpha]
}

fn drive_winding(rate: u32) -> Estimate {
    let mut odometry = Odometry::new(geometry(), noise());
    for k in 1..=100 * rate {
        let rolled = winding(f64::from(k) / f64::from(rate));
        let totals = [0, 1].map(|wheel| quantised(rolled[wheel] / COUNT, PHASES[wheel]));
        odometry.tick(totals, 1.0 / rate as f32);
    }
    odometry.estimator.present()
}

#[test]
fn tick_rates_of_50_hz_200_hz_and_1_khz_give_the_same_pose_and_covariance() {
    let finest = drive_winding(1000);
    for rate in [50, 200] {
        let coarse = drive_winding(rate);
        let distance = (coarse.pose.x - finest.pose.x).hypot(coarse.pose.y - finest.pose.y);
        let angle = (coarse.pose.theta - finest.pose.theta).abs();
        // The counts at the end are the same; between, a count's half is placed up to 20 ms later: random, of 0.05 mm, a few thousand times.
        assert!(distance < 1e-3, "{rate} Hz: {distance} m");
        assert!(angle < 1e-6, "{rate} Hz: {angle} rad");
        let (c, wanted) = (coarse.covariance, finest.covariance);
        for i in 0..3 {
            for j in 0..3 {
                let scale = (wanted[(i, i)] * wanted[(j, j)]).sqrt();
                let error = (c[(i, j)] - wanted[(i, j)]).abs() / scale;
                assert!(error < 0.01, "{rate} Hz, {i}{j}: {error}");
            }
        }
        println!("{rate} Hz: {:.4} mm, {angle:.1e} rad", distance * 1e3);
    }
}

/// 10 km straight at a heading, at 1 m/s and 100 Hz (106 counts a tick); `look` sees the estimator every 10 m.
fn ten_kilometres(heading: f64, mut look: impl FnMut(f64, &Odometry)) {
    let mut odometry = Odometry::new(geometry(), noise());
    let turn = (heading * 0.5 * BASE / COUNT) as i64;
    for k in 0..=1000 {
        odometry.tick([-turn * k / 1000, turn * k / 1000], 1e-3);
    }
    for k in 0..1_000_000 {
        odometry.tick([106 * k - turn, 106 * k + turn], 1e-2);
        if k % 1000 == 0 {
            look(106.0 * k as f64 * COUNT, &odometry);
        }
    }
}

#[test]
fn the_covariance_stays_positive_over_10_km_straight_at_any_heading() {
    let mut failures = Vec::new();
    for heading in [0.0, 0.7312, 1.9, -2.2, 2.94] {
        let (mut worst, mut first) = (0.0_f64, None);
        ten_kilometres(heading, |distance, odometry| {
            let c = odometry.estimator.present().covariance.cast::<f64>();
            worst = worst.min(smallest_eigenvalue(&c));
            if worst < -1e-6 {
                first.get_or_insert(distance);
            }
        });
        println!("heading {heading}: {worst:.1e}, below -1e-6 from {first:?} m");
        // −1e-6: three f32 roundings of a correlation near ±1, 6e-8 each, and room.
        if worst < -1e-6 {
            failures.push((heading, worst, first));
        }
    }
    assert!(
        failures.is_empty(),
        "heading, eigenvalue, since: {failures:?}"
    );
}

#[test]
fn a_fix_is_accepted_wherever_a_long_straight_run_has_led() {
    let mut refused = Vec::new();
    for heading in [0.0, 0.7312, 1.9, -2.2, 2.94] {
        ten_kilometres(heading, |distance, odometry| {
            let belief = odometry.estimator.belief();
            let r = Matrix3::from_diagonal(&Vector3::new(1e-4, 1e-4, 1e-4));
            let innovation = Vector3::new(0.01, 0.01, 0.01);
            let terms = Terms {
                gate: 0.0,
                learns: false,
            };
            let mut update = Update::none(&belief, &Spread::NONE);
            let fixed = update.by_pose(&innovation, &r, terms);
            if fixed.is_err() {
                refused.push((heading, distance));
            }
        });
    }
    let first = &refused[..refused.len().min(5)];
    assert!(refused.is_empty(), "{} refused: {first:?} …", refused.len());
}
