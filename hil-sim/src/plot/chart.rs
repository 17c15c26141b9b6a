//! Charts: circles, ways and names in a plane, several panels to a figure.

use std::path::Path;

use anyhow::ensure;
use plotters::style::RGBColor;

use super::geometry::{Point, Rect};
use super::panel::{Panel, Swatch, legend};
use super::path::view;
use super::scene::{Align, BLACK, GREY, Label, Pen, Scene};
use super::{BLUE, VERMILLION, new_figure};

const GREEN: RGBColor = RGBColor(0x00, 0x9e, 0x73);

/// What a mark stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ink {
    /// A bound by forward reasoning.
    Bound,
    /// What is left of it by backward reasoning, or after it.
    Left,
    /// A meadow.
    Meadow,
    /// What is true.
    Truth,
    /// What holds the others together.
    Frame,
}

/// Something in a chart, m.
#[derive(Clone, Debug, PartialEq)]
pub enum Mark {
    /// A circle.
    Circle([f64; 2], f64, Ink),
    /// A line.
    Way(Vec<[f64; 2]>, Ink),
    /// Points.
    Dots(Vec<[f64; 2]>, Ink),
    /// A name beside a point.
    Name([f64; 2], String),
}

/// A panel.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Chart {
    /// What it shows.
    pub title: String,
    /// In the order in which they are drawn.
    pub marks: Vec<Mark>,
    /// What its inks mean.
    pub legend: Vec<(Ink, String)>,
    /// It is a plan in metres; otherwise a mere diagram.
    pub has_axes: bool,
}

/// Draws up to four charts.
///
/// # Errors
///
/// None or more than four charts, one with nothing in it, a number that is not finite, a file name that ends neither in `.svg` nor in `.png`, or a file that
/// cannot be written.
pub fn plot_charts(charts: &[Chart], title: &str, path: &Path) -> anyhow::Result<()> {
    charts_scene(charts, title)?.save(path)
}

pub(super) fn charts_scene(charts: &[Chart], title: &str) -> anyhow::Result<Scene> {
    ensure!(
        (1..=4).contains(&charts.len()),
        "one to four charts make a figure"
    );
    let mut scene = new_figure(title);
    let rows = charts.len().div_ceil(2) as f64;
    let height = 935.0 / rows;
    for (index, chart) in charts.iter().enumerate() {
        let left = 88.0 + 696.0 * (index % 2) as f64;
        let top = 48.0 + height * (index / 2) as f64;
        draw(
            &mut scene,
            Rect::new(left, top, left + 592.0, top + height - 62.0),
            chart,
        )?;
    }
    Ok(scene)
}

impl Mark {
    /// Corners of what it fills.
    fn extent(&self) -> Vec<Point> {
        match self {
            Self::Circle([x, y], radius, _) => {
                vec![(x - radius, y - radius), (x + radius, y + radius)]
            }
            Self::Way(points, _) | Self::Dots(points, _) => {
                points.iter().map(|[x, y]| (*x, *y)).collect()
            }
            Self::Name([x, y], _) => vec![(*x, *y)],
        }
    }
}

impl Ink {
    fn color(self) -> RGBColor {
        match self {
            Self::Bound => VERMILLION,
            Self::Left => BLUE,
            Self::Meadow => GREEN,
            Self::Truth => BLACK,
            Self::Frame => GREY,
        }
    }

    fn pen(self) -> Pen {
        match self {
            Self::Bound => Pen::solid(VERMILLION, 1.6),
            Self::Left => Pen::dashed(BLUE, 2.2),
            Self::Meadow => Pen::solid(GREEN, 1.2),
            Self::Truth => Pen::solid(BLACK, 1.6),
            Self::Frame => Pen::solid(GREY, 1.0),
        }
    }

    fn swatch(self) -> Swatch {
        match self {
            Self::Meadow => Swatch::Ellipse(GREEN),
            _ => Swatch::Line(self.pen()),
        }
    }
}

fn draw(scene: &mut Scene, place: Rect, chart: &Chart) -> anyhow::Result<()> {
    let points: Vec<Point> = chart.marks.iter().flat_map(Mark::extent).collect();
    ensure!(
        points.iter().all(|(x, y)| x.is_finite() && y.is_finite()),
        "{}: a number to plot is not finite",
        chart.title
    );
    let Some(bounds) = Rect::around(points) else {
        anyhow::bail!("{}: nothing to plot", chart.title);
    };
    let mut heading = Label::new(
        chart.title.as_str(),
        (place.x0, place.y0 + 8.0),
        14.0,
        Align::Left,
    );
    heading.bold = true;
    scene.text(heading.fit(place.width()));
    let entries: Vec<_> = chart
        .legend
        .iter()
        .map(|(ink, text)| (ink.swatch(), text.clone()))
        .collect();
    let top = legend(scene, (place.x0, place.x1), place.y0 + 18.0, &entries);
    let panel = view(bounds, Rect { y0: top, ..place });
    if chart.has_axes {
        panel.axes(scene, "x [m]", "y [m]", true);
    }
    for mark in &chart.marks {
        draw_mark(scene, &panel, mark);
    }
    Ok(())
}

/// A circle as a polygon that nobody sees the corners of, closed.
fn outline(center: Point, radius: f64) -> Vec<Point> {
    (0..=96)
        .map(|side| {
            let (sin, cos) = (f64::from(side) * std::f64::consts::TAU / 96.0).sin_cos();
            (center.0 + radius * cos, center.1 + radius * sin)
        })
        .collect()
}

fn draw_mark(scene: &mut Scene, panel: &Panel, mark: &Mark) {
    let pixel = |[x, y]: &[f64; 2]| panel.pixel((*x, *y));
    match mark {
        Mark::Circle(center, radius, ink) => {
            let (at, edge) = (pixel(center), pixel(&[center[0] + radius, center[1]]));
            let outline = outline(at, edge.0 - at.0);
            if *ink == Ink::Meadow {
                scene.area(outline.clone(), ink.color(), 0.15);
            }
            scene.line(&outline, ink.pen());
        }
        Mark::Way(points, ink) => {
            let line: Vec<Point> = points.iter().map(pixel).collect();
            scene.line(&line, ink.pen());
        }
        Mark::Dots(points, ink) => {
            let is_cloud = points.len() > 50;
            for (x, y) in points.iter().map(pixel) {
                if is_cloud {
                    // A disc has corners that nobody sees and the file must hold.
                    let dot = Rect::new(x - 0.9, y - 0.9, x + 0.9, y + 0.9);
                    scene.rect(dot, ink.color(), 1.0);
                } else {
                    scene.disc((x, y), 3.0, ink.color());
                }
            }
        }
        Mark::Name(at, text) => {
            let (x, y) = pixel(at);
            scene.text(Label::new(
                text.as_str(),
                (x + 7.0, y - 9.0),
                12.0,
                Align::Left,
            ));
        }
    }
}
