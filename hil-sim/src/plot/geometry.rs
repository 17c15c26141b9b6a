//! The mathematics of the figures: ticks, ellipses, clipping, and fewer points for the same picture.

/// A point, in metres or in pixels.
pub(super) type Point = (f64, f64);

/// An upright rectangle; y grows downwards for pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Rect {
    pub x0: f64,
    pub y0: f64,
    pub x1: f64,
    pub y1: f64,
}

impl Rect {
    pub fn new(x0: f64, y0: f64, x1: f64, y1: f64) -> Self {
        Self { x0, y0, x1, y1 }
    }

    pub fn width(&self) -> f64 {
        self.x1 - self.x0
    }

    pub fn height(&self) -> f64 {
        self.y1 - self.y0
    }

    /// The smallest rectangle around the points; none without points.
    pub fn around(points: impl IntoIterator<Item = Point>) -> Option<Self> {
        points.into_iter().fold(None, |rect: Option<Self>, (x, y)| {
            let rect = rect.unwrap_or_else(|| Self::new(x, y, x, y));
            Some(Self::new(
                rect.x0.min(x),
                rect.y0.min(y),
                rect.x1.max(x),
                rect.y1.max(y),
            ))
        })
    }
}

/// The interval around the values; none without values.
pub(super) fn interval(values: impl IntoIterator<Item = f64>) -> Option<(f64, f64)> {
    Rect::around(values.into_iter().map(|value| (value, 0.0))).map(|rect| (rect.x0, rect.x1))
}

/// The round numbers (1, 2 or 5 times a power of ten apart) of an interval, at most `most` of them or so, and the
/// number of decimals that tells them apart.
pub(super) fn ticks(low: f64, high: f64, most: f64) -> (Vec<f64>, usize) {
    let raw = (high - low) / most.max(1.0);
    if !(raw.is_finite() && raw > 0.0) {
        return (Vec::new(), 0);
    }
    let magnitude = 10f64.powf(raw.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0]
        .into_iter()
        .map(|factor| factor * magnitude)
        .find(|step| *step >= raw * (1.0 - 1e-9))
        .unwrap_or(10.0 * magnitude);
    let decimals = (-(step.log10() + 1e-9).floor()).max(0.0) as usize;
    let first = (low / step - 1e-9).ceil();
    let last = (high / step + 1e-9).floor();
    // Adding zero turns a negative zero into a zero.
    let values = (0..=(last - first).max(-1.0) as i64)
        .map(|index| (first + index as f64) * step + 0.0)
        .filter(|value| *value <= high + step * 1e-6);
    (values.collect(), decimals)
}

/// The square root of the 95 % quantile of χ² with two degrees of freedom.
pub(super) const ELLIPSE_95: f64 = 2.447_746_830_680_816;

/// The same in one dimension.
pub(super) const INTERVAL_95: f64 = 1.959_963_984_540_054;

/// The region that holds the position with 95 %.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ellipse {
    /// Half of the long axis.
    pub major: f64,
    /// Half of the short axis.
    pub minor: f64,
    /// Direction of the long axis, rad.
    pub angle: f64,
}

impl Ellipse {
    /// None if the matrix is no covariance: a negative eigenvalue beyond what rounding explains.
    pub fn of(cxx: f64, cxy: f64, cyy: f64) -> Option<Self> {
        let mean = f64::midpoint(cxx, cyy);
        let radius = (0.5 * (cxx - cyy)).hypot(cxy);
        let (large, small) = (mean + radius, mean - radius);
        let valid = large.is_finite() && large >= 0.0 && small >= -1e-6 * large;
        valid.then(|| Self {
            major: ELLIPSE_95 * large.sqrt(),
            minor: ELLIPSE_95 * small.max(0.0).sqrt(),
            angle: 0.5 * (2.0 * cxy).atan2(cxx - cyy),
        })
    }

