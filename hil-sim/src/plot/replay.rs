//! The figure of replayed logs: the paths, and the errors of the estimate with its bounds.

use std::path::Path;

use anyhow::ensure;
use plotters::style::RGBColor;

use super::geometry::{Ellipse, INTERVAL_95, Point, Rect};
use super::panel::{Panel, Swatch, axis, legend, time_axis};
use super::path::{self, Track};
use super::scene::{Align, GREY, Label, Pen, Scene, pale};
use super::{BLUE, ESTIMATE, PURPLE, TRUTH, VERMILLION, new_figure, wrap};

/// A replayed log: what the estimator made of it, and the truth if it is known.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReplayPath {
    /// Name for the legend.
    pub name: String,
    /// Time of each row, s. Empty: the figure counts rows.
    pub t: Vec<f64>,
    /// Estimated x and y, m, and heading, rad, of each row.
    pub estimated: Vec<[f64; 3]>,
    /// True x and y, m, and heading, rad, of each row.
    pub truth: Option<Vec<[f64; 3]>>,
    /// Covariance xx, xy, xθ, yy, yθ, θθ of each row, in m², m·rad and rad². Empty: unknown.
    pub covariance: Vec<[f64; 6]>,
}

/// Okabe and Ito's colours, the darker ones first; the yellow is too light for a line.
const COLORS: [RGBColor; 6] = [
    BLUE,
    VERMILLION,
    RGBColor(0x00, 0x9e, 0x73),
    PURPLE,
    RGBColor(0xe6, 0x9f, 0x00),
    RGBColor(0x56, 0xb4, 0xe9),
];

impl ReplayPath {
    /// A mistake of the caller should not become a wrong figure.
    fn check(&self) -> anyhow::Result<()> {
        let Self { name, .. } = self;
        let rows = self.estimated.len();
        ensure!(rows > 0, "path `{name}` has no row");
        let lengths = [
            ("times", self.t.len(), !self.t.is_empty()),
            (
                "covariances",
                self.covariance.len(),
                !self.covariance.is_empty(),
            ),
            (
                "true poses",
                self.truth.as_ref().map_or(0, Vec::len),
                self.truth.is_some(),
            ),
        ];
        for (what, length, given) in lengths {
            ensure!(
                !given || length == rows,
                "path `{name}` has {rows} estimated poses but {length} {what}"
            );
        }
        let poses = self.estimated.iter().chain(self.truth.iter().flatten());
        let numbers = poses
            .flatten()
            .chain(self.covariance.iter().flatten())
            .chain(&self.t);
        for number in numbers {
            ensure!(
                number.is_finite(),
                "path `{name}` has a number that is not finite"
            );
        }
        ensure!(self.t.is_sorted(), "path `{name}`: the time goes backwards");
        Ok(())
    }

    fn x(&self, timed: bool, index: usize) -> f64 {
        if timed { self.t[index] } else { index as f64 }
    }

    /// Pairs of true and estimated poses.
    fn pairs(&self) -> impl Iterator<Item = (&[f64; 3], &[f64; 3])> {
        self.truth.iter().flatten().zip(&self.estimated)
    }

    fn position_errors(&self) -> Vec<f64> {
        self.pairs()
            .map(|(truth, estimate)| (estimate[0] - truth[0]).hypot(estimate[1] - truth[1]))
            .collect()
    }

    fn heading_errors(&self) -> Vec<f64> {
        self.pairs()
            .map(|(truth, estimate)| wrap(estimate[2] - truth[2]).to_degrees())
            .collect()
    }

    /// The long half axis of the ellipse: no direction is worse.
    fn position_bounds(&self) -> Vec<f64> {
        let bound = |c: &[f64; 6]| Ellipse::of(c[0], c[1], c[3]).map_or(0.0, |e| e.major);
        self.covariance.iter().map(bound).collect()
    }

    fn heading_bounds(&self) -> Vec<f64> {
        let bound = |c: &[f64; 6]| (INTERVAL_95 * c[5].max(0.0).sqrt()).to_degrees();
        self.covariance.iter().map(bound).collect()
    }
}

/// Draws replayed logs: the paths from above with the 95 % ellipses of the estimates, and over time the errors of
/// position and heading with the 95 % bounds that the covariance claims. Paths without truth show the bounds only.
///
/// # Errors
///
/// No path, a path without rows, parts of different lengths, numbers that are not finite, a file name that ends
/// neither in `.svg` nor in `.png`, or a file that cannot be written.
pub fn plot_replay(paths: &[ReplayPath], title: &str, path: &Path) -> anyhow::Result<()> {
    replay_scene(paths, title)?.save(path)
}

pub(super) fn replay_scene(paths: &[ReplayPath], title: &str) -> anyhow::Result<Scene> {
    ensure!(!paths.is_empty(), "no replayed path to plot");
    for path in paths {
        path.check()?;
    }
    let mut scene = new_figure(title);
    let tracks: Vec<Track> = paths
        .iter()
        .enumerate()
        .map(|(index, path)| track(path, index, paths.len()))
        .collect();
    let place = Rect::new(88.0, 52.0, 676.0, 945.0);
    path::draw(&mut scene, place, &tracks, &path::Asked::default());
    let timed = paths.iter().all(|path| !path.t.is_empty());
    let panels = [
        Errors {
            name: "position error",
            y_label: "position error [m]",
            least: 0.002,
            signed: false,
            error_of: ReplayPath::position_errors,
            bound_of: ReplayPath::position_bounds,
        },
        Errors {
            name: "heading error",
            y_label: "heading error [°]",
            least: 0.1,
            signed: true,
            error_of: ReplayPath::heading_errors,
            bound_of: ReplayPath::heading_bounds,
        },
    ];
    for (panel, (top, bottom)) in panels.iter().zip([(52.0, 462.0), (535.0, 945.0)]) {
        let place = Rect::new(784.0, top, 1376.0, bottom);
        panel.draw(&mut scene, place, &tracks, timed);
    }
    Ok(scene)
}

