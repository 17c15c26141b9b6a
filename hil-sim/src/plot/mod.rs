//! Figures of traces, of replayed logs, of calibrations and of clouds of poses, as SVG or PNG; equal rows make equal files, on any machine.

mod asked;
mod chart;
mod cloud;
mod convergence;
mod geometry;
mod motion;
mod panel;
mod path;
mod render;
mod replay;
mod returns;
mod scene;

use std::path::Path;

use anyhow::ensure;
use plotters::style::RGBColor;

pub use asked::{AskedPath, Place, asked_paths};
pub use chart::{Chart, Ink, Mark, plot_charts};
pub use cloud::{Cloud, OverTime, plot_cloud};
pub use convergence::plot_convergence;
pub use replay::{ReplayPath, plot_replay};
pub use returns::{Returns, plot_returns};

use crate::trace::Row;
use geometry::Rect;
use path::{Asked, Track};
use scene::{Align, Label, Pen, Scene, WIDTH};

// Okabe and Ito's colours can be told apart by everyone.
const BLUE: RGBColor = RGBColor(0x00, 0x72, 0xb2);
const VERMILLION: RGBColor = RGBColor(0xd5, 0x5e, 0x00);
const PURPLE: RGBColor = RGBColor(0x9b, 0x3f, 0x74);

/// The wide line stays visible on either side of the dashes above it.
const TRUTH: Pen = Pen::solid(BLUE, 4.0);
const ESTIMATE: Pen = Pen::dashed(VERMILLION, 2.2);

/// Checks that a figure can have this name, so that a run need not end to find out.
///
/// # Errors
///
/// A file name that ends neither in `.svg` nor in `.png`.
pub fn check_name(path: &Path) -> anyhow::Result<()> {
    render::Format::of(path).map(drop)
}

/// Draws a trace: the true and estimated paths from above with the 95 % ellipses of the estimate, the speeds with
/// their references and the states of the axes, the duties with the faults, and where the run ended. If it was asked
/// for paths, they are drawn, too, and where the references were.
///
/// # Errors
///
/// No row, a number that is not finite, a file name that ends neither in `.svg` nor in `.png`, or a file that cannot
/// be written.
pub fn plot(rows: &[Row], asked: &[AskedPath], title: &str, path: &Path) -> anyhow::Result<()> {
    trace_scene(rows, asked, title)?.save(path)
}

fn trace_scene(rows: &[Row], asked: &[AskedPath], title: &str) -> anyhow::Result<Scene> {
    let Some(last) = rows.last() else {
        anyhow::bail!("no row to plot");
    };
    for row in rows {
        ensure!(
            drawn_numbers(row).iter().all(|number| number.is_finite()),
            "the row at t = {} s has a number that is not finite",
            row.t
        );
    }
    let replay = as_path(rows);
    let track = Track {
        path: &replay,
        truth: TRUTH,
        estimate: ESTIMATE,
    };
    let asked = Asked {
        paths: asked,
        reference: if asked.is_empty() {
            Vec::new()
        } else {
            rows.iter().map(asked::reference).collect()
        },
    };
    let mut scene = new_figure(title);
    let place = Rect::new(88.0, 52.0, 676.0, 770.0);
    path::draw(&mut scene, place, &[track], &asked);
    motion::table(&mut scene, Rect::new(88.0, 832.0, 676.0, 982.0), last);
    motion::draw(&mut scene, Rect::new(784.0, 52.0, 1376.0, 998.0), rows);
    Ok(scene)
}

/// A figure with nothing but its title.
fn new_figure(title: &str) -> Scene {
    let mut scene = Scene::default();
    let middle = 0.5 * f64::from(WIDTH);
    let mut label = Label::new(title, (middle, 26.0), 19.0, Align::Center);
    label.bold = true;
    scene.text(label.fit(f64::from(WIDTH) - 60.0));
    scene
}

fn drawn_numbers(row: &Row) -> [f64; 23] {
    [
        row.t,
        row.true_x,
        row.true_y,
        row.true_theta,
        row.est_x,
        row.est_y,
        row.est_theta,
        row.cxx,
        row.cxy,
        row.cxt,
        row.cyy,
        row.cyt,
        row.ctt,
        row.s,
        row.s_ref,
        row.alpha,
        row.alpha_ref,
        row.v_s,
        row.v_s_ref,
        row.v_alpha,
        row.v_alpha_ref,
        row.left_duty,
        row.right_duty,
    ]
}

fn as_path(rows: &[Row]) -> ReplayPath {
    let pose = |row: &Row| [row.true_x, row.true_y, row.true_theta];
    let covariance = |row: &Row| [row.cxx, row.cxy, row.cxt, row.cyy, row.cyt, row.ctt];
    ReplayPath {
        name: String::new(),
        t: rows.iter().map(|row| row.t).collect(),
        estimated: rows
            .iter()
            .map(|row| [row.est_x, row.est_y, row.est_theta])
            .collect(),
        truth: Some(rows.iter().map(pose).collect()),
        covariance: rows.iter().map(covariance).collect(),
    }
}

/// The same angle between -π and π.
fn wrap(angle: f64) -> f64 {
    angle.sin().atan2(angle.cos())
}

#[cfg(test)]
mod tests;
