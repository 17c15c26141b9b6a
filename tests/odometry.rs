//! Pose and covariance from wheel counts: the reference vectors, and kilometres against float64.

mod counts;

use counts::{BASE, COUNT, Odometry, geometry, noise, quantised};
use vehicle_controller::controller::estimator::Compound;
use vehicle_controller::controller::{Estimate, Pose};
use vehicle_controller::math::upper_triangle;
use vehicle_controller::vehicle::differential::Geometry;
use vehicle_controller::vehicle::{Calibration, Twist};

/// Rows of `vectors/pose_covariance.csv`: counts left and right, then pose and upper triangle after them.
fn rows() -> Vec<[f64; 11]> {
    include_str!("vectors/pose_covariance.csv")
        .lines()
        .filter(|line| !line.starts_with('#') && !line.starts_with("left"))
        .map(|line| {
            let mut row = [0.0; 11];
            assert_eq!(line.split(',').count(), row.len());
            for (value, word) in row.iter_mut().zip(line.split(',')) {
                *value = word.parse().unwrap();
            }
            row
        })
        .collect()
}

/// The largest errors of position (m), heading (rad) and covariance (of √(`C_ii` `C_jj`)) over the rows.
fn worst_of_the_rows() -> [f64; 3] {
    let rows = rows();
    assert_eq!(rows.len(), 400);
    let mut estimate = Estimate::certain(Pose::default());
    let mut worst = [0.0_f64; 3];
    for [left, right, x, y, theta, c @ ..] in rows {
        let increment = Twist {
            translation: (0.5 * COUNT * (right + left)) as f32,
            rotation: (COUNT * (right - left) / BASE) as f32,
        };
        let variation = Twist {
            translation: increment.translation.abs(),
            rotation: increment.rotation.abs(),
        };
        estimate.propagate(&Compound::arc(increment, variation), &noise());
        let pose = &estimate.pose;
        worst[0] = worst[0].max((pose.x - x).hypot(pose.y - y));
        worst[1] = worst[1].max((pose.theta - theta).abs());
        let [xx, _, _, yy, _, tt] = c;
        let scale = [xx * xx, xx * yy, xx * tt, yy * yy, yy * tt, tt * tt].map(f64::sqrt);
        for ((is, wanted), scale) in upper_triangle(&estimate.covariance)
            .iter()
            .zip(c)
            .zip(scale)
        {
            worst[2] = worst[2].max((*is - wanted).abs() / scale);
        }
    }
    println!("vectors: {worst:?}");
    worst
}

#[test]
fn the_pose_follows_the_vectors_to_a_micrometre_and_a_microradian() {
    // 400 rows of up to 6 mm, each rounded to f32: 400 × 6 mm × 1e-7 is 0.2 µm at worst, and nothing else is lost.
    let [position, heading, _] = worst_of_the_rows();
    assert!(position < 1e-6, "{position} m");
    assert!(heading < 1e-6, "{heading} rad");
}

#[test]
fn the_covariance_follows_the_vectors_to_a_ten_thousandth() {
    // In units of √(C_ii C_jj), as some covariances pass through zero. 400 additions in f32: 400 × 6e-8 is 2.4e-5.
    let [.., covariance] = worst_of_the_rows();
    assert!(covariance < 1e-4, "{covariance}");
}

/// Section 2 of the theory in float64, from totals of counts.
#[derive(Default)]
struct Reference {
    last: [i64; 2],
    x: f64,
    y: f64,
    theta: f64,
}

impl Reference {
    fn tick(&mut self, geometry: &Geometry, totals: [i64; 2]) {
        let left = geometry.per_count()[0] * (totals[0] - self.last[0]) as f64;
        let right = geometry.per_count()[1] * (totals[1] - self.last[1]) as f64;
        self.last = totals;
        let half = 0.5 * (right - left) / geometry.wheel_base();
        let sinc = if half.abs() < 1e-3 {
            1.0 - half * half / 6.0
        } else {
            half.sin() / half
        };
        let (sin, cos) = (self.theta + half).sin_cos();
        self.x += 0.5 * (right + left) * sinc * cos;
        self.y += 0.5 * (right + left) * sinc * sin;
        // Not accumulated: ten million roundings of a large angle would be seen.
        self.theta = (geometry.per_count()[1] * totals[1] as f64
            - geometry.per_count()[0] * totals[0] as f64)
            / geometry.wheel_base();
    }
}

