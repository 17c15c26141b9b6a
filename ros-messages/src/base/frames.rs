//! The frames of REP 105. `odom` → `base_link` must be continuous, but the base's estimate leaps with a fix. So the estimate, which is `map` → `base_link`,
//! is split: estimate = (map → odom) ∘ (odom → base_link), always. While nothing corrects the estimate, odom → base_link moves as it does. Where a
//! correction may have, odom → base_link goes on by the speeds, and map → odom takes what is left.

use super::covariance::turned;
use std::f64::consts::{PI, TAU};

/// Beyond this times the greatest speed, a base has been moved by somebody else than its wheels: its estimate has leapt.
const LEAP_RATIO: f64 = 1.5;
/// And this much, m: the noise of speeds over a line.
const LEAP_FLOOR: f64 = 0.02;
/// Speeds tell where a base is for no longer than this, s: then the line was lost in between.
const PREDICTED: f64 = 0.2;

/// A pose in the plane: m, m, rad.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pose {
    /// m, forward of the frame.
    pub x: f64,
    /// m, to its left.
    pub y: f64,
    /// rad, counterclockwise, in (−π, π].
    pub theta: f64,
}

impl Pose {
    /// Of these numbers; θ is wrapped.
    pub fn new(x: f64, y: f64, theta: f64) -> Self {
        Self {
            x,
            y,
            theta: wrapped(theta),
        }
    }

    /// `self` ∘ `other`: `other`, which is seen from `self`, as seen from where `self` is.
    #[must_use]
    pub fn then(&self, other: &Self) -> Self {
        let (sin, cos) = self.theta.sin_cos();
        Self::new(
            self.x + cos * other.x - sin * other.y,
            self.y + sin * other.x + cos * other.y,
            self.theta + other.theta,
        )
    }

    /// The way back.
    #[must_use]
    pub fn inverse(&self) -> Self {
        let (sin, cos) = self.theta.sin_cos();
        Self::new(
            -cos * self.x - sin * self.y,
            sin * self.x - cos * self.y,
            -self.theta,
        )
    }

    /// What `dt` seconds of a constant twist lead to: an arc, by its chord.
    pub fn after(v: f64, omega: f64, dt: f64) -> Self {
        let turn = omega * dt;
        // sin(x)/x to 1e-9 where its quotient is not one.
        let half = turn / 2.0;
        let sinc = if half.abs() < 1e-4 {
            1.0 - half * half / 6.0
        } else {
            half.sin() / half
        };
        let chord = v * dt * sinc;
        Self::new(chord * half.cos(), chord * half.sin(), turn)
    }
}

/// An angle in (−π, π].
pub fn wrapped(angle: f64) -> f64 {
    let rest = angle.rem_euclid(TAU);
    if rest > PI { rest - TAU } else { rest }
}

/// What a telemetry line says of the motion.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Reading {
    /// The base's time, s.
    pub time: f64,
    /// Its estimate, in the frame of the map.
    pub estimate: Pose,
    /// Forward, m/s.
    pub v: f64,
    /// Counterclockwise, rad/s.
    pub omega: f64,
}

/// map → odom and odom → base_link.
#[derive(Clone, Debug)]
pub struct Frames {
    map_to_odom: Pose,
    odom: Pose,
    last: Option<Reading>,
    max_speed: f64,
    leaps: u64,
    /// The base has started anew since the last reading.
    anew: bool,
}

impl Frames {
    /// For a base that is never faster than this, m/s.
    pub fn new(max_speed: f64) -> Self {
        Self {
            map_to_odom: Pose::default(),
            odom: Pose::default(),
            last: None,
            max_speed,
            leaps: 0,
            anew: false,
        }
    }

    /// The base is never faster than this, m/s.
    pub fn set_max_speed(&mut self, max_speed: f64) {
        self.max_speed = max_speed;
    }

    /// The base has started anew: what it believes now has nothing to do with what it believed.
    pub fn restart(&mut self) {
        self.anew = true;
    }

    /// A covariance of the estimate, by rows x, y, θ of the map, by those of odom.
    #[must_use]
    pub fn in_odom(&self, covariance: &[[f64; 3]; 3]) -> [[f64; 3]; 3] {
        // Where nothing has turned the frame, each digit stays as it is.
        if self.map_to_odom.theta == 0.0 {
            *covariance
        } else {
            turned(covariance, -self.map_to_odom.theta)
        }
    }

    /// Goes on to a reading. `corrected`: since the last one, the estimate may have been corrected.
    pub fn advance(&mut self, reading: Reading, corrected: bool) {
        let anew = std::mem::take(&mut self.anew);
        let Some(last) = self.last.replace(reading) else {
            self.odom = self.map_to_odom.inverse().then(&reading.estimate);
            return;
        };
        let dt = if anew { -1.0 } else { reading.time - last.time };
        let moved = last.estimate.inverse().then(&reading.estimate);
        let distance = moved.x.hypot(moved.y);
        // A clock that went back is that of a base that has started anew, at a pose that says nothing of the old one.
        let leapt = dt < 0.0 || distance > LEAP_RATIO * self.max_speed * dt + LEAP_FLOOR;
        if !corrected && !leapt {
            self.odom = self.map_to_odom.inverse().then(&reading.estimate);
            return;
        }
        self.leaps += u64::from(leapt && !corrected);
        let dt = dt.clamp(0.0, PREDICTED);
        let (v, omega) = (
            f64::midpoint(last.v, reading.v),
            f64::midpoint(last.omega, reading.omega),
        );
        self.odom = self.odom.then(&Pose::after(v, omega, dt));
        self.map_to_odom = reading.estimate.then(&self.odom.inverse());
    }

