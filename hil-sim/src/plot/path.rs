//! The panel of the path seen from above.

use plotters::style::RGBColor;

use super::asked::AskedPath;
use super::geometry::{Ellipse, Point, Rect, clip_area, clip_line, simplify};
use super::panel::{Panel, Swatch, end_marker, legend, start_marker};
use super::scene::{BLACK, Pen, Scene, circle, pale};
use super::{PURPLE, ReplayPath};

/// Ellipses per path.
const ELLIPSES: usize = 12;
/// An ellipse with a smaller half axis is hidden by the path, pixels.
const VISIBLE: f64 = 4.0;
/// Radius of a marker, pixels.
const MARKER: f64 = 13.0;
/// Least width and height of what is shown, m.
const LEAST_EXTENT: f64 = 0.2;
/// Room for the markers around the path, pixels.
const MARGIN: f64 = 60.0;
/// Legs and postures that were asked for, and targets.
const LEGS: Pen = Pen::solid(RGBColor(0x00, 0x9e, 0x73), 1.6);
const TARGETS: Pen = Pen::dashed(RGBColor(0x00, 0x9e, 0x73), 1.6);
/// Above all others: it seldom leaves the estimate.
const REFERENCE: Pen = Pen::solid(PURPLE, 0.9);
/// Radius of a posture's ring, pixels.
const RING: f64 = 4.0;
/// Points per line, for the size of the file.
const MOST_POINTS: usize = 12_000;

/// A path and how to draw it.
pub(super) struct Track<'a> {
    pub path: &'a ReplayPath,
    pub truth: Pen,
    pub estimate: Pen,
}

/// What a base was asked for, and where its references were.
#[derive(Default)]
pub(super) struct Asked<'a> {
    pub paths: &'a [AskedPath],
    pub reference: Vec<[f64; 3]>,
}

impl Asked<'_> {
    /// The corners of a path's legs, m.
    fn corners(path: &AskedPath) -> impl Iterator<Item = Point> {
        let places = path.places.iter().map(|place| place.at);
        path.start.into_iter().chain(places).map(|[x, y]| (x, y))
    }

    fn has(&self, is_chase: bool) -> bool {
        self.paths
            .iter()
            .any(|path| path.start.is_none() == is_chase)
    }
}

/// An ellipse and its centre, m.
type Placed = (Point, Ellipse);

/// Draws the panel: the legend at the top of the place, then the axes.
pub(super) fn draw(scene: &mut Scene, place: Rect, tracks: &[Track], asked: &Asked) {
    let ellipses: Vec<Vec<Placed>> = tracks.iter().map(|track| placed(track.path)).collect();
    let any_truth = tracks.iter().any(|track| track.path.truth.is_some());
    let bounds = bounds(tracks, &ellipses, asked);
    // The scale does not depend on the legend's height enough to change what is visible.
    let guess = view(bounds, place);
    let ends: Vec<Point> = tracks.iter().flat_map(ends).collect();
    let shown: Vec<Vec<Placed>> = ellipses
        .into_iter()
        .map(|placed| {
            let visible = |placed: &Placed| is_visible(&guess, placed, &ends);
            placed.into_iter().filter(visible).collect()
        })
        .collect();
    let count = shown.iter().map(Vec::len).sum();
    let mut entries = asked_entries(asked);
    entries.extend(self::entries(tracks, any_truth, count));
    let top = legend(scene, (place.x0, place.x1), place.y0, &entries);
    let panel = view(bounds, Rect { y0: top, ..place });
    for (track, ellipses) in tracks.iter().zip(&shown) {
        fill_ellipses(scene, &panel, ellipses, track.estimate.color);
    }
    panel.axes(scene, "x [m]", "y [m]", true);
    for (track, ellipses) in tracks.iter().zip(&shown) {
        draw_ellipses(scene, &panel, ellipses, track.estimate.color);
    }
    for track in tracks {
        if let Some(truth) = &track.path.truth {
            draw_path(scene, &panel, truth, track.truth);
        }
        draw_path(scene, &panel, &track.path.estimated, track.estimate);
    }
    draw_asked(scene, &panel, asked);
    draw_path(scene, &panel, &asked.reference, REFERENCE);
    for track in tracks {
        if let Some(truth) = &track.path.truth {
            draw_ends(scene, &panel, truth, track.truth.color, 1.0);
        }
        draw_ends(
            scene,
            &panel,
            &track.path.estimated,
            track.estimate.color,
            0.62,
        );
    }
}

