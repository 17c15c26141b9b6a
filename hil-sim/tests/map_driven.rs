//! Tours through protocol lines, on simulated motors, wheels and encoders: a driver who sees the world drives, the base has nothing but its odometry.

mod bench;

use bench::Bench;
use hil_sim::map::landmarks::Landmarks;
use hil_sim::map::sketch::Sketch;
use hil_sim::map::tour::{between, holds};
use hil_sim::map::walker::wrap;
use hil_sim::random::Random;
use rayon::prelude::*;
use std::f64::consts::TAU;
use vehicle_controller::map::{Heading, PlaceId};

/// Places on a circle of this radius, m, and so many.
const RADIUS: f64 = 6.0;
const PLACES: usize = 12;
/// 500 have been driven, too: 80 s on two cores.
const TOURS: u64 = 100;
/// Meadows, m, and how near the driver comes.
const MEADOW: f64 = 0.3;
const NEAR: f64 = 0.1;

/// What was said of the places where the base was, and of those where it was not.
#[derive(Default)]
struct Said {
    found: u32,
    false_no: u32,
    elsewhere: u32,
    excluded: u32,
    /// Landmarks that told where the base was.
    told: u32,
    /// The circles of the places as seen from the first one, m: before its landmark was seen again, and after that.
    circles: [Vec<f64>; 2],
}

struct Driver {
    bench: Bench,
    landmarks: Landmarks,
}

impl Driver {
    fn pose(&self) -> [f64; 3] {
        let truth = self.bench.truth();
        [truth.x, truth.y, truth.heading.to_radians()]
    }

    /// Drives to a point: the base is told where it is, which changes its estimate and not its map.
    fn go(&mut self, [x, y]: [f64; 2]) {
        for _ in 0..6 {
            let [here_x, here_y, theta] = self.pose();
            if (x - here_x).hypot(y - here_y) < NEAR {
                return;
            }
            self.ok(&format!(
                "ResetPos {here_x:.6} {here_y:.6} {:.6}",
                wrap(theta).to_degrees()
            ));
            self.ok(&format!("GoTo {x:.4} {y:.4}"));
            self.bench.wait_for("! path done", 60.0);
        }
        panic!("it does not get there");
    }

    fn ask(&mut self, line: &str) -> String {
        self.bench.send(&format!("@7 {line}"));
        self.bench.wait_for("@7 ", 2.0)
    }

    fn ok(&mut self, line: &str) {
        assert_eq!(self.ask(line), "OK", "{line}");
    }

    fn sight(&mut self, name: &str) -> String {
        let pose = self.pose();
        let line = self.landmarks.sight(name, pose, 1.0, 0.02).unwrap();
        self.ask(&line)
    }

    /// The map as the base tells it.
    fn sketch(&mut self) -> Sketch {
        let from = self.bench.lines.len();
        self.bench.send("GetMap");
        // 60 rows at 115 200 baud.
        self.bench.run(1.0);
        let lines = self.bench.lines[from..].iter().map(|(_, line)| &**line);
        Sketch::all(lines).unwrap().remove(0)
    }

    /// The radii of the places' circles as seen from the first one.
    fn circles(&mut self) -> Vec<f64> {
        let circles = self.sketch().circles();
        let others = circles.iter().filter(|(name, ..)| name != "p0");
        others.map(|(_, disc, _)| disc.radius).collect()
    }

    /// Asks for every place; the base is at one of them.
    fn look(&mut self, frames: &[[f64; 3]], said: &mut Said) {
        let [x, y, _] = self.pose();
        for (index, frame) in frames.iter().enumerate() {
            let reply = self.ask(&format!("AmIThere p{index}"));
            let is_no = reply.starts_with(&format!("AmIThere p{index} no "));
            if (frame[0] - x).hypot(frame[1] - y) <= MEADOW {
                said.found += 1;
                said.false_no += u32::from(is_no);
            } else {
                said.elsewhere += 1;
                said.excluded += u32::from(is_no);
            }
        }
    }
}

