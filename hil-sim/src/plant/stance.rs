//! Where a wheel touches the floor and which way it points: the rows by which the motion of the body
//! becomes that of the wheel over ground.

use super::body::Velocity;

/// A linear form in the body's velocity: factors of u, v \[1\] and r \[m\].
pub(super) type Row = [f64; 3];

/// A wheel's place and direction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stance {
    /// The speed over ground in the wheel's plane.
    pub along: Row,
    /// The speed over ground at right angles to it, to the left.
    pub across: Row,
}

impl Stance {
    /// A wheel that touches at this place in the body's frame \[m\] and points at this angle from
    /// the body's x axis, counterclockwise \[rad\].
    #[inline]
    pub(super) fn new([x, y]: [f64; 2], angle: f64) -> Self {
        // The contact moves with (u − r·y, v + r·x).
        let (sin, cos) = angle.sin_cos();
        Self {
            along: [cos, sin, x * sin - y * cos],
            across: [-sin, cos, x * cos + y * sin],
        }
    }

    /// Speeds over ground along and across the wheel \[m/s\].
    #[inline]
    pub(super) fn speeds(&self, velocity: Velocity) -> (f64, f64) {
        (
            product(&self.along, velocity),
            product(&self.across, velocity),
        )
    }
}

/// The value of a form at a velocity.
#[inline]
pub(super) fn product(row: &Row, velocity: Velocity) -> f64 {
    row[0] * velocity.forward + row[1] * velocity.lateral + row[2] * velocity.yaw
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wheel_at_right_angles_to_its_way_to_the_centre_does_not_scrub() {
        // The body turns at 2 rad/s about (0, 0.5); the wheel at (0.3, 0.1) is 0.5 m from there, at
        // right angles to (0.3, −0.4): it points along (0.4, 0.3). Tolerance: rounding.
        let turn = Velocity {
            forward: 1.0,
            lateral: 0.0,
            yaw: 2.0,
        };
        let (along, across) = Stance::new([0.3, 0.1], 0.3f64.atan2(0.4)).speeds(turn);
        assert!((along - 1.0).abs() < 1e-15 && across.abs() < 1e-15);
    }
}