fn asked_entries(asked: &Asked) -> Vec<(Swatch, String)> {
    let mut entries = Vec::new();
    if asked.has(false) {
        let text = "path asked for: postures and legs".into();
        entries.push((Swatch::Ringed(LEGS), text));
    }
    if asked.has(true) {
        entries.push((Swatch::Line(TARGETS), "target chased".into()));
    }
    if !asked.reference.is_empty() {
        entries.push((Swatch::Line(REFERENCE), "reference".into()));
    }
    entries
}

/// Where markers will be drawn, m.
fn ends(track: &Track) -> impl Iterator<Item = Point> {
    let ends = |poses: &[[f64; 3]]| [poses.first().copied(), poses.last().copied()];
    let truth = track.path.truth.as_deref().unwrap_or_default();
    [ends(truth), ends(&track.path.estimated)]
        .into_iter()
        .flatten()
        .flatten()
        .map(|pose| (pose[0], pose[1]))
}

/// Whether neither the width of the path nor a marker hides the ellipse.
fn is_visible(panel: &Panel, (center, ellipse): &Placed, ends: &[Point]) -> bool {
    let size = ellipse.major * scale(panel);
    let at = panel.pixel(*center);
    let hidden = ends.iter().any(|end| {
        let (x, y) = panel.pixel(*end);
        (x - at.0).hypot(y - at.1) + size < MARKER
    });
    size >= VISIBLE && !hidden
}

/// Pixels per metre.
fn scale(panel: &Panel) -> f64 {
    panel.rect.width() / (panel.x.1 - panel.x.0)
}

fn entries(tracks: &[Track], any_truth: bool, ellipses: usize) -> Vec<(Swatch, String)> {
    let mut entries = Vec::new();
    if let [track] = tracks {
        if any_truth {
            entries.push((Swatch::Line(track.truth), "true path".into()));
        }
        entries.push((Swatch::Line(track.estimate), "estimated path".into()));
    } else {
        for track in tracks {
            entries.push((Swatch::Line(track.estimate), track.path.name.clone()));
        }
        if any_truth {
            entries.push((Swatch::None, "pale and wide: true paths".into()));
        }
    }
    if ellipses > 0 {
        let color = if let [track] = tracks {
            track.estimate.color
        } else {
            BLACK
        };
        let text = "95 % ellipse of estimate".into();
        entries.push((Swatch::Ellipse(color), text));
    } else if tracks.iter().any(|track| !track.path.covariance.is_empty()) {
        entries.push((Swatch::None, "95 % ellipses: too small to show".into()));
    }
    entries.push((Swatch::Start, "start".into()));
    entries.push((Swatch::End, "end".into()));
    entries
}

/// The ellipses at equal distances along the estimated path, and at its ends.
fn placed(path: &ReplayPath) -> Vec<Placed> {
    let mut travelled = 0.0;
    let distances: Vec<f64> = path
        .estimated
        .iter()
        .scan(None, |previous: &mut Option<Point>, pose| {
            if let Some((x, y)) = *previous {
                travelled += (pose[0] - x).hypot(pose[1] - y);
            }
            *previous = Some((pose[0], pose[1]));
            Some(travelled)
        })
        .collect();
    let last = distances.len().saturating_sub(1);
    let mut indices: Vec<usize> = (0..ELLIPSES)
        .map(|k| travelled * k as f64 / (ELLIPSES - 1) as f64)
        .map(|distance| distances.partition_point(|d| *d < distance).min(last))
        .chain([last])
        .collect();
    indices.dedup();
    indices
        .into_iter()
        .filter_map(|index| {
            let pose = path.estimated.get(index)?;
            let [cxx, cxy, _, cyy, ..] = *path.covariance.get(index)?;
            Some(((pose[0], pose[1]), Ellipse::of(cxx, cxy, cyy)?))
        })
        .collect()
}

