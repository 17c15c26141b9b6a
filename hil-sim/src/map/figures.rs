//! The counterparts of the figures of Brooks's paper, drawn by the library's own cylinders.

use crate::plot::{Chart, Ink, Mark};
use crate::random::Random;
use anyhow::{Result, anyhow};
use std::f64::consts::{FRAC_PI_2, TAU};
use vehicle_controller::map::{Cylinder, Disc, Heading, Journey, Leg, Motion};

/// ±5°, and ±5 cm for each metre and besides.
const TURN_BOUND: f64 = 5.0 / 360.0 * TAU;
/// Samples of a cloud.
const SAMPLES: u32 = 700;

/// A turn by some degrees and a run of some metres, with the paper's bounds.
fn motion(turn: f64, run: f64) -> Motion {
    let bound = 0.05 + 0.05 * run;
    Motion {
        turn: turn.to_radians(),
        turn_bound: TURN_BOUND,
        nearest: run - bound,
        farthest: run + bound,
    }
}

fn cylinder(motion: &Motion) -> Result<Cylinder> {
    Cylinder::of_motion(motion).map_err(|error| anyhow!("{error}"))
}

fn circle(disc: &Disc, ink: Ink) -> Mark {
    Mark::Circle([disc.x, disc.y], disc.radius, ink)
}

/// Where these motions may lead: each anywhere within its bounds, or at their edge.
fn sample(random: &mut Random, motions: &[Motion]) -> Vec<[f64; 2]> {
    let [mut x, mut y, mut theta] = [0.0; 3];
    let mut way = vec![[x, y]];
    for motion in motions {
        let mut within = |low: f64, high: f64| low + (high - low) * random.fraction();
        theta += motion.turn + within(-motion.turn_bound, motion.turn_bound);
        let run = within(motion.nearest, motion.farthest);
        x += run * theta.cos();
        y += run * theta.sin();
        way.push([x, y]);
    }
    way
}

/// Where they lead if nothing is wrong.
fn nominal(motions: &[Motion]) -> Vec<[f64; 2]> {
    let exact = motions.iter().map(|motion| Motion {
        turn_bound: 0.0,
        nearest: f64::midpoint(motion.nearest, motion.farthest),
        farthest: f64::midpoint(motion.nearest, motion.farthest),
        ..*motion
    });
    sample(&mut Random::new(0, 0), &exact.collect::<Vec<_>>())
}

/// The four panels.
///
/// # Errors
/// None: the motions are proper.
pub fn figures(seed: u64) -> Result<Vec<Chart>> {
    Ok(vec![
        metric(seed)?,
        relational()?,
        manifold(seed)?,
        square()?,
    ])
}

/// The drive of the paper's first two figures: A to E.
fn drive() -> [Motion; 4] {
    [
        motion(20.0, 3.0),
        motion(65.0, 2.2),
        motion(130.0, 2.6),
        motion(65.0, 2.5),
    ]
}

/// Figure 1: one set of measurements, several places where E may be.
fn metric(seed: u64) -> Result<Chart> {
    let motions = drive();
    let mut random = Random::new(seed, 1);
    let mut chart = Chart {
        title: "Figure 1: what was measured fits different places E".into(),
        has_axes: true,
        legend: vec![
            (Ink::Truth, "as measured".into()),
            (Ink::Frame, "as it may have been".into()),
            (Ink::Bound, "bound of E".into()),
        ],
        ..Chart::default()
    };
    for _ in 0..6 {
        chart
            .marks
            .push(Mark::Way(sample(&mut random, &motions), Ink::Frame));
    }
    let way = nominal(&motions);
    for (name, at) in ["A", "B", "C", "D", "E"].into_iter().zip(&way) {
        chart.marks.push(Mark::Name(*at, name.into()));
    }
    chart.marks.push(Mark::Way(way, Ink::Truth));
    let chain: Vec<_> = motions.iter().map(cylinder).collect::<Result<_>>()?;
    chart
        .marks
        .push(circle(&Cylinder::of_chain(&chain).disc, Ink::Bound));
    Ok(chart)
}

