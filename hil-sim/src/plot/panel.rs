//! A panel: axes, grid, lines over time, coloured bands and legends.

use plotters::style::RGBColor;

use super::geometry::{Point, Rect, clip_line, decimate, interval, ticks};
use super::scene::{Align, BLACK, GREY, Label, Pen, Scene, WHITE, circle};

const GRID: Pen = Pen::solid(RGBColor(0xdd, 0xdd, 0xdd), 0.8);
const FRAME: Pen = Pen::solid(GREY, 1.0);
const TEXT: f64 = 12.0;
/// Room for the labels of the ticks at the left.
const TICK_ROOM: f64 = 46.0;

/// A rectangle of the figure and the values at its edges.
#[derive(Clone, Copy, Debug)]
pub(super) struct Panel {
    pub rect: Rect,
    pub x: (f64, f64),
    pub y: (f64, f64),
    /// Part of the height, at the top, that is for names instead of values.
    pub headroom: f64,
}

impl Panel {
    /// The pixel of a value.
    pub fn pixel(&self, (x, y): Point) -> Point {
        let across = (x - self.x.0) / (self.x.1 - self.x.0);
        let up = (y - self.y.0) / (self.y.1 - self.y.0);
        (
            self.rect.x0 + across * self.rect.width(),
            self.rect.y1 - up * self.rect.height(),
        )
    }

    /// Draws the frame, a light grid and the labels; `square` asks for equal steps on both axes.
    pub fn axes(&self, scene: &mut Scene, x_label: &str, y_label: &str, square: bool) {
        let (columns, rows) = if square {
            let pixels = 80.0;
            (self.rect.width() / pixels, self.rect.height() / pixels)
        } else {
            (self.rect.width() / 75.0, self.rect.height() / 34.0)
        };
        self.x_ticks(scene, columns);
        self.y_ticks(scene, rows);
        scene.frame(self.rect, FRAME);
        let middle = 0.5 * (self.rect.x0 + self.rect.x1);
        scene.text(Label::new(
            x_label,
            (middle, self.rect.y1 + 34.0),
            TEXT + 1.0,
            Align::Center,
        ));
        let middle = 0.5 * (self.rect.y0 + self.rect.y1);
        let at = (self.rect.x0 - TICK_ROOM - 20.0, middle);
        let mut label = Label::new(y_label, at, TEXT + 1.0, Align::Center);
        label.vertical = true;
        scene.text(label);
    }

    fn x_ticks(&self, scene: &mut Scene, most: f64) {
        let label = |value: &f64, decimals: usize| {
            let x = self.pixel((*value, self.y.0)).0;
            let at = (x, self.rect.y1 + 14.0);
            Label::new(format!("{value:.decimals$}"), at, TEXT, Align::Center)
        };
        let (mut values, mut decimals) = ticks(self.x.0, self.x.1, most);
        let widest = values
            .iter()
            .map(|value| label(value, decimals).width())
            .fold(0.0, f64::max);
        if (widest + 12.0) * values.len() as f64 > self.rect.width() {
            (values, decimals) = ticks(self.x.0, self.x.1, self.rect.width() / (widest + 30.0));
        }
        for value in values {
            let label = label(&value, decimals);
            let x = label.at.0;
            scene.line(&[(x, self.rect.y0), (x, self.rect.y1)], GRID);
            scene.line(&[(x, self.rect.y1), (x, self.rect.y1 + 4.0)], FRAME);
            scene.text(label);
        }
    }

    fn y_ticks(&self, scene: &mut Scene, most: f64) {
        let (values, decimals) = ticks(self.y.0, self.y.1, most);
        let top = self.y.1 - self.headroom * (self.y.1 - self.y.0);
        for value in values.into_iter().filter(|value| *value <= top) {
            let y = self.pixel((self.x.0, value)).1;
            scene.line(&[(self.rect.x0, y), (self.rect.x1, y)], GRID);
            scene.line(&[(self.rect.x0 - 4.0, y), (self.rect.x0, y)], FRAME);
            let at = (self.rect.x0 - 8.0, y);
            let label = Label::new(format!("{value:.decimals$}"), at, TEXT, Align::Right);
            scene.text(label.fit(TICK_ROOM));
        }
    }

