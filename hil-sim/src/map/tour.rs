//! A tour of twelve places in a building, twice around: is a place that is found again ever excluded, and what is the first one's landmark worth?

use super::walker::{Walker, wrap};
use crate::robot::Robot;
use crate::se2::Pose;
use anyhow::{Result, bail, ensure};
use vehicle_controller::map::{Answer, Cylinder, PlaceId};
use vehicle_controller::params::{Id, Params};

/// How many places.
pub const PLACES: usize = 12;
/// The meadow of each, m.
const MEADOW: f64 = 0.3;

/// Of places that are found again, so many besides the first one are told by their landmarks.
const TOLD: f64 = 0.6;

/// What a tour has shown.
#[derive(Clone, Debug, Default)]
pub struct Tour {
    /// Places that were found again: by the ways driven since a landmark was seen last.
    pub found: [u32; PLACES],
    /// Of these, those that the map had excluded.
    pub false_no: u32,
    /// Places that the base was asked for when it was at another one, and those of them that were excluded.
    pub elsewhere: [u32; 2],
    /// The circles of the places as seen from the first one, m: before its landmark was seen again, and after that.
    pub circles: [Vec<f64>; 2],
    /// Of two landmarks that are alike, one was in sight: it was told which, or it may have been either.
    pub alike: [u32; 2],
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
        // The same landmark twice: the place across the courtyard has one like it.
        for name in [alone(index), alike(index)] {
            let added = base.sight(&name, landmark)?;
            ensure!(matches!(added, Answer::Added(_)), "{added:?}");
        }
    }
    let mut ways = PLACES;
    for index in 0..PLACES {
        let [x, y, _] = frames[index];
        let inside = near(&mut base, [x, y], 0.0, 0.5 * MEADOW);
        base.go(inside, 0.12);
        tour.look(&mut base, &frames, index, ways)?;
        ways += 1;
        if index > 0 && base.between(0.0, 1.0) > TOLD {
            continue;
        }
        let before = circles(&base);
        let told = base.sight(&alike(index), landmarks[index])?;
        match told {
            Answer::Confirmed(..) => tour.alike[0] += 1,
            _ => tour.alike[1] += 1,
        }
        for told in [told, base.sight(&alone(index), landmarks[index])?] {
            match told {
                Answer::Confirmed(place, _) => {
                    let name = base.atlas.map().place(place).map(|place| place.name);
                    ensure!(name.is_some_and(|name| *name == *format!("p{index}")));
                }
                Answer::Unsure(2) => {}
                other => bail!("p{index}: {other:?}"),
            }
        }
        ways = 1;
        if index == 0 {
            tour.circles = [before, circles(&base)];
        }
    }
    tour.check(&base, &frames);
    Ok(tour)
}

/// A landmark that only this place has.
fn alone(index: usize) -> String {
    format!("l{index}")
}

/// One that another place has, too.
fn alike(index: usize) -> String {
    format!("k{}", index % (PLACES / 2))
}

/// The radii of the places' circles as seen from the first one.
fn circles(base: &Walker) -> Vec<f64> {
    let map = base.atlas.map();
    let ids: Vec<PlaceId> = map.places().map(|(id, _)| id).collect();
    let radius = |id: &PlaceId| map.relation(ids[0], *id).map(|bound| bound.disc.radius);
    ids[1..].iter().filter_map(radius).collect()
}

impl Tour {
    /// Asks for every place; the base is at one of them, so many ways after it was told where it was.
    fn look(&mut self, base: &mut Walker, frames: &[Pose], at: usize, ways: usize) -> Result<()> {
        let here = base.pose();
        for (index, frame) in frames.iter().enumerate() {
            let there = base.am_i_there(&format!("p{index}"))?;
            let [x, y, _] = between(*frame, here);
            if x.hypot(y) <= MEADOW {
                self.found[ways - 1] += u32::from(index == at);
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
