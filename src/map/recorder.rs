//! From what the base does to motions with bounds [B §4], whatever way it drives.

use super::real::{larger, sin_cos, smaller};
use super::{Cylinder, Disc, GRAIN, Heading, Leg, Motion, ROUNDING};
use core::f64::consts::{FRAC_PI_3, PI};
use heapless::Vec;

/// How wrong odometry may be. Of a turn in place the heading, and of a run the heading and the length; \[B\]'s example is ±5° and ±(5 + 0.05 d) cm.
///
/// A motion is a turn and the run after it, straight or curved, of up to 180° of turning to and fro in all: what it has turned is wrong by `turn` + `turn_per_metre` · d at
/// most, at any point of its way, and what it has run by `distance` + `distance_share` · d in all. An error of the heading comes with turning, at most as much as has
/// been turned, or with the way.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Bounds {
    /// rad, for each motion.
    pub turn: f64,
    /// rad/m.
    pub turn_per_metre: f64,
    /// m, for each motion.
    pub distance: f64,
    /// m/m.
    pub distance_share: f64,
}

impl Bounds {
    /// Of a base that is never wrong.
    const NONE: Self = Self {
        turn: 0.0,
        turn_per_metre: 0.0,
        distance: 0.0,
        distance_share: 0.0,
    };

    /// What holds if either does.
    fn wider(&self, other: &Self) -> Self {
        Self {
            turn: larger(self.turn, other.turn),
            turn_per_metre: larger(self.turn_per_metre, other.turn_per_metre),
            distance: larger(self.distance, other.distance),
            distance_share: larger(self.distance_share, other.distance_share),
        }
    }
}

/// A piece of a drive: at most some millimetres or a degree.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Step {
    /// ΔS, m.
    pub travelled: f64,
    /// Δα, rad.
    pub turned: f64,
    /// Total variation of S, m.
    pub path: f64,
    /// Total variation of α, rad.
    pub swing: f64,
}

/// The motions of a drive, each with its bound: `MOTIONS` of them at most, the oldest of more taken together.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Recorder<const MOTIONS: usize> {
    motions: Vec<Leg, MOTIONS>,
    open: Open,
}

/// The motion under way, as odometry has it.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Open {
    /// Where it has led, in the frame of its start, m.
    x: f64,
    y: f64,
    /// What it has turned, rad.
    heading: f64,
    /// Total variation of S while it turned in place, and since it runs, m.
    turning: f64,
    running: f64,
    /// ΔS since it runs, m.
    run: f64,
    /// Total variation of α while it turned in place, and since it runs, rad.
    pivot: f64,
    swing: f64,
    /// The headings since it runs, rad.
    lowest: f64,
    highest: f64,
    /// What (x, y) may be off by, because steps are taken for arcs, m.
    slack: f64,
    /// The widest of those that were given on its way.
    bounds: Bounds,
    /// There was a step.
    moved: bool,
}

impl Default for Open {
    fn default() -> Self {
        Self::NONE
    }
}

/// A step with less radius than 5 cm is a turn in place.
const PIVOT: f64 = 20.0;
/// A run of so many metres ends where the base turns in place, or goes back.
const RUN: f64 = 0.02;

impl<const MOTIONS: usize> Recorder<MOTIONS> {
    /// Nothing yet.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            motions: Vec::new(),
            open: Open::NONE,
        }
    }

    /// Takes a step in, which was not wrong by more than these bounds allow. A motion ends, and the next begins, where the base turns in place after a run, or
    /// turns its run back, or has turned a half turn in all.
    pub fn take(&mut self, step: &Step, bounds: &Bounds) {
        if self.open.ends_before(step) {
            let motion = self.open.bound();
            self.append(motion);
            self.open = Open::NONE;
        }
        self.open.take(step, bounds);
    }

    /// Adds a motion; the two oldest become one if there is no room.
    fn append(&mut self, motion: Leg) {
        if self.motions.is_full()
            && let [first, second, ..] = &mut *self.motions
        {
            *second = first.then(second);
            self.motions.remove(0);
        }
        let _ = self.motions.push(motion);
    }

    /// The bound of where the drive has led as seen from its start, and of that as seen from there: what both groupings of its motions have in common.
    #[must_use]
    #[inline(never)]
    pub fn bound(&self) -> Leg {
        let open = self.open.moved.then(|| self.open.bound());
        let motions = self.motions.iter().chain(&open);
        let left = motions.clone().copied().reduce(|all, next| all.then(&next));
        let right = motions.rev().copied().reduce(|all, one| one.then(&all));
        match (left, right) {
            (Some(left), Some(right)) => left.common(&right),
            _ => Leg::HERE,
        }
    }

    /// True if the base has not moved.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.motions.is_empty() && !self.open.moved
    }

    /// Goes on from here as another one.
    pub fn resume<const OTHER: usize>(&mut self, other: &Recorder<OTHER>) {
        self.motions.clear();
        self.go_on(other);
    }

    /// Begins anew with a motion that is known otherwise, and goes on from its end as another one.
    pub fn resume_after<const OTHER: usize>(&mut self, motion: &Leg, other: &Recorder<OTHER>) {
        self.motions.clear();
        self.append(*motion);
        self.go_on(other);
    }

    fn go_on<const OTHER: usize>(&mut self, other: &Recorder<OTHER>) {
        for motion in &other.motions {
            self.append(*motion);
        }
        self.open = other.open;
    }
}