    /// Draws a line through values that go forward in x.
    pub fn series(&self, scene: &mut Scene, values: impl Iterator<Item = Point>, pen: Pen) {
        let points: Vec<Point> = values.map(|value| self.pixel(value)).collect();
        if let [point] = points[..] {
            scene.disc(point, 1.5 + pen.width, pen.color);
            return;
        }
        for part in clip_line(&decimate(&points, 1.0), self.rect) {
            scene.line(&part, pen);
        }
    }

    /// The intervals of pixels in which a thing that lasts from its sample to the next keeps its value. Where several
    /// samples share a column of pixels the greatest value counts, so that nothing short gets lost.
    pub fn bands<T: Copy + Ord>(
        &self,
        samples: impl Iterator<Item = (f64, T)>,
    ) -> Vec<(f64, f64, T)> {
        const COLUMN: f64 = 0.5;
        // Start, greatest and last value of each column that has samples.
        let mut columns: Vec<(f64, T, T)> = Vec::new();
        for (x, value) in samples {
            let pixel = (self.pixel((x, 0.0)).0 / COLUMN).floor() * COLUMN;
            match columns.last_mut() {
                Some((at, greatest, last)) if *at == pixel => {
                    *greatest = value.max(*greatest);
                    *last = value;
                }
                _ => columns.push((pixel, value, value)),
            }
        }
        let mut bands: Vec<(f64, f64, T)> = Vec::new();
        let mut extend = |start: f64, end: f64, value: T| {
            let (start, end) = (start.max(self.rect.x0), end.min(self.rect.x1));
            match bands.last_mut() {
                Some((_, last_end, last)) if *last == value => *last_end = end,
                _ if start < end => bands.push((start, end, value)),
                _ => {}
            }
        };
        for (index, &(start, greatest, last)) in columns.iter().enumerate() {
            let end = columns.get(index + 1).map_or(start + 2.0, |next| next.0);
            extend(start, start + COLUMN, greatest);
            extend(start + COLUMN, end, last);
        }
        bands
    }
}

/// The interval of an axis: the values, at least `least` wide, and some room; `top` is a part of the height left free.
pub(super) fn axis(values: impl IntoIterator<Item = f64>, least: f64, top: f64) -> (f64, f64) {
    let (low, high) = interval(values).unwrap_or((0.0, 0.0));
    let missing = (least - (high - low)).max(0.0);
    let (low, high) = (low - 0.5 * missing, high + 0.5 * missing);
    let height = (high - low) / (1.0 - 0.06 - 0.06 - top);
    (low - 0.06 * height, high + (0.06 + top) * height)
}

/// The interval of an axis of times.
pub(super) fn time_axis(times: impl IntoIterator<Item = f64>) -> (f64, f64) {
    match interval(times) {
        Some((first, last)) if last - first > 1e-12 * last.abs().max(1.0) => (first, last),
        Some((only, _)) => (only - 0.5, only + 0.5),
        None => (0.0, 1.0),
    }
}

/// The picture of an entry of a legend.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Swatch {
    Line(Pen),
    /// A line with a ring.
    Ringed(Pen),
    Box(RGBColor),
    Ellipse(RGBColor),
    Start,
    End,
    None,
}

/// Draws the entries of a legend in rows and gives the y below the last.
pub(super) fn legend(
    scene: &mut Scene,
    (x0, x1): (f64, f64),
    top: f64,
    entries: &[(Swatch, String)],
) -> f64 {
    const ROW: f64 = 20.0;
    const PICTURE: f64 = 28.0;
    let (mut x, mut y) = (x0, top + 0.5 * ROW);
    for (swatch, text) in entries {
        let picture = if *swatch == Swatch::None {
            0.0
        } else {
            PICTURE + 6.0
        };
        let label = Label::new(text.as_str(), (0.0, 0.0), TEXT, Align::Left);
        let mut label = label.fit(x1 - x0 - picture);
        let width = picture + label.width();
        if x > x0 && x + width > x1 {
            (x, y) = (x0, y + ROW);
        }
        draw_swatch(scene, Rect::new(x, y - 6.0, x + PICTURE, y + 6.0), *swatch);
        label.at = (x + picture, y);
        scene.text(label);
        x += width + 15.0;
    }
    y + 0.5 * ROW + 4.0
}