/// What should be seen: the paths, and the ellipses unless they are much larger.
fn bounds(tracks: &[Track], ellipses: &[Vec<Placed>], asked: &Asked) -> Rect {
    let poses = tracks.iter().flat_map(|track| {
        track
            .path
            .estimated
            .iter()
            .chain(track.path.truth.iter().flatten())
    });
    let corners = asked.paths.iter().flat_map(Asked::corners);
    let points = poses.map(|pose| (pose[0], pose[1])).chain(corners);
    let paths = Rect::around(points).unwrap_or(Rect::new(0.0, 0.0, 0.0, 0.0));
    let limit = 0.5 * paths.width().max(paths.height()).max(LEAST_EXTENT);
    let outlines = ellipses
        .iter()
        .flatten()
        .flat_map(|(center, ellipse)| ellipse.outline(*center));
    let around = Rect::around(outlines).unwrap_or(paths);
    Rect::new(
        around.x0.clamp(paths.x0 - limit, paths.x0),
        around.y0.clamp(paths.y0 - limit, paths.y0),
        around.x1.clamp(paths.x1, paths.x1 + limit),
        around.y1.clamp(paths.y1, paths.y1 + limit),
    )
}

/// The panel in which the bounds fill the place at an equal scale of both axes.
pub(super) fn view(bounds: Rect, place: Rect) -> Panel {
    let across = bounds.width().max(LEAST_EXTENT) / (place.width() - 2.0 * MARGIN);
    let up = bounds.height().max(LEAST_EXTENT) / (place.height() - 2.0 * MARGIN);
    let metres = 0.5 * across.max(up);
    let (x, y) = (0.5 * (bounds.x0 + bounds.x1), 0.5 * (bounds.y0 + bounds.y1));
    let (half_x, half_y) = (metres * place.width(), metres * place.height());
    Panel {
        rect: place,
        x: (x - half_x, x + half_x),
        y: (y - half_y, y + half_y),
        headroom: 0.0,
    }
}

fn draw_path(scene: &mut Scene, panel: &Panel, poses: &[[f64; 3]], pen: Pen) {
    let points: Vec<Point> = poses
        .iter()
        .map(|pose| panel.pixel((pose[0], pose[1])))
        .collect();
    scene.line(&simplify(&points, MOST_POINTS), pen);
}

/// The legs with a ring at each posture, and a dash in its heading if it has one.
fn draw_asked(scene: &mut Scene, panel: &Panel, asked: &Asked) {
    for path in asked.paths {
        let corners: Vec<Point> = Asked::corners(path).map(|at| panel.pixel(at)).collect();
        let is_chase = path.start.is_none();
        scene.line(&corners, if is_chase { TARGETS } else { LEGS });
        for place in path.places.iter().filter(|_| !is_chase) {
            let at = panel.pixel((place.at[0], place.at[1]));
            scene.line(&circle(at, RING), LEGS);
            if let Some(heading) = place.heading {
                let (sin, cos) = heading.sin_cos();
                // On the screen y grows downwards.
                let along = |way: f64| (at.0 + way * cos, at.1 - way * sin);
                scene.line(&[along(RING), along(4.0 * RING)], LEGS);
            }
        }
    }
}

fn outline(panel: &Panel, (center, ellipse): &Placed) -> Vec<Point> {
    let outline = ellipse.outline(*center).into_iter();
    outline.map(|point| panel.pixel(point)).collect()
}

/// Opaque, so that many ellipses above each other stay as pale as one.
fn fill_ellipses(scene: &mut Scene, panel: &Panel, ellipses: &[Placed], color: RGBColor) {
    for placed in ellipses {
        let inside = clip_area(&outline(panel, placed), panel.rect);
        scene.area(inside, pale(color, 0.1), 1.0);
    }
}

fn draw_ellipses(scene: &mut Scene, panel: &Panel, ellipses: &[Placed], color: RGBColor) {
    for placed in ellipses {
        for part in clip_line(&outline(panel, placed), panel.rect) {
            scene.line(&part, Pen::solid(color, 0.9));
        }
    }
}

fn draw_ends(scene: &mut Scene, panel: &Panel, poses: &[[f64; 3]], color: RGBColor, size: f64) {
    let at = |pose: &[f64; 3]| panel.pixel((pose[0], pose[1]));
    if let Some(first) = poses.first() {
        start_marker(scene, at(first), first[2], color, size);
    }
    if let Some(last) = poses.last() {
        end_marker(scene, at(last), last[2], color, size);
    }
}
