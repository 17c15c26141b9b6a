//! The figure of a cloud of true poses about an estimate: the ellipse of the Cartesian covariance, and the banana that the same covariance means in
//! exponential coordinates.

use std::path::Path;

use anyhow::ensure;
use nalgebra::{Matrix3, Vector3};
use plotters::style::RGBColor;

use super::geometry::{ELLIPSE_95, Ellipse, Point, Rect, clip_area, clip_line, hull};
use super::panel::{Panel, Swatch, axis, end_marker, legend, time_axis};
use super::path::view;
use super::scene::{BLACK, GREY, Pen, Scene, pale};
use super::{BLUE, ESTIMATE, PURPLE, VERMILLION, new_figure};
use crate::se2;

/// A cloud as seen from the estimate: x ahead of it, y to its left, m.
#[derive(Clone, Debug, PartialEq)]
pub struct Cloud {
    /// Where the truth is.
    pub points: Vec<[f64; 2]>,
    /// What they are.
    pub points_name: String,
    /// What the estimate says of its error, in its own directions: m², m·rad, rad².
    pub covariance: Matrix3<f64>,
    /// A mean, a covariance and their name, to compare with.
    pub other: Option<([f64; 2], Matrix3<f64>, String)>,
    /// What happened on the way.
    pub over_time: Option<OverTime>,
}

/// Mean NEES/3 over time.
#[derive(Clone, Debug, PartialEq)]
pub struct OverTime {
    /// s.
    pub times: Vec<f64>,
    /// In exponential coordinates.
    pub nees: Vec<f64>,
    /// In differences of x, y and θ.
    pub cartesian: Vec<f64>,
    /// Where it lies with 95 %, if the covariance is right.
    pub band: [f64; 2],
}

const CLOUD: RGBColor = BLUE;
const BANANA: RGBColor = RGBColor(0xe6, 0x9f, 0x00);
const OTHER: Pen = Pen::solid(PURPLE, 1.6);

/// Draws a cloud.
///
/// # Errors
///
/// No point, a number that is not finite, a file name that ends neither in `.svg` nor in `.png`, or a file that cannot be written.
pub fn plot_cloud(cloud: &Cloud, title: &str, path: &Path) -> anyhow::Result<()> {
    cloud_scene(cloud, title)?.save(path)
}

pub(super) fn cloud_scene(cloud: &Cloud, title: &str) -> anyhow::Result<Scene> {
    ensure!(!cloud.points.is_empty(), "no point to plot");
    let numbers = cloud.points.iter().flatten().chain(&cloud.covariance);
    for number in numbers {
        ensure!(number.is_finite(), "a number to plot is not finite");
    }
    let mut scene = new_figure(title);
    let right = if cloud.over_time.is_some() {
        776.0
    } else {
        1376.0
    };
    draw_cloud(&mut scene, Rect::new(88.0, 52.0, right, 945.0), cloud);
    if let Some(over_time) = &cloud.over_time {
        draw_nees(&mut scene, Rect::new(884.0, 52.0, 1376.0, 945.0), over_time);
    }
    Ok(scene)
}

fn draw_cloud(scene: &mut Scene, place: Rect, cloud: &Cloud) {
    let pieces = banana(&cloud.covariance);
    let ellipse = ellipse([0.0; 2], &cloud.covariance);
    let other = cloud
        .other
        .as_ref()
        .map(|(mean, covariance, _)| self::ellipse(*mean, covariance))
        .unwrap_or_default();
    let mut entries = vec![
        (Swatch::Box(CLOUD), cloud.points_name.clone()),
        (
            Swatch::Line(ESTIMATE),
            "95 % ellipse of the estimate's covariance".into(),
        ),
        (
            Swatch::Ellipse(BANANA),
            "the same in exponential coordinates".into(),
        ),
    ];
    if let Some((_, _, name)) = &cloud.other {
        entries.push((Swatch::Line(OTHER), name.clone()));
    }
    entries.push((Swatch::End, "estimate".into()));
    let points = cloud.points.iter().map(|[x, y]| (*x, *y));
    let shown = points
        .clone()
        .chain(pieces.iter().flatten().copied())
        .chain(ellipse.iter().chain(&other).copied());
    let bounds = Rect::around(shown).unwrap_or(Rect::new(0.0, 0.0, 0.0, 0.0));
    let top = legend(scene, (place.x0, place.x1), place.y0, &entries);
    let panel = view(bounds, Rect { y0: top, ..place });
    let pixels =
        |line: &[Point]| -> Vec<Point> { line.iter().map(|point| panel.pixel(*point)).collect() };
    // What is filled hides the lines inside: the outline of all the pieces together is left.
    for piece in &pieces {
        for part in clip_line(&pixels(piece), panel.rect) {
            scene.line(&part, Pen::solid(BANANA, 3.0));
        }
    }
    for piece in &pieces {
        scene.area(
            clip_area(&pixels(piece), panel.rect),
            pale(BANANA, 0.15),
            1.0,
        );
    }
    panel.axes(scene, "ahead of the estimate [m]", "to its left [m]", true);
    for point in points {
        let (x, y) = panel.pixel(point);
        scene.rect(Rect::new(x - 1.1, y - 1.1, x + 1.1, y + 1.1), CLOUD, 0.75);
    }
    scene.line(&pixels(&other), OTHER);
    scene.line(&pixels(&ellipse), ESTIMATE);
    end_marker(scene, panel.pixel((0.0, 0.0)), 0.0, BLACK, 0.55);
}

fn ellipse([x, y]: [f64; 2], covariance: &Matrix3<f64>) -> Vec<Point> {
    Ellipse::of(covariance.m11, covariance.m12, covariance.m22)
        .map(|ellipse| ellipse.outline((x, y)))
        .unwrap_or_default()
}