/// One path gets the colours of a trace's figure; of several each has its own, and a paler one for its truth.
fn track(path: &ReplayPath, index: usize, count: usize) -> Track<'_> {
    if count == 1 {
        return Track {
            path,
            truth: TRUTH,
            estimate: ESTIMATE,
        };
    }
    let color = COLORS[index % COLORS.len()];
    Track {
        path,
        truth: Pen::solid(pale(color, 0.35), 5.0),
        estimate: Pen {
            dashed: index >= COLORS.len(),
            ..Pen::solid(color, 1.8)
        },
    }
}

/// A panel of errors.
struct Errors {
    name: &'static str,
    y_label: &'static str,
    /// Least height of the axis, in the unit of the label.
    least: f64,
    /// Whether an error may be negative, with a bound on either side.
    signed: bool,
    error_of: fn(&ReplayPath) -> Vec<f64>,
    bound_of: fn(&ReplayPath) -> Vec<f64>,
}

impl Errors {
    fn draw(&self, scene: &mut Scene, place: Rect, tracks: &[Track], timed: bool) {
        let top = legend(scene, (place.x0, place.x1), place.y0, &self.entries(tracks));
        let mut values = vec![0.0];
        for track in tracks {
            values.extend((self.error_of)(track.path));
            let bounds = (self.bound_of)(track.path);
            if self.signed {
                values.extend(bounds.iter().map(|bound| -bound));
            }
            values.extend(bounds);
        }
        let xs = tracks.iter().flat_map(|track| {
            (0..track.path.estimated.len()).map(|index| track.path.x(timed, index))
        });
        let panel = Panel {
            rect: Rect { y0: top, ..place },
            x: time_axis(xs),
            y: axis(values, self.least, 0.0),
            headroom: 0.0,
        };
        let x_label = if timed { "time t [s]" } else { "row" };
        panel.axes(scene, x_label, self.y_label, false);
        for track in tracks {
            self.draw_track(scene, &panel, track, timed);
        }
        if tracks
            .iter()
            .all(|track| track.path.truth.is_none() && track.path.covariance.is_empty())
        {
            let at = (
                0.5 * (panel.rect.x0 + panel.rect.x1),
                0.5 * (panel.rect.y0 + panel.rect.y1) - 20.0,
            );
            let mut label = Label::new("neither truth nor covariance", at, 14.0, Align::Center);
            label.color = GREY;
            scene.text(label);
        }
    }

    fn entries(&self, tracks: &[Track]) -> Vec<(Swatch, String)> {
        let mut entries = Vec::new();
        if let [track] = tracks {
            if track.path.truth.is_some() {
                entries.push((Swatch::Line(error_pen(track)), self.name.into()));
            }
            if !track.path.covariance.is_empty() {
                let text = "95 % bound of the estimate".into();
                entries.push((Swatch::Line(bound_pen(track)), text));
            }
            return entries;
        }
        for track in tracks {
            entries.push((Swatch::Line(error_pen(track)), track.path.name.clone()));
        }
        if tracks.iter().any(|track| !track.path.covariance.is_empty()) {
            entries.push((Swatch::None, "dashed: 95 % bounds".into()));
        }
        entries
    }

    fn draw_track(&self, scene: &mut Scene, panel: &Panel, track: &Track, timed: bool) {
        let points = |values: &[f64], sign: f64| -> Vec<Point> {
            let point = |(index, value): (usize, &f64)| (track.path.x(timed, index), sign * value);
            values.iter().enumerate().map(point).collect()
        };
        let bounds = (self.bound_of)(track.path);
        let signs: &[f64] = if self.signed { &[1.0, -1.0] } else { &[1.0] };
        for sign in signs {
            panel.series(scene, points(&bounds, *sign).into_iter(), bound_pen(track));
        }
        let errors = (self.error_of)(track.path);
        panel.series(scene, points(&errors, 1.0).into_iter(), error_pen(track));
    }
}

fn error_pen(track: &Track) -> Pen {
    Pen::solid(track.estimate.color, 1.8)
}

fn bound_pen(track: &Track) -> Pen {
    Pen::dashed(track.estimate.color, 1.2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_and_bounds_of_known_poses() {
        let path = ReplayPath {
            name: "known".into(),
            t: vec![0.0],
            estimated: vec![[3.0, 4.0, 3.1]],
            truth: Some(vec![[0.0, 0.0, -3.1]]),
            covariance: vec![[0.01, 0.0, 0.0, 0.04, 0.0, 0.25]],
        };
        let close = |values: Vec<f64>, expected: f64| {
            assert_eq!(values.len(), 1);
            assert!((values[0] - expected).abs() < 1e-5, "{values:?}");
        };
        close(path.position_errors(), 5.0);
        // The short way round, not 6.2 rad.
        close(
            path.heading_errors(),
            (6.2 - std::f64::consts::TAU).to_degrees(),
        );
        close(path.position_bounds(), 0.2 * 5.991_465f64.sqrt());
        close(path.heading_bounds(), (1.959_964f64 * 0.5).to_degrees());
    }
}