impl Open {
    const NONE: Self = Self {
        x: 0.0,
        y: 0.0,
        heading: 0.0,
        turning: 0.0,
        running: 0.0,
        run: 0.0,
        pivot: 0.0,
        swing: 0.0,
        lowest: 0.0,
        highest: 0.0,
        slack: 0.0,
        bounds: Bounds::NONE,
        moved: false,
    };

    fn ends_before(&self, step: &Step) -> bool {
        let is_back = step.travelled * self.run < 0.0 && step.travelled.abs() > 0.1 * RUN;
        let is_over = is_pivot(step) || is_back;
        let has_turned = self.pivot + self.swing >= PI;
        self.running >= RUN && is_over || has_turned
    }

    fn take(&mut self, step: &Step, bounds: &Bounds) {
        let half = 0.5 * step.turned;
        // A step is small: sinc to the second order is good to 1e-9 for 10°.
        let chord = step.travelled * (1.0 - half * half / 6.0);
        let (sin, cos) = sin_cos(crate::math::wrap(self.heading + half));
        self.x += chord * cos;
        self.y += chord * sin;
        // The heading on the way is another than the arc's by no more than the whole swing.
        self.slack += step.path * step.swing;
        if is_pivot(step) {
            // What has run so far is too short to be a run.
            self.turning += self.running + step.path;
            self.pivot += self.swing + step.swing;
            (self.running, self.run, self.swing) = (0.0, 0.0, 0.0);
        } else {
            let aside = 0.5 * (step.swing - step.turned.abs());
            let ends = (self.heading, self.heading + step.turned);
            let lowest = smaller(ends.0, ends.1) - aside;
            let highest = larger(ends.0, ends.1) + aside;
            let is_first = self.running == 0.0;
            self.lowest = if is_first {
                lowest
            } else {
                smaller(self.lowest, lowest)
            };
            self.highest = if is_first {
                highest
            } else {
                larger(self.highest, highest)
            };
            self.running += step.path;
            self.run += step.travelled;
            self.swing += step.swing;
        }
        self.heading += step.turned;
        self.bounds = self.bounds.wider(bounds);
        self.moved = true;
    }

    /// The bound of the motion: the tighter discs of those that hold.
    fn bound(&self) -> Leg {
        let bounds = &self.bounds;
        let path = self.turning + self.running;
        let alpha = bounds.turn + bounds.turn_per_metre * path;
        let any = Leg::from(Cylinder {
            disc: self.along(path, alpha),
            heading: Heading::new(self.heading, alpha),
        });
        let Some([there, back]) = self.straight(alpha) else {
            return any;
        };
        Leg {
            there: Cylinder {
                disc: any.there.disc.tighter(&there),
                ..any.there
            },
            back: Cylinder {
                disc: any.back.disc.tighter(&back),
                ..any.back
            },
        }
    }

    /// Of any way of that length. With the heading wrong by e, |e| ≤ α, at each point of it,
    ///
    /// ```text
    ///     |∫ (exp(i(θ + e)) − cos α exp(iθ)) dS| ≤ L sin α
    /// ```
    ///
    /// for α < 90°, and what the length is wrong by adds to that, wherever it is. Beyond, all that is known is the length.
    fn along(&self, path: f64, alpha: f64) -> Disc {
        let bounds = &self.bounds;
        let wrong = bounds.distance + bounds.distance_share * path;
        let (sin, cos) = if alpha < core::f64::consts::FRAC_PI_2 {
            sin_cos(alpha)
        } else {
            (1.0, 0.0)
        };
        Disc {
            x: cos * self.x,
            y: cos * self.y,
            radius: path * sin + wrong + self.slack + ROUNDING * path + GRAIN,
        }
    }

    /// Of a run that is straight, or nearly, its end from the motion's beginning, and the reverse: the turn's direction, and the length of a chord. The headings
    /// of the run lie within β of one, so its chord is not shorter than its length times cos β, and its beginning is seen from its end within β of straight
    /// behind; what it turns on its way may be wrong by all of that, or by as much as a turn.
    fn straight(&self, alpha: f64) -> Option<[Disc; 2]> {
        let bounds = &self.bounds;
        let (middle, spread) = (
            0.5 * (self.lowest + self.highest),
            0.5 * (self.highest - self.lowest),
        );
        let beta = spread + bounds.turn_per_metre * self.running + smaller(self.swing, bounds.turn);
        if self.running == 0.0 || !(0.0..FRAC_PI_3).contains(&beta) {
            return None;
        }
        let (_, cos) = sin_cos(beta);
        let back = 0.5 * larger(self.running - self.run.abs(), 0.0);
        let ahead = self.run.abs() + back;
        let wrong = bounds.distance + bounds.distance_share * self.running;
        let near = ahead - wrong;
        let (near, far) = (if near > 0.0 { near * cos } else { near }, ahead + wrong);
        let (nearest, farthest) = if self.run < 0.0 {
            (-far, -near)
        } else {
            (near, far)
        };
        // What is no part of the run may have led anywhere.
        let aside = back + self.turning + bounds.distance_share * self.turning;
        let disc = |motion: &Motion| {
            let mut disc = Cylinder::of_motion(motion).ok()?.disc;
            disc.radius += aside;
            Some(disc)
        };
        let there = disc(&Motion {
            turn: middle,
            turn_bound: alpha + spread,
            nearest,
            farthest,
        })?;
        let behind = disc(&Motion {
            turn: middle - self.heading,
            turn_bound: beta,
            nearest: -farthest,
            farthest: -nearest,
        })?;
        Some([there, behind])
    }
}

fn is_pivot(step: &Step) -> bool {
    step.swing > PIVOT * step.path
}