fn draw_swatch(scene: &mut Scene, rect: Rect, swatch: Swatch) {
    let (x, y) = (0.5 * (rect.x0 + rect.x1), 0.5 * (rect.y0 + rect.y1));
    match swatch {
        Swatch::Line(pen) => scene.line(&[(rect.x0, y), (rect.x1, y)], pen),
        Swatch::Ringed(pen) => {
            scene.line(&[(rect.x0, y), (rect.x1, y)], pen);
            scene.line(&circle((x, y), 4.0), pen);
        }
        Swatch::Box(color) => {
            scene.rect(rect, color, 1.0);
            scene.frame(rect, Pen::solid(GREY, 0.6));
        }
        Swatch::Ellipse(color) => {
            let outline: Vec<Point> = circle((0.0, 0.0), 1.0)
                .into_iter()
                .map(|(u, v)| (x + 0.5 * rect.width() * u, y + 0.5 * rect.height() * v))
                .collect();
            scene.area(outline.clone(), color, 0.1);
            scene.line(&outline, Pen::solid(color, 1.0));
        }
        Swatch::Start => start_marker(scene, (rect.x0 + 6.0, y), 0.0, BLACK, 0.55),
        Swatch::End => end_marker(scene, (rect.x0 + 3.0, y), 0.0, BLACK, 0.47),
        Swatch::None => {}
    }
}

/// A ring with an arrow in the direction of the heading; open, so that the end's square can be seen inside.
pub(super) fn start_marker(scene: &mut Scene, at: Point, heading: f64, color: RGBColor, size: f64) {
    arrow(scene, at, heading, 36.0 * size, color, size);
    scene.line(&circle(at, 10.5 * size), Pen::solid(color, 3.2 * size));
}

/// A square with a longer arrow in the direction of the heading.
pub(super) fn end_marker(scene: &mut Scene, at: Point, heading: f64, color: RGBColor, size: f64) {
    arrow(scene, at, heading, 52.0 * size, color, size);
    for (half, color) in [(5.5 * size + 0.8, WHITE), (5.5 * size, color)] {
        let rect = Rect::new(at.0 - half, at.1 - half, at.0 + half, at.1 + half);
        scene.rect(rect, color, 1.0);
    }
}

fn arrow(scene: &mut Scene, at: Point, heading: f64, length: f64, color: RGBColor, size: f64) {
    let (sin, cos) = heading.sin_cos();
    // On the screen y grows downwards.
    let along = |u: f64, v: f64| (at.0 + u * cos - v * sin, at.1 - u * sin - v * cos);
    let neck = length - 14.0 * size;
    // A white border keeps the arrow apart from the paths beneath.
    for (border, color) in [(0.9, WHITE), (0.0, color)] {
        let (shaft, head) = (1.7 * size + border, 6.5 * size + 1.5 * border);
        let outline = [
            (0.0, shaft),
            (neck - border, shaft),
            (neck - border, head),
            (length + 2.0 * border, 0.0),
            (neck - border, -head),
            (neck - border, -shaft),
            (0.0, -shaft),
        ];
        let points = outline.iter().map(|(u, v)| along(*u, *v)).collect();
        scene.area(points, color, 1.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn panel() -> Panel {
        Panel {
            rect: Rect::new(100.0, 50.0, 200.0, 150.0),
            x: (0.0, 10.0),
            y: (-1.0, 1.0),
            headroom: 0.0,
        }
    }

    #[test]
    fn values_become_pixels() {
        assert_eq!(panel().pixel((0.0, 1.0)), (100.0, 50.0));
        assert_eq!(panel().pixel((5.0, -1.0)), (150.0, 150.0));
    }

    #[test]
    fn bands_last_until_the_next_sample() {
        let samples = [(0.0, 1), (2.0, 1), (4.0, 3), (4.01, 0), (5.0, 0), (6.0, 0)];
        let bands = panel().bands(samples.into_iter());
        // The 3 lasts less than a column of pixels and is still there.
        let expected = [(100.0, 140.0, 1), (140.0, 140.5, 3), (140.5, 162.0, 0)];
        assert_eq!(bands, expected);
    }

    #[test]
    fn axes_have_their_least_height() {
        let (low, high) = axis([3.0, 3.0], 0.88, 0.0);
        assert!((low - 2.5).abs() < 1e-9 && (high - 3.5).abs() < 1e-9);
        assert_eq!(time_axis([4.0]), (3.5, 4.5));
        assert_eq!(time_axis([4.0, 6.0]), (4.0, 6.0));
    }
}
