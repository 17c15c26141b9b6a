//! The figure of a calibration: how the gains converge, with twice their deviations, and a path before and after (the counterparts of the figures 5 to 8 of
//! Hermosillo, Pradalier and Sekhavat).

use std::path::Path;

use anyhow::ensure;
use vehicle_controller::params::Params;
use vehicle_controller::vehicle::gains::GainVector;

use super::geometry::{Point, Rect};
use super::panel::{Panel, Swatch, axis, legend, time_axis};
use super::path::{self, Track};
use super::scene::{GREY, Pen, Scene, pale};
use super::{BLUE, ESTIMATE, PURPLE, TRUTH, new_figure};
use crate::calibrate::{self, named_gains};
use crate::replay::Replay;

/// A number that is learned: a weighted sum of the gains, in its parameter's unit.
struct Learned {
    name: String,
    weights: GainVector,
}

/// The gains of this vehicle; before those of two wheels k_d, which is what they have in common.
fn learned_by(params: &Params) -> Vec<Learned> {
    let gains: Vec<_> = named_gains(params);
    let sum = |name: String, parts: &[(usize, f64)]| {
        let mut weights = GainVector::zeros();
        for (place, weight) in parts {
            weights[*place] = *weight;
        }
        Learned { name, weights }
    };
    let two_wheels = gains.iter().any(|gain| gain.name == "k_l");
    let common = two_wheels.then(|| sum("k_d = (k_r + k_l)/2".into(), &[(0, 0.5), (1, 0.5)]));
    let each = gains.iter().map(|gain| {
        let name = match gain.id.spec().unit {
            "-" => gain.name.to_owned(),
            unit => format!("{} [{unit}]", gain.name),
        };
        sum(name, &[(gain.place, gain.unit)])
    });
    common.into_iter().chain(each).collect()
}

const VALUE: Pen = Pen::solid(BLUE, 2.0);
/// Room for the labels of an x axis, pixels.
const LABELS: f64 = 52.0;

impl Learned {
    fn value(&self, point: &calibrate::Point) -> f64 {
        self.weights.dot(&GainVector::from(point.gains))
    }

    fn deviation(&self, point: &calibrate::Point) -> f64 {
        let variance = self.weights.dot(&(point.covariance * self.weights));
        variance.max(0.0).sqrt()
    }
}

/// Draws how the gains of a vehicle with these parameters converge, with ± 2 standard deviations, and beside that a log's path before and after.
///
/// # Errors
///
/// No point, numbers that are not finite, a file name that ends neither in `.svg` nor in `.png`, or a file that cannot be written.
pub fn plot_convergence(
    points: &[calibrate::Point],
    params: &Params,
    replays: Option<(&Replay, &Replay)>,
    title: &str,
    path: &Path,
) -> anyhow::Result<()> {
    convergence_scene(points, params, replays, title)?.save(path)
}

pub(super) fn convergence_scene(
    points: &[calibrate::Point],
    params: &Params,
    replays: Option<(&Replay, &Replay)>,
    title: &str,
) -> anyhow::Result<Scene> {
    ensure!(
        !points.is_empty(),
        "nothing was learned that could be drawn"
    );
    let all = learned_by(params);
    for point in points {
        let numbers = all
            .iter()
            .flat_map(|l| [l.value(point), l.deviation(point)]);
        ensure!(
            numbers.chain([point.t]).all(f64::is_finite),
            "at {} s there is a gain that is not finite",
            point.t
        );
    }
    let mut scene = new_figure(title);
    if let Some((before, after)) = replays {
        draw_paths(&mut scene, before, after);
    }
    let entries = [
        (Swatch::Line(VALUE), "gain".into()),
        (
            Swatch::Box(pale(BLUE, 0.25)),
            "± 2 standard deviations".into(),
        ),
        (Swatch::Line(boundary()), "a log begins".into()),
    ];
    let place = Rect::new(784.0, 52.0, 1376.0, 998.0);
    let top = legend(&mut scene, (place.x0, place.x1), place.y0, &entries);
    let height = (place.y1 - top) / all.len() as f64;
    for (index, learned) in all.iter().enumerate() {
        let y0 = top + index as f64 * height;
        let rect = Rect::new(place.x0, y0, place.x1, y0 + height - LABELS);
        draw(&mut scene, rect, learned, points);
    }
    Ok(scene)
}

fn boundary() -> Pen {
    Pen::solid(pale(GREY, 0.6), 1.2)
}

/// The truth is the same for both, so it is drawn once.
fn draw_paths(scene: &mut Scene, before: &Replay, after: &Replay) {
    let named = |replay: &Replay, name: &str| {
        let mut path = replay.path();
        path.name = format!("{} {name}", replay.name);
        path.covariance.clear();
        path
    };
    let (before, mut after) = (named(before, "before"), named(after, "after"));
    after.truth = None;
    let track = |path, estimate| Track {
        path,
        truth: Pen::solid(pale(TRUTH.color, 0.5), TRUTH.width),
        estimate,
    };
    let tracks = [
        track(&before, Pen::dashed(PURPLE, 1.6)),
        track(&after, Pen::solid(ESTIMATE.color, 1.8)),
    ];
    let place = Rect::new(88.0, 52.0, 676.0, 945.0);
    path::draw(scene, place, &tracks, &path::Asked::default());
}

/// A gain holds from its fix to the next.
fn steps(points: &[calibrate::Point], value: impl Fn(&calibrate::Point) -> f64) -> Vec<Point> {
    let mut steps: Vec<Point> = Vec::new();
    for point in points {
        if let Some(&(_, last)) = steps.last() {
            steps.push((point.t, last));
        }
        steps.push((point.t, value(point)));
    }
    steps
}

fn draw(scene: &mut Scene, rect: Rect, learned: &Learned, points: &[calibrate::Point]) {
    let band = |sign: f64| {
        move |point: &calibrate::Point| learned.value(point) + sign * 2.0 * learned.deviation(point)
    };
    // The prior would hide how the rest converges: what is shown are all the values, and the bounds from when they are half of what they were.
    let first = learned.deviation(&points[0]);
    let late = |point: &&calibrate::Point| learned.deviation(point) < 0.5 * first;
    let bounds = points
        .iter()
        .filter(late)
        .flat_map(|point| [band(1.0)(point), band(-1.0)(point)]);
    let values = points
        .iter()
        .map(|point| learned.value(point))
        .chain(bounds);
    let panel = Panel {
        rect,
        x: time_axis(points.iter().map(|point| point.t)),
        y: axis(values, 1e-4, 0.0),
        headroom: 0.0,
    };
    let clipped = |sign: f64| -> Vec<Point> {
        let inside = |(t, value): Point| panel.pixel((t, value.clamp(panel.y.0, panel.y.1)));
        steps(points, band(sign)).into_iter().map(inside).collect()
    };
    let mut area = clipped(1.0);
    area.extend(clipped(-1.0).into_iter().rev());
    scene.area(area, BLUE, 0.25);
    panel.axes(scene, "time of the logs t [s]", &learned.name, false);
    for pair in points.windows(2) {
        if pair[0].log != pair[1].log {
            let ends = [panel.y.0, panel.y.1].map(|y| (pair[1].t, y));
            panel.series(scene, ends.into_iter(), boundary());
        }
    }
    let values = steps(points, |point| learned.value(point));
    panel.series(scene, values.into_iter(), VALUE);
}
