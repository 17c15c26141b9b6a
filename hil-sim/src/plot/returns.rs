//! The figure of the square path experiment: where the base truly returned to, as seen from where its odometry says it is, before and after a calibration.

use std::path::Path;

use anyhow::ensure;
use plotters::style::RGBColor;

use super::geometry::{Point, Rect};
use super::panel::{Swatch, legend};
use super::path::view;
use super::scene::{GREY, Pen, Scene};
use super::{BLUE, PURPLE, VERMILLION, new_figure};
use crate::umbmark::Directions;

/// Return errors with the gains from one source.
#[derive(Clone, Debug, PartialEq)]
pub struct Returns {
    /// Where the gains are from.
    pub name: String,
    /// x, y (m) of each square.
    pub errors: Directions<Vec<[f64; 2]>>,
}

/// Of a marker, pixels.
const RADIUS: f64 = 4.5;
const COLORS: [RGBColor; 3] = [VERMILLION, BLUE, PURPLE];

/// Draws the return errors of all, and beside that those of all but the first, larger.
///
/// # Errors
///
/// No square, a number that is not finite, a file name that ends neither in `.svg` nor in `.png`, or a file that cannot be written.
pub fn plot_returns(all: &[Returns], title: &str, path: &Path) -> anyhow::Result<()> {
    returns_scene(all, title)?.save(path)
}

pub(super) fn returns_scene(all: &[Returns], title: &str) -> anyhow::Result<Scene> {
    let numbers = || all.iter().flat_map(Returns::points);
    ensure!(numbers().next().is_some(), "no square to plot");
    ensure!(
        numbers().all(|(x, y)| x.is_finite() && y.is_finite()),
        "a number to plot is not finite"
    );
    let mut scene = new_figure(title);
    let colored: Vec<_> = all.iter().zip(COLORS.into_iter().cycle()).collect();
    let later = colored.get(1..).unwrap_or_default();
    draw(&mut scene, Rect::new(88.0, 52.0, 676.0, 945.0), &colored);
    if !later.is_empty() {
        draw(&mut scene, Rect::new(784.0, 52.0, 1376.0, 945.0), later);
    }
    Ok(scene)
}

impl Returns {
    fn points(&self) -> impl Iterator<Item = Point> {
        let Directions {
            clockwise,
            counter_clockwise,
        } = &self.errors;
        clockwise
            .iter()
            .chain(counter_clockwise)
            .map(|[x, y]| (*x, *y))
    }
}

fn draw(scene: &mut Scene, place: Rect, all: &[(&Returns, RGBColor)]) {
    let mut entries: Vec<_> = all
        .iter()
        .map(|(returns, color)| (Swatch::Box(*color), returns.name.clone()))
        .collect();
    entries.push((
        Swatch::None,
        "discs: clockwise, squares: counter-clockwise".into(),
    ));
    let top = legend(scene, (place.x0, place.x1), place.y0, &entries);
    let points = all.iter().flat_map(|(returns, _)| returns.points());
    let bounds = Rect::around(points.chain([(0.0, 0.0)])).unwrap_or(place);
    let panel = view(bounds, Rect { y0: top, ..place });
    panel.axes(scene, "true − calculated x [m]", "y [m]", true);
    let (x, y) = panel.pixel((0.0, 0.0));
    scene.line(&[(x - 9.0, y), (x + 9.0, y)], Pen::solid(GREY, 1.2));
    scene.line(&[(x, y - 9.0), (x, y + 9.0)], Pen::solid(GREY, 1.2));
    for (returns, color) in all {
        for error in &returns.errors.clockwise {
            scene.disc(panel.pixel((error[0], error[1])), RADIUS, *color);
        }
        for error in &returns.errors.counter_clockwise {
            let (x, y) = panel.pixel((error[0], error[1]));
            let square = Rect::new(x - RADIUS, y - RADIUS, x + RADIUS, y + RADIUS);
            scene.rect(square, *color, 1.0);
        }
    }
}
