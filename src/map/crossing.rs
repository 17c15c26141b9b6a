//! Whether two straight ways cross, as far as their ends are known [B §3.3].

use super::real::{larger, smaller, sqrt};
use super::{Disc, Map, PlaceId, ROUNDING};

/// What can be told of two straight ways.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Crossing {
    /// They cross, wherever in their discs the four ends are.
    Must,
    /// They may cross, or not.
    May,
    /// They do not, wherever their ends are.
    Cannot,
}

impl Crossing {
    /// Its name, as the protocol has it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Must => "must",
            Self::May => "may",
            Self::Cannot => "cannot",
        }
    }
}

/// Whether the straight way from `a` to `b` crosses the one from `c` to `d`, whose ends lie in these discs, seen from one frame.
///
/// They must, if each way has the other's ends certainly on either side. They cannot, if a straight line divides one's discs from the other's; such a line is
/// sought across all that leads from an end to an end. What is neither may.
#[must_use]
pub fn crossing(a: &Disc, b: &Disc, c: &Disc, d: &Disc) -> Crossing {
    let opposite = |from, to, one, other| {
        let sides = (side(from, to, one), side(from, to, other));
        matches!(sides, (Some(one), Some(other)) if one != other)
    };
    if opposite(a, b, c, d) && opposite(c, d, a, b) {
        return Crossing::Must;
    }
    let (along, across) = (vector(a, b), vector(c, d));
    let directions = [
        [-along[1], along[0]],
        [-across[1], across[0]],
        vector(a, c),
        vector(a, d),
        vector(b, c),
        vector(b, d),
    ];
    let divided = directions
        .iter()
        .any(|n| divides(*n, [a, b], [c, d]) || divides(*n, [c, d], [a, b]));
    if divided {
        Crossing::Cannot
    } else {
        Crossing::May
    }
}

/// From one centre to the other.
fn vector(from: &Disc, to: &Disc) -> [f64; 2] {
    [to.x - from.x, to.y - from.y]
}

fn length([x, y]: [f64; 2]) -> f64 {
    sqrt(x * x + y * y)
}

/// True if c is on the left of the line from a to b, false if on the right, `None` if it may be either.
///
/// Twice the area of the triangle is a×b + b×c + c×a. With each corner anywhere in its disc it changes by no more than
///
/// ```text
///     r_a |bc| + r_b |ca| + r_c |ab| + r_a r_b + r_b r_c + r_c r_a
/// ```
fn side(a: &Disc, b: &Disc, c: &Disc) -> Option<bool> {
    let (ab, ac) = (vector(a, b), vector(a, c));
    let area = ab[0] * ac[1] - ab[1] * ac[0];
    let (to_b, to_c, between) = (length(ab), length(ac), length(vector(b, c)));
    let change = a.radius * between
        + b.radius * to_c
        + c.radius * to_b
        + a.radius * b.radius
        + b.radius * c.radius
        + c.radius * a.radius;
    let certain = area.abs() > change + ROUNDING * (change + to_b * to_c);
    certain.then_some(area > 0.0)
}

/// True if all of the discs `beyond` lie further in the direction n than all of the discs `before`.
fn divides(n: [f64; 2], before: [&Disc; 2], beyond: [&Disc; 2]) -> bool {
    let [origin, other] = before;
    let size = length(n);
    let along = |disc: &Disc| {
        let [x, y] = vector(origin, disc);
        n[0] * x + n[1] * y
    };
    let before = larger(size * origin.radius, along(other) + size * other.radius);
    let [near, far] = beyond;
    let beyond = smaller(
        along(near) - size * near.radius,
        along(far) - size * far.radius,
    );
    let scale = [other, near, far]
        .iter()
        .map(|disc| length(vector(origin, disc)) + disc.radius)
        .fold(origin.radius, |sum, scale| sum + scale);
    beyond > before + ROUNDING * size * scale
}

impl<const PLACES: usize, const ARCS: usize> Map<PLACES, ARCS> {
    /// Whether the straight way from `a` to `b` crosses the one from `c` to `d`, from what is known of the four places as seen from each of them. What no
    /// chain of arcs connects may cross, and so may ways from one and the same place.
    #[must_use]
    pub fn crosses(&self, a: PlaceId, b: PlaceId, c: PlaceId, d: PlaceId) -> Crossing {
        for frame in [a, b, c, d] {
            let seen = [a, b, c, d].map(|place| self.relation(frame, place));
            if let [Some(a), Some(b), Some(c), Some(d)] = seen {
                let crossing = crossing(&a.disc, &b.disc, &c.disc, &d.disc);
                if crossing != Crossing::May {
                    return crossing;
                }
            }
        }
        Crossing::May
    }
}
