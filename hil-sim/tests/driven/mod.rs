//! Logs of bases whose gains are known.
#![allow(dead_code, reason = "each test uses a part of it")]

use hil_sim::replay::{Log, Row};
use std::f64::consts::PI;
use std::fmt::Write;

/// Metres per count and wheel base of the robot `default`.
const COUNT: f64 = PI * 0.084 / 2796.8;
const BASE: f64 = 0.2;

/// The logs that are made here have no noise but that of whole counts, and wheels that may differ by much: 1° per metre, not the default's 0.2°.
pub const QUIET: [&str; 4] = [
    "noise_s=1e-8",
    "noise_drift=1e-4",
    "noise_rot=1e-4",
    "k_drift=1",
];

/// A log at 20 Hz of a base with these gains, k_r, k_l, k_b, whose wheels roll at the speeds that `speeds` has of the time, left first. The truth is
/// integrated in steps of 1 ms.
pub fn driven(gains: [f64; 3], seconds: u32, speeds: &dyn Fn(f64) -> [f64; 2]) -> Log {
    let [right, left, base] = gains;
    let (mut x, mut y, mut theta) = (0.0, 0.0, 0.0_f64);
    let (mut turned, mut last) = ([0.0; 2], [0_i64; 2]);
    let mut rows = Vec::new();
    for step in 0..=seconds * 1000 {
        let t = f64::from(step) * 1e-3;
        if step % 50 == 0 {
            let total = turned.map(|metres: f64| (metres / COUNT).floor() as i64);
            rows.push(Row {
                front: [0; 2],
                steer: None,
                t,
                counts: [total[0] - last[0], total[1] - last[1]],
                truth: Some([x, y, theta]),
            });
            last = total;
        }
        // What the counts say of either wheel, and what it truly rolls.
        let said = speeds(t + 5e-4).map(|speed| speed * 1e-3);
        turned = [turned[0] + said[0], turned[1] + said[1]];
        let rolled = [said[0] * left, said[1] * right];
        let half = 0.5 * (rolled[1] - rolled[0]) / (BASE * base);
        let ahead = 0.5 * (rolled[0] + rolled[1]);
        x += ahead * (theta + half).cos();
        y += ahead * (theta + half).sin();
        theta += 2.0 * half;
    }
    Log::new("driven".into(), rows).unwrap()
}

/// The path of theory section 6, in wheel speeds.
pub fn winding(t: f64) -> [f64; 2] {
    let (v, w) = (0.4 + 0.1 * (0.3 * t).sin(), 0.15 + 0.8 * (0.21 * t).sin());
    [v - 0.5 * BASE * w, v + 0.5 * BASE * w]
}

/// A log as its file has it.
pub fn file(log: &Log) -> String {
    let mut text = String::from("t,left,right,x,y,theta\n");
    for row in log.rows() {
        let ([left, right], [x, y, theta]) = (row.counts, row.truth.unwrap());
        writeln!(text, "{:.3},{left},{right},{x:.9},{y:.9},{theta:.9}", row.t).unwrap();
    }
    text
}