/// 10 km at 1 m/s and 1 kHz, after a turn in place by `heading`; `bend(t)` is the yaw rate. The largest errors, m and rad, looked at every 10 m.
fn ten_kilometres(geometry: Geometry, heading: f64, bend: impl Fn(f64) -> f64) -> [f64; 2] {
    const DT: f64 = 1e-3;
    let mut odometry = Odometry::new(geometry, noise());
    let mut reference = Reference::default();
    let mut worst = [0.0_f64; 2];
    // Metres that the wheels have rolled.
    let mut rolled = [0.0_f64; 2];
    let turn = 1000;
    for k in 0..turn + 10_000_000 {
        let (v, omega) = if k < turn {
            (0.0, heading / (f64::from(turn) * DT))
        } else {
            (1.0, bend(f64::from(k - turn) * DT))
        };
        rolled[0] += DT * (v - 0.5 * omega * geometry.wheel_base());
        rolled[1] += DT * (v + 0.5 * omega * geometry.wheel_base());
        let totals = [
            quantised(rolled[0] / geometry.per_count()[0], 0.2),
            quantised(rolled[1] / geometry.per_count()[1], 0.7),
        ];
        odometry.tick(totals, DT as f32);
        reference.tick(&geometry, totals);
        if k % 10_000 == 0 || k == turn + 9_999_999 {
            let pose = odometry.estimator.present().pose;
            let distance = (pose.x - reference.x).hypot(pose.y - reference.y);
            worst[0] = worst[0].max(distance);
            worst[1] = worst[1].max((pose.theta - reference.theta).abs());
        }
    }
    assert!(rolled[0] + rolled[1] > 19_999.0, "{rolled:?}");
    worst
}

/// Wheels of 84.00 mm and 84.07 mm, neither of which is a round number of anything.
fn unequal() -> Geometry {
    Geometry::new(0.2013, COUNT, COUNT * 1.000_871_3, Calibration::NOMINAL)
}

/// 5 mm in 10 km is 5e-7: the theory allows 1.5 mm for f32 sines of an angle that is reduced in f64; an f32 heading near π and an f32 step add
/// 1.2e-7 and 6e-8 of the way, in the same direction for as long as the heading stays. The heading itself is a sum without loss.
fn assert_close(name: &str, [position, heading]: [f64; 2]) {
    println!("10 km, {name}: {:.3} mm, {heading:.1e} rad", position * 1e3);
    assert!(position < 5e-3, "{name}: {position} m");
    assert!(heading < 1e-6, "{name}: {heading} rad");
}

#[test]
fn ten_kilometres_with_a_gently_curving_heading_are_within_5_mm_of_float64() {
    let worst = ten_kilometres(geometry(), 0.0, |t| 0.03 * (0.011 * t).sin());
    assert_close("curving", worst);
}

#[test]
fn ten_kilometres_curving_on_unequal_wheels_are_within_5_mm_of_float64() {
    let worst = ten_kilometres(unequal(), 1.0, |t| 0.02 + 0.03 * (0.007 * t).sin());
    assert_close("curving, unequal wheels", worst);
}

#[test]
fn ten_kilometres_straight_at_awkward_headings_are_within_5_mm_of_float64() {
    for heading in [0.7312, 1.9, -2.2, 2.94] {
        let worst = ten_kilometres(geometry(), heading, |_| 0.0);
        assert_close(&format!("straight at {heading} rad"), worst);
    }
}

#[test]
fn ten_kilometres_straight_on_unequal_wheels_are_within_5_mm_of_float64() {
    for heading in [1.234, -2.7] {
        let worst = ten_kilometres(unequal(), heading, |_| 0.0);
        assert_close(&format!("unequal, straight at {heading} rad"), worst);
    }
}
