//! Corrections that arrive late, from several sensors, after a reset, or at random.

mod counts;

use counts::base::{Base, difference, pose, symmetric, vector, wide};
use counts::{Random, noise, smallest_eigenvalue};
use nalgebra::{Matrix3, RowVector3, Vector3};
use vehicle_controller::controller::{CorrectionError, Observation, Pose, Refusal};
use vehicle_controller::params::{Id, Params};
use vehicle_controller::vehicle::Calibration;

/// 10 cm and 5°, correlated.
fn blurred() -> Matrix3<f64> {
    symmetric([0.01, 0.002, -0.003, 0.01, 0.004, 0.0076])
}

/// 2 cm and 1°.
fn sharp() -> Matrix3<f64> {
    symmetric([4e-4, 1e-4, 0.0, 4e-4, 0.0, 3e-4])
}

/// 60 °/s.
const OMEGA: f64 = std::f64::consts::FRAC_PI_3;

/// Distance (m), angle (rad) and difference of covariance (correlation scale) between two bases' estimates.
fn apart(a: &Base, b: &Base) -> [f64; 3] {
    let (a, b) = (a.estimate(), b.estimate());
    let d = vector(&a.pose) - vector(&b.pose);
    [d.xy().norm(), d.z.abs(), difference(&wide(&a), &wide(&b))]
}

/// The requirement is 2 mm and 0.1°: a heading innovation of 5° turns the motion since, which to first order is a shift. (It turns C as well, so
/// that is looked at with small innovations.)
fn assert_the_same(what: &str, a: &Base, b: &Base) {
    let apart = apart(a, b);
    println!(
        "{what}: {:.3} mm, {:.4}°, {:.1e}",
        apart[0] * 1e3,
        apart[1].to_degrees(),
        apart[2]
    );
    assert!(apart[0] < 2e-3, "{what}: {} m", apart[0]);
    assert!(apart[1] < 0.1_f64.to_radians(), "{what}: {} rad", apart[1]);
}

fn underway(millis: u32) -> Base {
    let mut base = Base::at(Pose::default(), &blurred(), noise());
    base.drive(millis, 0.5, OMEGA);
    base
}

/// A fix that finds the vehicle 10 cm and 5° from where it thinks it is.
fn elsewhere(base: &Base) -> Pose {
    pose(vector(&base.estimate().pose) + Vector3::new(0.08, -0.06, 0.087))
}

#[test]
fn a_late_fix_is_the_fresh_one_carried() {
    // The ring has an entry each 32 ms: near one, between two, and at the very beginning of what is kept.
    for (start, late) in [
        (2000, 300),
        (2013, 300),
        (2007, 20),
        (2000, 1499),
        (1990, 3),
    ] {
        let mut fresh = underway(start);
        let z = elsewhere(&fresh);
        fresh.fix(z, sharp(), 0.0).unwrap();
        fresh.drive(late + 50, 0.5, OMEGA);
        let mut delayed = underway(start);
        delayed.drive(late, 0.5, OMEGA);
        delayed.fix(z, sharp(), late as f32 * 1e-3).unwrap();
        delayed.drive(50, 0.5, OMEGA);
        assert_the_same(&format!("{late} ms late"), &delayed, &fresh);
    }
}

