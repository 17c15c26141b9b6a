//! True motions and poses in float64, and whether the map's bounds hold them.
#![allow(dead_code, reason = "each test file uses a part of it")]

use crate::common::Random;
use std::f64::consts::{PI, TAU};
use vehicle_controller::map::{Cylinder, Disc, Heading, Motion};

/// Roundings of float64, relative.
const EXACT: f64 = 1e-12;

/// A pose, m and rad, as seen from another.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Pose {
    pub(crate) x: f64,
    pub(crate) y: f64,
    pub(crate) theta: f64,
}

impl Pose {
    /// After a turn and a straight run.
    pub(crate) fn after(self, [turn, run]: [f64; 2]) -> Self {
        let theta = self.theta + turn;
        Self {
            x: self.x + run * theta.cos(),
            y: self.y + run * theta.sin(),
            theta,
        }
    }

    /// What is seen from here as `other`, in the frame that this is seen from.
    pub(crate) fn then(self, other: Self) -> Self {
        let (sin, cos) = self.theta.sin_cos();
        Self {
            x: self.x + cos * other.x - sin * other.y,
            y: self.y + sin * other.x + cos * other.y,
            theta: self.theta + other.theta,
        }
    }

    /// The frame as seen from here.
    pub(crate) fn inverse(self) -> Self {
        let (sin, cos) = self.theta.sin_cos();
        Self {
            x: -(cos * self.x + sin * self.y),
            y: -(cos * self.y - sin * self.x),
            theta: -self.theta,
        }
    }
}

/// By how much an angle is off, in ±π.
pub(crate) fn off(angle: f64) -> f64 {
    angle - TAU * (angle / TAU).round()
}

/// The distance of a point from the centre of the disc, in units of its radius.
pub(crate) fn share(disc: &Disc, x: f64, y: f64) -> f64 {
    let [dx, dy] = [x - disc.x, y - disc.y];
    dx.hypot(dy) / disc.radius
}

/// True if the disc holds the point, but for what float64 rounds.
pub(crate) fn covers(disc: &Disc, x: f64, y: f64) -> bool {
    let [cx, cy, radius] = [disc.x, disc.y, disc.radius];
    let rounding = EXACT * (cx.hypot(cy) + radius);
    (x - cx).hypot(y - cy) <= radius + rounding
}

/// True if the interval holds the heading.
pub(crate) fn admits(heading: Heading, theta: f64) -> bool {
    heading.is_any() || off(theta - heading.centre()).abs() <= heading.half() + EXACT
}

/// True if the cylinder holds the pose.
pub(crate) fn holds(bound: &Cylinder, pose: Pose) -> bool {
    covers(&bound.disc, pose.x, pose.y) && admits(bound.heading, pose.theta)
}

/// One of the two ends, or anything between, or the middle.
pub(crate) fn within(random: &mut Random, low: f64, high: f64) -> f64 {
    match random.below(5) {
        0 => low,
        1 => high,
        2 => 0.5 * (low + high),
        _ => random.between(low, high),
    }
}

/// A motion that these bounds admit: the turn and the run.
pub(crate) fn sample(random: &mut Random, motion: &Motion) -> [f64; 2] {
    let [turn, bound] = [motion.turn, motion.turn_bound];
    let [nearest, farthest] = [motion.nearest, motion.farthest];
    [
        turn + within(random, -bound, bound),
        within(random, nearest, farthest),
    ]
}

/// Any motion whatever: forwards, backwards, of unsure sign, none at all; well or hardly known.
pub(crate) fn any_motion(random: &mut Random) -> Motion {
    let bound = match random.below(8) {
        0 => 0.0,
        1 => random.between(0.2, 1.5),
        2 => random.between(1.5, 1.65),
        3 => random.between(1.6, 4.0),
        _ => random.between(0.0, 0.2),
    };
    let length = 10_f64.powf(random.between(-2.0, 2.0));
    let spread = match random.below(4) {
        0 => 0.0,
        1 => random.between(0.0, 1.5),
        _ => random.between(0.0, 0.1),
    };
    let length = match random.below(8) {
        0 => 0.0,
        1 | 2 => -length,
        _ => length,
    };
    let turns = if random.below(16) == 0 { 10.0 } else { 1.0 };
    let spread = spread * length.abs().max(0.05);
    Motion {
        turn: random.between(-PI * turns, PI * turns),
        turn_bound: bound,
        nearest: (length - spread),
        farthest: (length + spread),
    }
}

/// A motion as a base makes it in a building, with the paper's bounds: 5°, and 5 cm and a twentieth.
pub(crate) fn usual_motion(random: &mut Random) -> Motion {
    let length = random.between(0.3, 5.0);
    let spread = 0.05 + 0.05 * length;
    Motion {
        turn: random.between(-PI, PI),
        turn_bound: 5_f64.to_radians(),
        nearest: (length - spread),
        farthest: (length + spread),
    }
}

/// A disc of that radius that holds the point, anywhere but at its very edge.
pub(crate) fn disc_about(random: &mut Random, [x, y]: [f64; 2], radius: f64) -> Disc {
    let direction = random.between(-PI, PI);
    let away = within(random, 0.0, 0.999) * radius;
    Disc {
        x: (x + away * direction.cos()),
        y: (y + away * direction.sin()),
        radius: radius + 1e-9 * (1.0 + x.abs() + y.abs()),
    }
}

/// A bound of a pose: that radius, and that many radians either way.
pub(crate) fn bound_about(random: &mut Random, pose: Pose, radius: f64, half: f64) -> Cylinder {
    let off_centre = within(random, -0.999, 0.999) * half;
    Cylinder {
        disc: disc_about(random, [pose.x, pose.y], radius),
        heading: Heading::new(pose.theta + off_centre, half + 1e-9),
    }
}
