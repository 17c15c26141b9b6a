//! A tour of twelve places in a building, twice around: is a place that is found again ever excluded, and what is the first one's landmark worth?

use super::walker::{Walker, wrap};
use crate::robot::Robot;
use crate::se2::Pose;
use anyhow::{Result, ensure};
use vehicle_controller::map::{Answer, Cylinder, PlaceId};
use vehicle_controller::params::{Id, Params};

/// How many places.
pub const PLACES: usize = 12;
/// The meadow of each, m.
const MEADOW: f64 = 0.3;

/// What a tour has shown.
#[derive(Clone, Debug, Default)]
pub struct Tour {
    /// Places that were found again.
    pub found: u32,
    /// Of these, those that the map had excluded.
    pub false_no: u32,
    /// Places that the base was asked for when it was at another one, and those of them that were excluded.
    pub elsewhere: [u32; 2],
    /// The circles of the places as seen from the first one, m: before its landmark was seen again, and after that.
    pub circles: [Vec<f64>; 2],
    /// Bounds of arcs that do not hold what is true.
    pub broken: u32,
    /// Arcs at the end.
    pub arcs: usize,
}

/// The random part of what goes wrong, besides what is wrong of the robot: 5 mm and 0.1° in 5 m, 0.2° in a half turn.
///
/// # Panics
/// Never: they are within the parameters' ranges.
#[must_use]
pub fn noise(robot: &Robot) -> Params {
    let mut noise = robot.params;
    for (id, value) in [
        (Id::NoiseS, 5e-6),
        (Id::NoiseDrift, 0.002),
        (Id::NoiseRot, 0.0002),
    ] {
        noise.set(id, value).expect("it is within its range");
    }
    noise
}

/// The frame of one pose as seen from another.
#[must_use]
pub fn between(from: Pose, to: Pose) -> Pose {
    let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
    let (sin, cos) = from[2].sin_cos();
    [
        cos * dx + sin * dy,
        cos * dy - sin * dx,
        wrap(to[2] - from[2]),
    ]
}

/// True if a bound holds a pose.
#[must_use]
pub fn holds(bound: &Cylinder, [x, y, theta]: Pose) -> bool {
    let away = (x - bound.disc.x).hypot(y - bound.disc.y);
    let turned = wrap(theta - bound.heading.centre()).abs();
    away <= bound.disc.radius && (bound.heading.is_any() || turned <= bound.heading.half())
}

/// The robot with bounds that fit it. Its wheels make it turn 1.3 % less than it believes and run 0.6 % less, and drift by 0.23 °/m; the rest is for what is random.
///
/// # Panics
/// Never: they are within the parameters' ranges.
#[must_use]
pub fn bounded(robot: &Robot) -> Robot {
    let mut robot = robot.clone();
    for (id, value) in [
        (Id::BoundTurn, 3.5),
        (Id::BoundTurnPerM, 0.35),
        (Id::BoundDist, 0.03),
        (Id::BoundDistRel, 0.02),
    ] {
        robot.params.set(id, value).expect("it is within its range");
    }
    robot
}

/// Drives it.
///
/// # Errors
/// If the atlas refuses what it should not.
pub fn tour(robot: &Robot, seed: u64) -> Result<Tour> {
    let mut base = Walker::new(robot, &noise(robot), seed)?;
    let mut tour = Tour::default();
    // Rooms along the corridor around a courtyard of 21 m by 15 m, and a landmark some metres from each.
    let corridor = |index: usize| {
        let [x, y] = [[0.0, 0.0], [21.0, 0.0], [21.0, 15.0], [0.0, 15.0]][index / 3];
        let along = f64::from((index % 3) as u8) / 3.0;
        let [dx, dy] = [[21.0, 0.0], [0.0, 15.0], [-21.0, 0.0], [0.0, -15.0]][index / 3];
        [x + along * dx, y + along * dy]
    };
    let start = corridor(0);
    let near = |base: &mut Walker, [x, y]: [f64; 2], least: f64, most: f64| {
        let (angle, away) = (base.between(-3.15, 3.15), base.between(least, most));
        [x + away * angle.cos(), y + away * angle.sin()]
    };
    let mut frames: Vec<Pose> = Vec::new();
    let mut landmarks = Vec::new();
    for index in 0..PLACES {
        if index > 0 {
            let place = near(&mut base, corridor(index), 0.0, 2.0);
            base.go([place[0] - start[0], place[1] - start[1]], 1.0);
        }
        frames.push(base.pose());
        base.mark(&format!("p{index}"), MEADOW)?;
        let [x, y, _] = base.pose();
        let landmark = near(&mut base, [x, y], 5.0, 10.0);
        landmarks.push(landmark);
        let added = base.sight(&format!("l{index}"), landmark)?;
        ensure!(matches!(added, Answer::Added(_)), "{added:?}");
    }
    for index in 0..PLACES {
        let [x, y, _] = frames[index];
        let inside = near(&mut base, [x, y], 0.0, 0.5 * MEADOW);
        base.go(inside, 0.12);
        tour.look(&mut base, &frames, index)?;
        let before = circles(&base);
        let seen = base.sight(&format!("l{index}"), landmarks[index])?;
        ensure!(matches!(seen, Answer::Confirmed(..)), "p{index}: {seen:?}");
        if index == 0 {
            tour.circles = [before, circles(&base)];
        }
    }
    tour.check(&base, &frames);
    Ok(tour)
}

/// The radii of the places' circles as seen from the first one.
fn circles(base: &Walker) -> Vec<f64> {
    let map = base.atlas.map();
    let ids: Vec<PlaceId> = map.places().map(|(id, _)| id).collect();
    let radius = |id: &PlaceId| map.relation(ids[0], *id).map(|bound| bound.disc.radius);
    ids[1..].iter().filter_map(radius).collect()
}

impl Tour {
    /// Asks for every place; the base is at one of them.
    fn look(&mut self, base: &mut Walker, frames: &[Pose], at: usize) -> Result<()> {
        let here = base.pose();
        for (index, frame) in frames.iter().enumerate() {
            let there = base.am_i_there(&format!("p{index}"))?;
            let [x, y, _] = between(*frame, here);
            if x.hypot(y) <= MEADOW {
                self.found += u32::from(index == at);
                self.false_no += u32::from(!there.is_plausible);
            } else {
                self.elsewhere[0] += 1;
                self.elsewhere[1] += u32::from(!there.is_plausible);
            }
        }
        Ok(())
    }

    /// Holds every arc against the truth.
    fn check(&mut self, base: &Walker, frames: &[Pose]) {
        let map = base.atlas.map();
        let pose = |id: PlaceId| {
            let index = map.places().position(|(known, _)| known == id);
            frames[index.unwrap_or_default()]
        };
        for arc in map.arcs() {
            let truth = between(pose(arc.from), pose(arc.to));
            self.broken += u32::from(!holds(&arc.bound, truth));
        }
        self.arcs = map.arcs().len();
    }
}
