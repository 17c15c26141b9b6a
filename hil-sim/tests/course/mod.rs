//! A path as it was planned, to hold a drive against.
#![allow(dead_code, reason = "each test uses a part of it")]

use hil_sim::random::Random;
use hil_sim::rig::PERIOD;
use hil_sim::robot::Robot;
use std::f64::consts::PI;
use vehicle_controller::controller::Pose;
use vehicle_controller::params::DEGREES;
use vehicle_controller::trajectory::{Corner, Leg, Passage, Path, Posture, Settings};

/// Postures in a queue.
pub const POSTURES: usize = 32;

/// The path that a robot plans from the origin through some postures.
pub struct Course {
    /// What was asked for.
    pub postures: Vec<Posture>,
    /// What was made of it.
    pub legs: Vec<Leg>,
    /// Points of it, 2 mm apart where it is curved.
    points: Vec<[f64; 2]>,
    /// Where the last pose was.
    at: usize,
}

/// How a robot drives its paths.
pub fn settings(robot: &Robot) -> Settings {
    robot.params.trajectory(PERIOD)
}

impl Course {
    /// Plans, as the robot does when it is told to start.
    pub fn plan(robot: &Robot, postures: &[Posture]) -> Self {
        let settings = settings(robot);
        let mut path = Path::<POSTURES>::default();
        for posture in postures {
            path.push(posture).unwrap();
        }
        let start = Pose::default();
        path.plan(&start, settings.corner, &settings.limits)
            .unwrap();
        let legs: Vec<Leg> = path.legs().collect();
        Self {
            postures: postures.to_vec(),
            points: points(&start, &legs),
            legs,
            at: 0,
        }
    }

    /// Distance of a point from the path, m. It is looked for near where the last one was: a path may cross itself.
    pub fn off(&mut self, x: f64, y: f64) -> f64 {
        const AHEAD: f64 = 0.08;
        let mut best = (f64::INFINITY, self.at);
        // From the point to where the segment begins.
        let mut way = 0.0_f64;
        for (i, ends) in self.points.windows(2).enumerate().skip(self.at) {
            if way > AHEAD + best.0.min(1.0) {
                break;
            }
            let off = distance([x, y], ends[0], ends[1]);
            if off < best.0 {
                best = (off, i);
            }
            way = (ends[1][0] - x).hypot(ends[1][1] - y);
        }
        self.at = best.1;
        best.0
    }

    /// The heading in which it ends, rad.
    pub fn last_heading(&self) -> f64 {
        let leg = self.legs.last().unwrap();
        let asked = self.postures.last().unwrap().heading;
        f64::from(asked.unwrap_or(leg.heading))
    }
}

/// The line that appends a posture.
pub fn follow(posture: &Posture) -> String {
    let heading = posture.heading.map_or("-".to_owned(), |theta| {
        format!("{}", f64::from(theta) * DEGREES)
    });
    let speed = posture.speed.map_or(String::new(), |v| format!(" {v}"));
    format!("Follow {} {} {heading}{speed}", posture.x, posture.y)
}

/// A posture with nothing but its place.
pub fn place(x: f64, y: f64) -> Posture {
    Posture {
        x,
        y,
        heading: None,
        speed: None,
    }
}

/// Up to 8 legs from 5 cm to `longest` (m), any corners between them; a tenth of the postures has a heading, a third a speed.
pub fn polyline(random: &mut Random, longest: f64) -> Vec<Posture> {
    let mut between = |low: f64, high: f64| low + (high - low) * random.fraction();
    let (mut x, mut y, mut heading) = (0.0, 0.0, between(-PI, PI));
    let count = between(1.0, 9.0) as usize;
    let mut postures = Vec::new();
    for _ in 0..count {
        let length = between(0.05, longest);
        x += length * heading.cos();
        y += length * heading.sin();
        heading += between(-PI, PI) * between(0.0, 1.0);
        postures.push(Posture {
            x,
            y,
            heading: (between(0.0, 1.0) < 0.1).then(|| between(-PI, PI) as f32),
            speed: (between(0.0, 1.0) < 0.3).then(|| between(0.1, 0.5) as f32),
        });
    }
    postures
}

/// A figure eight in so many postures a lap, from its crossing: Gerono's lemniscate, x = a sin τ, y = a sin τ cos τ, 2a wide.
pub fn figure_eight(a: f64, laps: u32, postures: u32) -> Vec<Posture> {
    (1..=laps * postures)
        .map(|k| {
            let (sin, cos) = (2.0 * PI * f64::from(k) / f64::from(postures)).sin_cos();
            place(a * sin, a * sin * cos)
        })
        .collect()
}

fn points(start: &Pose, legs: &[Leg]) -> Vec<[f64; 2]> {
    let mut points = vec![[start.x, start.y]];
    let mut before: Option<Corner> = None;
    for leg in legs {
        let heading = f64::from(leg.heading);
        let along = |lead: f64| {
            [
                leg.to.x - lead * heading.cos(),
                leg.to.y - lead * heading.sin(),
            ]
        };
        if let Some(corner) = before {
            points.push(along(f64::from(leg.length - corner.lead)));
        }
        before = None;
        match leg.end {
            Passage::Stop(_) => points.push(along(0.0)),
            Passage::Rounded(corner) => {
                points.push(along(f64::from(corner.lead)));
                round(&mut points, heading, &corner);
                before = Some(corner);
            }
        }
    }
    points
}

/// The clothoid, arc and clothoid of a corner: the integral of what its turn does at its speed.
fn round(points: &mut Vec<[f64; 2]>, heading: f64, corner: &Corner) {
    let (v, w) = (f64::from(corner.speed), f64::from(corner.turn_speed));
    let (a, d) = (f64::from(corner.turn_acceleration), f64::from(corner.angle));
    if w == 0.0 {
        return;
    }
    let ramp = w / a;
    let duration = d.abs() / w + ramp;
    let angle = |t: f64| {
        let turned = if t < ramp {
            0.5 * a * t * t
        } else if t < duration - ramp {
            w * (t - 0.5 * ramp)
        } else {
            d.abs() - 0.5 * a * (duration - t) * (duration - t)
        };
        heading + d.signum() * turned
    };
    let steps = (duration * v / 2e-3).ceil();
    let dt = duration / steps;
    let mut at = *points.last().unwrap();
    for k in 0..steps as usize {
        let middle = angle((k as f64 + 0.5) * dt);
        at = [at[0] + v * dt * middle.cos(), at[1] + v * dt * middle.sin()];
        points.push(at);
    }
}

fn distance(p: [f64; 2], a: [f64; 2], b: [f64; 2]) -> f64 {
    let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
    let square = dx * dx + dy * dy;
    let along = if square > 0.0 {
        (((p[0] - a[0]) * dx + (p[1] - a[1]) * dy) / square).clamp(0.0, 1.0)
    } else {
        0.0
    };
    (p[0] - a[0] - along * dx).hypot(p[1] - a[1] - along * dy)
}