/// Figure 2: the graph, which says no more than what is known.
fn relational() -> Result<Chart> {
    let mut chart = Chart {
        title: "Figure 2: a graph says no more than is known".into(),
        legend: vec![(
            Ink::Truth,
            "an arc: d ± r, η ± α of the cylinder (its place here means nothing)".into(),
        )],
        ..Chart::default()
    };
    let at = |index: usize| {
        let angle = FRAC_PI_2 - TAU * index as f64 / 5.0;
        [1.6 * angle.cos(), angle.sin()]
    };
    for (index, motion) in drive().iter().enumerate() {
        let Cylinder { disc, heading } = cylinder(motion)?;
        let (from, to) = (at(index), at(index + 1));
        chart.marks.push(Mark::Way(vec![from, to], Ink::Truth));
        let text = format!(
            "{:.2} ± {:.2} m, {:.0} ± {:.0}°",
            disc.distance(),
            disc.radius,
            heading.centre().to_degrees(),
            heading.half().to_degrees()
        );
        // The label is to its right: away from the place there.
        let share = if to[0] < from[0] - 1.0 { 0.8 } else { 0.35 };
        let middle = [0, 1].map(|axis| (1.0 - share) * from[axis] + share * to[axis]);
        chart.marks.push(Mark::Name(middle, text));
    }
    for (index, name) in ["A", "B", "C", "D", "E"].into_iter().enumerate() {
        chart.marks.push(Mark::Circle(at(index), 0.04, Ink::Meadow));
        chart.marks.push(Mark::Name(at(index), name.into()));
    }
    // Room for the labels at the right.
    chart.marks.push(Mark::Way(vec![[2.6, 0.0]], Ink::Frame));
    Ok(chart)
}

/// Figure 3: the uncertainty manifold of a motion, from above, and its circle.
fn manifold(seed: u64) -> Result<Chart> {
    let wide = Motion {
        turn_bound: 0.35,
        ..motion(25.0, 2.0)
    };
    let mut random = Random::new(seed, 3);
    let ends = (0..SAMPLES).filter_map(|_| sample(&mut random, &[wide]).pop());
    let bound = cylinder(&wide)?;
    Ok(Chart {
        title: "Figure 3: where a motion may lead (25 ± 20°, 2 ± 0.15 m)".into(),
        has_axes: true,
        legend: vec![(Ink::Truth, "samples".into()), (Ink::Bound, "bound".into())],
        marks: vec![
            Mark::Way(nominal(&[wide]), Ink::Frame),
            Mark::Dots(ends.collect(), Ink::Truth),
            circle(&bound.disc, Ink::Bound),
        ],
    })
}

/// Figures 4 and 5: four motions on a square; a landmark says that it is back in the meadow.
fn square() -> Result<Chart> {
    let motions = [motion(90.0, 1.0); 4];
    let mut journey: Journey = Journey::new();
    for motion in &motions {
        let leg = Leg::of_motion(motion).map_err(|error| anyhow!("{error}"))?;
        journey.go_along(&leg)?;
    }
    let meadow = Cylinder {
        disc: Disc::about(0.2),
        heading: Heading::new(0.0, TURN_BOUND),
    };
    let forward = journey.bounds().to_vec();
    journey.confirm(&meadow)?;
    let mut marks = vec![
        circle(&meadow.disc, Ink::Meadow),
        Mark::Way(nominal(&motions), Ink::Frame),
    ];
    for (index, (bound, left)) in forward.iter().zip(journey.bounds()).enumerate() {
        marks.push(circle(&bound.disc, Ink::Bound));
        if left != bound {
            marks.push(circle(&left.disc, Ink::Left));
        }
        marks.push(Mark::Name(
            [bound.disc.x, bound.disc.y],
            format!("{}", index + 1),
        ));
    }
    Ok(Chart {
        title: "Figures 4 and 5: a square, forward and backward".into(),
        has_axes: true,
        legend: vec![
            (Ink::Bound, "forward".into()),
            (Ink::Left, "after a landmark at the end".into()),
            (Ink::Meadow, "meadow".into()),
        ],
        marks,
    })
}