    /// The outline, closed.
    pub fn outline(&self, (x, y): Point) -> Vec<Point> {
        const SIDES: i32 = 72;
        let (sin, cos) = self.angle.sin_cos();
        (0..=SIDES)
            .map(|side| {
                let phase = std::f64::consts::TAU * f64::from(side) / f64::from(SIDES);
                let (u, v) = (self.major * phase.cos(), self.minor * phase.sin());
                (x + u * cos - v * sin, y + u * sin + v * cos)
            })
            .collect()
    }
}

/// Keeps what a line as wide as a column can show: the first, lowest, highest and last point of every column.
pub(super) fn decimate(points: &[Point], column: f64) -> Vec<Point> {
    let column_of = |point: &Point| (point.0 / column).floor();
    let mut kept = Vec::new();
    for group in points.chunk_by(|a, b| column_of(a) == column_of(b)) {
        let last = group.len() - 1;
        let by_y = |a: &usize, b: &usize| group[*a].1.total_cmp(&group[*b].1);
        let lowest = (0..group.len()).min_by(by_y).unwrap_or(0);
        let highest = (0..group.len()).max_by(by_y).unwrap_or(last);
        let mut picks = [0, lowest, highest, last];
        picks.sort_unstable();
        for (index, pick) in picks.into_iter().enumerate() {
            if index == 0 || picks[index - 1] != pick {
                kept.push(group[pick]);
            }
        }
    }
    kept
}

/// Drops points that lie closer than a tolerance to the last kept one; the tolerance grows until few enough remain.
pub(super) fn simplify(points: &[Point], most: usize) -> Vec<Point> {
    let mut tolerance = 0.4;
    loop {
        let kept = thin(points, tolerance);
        if kept.len() <= most.max(2) {
            return kept;
        }
        tolerance *= 1.5;
    }
}

fn thin(points: &[Point], tolerance: f64) -> Vec<Point> {
    let mut kept: Vec<Point> = Vec::new();
    for point in points {
        if kept.last().is_none_or(|last| far(*last, *point, tolerance)) {
            kept.push(*point);
        }
    }
    if let Some(end) = points.last()
        && kept.last() != Some(end)
    {
        kept.push(*end);
    }
    kept
}

fn far(a: Point, b: Point, tolerance: f64) -> bool {
    (a.0 - b.0).hypot(a.1 - b.1) > tolerance
}

/// Length of a line.
pub(super) fn length(points: &[Point]) -> f64 {
    points
        .windows(2)
        .map(|pair| (pair[1].0 - pair[0].0).hypot(pair[1].1 - pair[0].1))
        .sum()
}

fn between(a: Point, b: Point, part: f64) -> Point {
    (a.0 + (b.0 - a.0) * part, a.1 + (b.1 - a.1) * part)
}

/// Cuts a line into dashes of the length `on`, `off` apart.
pub(super) fn dash(points: &[Point], on: f64, off: f64) -> Vec<Vec<Point>> {
    let mut dashes = Vec::new();
    let Some(first) = points.first() else {
        return dashes;
    };
    let (mut drawing, mut left, mut current) = (true, on, vec![*first]);
    for pair in points.windows(2) {
        let whole = (pair[1].0 - pair[0].0).hypot(pair[1].1 - pair[0].1);
        let mut done = 0.0;
        while whole - done > left {
            done += left;
            let cut = between(pair[0], pair[1], done / whole);
            if drawing {
                current.push(cut);
                dashes.push(std::mem::take(&mut current));
            } else {
                current = vec![cut];
            }
            drawing = !drawing;
            left = if drawing { on } else { off };
        }
        left -= whole - done;
        if drawing {
            current.push(pair[1]);
        }
    }
    if drawing && current.len() > 1 {
        dashes.push(current);
    }
    dashes
}

/// The parts of the line inside the rectangle.
pub(super) fn clip_line(points: &[Point], rect: Rect) -> Vec<Vec<Point>> {
    let mut parts: Vec<Vec<Point>> = Vec::new();
    for pair in points.windows(2) {
        let Some((a, b)) = clip_segment(pair[0], pair[1], rect) else {
            continue;
        };
        match parts.last_mut() {
            Some(part) if part.last() == Some(&a) => part.push(b),
            _ => parts.push(vec![a, b]),
        }
    }
    parts
}