fn tour(seed: u64) -> Said {
    let mut said = Said::default();
    let mut random = Random::new(seed, 9);
    let mut driver = Driver {
        bench: Bench::new("uncalibrated", seed),
        landmarks: Landmarks::new(seed),
    };
    driver.ok("SetParam move_speed 0.5");
    let mut frames = Vec::new();
    for index in 0..PLACES {
        let angle = TAU * index as f64 / PLACES as f64;
        if index > 0 {
            let away = RADIUS + random.fraction();
            driver.go([RADIUS - away * angle.cos(), -away * angle.sin()]);
        }
        let [x, y, theta] = driver.pose();
        frames.push([x, y, theta]);
        assert_eq!(
            driver.ask(&format!("Mark p{index} {MEADOW}")),
            format!("Marked p{index}")
        );
        let (direction, range) = (TAU * random.fraction(), 3.0 + 3.0 * random.fraction());
        let (name, place) = (
            format!("l{index}"),
            [x + range * direction.cos(), y + range * direction.sin()],
        );
        driver.landmarks.place(&name, place);
        assert_eq!(driver.sight(&name), format!("Added p{index}"));
        if random.fraction() < 0.3 {
            // A turn that leads nowhere.
            driver.ok("t 360");
            driver.bench.wait_for("! turn done", 20.0);
        }
    }
    for (index, [x, y, _]) in frames.clone().into_iter().enumerate() {
        driver.go([x, y]);
        driver.look(&frames, &mut said);
        // The first one after the whole round; of the others, every second.
        if index == 0 || random.fraction() < 0.5 {
            if index == 0 {
                said.circles[0] = driver.circles();
            }
            let reply = driver.sight(&format!("l{index}"));
            assert!(
                reply.starts_with(&format!("Confirmed p{index} ")),
                "seed {seed}: {reply}"
            );
            said.told += 1;
            if index == 0 {
                said.circles[1] = driver.circles();
            }
        }
    }
    check(&driver.sketch(), &frames);
    said
}

/// Every arc bounds the truth. A row has four decimals of a metre and three of a degree.
fn check(sketch: &Sketch, frames: &[[f64; 3]]) {
    let map = sketch.map();
    let pose = |id: PlaceId| frames[map.places().position(|(known, _)| known == id).unwrap()];
    for arc in map.arcs() {
        let truth = between(pose(arc.from), pose(arc.to));
        let mut bound = arc.bound;
        bound.disc.radius += 3e-4;
        if !bound.heading.is_any() {
            bound.heading = Heading::new(bound.heading.centre(), bound.heading.half() + 3e-5);
        }
        assert!(holds(&bound, truth), "{bound:?} {truth:?}");
    }
}

#[test]
fn every_place_that_is_found_again_may_be_the_one() {
    let tours: Vec<Said> = (1..=TOURS).into_par_iter().map(tour).collect();
    let sum = |of: fn(&Said) -> u32| tours.iter().map(of).sum::<u32>();
    let circles = |which: usize| -> Vec<f64> {
        let mut all: Vec<f64> = tours
            .iter()
            .flat_map(|said| said.circles[which].clone())
            .collect();
        all.sort_by(f64::total_cmp);
        all
    };
    let [before, after] = [0, 1].map(|which| {
        let all = circles(which);
        assert_eq!(all.len(), TOURS as usize * (PLACES - 1));
        all[all.len() / 2]
    });
    println!("median circle {before:.2} m before, {after:.2} m after");
    println!(
        "found {}, false no {}, elsewhere {} of which excluded {}, told {}",
        sum(|said| said.found),
        sum(|said| said.false_no),
        sum(|said| said.elsewhere),
        sum(|said| said.excluded),
        sum(|said| said.told),
    );
    assert!(sum(|said| said.found) >= TOURS as u32 * PLACES as u32);
    assert_eq!(sum(|said| said.false_no), 0);
    assert!(after <= 0.5 * before, "{before} {after}");
    assert!(sum(|said| said.excluded) > sum(|said| said.elsewhere) / 4);
}