    /// odom → base_link.
    pub fn odom(&self) -> Pose {
        self.odom
    }

    /// map → odom.
    pub fn map_to_odom(&self) -> Pose {
        self.map_to_odom
    }

    /// Leaps of the estimate that no correction of ours explains.
    pub fn leaps(&self) -> u64 {
        self.leaps
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(a: Pose, b: Pose, tolerance: f64) -> bool {
        (a.x - b.x).hypot(a.y - b.y) < tolerance && wrapped(a.theta - b.theta).abs() < tolerance
    }

    /// A drive along an arc, at 50 Hz; every `every`-th line the estimate has been corrected by `by`, seen from the base.
    fn drive(every: usize, by: Pose) -> (Frames, Vec<(Pose, Pose, Pose)>) {
        let (v, omega) = (0.4, 0.7);
        let mut frames = Frames::new(0.7);
        let (mut estimate, mut seen) = (Pose::new(2.0, -1.0, 3.0), Vec::new());
        for line in 0..3000_usize {
            estimate = estimate.then(&Pose::after(v, omega, 0.02));
            let corrected = line % every == every - 1;
            if corrected {
                estimate = estimate.then(&by);
            }
            let reading = Reading {
                time: line as f64 * 0.02,
                estimate,
                v,
                omega,
            };
            frames.advance(reading, corrected);
            seen.push((estimate, frames.map_to_odom(), frames.odom()));
        }
        (frames, seen)
    }

    #[test]
    fn the_estimate_is_what_both_make_together() {
        for (estimate, map_to_odom, odom) in drive(25, Pose::new(0.3, -0.2, 0.5)).1 {
            assert!(near(map_to_odom.then(&odom), estimate, 1e-9));
        }
    }

    #[test]
    fn odom_goes_as_the_base_does_whatever_corrects_the_estimate() {
        let (frames, seen) = drive(25, Pose::new(0.3, -0.2, 0.5));
        assert_eq!(frames.leaps(), 0);
        let step = Pose::after(0.4, 0.7, 0.02);
        for pair in seen.windows(2) {
            let moved = pair[0].2.inverse().then(&pair[1].2);
            assert!(near(moved, step, 1e-9), "{moved:?}");
        }
    }

    #[test]
    fn without_corrections_odom_is_the_estimate() {
        for (estimate, map_to_odom, odom) in drive(usize::MAX, Pose::default()).1 {
            assert_eq!(map_to_odom, Pose::default());
            assert!(near(odom, estimate, 1e-12));
        }
    }

    #[test]
    fn a_base_that_starts_anew_leaves_odom_where_it_was() {
        let mut frames = Frames::new(0.7);
        let at = |time, x| Reading {
            time,
            estimate: Pose::new(x, 0.0, 0.0),
            ..Reading::default()
        };
        frames.advance(at(100.0, 5.0), false);
        frames.advance(at(0.5, 0.0), false);
        assert!(near(frames.odom(), Pose::new(5.0, 0.0, 0.0), 1e-12));
        assert!(near(frames.map_to_odom(), Pose::new(-5.0, 0.0, 0.0), 1e-12));
        assert_eq!(frames.leaps(), 1);
        // What it drives while the line is away, it has driven.
        frames.advance(at(2.5, 1.0), false);
        assert!(near(frames.odom(), Pose::new(6.0, 0.0, 0.0), 1e-12));
        // But not so far: it was carried.
        frames.advance(at(3.5, 9.0), false);
        assert_eq!(frames.leaps(), 2);
        assert!(near(frames.odom(), Pose::new(6.0, 0.0, 0.0), 1e-12));
        // Started anew so long ago that its clock shows more than it did.
        frames.restart();
        frames.advance(at(9.0, 8.9), false);
        assert!(near(frames.odom(), Pose::new(6.0, 0.0, 0.0), 1e-12));
    }

    #[test]
    fn poses_and_their_inverses_cancel() {
        let pose = Pose::new(1.0, 2.0, -2.5);
        assert!(near(pose.then(&pose.inverse()), Pose::default(), 1e-12));
        assert!(near(pose.inverse().then(&pose), Pose::default(), 1e-12));
        assert_eq!(Pose::new(0.0, 0.0, -PI).theta, PI);
        // A quarter of a circle of 1 m.
        let arc = Pose::after(PI / 2.0, PI / 2.0, 1.0);
        assert!(near(arc, Pose::new(1.0, 1.0, PI / 2.0), 1e-12), "{arc:?}");
    }
}