/// Liang and Barsky's algorithm.
fn clip_segment(a: Point, b: Point, rect: Rect) -> Option<(Point, Point)> {
    let (dx, dy) = (b.0 - a.0, b.1 - a.1);
    let (mut enter, mut leave) = (0.0f64, 1.0f64);
    let edges = [
        (-dx, a.0 - rect.x0),
        (dx, rect.x1 - a.0),
        (-dy, a.1 - rect.y0),
        (dy, rect.y1 - a.1),
    ];
    for (outwards, room) in edges {
        if outwards == 0.0 {
            if room < 0.0 {
                return None;
            }
        } else if outwards < 0.0 {
            enter = enter.max(room / outwards);
        } else {
            leave = leave.min(room / outwards);
        }
    }
    // The ends stay exact, so that neighbouring segments join.
    let start = if enter > 0.0 { between(a, b, enter) } else { a };
    let end = if leave < 1.0 { between(a, b, leave) } else { b };
    (enter <= leave).then_some((start, end))
}

/// The part of the area inside the rectangle: Sutherland and Hodgman's algorithm.
pub(super) fn clip_area(points: &[Point], rect: Rect) -> Vec<Point> {
    let rooms: [&dyn Fn(Point) -> f64; 4] = [
        &|p| p.0 - rect.x0,
        &|p| rect.x1 - p.0,
        &|p| p.1 - rect.y0,
        &|p| rect.y1 - p.1,
    ];
    rooms.iter().fold(points.to_vec(), |area, room| {
        let mut kept = Vec::new();
        for (index, &b) in area.iter().enumerate() {
            let a = area[(index + area.len() - 1) % area.len()];
            let (room_a, room_b) = (room(a), room(b));
            if (room_a < 0.0) != (room_b < 0.0) {
                kept.push(between(a, b, room_a / (room_a - room_b)));
            }
            if room_b >= 0.0 {
                kept.push(b);
            }
        }
        kept
    })
}