#[test]
fn a_late_fix_leaves_the_covariance_of_the_fresh_one_carried() {
    let mut failures = Vec::new();
    // From one entry of the ring to the next, in steps of an eighth.
    for start in (2000..2032).step_by(4) {
        for late in [20, 50, 100, 300] {
            let mut fresh = underway(start);
            let z = pose(vector(&fresh.estimate().pose) + Vector3::new(1e-3, 1e-3, 1e-3));
            fresh.fix(z, sharp(), 0.0).unwrap();
            fresh.drive(late + 10, 0.5, OMEGA);
            let mut delayed = underway(start);
            delayed.drive(late, 0.5, OMEGA);
            delayed.fix(z, sharp(), late as f32 * 1e-3).unwrap();
            delayed.drive(10, 0.5, OMEGA);
            // Between two entries C is not quite linear (32 ms are 16 mm, Cθθ (16 mm)²/4 is 0.2 % of the Cxx after), and where that leaves the
            // noise since slightly indefinite its positive part is taken: a percent.
            let error = apart(&delayed, &fresh)[2];
            if error > 0.01 {
                failures.push(format!(
                    "at {start} ms, {late} ms late: {:.2} %",
                    error * 100.0
                ));
            }
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
}

#[test]
fn a_late_scalar_observation_is_the_fresh_one_carried() {
    let observation = Observation::Scalar {
        innovation: 0.1,
        variance: 1e-4,
        row: RowVector3::new(0.8, 0.6, 0.1),
    };
    let mut fresh = underway(2000);
    fresh.desk.observe(&observation, 0.0, 0.0).unwrap();
    fresh.drive(350, 0.5, OMEGA);
    let mut delayed = underway(2000);
    delayed.drive(300, 0.5, OMEGA);
    delayed.desk.observe(&observation, 0.3, 0.0).unwrap();
    delayed.drive(50, 0.5, OMEGA);
    assert_the_same("scalar", &delayed, &fresh);
}

/// Two fixes, in order, and the first of them late; after that [`apart`].
fn out_of_order(gains: &[(Id, f32)], learns: bool) -> [f64; 3] {
    let mut params = Params::default();
    params.set_all(gains).unwrap();
    let start = |millis: u32| {
        let mut base = Base::with(&params, noise());
        base.desk.learn(learns);
        base.desk.reset_pos(Pose::default(), &blurred()).unwrap();
        base.drive(millis, 0.5, OMEGA);
        base
    };
    // What the second fix says of the instant of the first goes through the smoother's gain.
    let mut ordered = start(2000);
    let first = elsewhere(&ordered);
    ordered.fix(first, sharp(), 0.0).unwrap();
    ordered.drive(280, 0.5, OMEGA);
    let mut second = start(2280);
    let z = pose(vector(&elsewhere(&second)) + Vector3::new(0.01, 0.01, -0.01));
    ordered.fix(z, sharp() * 2.0, 0.0).unwrap();
    ordered.drive(100, 0.5, OMEGA);
    second.fix(z, sharp() * 2.0, 0.0).unwrap();
    second.drive(20, 0.5, OMEGA);
    second.fix(first, sharp(), 0.3).unwrap();
    second.drive(80, 0.5, OMEGA);
    apart(&second, &ordered)
}

#[test]
fn late_fixes_out_of_order_are_nearly_those_in_order() {
    // The ring keeps no covariances between instants, so what the second fix and the first tell together is counted as if the noise between them
    // were told once more: a tenth of the covariance, and of a heading innovation of 5° a thirtieth.
    let known = [(Id::KDrift, 0.0), (Id::KRot, 0.0), (Id::KScale, 0.0)];
    let wide = [(Id::KDrift, 1.0), (Id::KRot, 1.93e-4), (Id::KScale, 1e-4)];
    for (gains, learns) in [(&known, false), (&known, true), (&wide, true)] {
        let [distance, angle, covariance] = out_of_order(gains, learns);
        assert!(distance < 1e-3, "{distance} m");
        assert!(angle < 0.17_f64.to_radians(), "{angle} rad");
        assert!(covariance < 0.15, "covariance {covariance}");
    }
    // To a filter that considers the gains the order matters even if it keeps everything: 0.6 mm, 0.21° and 0.04 of the covariance more.
    let [distance, angle, covariance] = out_of_order(&wide, false);
    assert!(distance < 1.6e-3, "{distance} m");
    assert!(angle < 0.38_f64.to_radians(), "{angle} rad");
    assert!(covariance < 0.19, "covariance {covariance}");
}

#[test]
fn correct_pos_refers_to_what_was_answered_while_the_vehicle_drove_on() {
    let mut fresh = underway(2000);
    let z = elsewhere(&fresh);
    fresh.fix(z, sharp(), 0.0).unwrap();
    fresh.drive(450, 0.5, OMEGA);
    let mut client = underway(2000);
    let read = client.desk.get_est_pos();
    let c = wide(&read);
    let gain = c * (c + sharp()).try_inverse().unwrap();
    client.drive(400, 0.5, OMEGA);
    let shift = vector(&z) - vector(&read.pose);
    client.desk.correct_pos(shift, &gain).unwrap();
    client.drive(50, 0.5, OMEGA);
    assert_the_same("CorrectPos", &client, &fresh);
}

#[test]
fn two_sensors_of_different_latency_are_never_refused_and_stay_consistent() {
    let mut random = Random(11);
    let c0 = blurred();
    let root = c0.cholesky().unwrap().l();
    let deviates = |random: &mut Random| Vector3::from_fn(|_, _| random.normal());
    // The truth goes the same way without ever being corrected.
    let mut truth = Base::at(Pose::default(), &Matrix3::zeros(), noise());
    let mut base = Base::at(pose(root * deviates(&mut random)), &c0, noise());
    let mut past = Vec::new();
    let (mut distances, mut fixes) = (0.0, 0.0);
    for k in 0..60_000_usize {
        let t = k as f64 * 1e-3;
        let (v, omega) = (0.4 + 0.1 * (0.3 * t).sin(), 0.15 + 0.8 * (0.21 * t).sin());
        truth.drive(1, v, omega);
        base.drive(1, v, omega);
        past.push(vector(&truth.estimate().pose));
        // A camera each 250 ms, 300 ms late; a beacon each 100 ms, 20 ms late.
        let (late, r) = match (k % 250, k % 100) {
            (0, _) => (300, sharp()),
            (_, 50) => (20, sharp() * 4.0),
            _ => continue,
        };
        let Some(then) = k.checked_sub(late) else {
            continue;
        };
        let z = past[then] + r.cholesky().unwrap().l() * deviates(&mut random);
        let observation = Observation::Pose {
            pose: pose(z),
            covariance: r,
        };
        // 25: a true one is that far off once in 60 000.
        let age = late as f32 * 1e-3;
        let distance = base.desk.observe(&observation, age, 25.0).unwrap();
        distances += f64::from(distance);
        fixes += 1.0;
        let c = wide(&base.estimate());
        assert!(smallest_eigenvalue(&c) > -1e-6, "{t}: {c}");
    }
    let (estimate, error) = (
        base.estimate(),
        vector(&base.estimate().pose) - past[past.len() - 1],
    );
    let nees = error.dot(&(wide(&estimate).try_inverse().unwrap() * error));
    println!(
        "{fixes} fixes: mean d² {:.3}, NEES {nees:.2}",
        distances / fixes
    );
    // Of 840 innovations with 3 degrees of freedom the mean is 3 ± 0.085; the odometry is better here than its noise says, so it may be less.
    assert!(
        (2.4..3.3).contains(&(distances / fixes)),
        "{}",
        distances / fixes
    );
    assert!(nees < 16.0, "{nees}");
}

/// A covariance with deviations of `low` to `high` and any correlations.
fn random_covariance(random: &mut Random, low: f64, high: f64) -> Matrix3<f64> {
    let mut deviation = || (random.between(low.ln(), high.ln())).exp();
    let d = Matrix3::from_diagonal(&Vector3::new(deviation(), deviation(), deviation()));
    let m = Matrix3::from_fn(|_, _| random.between(-1.0, 1.0)) + Matrix3::identity() * 0.3;
    let c = d * m * m.transpose() * d;
    (c + c.transpose()) * 0.5
}

#[test]
fn a_million_random_corrections_keep_c_symmetric_and_positive() {
    const SHARE: u32 = 125_000;
    std::thread::scope(|scope| {
        for seed in 0..8 {
            scope.spawn(move || correct_at_random(seed, SHARE));
        }
    });
}

/// Half of the seeds learn the gains.
fn correct_at_random(seed: u64, corrections: u32) {
    let learns = seed % 2 == 1;
    let mut random = Random(23 + seed);
    let mut base = if learns {
        let mut base = Base::new(noise());
        base.desk.learn(true);
        base
    } else {
        Base::at(Pose::default(), &blurred(), noise())
    };
    let (mut smallest, mut refused, mut absurd) = (0.0_f64, 0, 0);
    for n in 0..corrections {
        let (v, omega) = (random.between(-0.5, 0.5), random.between(-2.0, 2.0));
        for _ in 0..2 {
            base.hand_over();
            base.tick(20_000, v, omega);
        }
        let estimate = base.estimate();
        let c = wide(&estimate);
        assert_eq!(c, c.transpose(), "{seed} {n}");
        smallest = smallest.min(smallest_eigenvalue(&c));
        assert!(smallest >= -1e-6, "{seed} {n}: {smallest:.1e} {c}");
        assert!(
            vector(&estimate.pose).iter().all(|e| e.is_finite()),
            "{seed} {n}"
        );
        let r = random_covariance(&mut random, 1e-3, 0.3);
        // Gains that believed anything would soon be beyond reason.
        let likely = r.diagonal().map(|v| if learns { v.sqrt() } else { 0.1 });
        let nu = Vector3::from_fn(|i, _| random.between(-1.0, 1.0) * likely[i]);
        let age = if n % 2 == 0 {
            0.0
        } else {
            random.between(0.0, 1.5) as f32
        };
        let done = match n % 5 {
            0 | 1 => base
                .fix(pose(vector(&estimate.pose) + nu), r, age)
                .map(|_| ()),
            2 => {
                let read = base.desk.get_est_pos();
                let c = wide(&read);
                let gain = c * (c + r).try_inverse().unwrap();
                base.desk.correct_pos(nu, &gain)
            }
            _ => {
                let observation = Observation::Scalar {
                    innovation: nu.x,
                    variance: r.m11,
                    row: RowVector3::from_fn(|_, _| random.between(-1.0, 1.0)),
                };
                base.desk.observe(&observation, age, 0.0).map(|_| ())
            }
        };
        // What is older than the journey is refused, and rightly; and so are gains beyond reason, which is where late fixes of a place where it is now lead.
        let beyond_reason = Err(Refusal::Correction(CorrectionError::Gains));
        if learns && done == beyond_reason {
            absurd += 1;
        } else if let Err(refusal) = done
            && !matches!(refusal, Refusal::TooOld(_))
        {
            refused += 1;
            if refused < 4 {
                println!("{seed} {n}: {refusal:?} {c} {r}");
            }
        }
    }
    println!("seed {seed}: smallest eigenvalue {smallest:.1e}, {refused} refused, {absurd} absurd");
    // Every one of them was a proper observation.
    assert_eq!(refused, 0, "seed {seed}");
    assert!(absurd < corrections / 10, "seed {seed}: {absurd}");
    let learned = base.desk.calibration().gains != Calibration::NOMINAL;
    assert_eq!(learned, learns, "seed {seed}");
}

/// Somewhere else altogether.
fn new_place() -> Pose {
    pose(Vector3::new(10.0, 5.0, 1.0))
}

#[test]
fn a_reset_empties_the_past() {
    let z = pose(vector(&new_place()) + Vector3::new(0.08, -0.06, 0.05));
    let mut reset = underway(2000);
    reset.desk.reset_pos(new_place(), &blurred()).unwrap();
    reset.drive(2, 0.0, 0.0);
    // Of a second ago nothing is known any more.
    let refusal = reset.fix(z, sharp(), 1.0).unwrap_err();
    assert!(matches!(refusal, Refusal::TooOld(_)), "{refusal:?}");
    reset.fix(z, sharp(), 0.0).unwrap();
    reset.drive(10, 0.0, 0.0);
    let mut new = Base::at(new_place(), &blurred(), noise());
    new.drive(2, 0.0, 0.0);
    new.fix(z, sharp(), 0.0).unwrap();
    new.drive(10, 0.0, 0.0);
    assert_the_same("after a reset", &reset, &new);
}

#[test]
fn a_reset_empties_what_was_answered() {
    let mut base = underway(1000);
    base.desk.get_est_pos();
    base.desk.reset_pos(new_place(), &blurred()).unwrap();
    base.drive(2, 0.0, 0.0);
    let before = vector(&base.estimate().pose);
    let shift = Vector3::new(0.1, 0.2, 0.1);
    let gain = Matrix3::identity() * 0.5;
    base.desk.correct_pos(shift, &gain).unwrap();
    base.drive(1, 0.0, 0.0);
    let moved = vector(&base.estimate().pose) - before;
    // To the present, as nothing was answered since: exactly half, with no transport from where the vehicle was.
    assert!((moved - shift * 0.5).abs().max() < 1e-9, "{moved}");
}

#[test]
fn a_reset_that_is_carried_out_late_empties_the_past_as_well() {
    // The desk may live at a lower priority: snapshots from before the reset still come in after it was asked for.
    let mut base = underway(2000);
    base.desk.reset_pos(new_place(), &blurred()).unwrap();
    base.tick(1000, 0.0, 0.0);
    base.tick(1000, 0.0, 0.0);
    base.drive(40, 0.0, 0.0);
    let z = pose(vector(&new_place()) + Vector3::new(0.08, -0.06, 0.05));
    let refusal = base.fix(z, sharp(), 0.5).unwrap_err();
    assert!(matches!(refusal, Refusal::TooOld(_)), "{refusal:?}");
    base.fix(z, sharp(), 0.02).unwrap();
    base.drive(10, 0.0, 0.0);
    let mut new = Base::at(new_place(), &blurred(), noise());
    new.fix(z, sharp(), 0.0).unwrap();
    new.drive(10, 0.0, 0.0);
    assert_the_same("late reset", &base, &new);
}

#[test]
fn a_correction_that_is_carried_out_late_corrects_the_past_as_well() {
    // As above: a snapshot without the correction comes in after it was asked for, and must not be kept as if it had it.
    let drive = |ticks_between: u32| {
        let mut base = underway(2010);
        let z = elsewhere(&base);
        base.fix(z, sharp(), 0.0).unwrap();
        for _ in 0..ticks_between {
            base.tick(1000, 0.0, 0.0);
        }
        base.drive(100 - ticks_between, 0.0, 0.0);
        // A second sensor, of which the first one is news: it looks at the past just after the first correction was asked for.
        base.fix(z, sharp() * 4.0, 0.08).unwrap();
        base.drive(10, 0.0, 0.0);
        base
    };
    assert_the_same("late correction", &drive(40), &drive(0));
}