/// The positions of all ξ with ξᵀ C⁻¹ ξ below the 95 % quantile of χ² with two degrees of freedom, as pieces that overlap: for small headings that is the
/// ellipse. Each slice of one heading is an ellipse; a piece is two neighbouring slices and what lies between them.
fn banana(covariance: &Matrix3<f64>) -> Vec<Vec<Point>> {
    const SLICES: i32 = 24;
    // Closer together at the ends, where they become smaller quickly.
    let part = |index| (std::f64::consts::FRAC_PI_2 * f64::from(index) / f64::from(SLICES)).sin();
    let slices: Vec<Vec<Point>> = (-SLICES..=SLICES)
        .map(|index| slice(covariance, part(index)))
        .collect();
    slices
        .windows(2)
        .map(|two| hull(two.iter().flatten().copied().collect()))
        .collect()
}

/// The slice of one heading, `part` of the largest.
fn slice(covariance: &Matrix3<f64>, part: f64) -> Vec<Point> {
    const SIDES: i32 = 36;
    let c = covariance;
    let turned = ELLIPSE_95 * part * c.m33.max(0.0).sqrt();
    let over = |along: f64| if c.m33 > 0.0 { along / c.m33 } else { 0.0 };
    let (ahead, aside) = (over(c.m13), over(c.m23));
    let (xx, xy, yy) = (
        c.m11 - ahead * c.m13,
        c.m12 - ahead * c.m23,
        c.m22 - aside * c.m23,
    );
    let radius = ELLIPSE_95 * (1.0 - part * part).max(0.0).sqrt();
    let l11 = xx.max(0.0).sqrt();
    let l21 = if l11 > 0.0 { xy / l11 } else { 0.0 };
    let l22 = (yy - l21 * l21).max(0.0).sqrt();
    (0..=SIDES)
        .map(|side| {
            let (sin, cos) = (std::f64::consts::TAU * f64::from(side) / f64::from(SIDES)).sin_cos();
            let u = ahead * turned + radius * l11 * cos;
            let v = aside * turned + radius * (l21 * cos + l22 * sin);
            let [x, y, _] = se2::exp(&Vector3::new(u, v, turned));
            (x, y)
        })
        .collect()
}

fn draw_nees(scene: &mut Scene, place: Rect, over_time: &OverTime) {
    let nees = Pen::solid(BLUE, 2.0);
    let cartesian = Pen::dashed(VERMILLION, 1.6);
    let band = Pen::dashed(GREY, 1.2);
    let entries = [
        (Swatch::Line(nees), "exponential coordinates".into()),
        (Swatch::Line(cartesian), "differences of x, y, θ".into()),
        (Swatch::Line(band), "95 % band if right".into()),
    ];
    let top = legend(scene, (place.x0, place.x1), place.y0, &entries);
    let values = over_time.nees.iter().chain(&over_time.cartesian);
    let all = values.chain(&over_time.band).copied().chain([0.0]);
    let panel = Panel {
        rect: Rect { y0: top, ..place },
        x: time_axis(over_time.times.iter().copied()),
        y: axis(all, 1.0, 0.0),
        headroom: 0.0,
    };
    panel.axes(scene, "t [s]", "mean NEES/3", false);
    for edge in over_time.band {
        let (x0, x1) = panel.x;
        panel.series(scene, [(x0, edge), (x1, edge)].into_iter(), band);
    }
    for (values, pen) in [(&over_time.cartesian, cartesian), (&over_time.nees, nees)] {
        let points = over_time.times.iter().copied().zip(values.iter().copied());
        panel.series(scene, points, pen);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_a_doubt_of_the_heading_the_banana_is_the_ellipse() {
        let covariance = Matrix3::new(0.04, 0.01, 0.0, 0.01, 0.02, 0.0, 0.0, 0.0, 0.0);
        let outline = Rect::around(ellipse([0.0; 2], &covariance)).unwrap();
        let pieces = Rect::around(banana(&covariance).into_iter().flatten()).unwrap();
        for (a, b) in [(outline.x0, pieces.x0), (outline.y1, pieces.y1)] {
            // The sides of both are chords.
            assert!((a / b - 1.0).abs() < 0.01, "{outline:?} {pieces:?}");
        }
    }

    #[test]
    fn the_banana_bends_back_where_the_ellipse_goes_on() {
        // A straight way of 10 m, the heading unknown by 0.3 rad from the start on: the truth lies on a circle.
        let variance = 0.09;
        let covariance = Matrix3::new(
            1e-4,
            0.0,
            0.0,
            0.0,
            100.0 * variance,
            10.0 * variance,
            0.0,
            10.0 * variance,
            variance,
        );
        let ends = |points: Vec<Point>| {
            let by_y = |a: &Point, b: &Point| a.1.total_cmp(&b.1);
            points.into_iter().max_by(by_y).unwrap()
        };
        let angle = ELLIPSE_95 * 0.3;
        let tip = ends(banana(&covariance).into_iter().flatten().collect());
        let expected = (10.0 * angle.cos() - 10.0, 10.0 * angle.sin());
        // ξ of a pose that has turned about a point 10 m behind it is the twist of a circle: no ahead, 10 φ aside, φ.
        let exact = se2::exp(&Vector3::new(0.0, 10.0 * angle, angle));
        assert!((exact[0] - expected.0).abs() < 1e-9, "{exact:?}");
        assert!((tip.0 - expected.0).abs() < 0.1, "{tip:?} {expected:?}");
        assert!((tip.1 - expected.1).abs() < 0.1, "{tip:?} {expected:?}");
        let flat = ends(ellipse([0.0; 2], &covariance));
        assert!(flat.0.abs() < 0.1 && flat.1 > tip.1 + 0.5, "{flat:?}");
    }
}