/// The convex hull, closed: Andrew's monotone chain.
pub(super) fn hull(mut points: Vec<Point>) -> Vec<Point> {
    points.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let chain = |points: &mut dyn Iterator<Item = Point>| {
        let mut chain: Vec<Point> = Vec::new();
        for c in points {
            while let [.., a, b] = chain[..]
                && (b.0 - a.0) * (c.1 - a.1) <= (b.1 - a.1) * (c.0 - a.0)
            {
                chain.pop();
            }
            chain.push(c);
        }
        chain
    };
    let mut hull = chain(&mut points.iter().copied());
    let upper = chain(&mut points.iter().rev().copied());
    hull.extend(upper.into_iter().skip(1));
    hull
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(a: f64, b: f64) -> bool {
        (a - b).abs() < 1e-9
    }

    #[test]
    fn ticks_are_round() {
        assert_eq!(
            ticks(-0.05, 0.41, 5.0),
            (vec![0.0, 0.1, 0.2, 0.1 * 3.0, 0.4], 1)
        );
        assert_eq!(ticks(0.0, 1000.0, 4.0).0, [0.0, 500.0, 1000.0]);
        let (values, decimals) = ticks(-1.0, 1.0, 8.0);
        assert_eq!((values.len(), decimals), (5, 1));
        assert!(
            values
                .iter()
                .all(|value| !value.to_string().contains("-0 "))
        );
        assert!(ticks(1.0, 1.0, 5.0).0.is_empty());
    }

    #[test]
    fn ellipse_of_a_known_matrix() {
        // Standard deviations 0.3 and 0.1 m, turned by 30°.
        let (sin, cos) = 30f64.to_radians().sin_cos();
        let (large, small) = (0.09, 0.01);
        let ellipse = Ellipse::of(
            large * cos * cos + small * sin * sin,
            (large - small) * sin * cos,
            large * sin * sin + small * cos * cos,
        )
        .unwrap();
        assert!(close(ellipse.major, 5.991_464_547_107_98f64.sqrt() * 0.3));
        assert!(close(ellipse.minor, 5.991_464_547_107_98f64.sqrt() * 0.1));
        assert!(close(ellipse.angle, 30f64.to_radians()));
    }

    #[test]
    fn outline_satisfies_the_quadratic_form() {
        let (cxx, cxy, cyy) = (0.04, -0.01, 0.02);
        let determinant = cxx * cyy - cxy * cxy;
        let ellipse = Ellipse::of(cxx, cxy, cyy).unwrap();
        for (x, y) in ellipse.outline((1.0, -2.0)) {
            let (dx, dy) = (x - 1.0, y + 2.0);
            let form = (cyy * dx * dx - 2.0 * cxy * dx * dy + cxx * dy * dy) / determinant;
            assert!((form - 5.991_464_547).abs() < 1e-6, "{form}");
        }
    }

    #[test]
    fn degenerate_and_impossible_matrices() {
        let line = Ellipse::of(1.0, 1.0, 1.0).unwrap();
        assert!(close(line.minor, 0.0) && close(line.angle, 45f64.to_radians()));
        assert_eq!(Ellipse::of(0.0, 0.0, 0.0).unwrap().major, 0.0);
        assert_eq!(Ellipse::of(1.0, 2.0, 1.0), None);
        assert_eq!(Ellipse::of(f64::NAN, 0.0, 1.0), None);
    }

    #[test]
    fn decimation_keeps_the_extremes() {
        let points: Vec<Point> = (0..1000)
            .map(|i| (f64::from(i) * 0.01, f64::from((i * 37) % 101)))
            .collect();
        let kept = decimate(&points, 1.0);
        assert!(kept.len() <= 40);
        assert_eq!(kept[0], points[0]);
        assert_eq!(kept.last(), points.last());
        assert!(kept.iter().any(|point| point.1 == 100.0));
        assert!(kept.is_sorted_by(|a, b| a.0 < b.0));
    }

    #[test]
    fn simplification_is_bounded_and_keeps_the_ends() {
        let points: Vec<Point> = (0..5000)
            .map(|i| (f64::from(i % 97), f64::from(i % 53)))
            .collect();
        let kept = simplify(&points, 100);
        assert!(kept.len() <= 100);
        assert_eq!((kept[0], kept.last()), (points[0], points.last()));
        assert_eq!(simplify(&points[..1], 100), points[..1]);
    }

    #[test]
    fn dashes_have_their_length() {
        let dashes = dash(&[(0.0, 0.0), (7.0, 0.0), (7.0, 10.0)], 5.0, 3.0);
        assert_eq!(
            dashes,
            [
                vec![(0.0, 0.0), (5.0, 0.0)],
                vec![(7.0, 1.0), (7.0, 6.0)],
                vec![(7.0, 9.0), (7.0, 10.0)],
            ]
        );
    }

    #[test]
    fn hull_leaves_out_what_is_inside() {
        let square = [(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)];
        let inside = [(1.0, 1.0), (1.0, 0.0), (0.5, 1.5), (0.0, 0.0)];
        let hull = hull(square.into_iter().chain(inside).collect());
        assert_eq!(
            hull,
            [square[0], square[1], square[2], square[3], square[0]]
        );
    }

    #[test]
    fn clipping_stays_inside() {
        let rect = Rect::new(0.0, 0.0, 10.0, 10.0);
        let line = [(-5.0, 5.0), (5.0, 5.0), (5.0, 20.0), (20.0, 20.0)];
        assert_eq!(
            clip_line(&line, rect),
            [vec![(0.0, 5.0), (5.0, 5.0), (5.0, 10.0)]]
        );
        let area = [(-5.0, -5.0), (5.0, -5.0), (5.0, 5.0), (-5.0, 5.0)];
        let clipped = Rect::around(clip_area(&area, rect)).unwrap();
        assert_eq!(clipped, Rect::new(0.0, 0.0, 5.0, 5.0));
        assert!(clip_area(&[(20.0, 20.0), (30.0, 20.0), (25.0, 30.0)], rect).is_empty());
    }
}
