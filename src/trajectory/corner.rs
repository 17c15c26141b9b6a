//! One corner between two straight legs, rounded by clothoid, arc, clothoid (theory section 8).

use super::KinematicLimits;
use crate::controller::AxisCommand;
use crate::math::{larger, sign, sin_cos, sinc_cosc, smaller, sqrt};
use core::f32::consts::PI;

/// A corner as it is driven: one turn, at constant v_s.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Corner {
    /// δ, from one leg's direction to the next one's, rad; within ±π, positive to the left.
    pub angle: f32,
    /// v_s, m/s.
    pub speed: f32,
    /// The largest |v_α| that the turn comes to, rad/s.
    pub turn_speed: f32,
    /// a_α, rad/s².
    pub turn_acceleration: f32,
    /// T, m: so far before the corner the turn starts, and so far behind it it ends.
    pub lead: f32,
    /// By how much the path misses the corner, m: no point of the legs that are left out is further from it.
    pub miss: f32,
    /// The path's length, m.
    pub length: f32,
}

/// What a corner may have of a leg.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Room {
    /// From the corner on, m.
    pub length: f32,
    /// v_s at its other end, m/s, where that is settled: the vehicle has to come to the corner's in what that leaves of it.
    pub at: Option<f32>,
}

impl Room {
    /// A margin on a_s, so that v_s is reached before the turn starts, not with it.
    pub(super) const RUN_UP: f32 = 0.9;

    fn holds(self, corner: &Corner, limits: &KinematicLimits) -> bool {
        let run = self.at.map_or(0.0, |speed| {
            let change = corner.speed * corner.speed - speed * speed;
            0.5 * change.abs() / (Self::RUN_UP * limits.acceleration)
        });
        corner.lead + run <= self.length
    }
}

/// The speed is found to 2⁻ⁿ of the wanted one: nobody sees a difference of less than a hundredth.
const HALVINGS: u32 = 7;

impl Corner {
    /// A turn by δ within ±π at v_s > 0, with at most v_α > 0 and with a_α > 0, whatever its room.
    ///
    /// The trapezoid of the angular speed has the ramps t₁ = v_α/a_α, of δ₁ = v_α²/(2 a_α) each, and comes to v_α = √(δ a_α) at most. It is symmetric in
    /// time, so its path is symmetric about the bisector. With the angle counted from the middle's direction, the first half reaches along it and aside
    ///
    /// ```text
    ///     x = v_s t₁ ∫ cos(δ/2 − δ₁ u²) du + (v_s/v_α) sin(δ/2 − δ₁)           u = 0 … 1
    ///     y = v_s t₁ ∫ sin(δ/2 − δ₁ u²) du + (v_s/v_α) (1 − cos(δ/2 − δ₁))
    /// ```
    ///
    /// and T = X − Y/tan δ, with (X, Y) = 2x (cos δ/2, sin δ/2), is x / cos(δ/2), which has no gap at δ = 0. The path's middle misses the corner by
    /// T sin(δ/2) − y.
    #[must_use]
    pub fn at(angle: f32, speed: f32, turn_speed: f32, turn_acceleration: f32) -> Self {
        let half = 0.5 * angle.abs();
        let peak = smaller(turn_speed, sqrt(2.0 * half * turn_acceleration));
        let mut corner = Self {
            angle,
            speed,
            turn_speed: peak,
            turn_acceleration,
            ..Self::default()
        };
        if peak > 0.0 {
            let ramp = peak / turn_acceleration;
            let swept = smaller(0.5 * peak * ramp, half);
            // Half of the arc.
            let turned = half - swept;
            let cruise = turned / peak;
            let (sin, cos) = sin_cos(half);
            let (c, s) = fresnel(swept);
            let (ahead, aside) = sinc_cosc(turned);
            let x = ramp * (cos * c + sin * s) + cruise * ahead;
            let y = ramp * (sin * c - cos * s) + cruise * aside;
            corner.lead = speed * x / larger(cos, f32::MIN_POSITIVE);
            corner.miss = corner.lead * sin - speed * y;
            corner.length = 2.0 * speed * (ramp + cruise);
        }
        corner
    }

    /// The fastest way round a corner of δ, at `wanted` m/s at most, that leaves the `room` of the leg before it and of the one behind it, misses the corner
    /// by no more than `miss` (m) and stays within the limits of the vehicle. None if there is none above the slowest speed: such a corner is turned on the
    /// spot.
    ///
    /// For a given v_s the largest v_α takes the least room, and then the room grows with v_s: v_α and a_α are proportional to v_s, or fall with it, or do
    /// not depend on it. So the speed can be bracketed.
    #[must_use]
    pub fn fit(
        angle: f32,
        wanted: f32,
        room: [Room; 2],
        miss: f32,
        limits: &KinematicLimits,
    ) -> Option<Self> {
        let wanted = smaller(wanted, limits.straight_speed());
        let slowest = smaller(limits.slowest, wanted);
        // NaN, too.
        if !(angle.abs() <= PI && slowest > 0.0) {
            return None;
        }
        let try_at = |speed: f32| {
            let corner = Self::within(angle, speed, limits);
            let fits = room.iter().all(|room| room.holds(&corner, limits));
            // The angle is another one if the limits leave no turn.
            (fits && corner.miss <= miss && corner.angle == angle).then_some(corner)
        };
        if let Some(corner) = try_at(wanted) {
            return Some(corner);
        }
        let mut found = try_at(slowest)?;
        let mut too_fast = wanted;
        for _ in 0..HALVINGS {
            let speed = 0.5 * (found.speed + too_fast);
            match try_at(speed) {
                Some(corner) => found = corner,
                None => too_fast = speed,
            }
        }
        Some(found)
    }

    /// A corner at v_s (m/s) with the turn that the vehicle's limits leave for it; straight on if they leave none.
    #[must_use]
    pub fn within(angle: f32, speed: f32, limits: &KinematicLimits) -> Self {
        let turn_speed = limits.turn_speed_at(speed);
        if turn_speed > 0.0 {
            let acceleration = limits.turn_acceleration_at(speed);
            Self::at(angle, speed, turn_speed, acceleration)
        } else {
            Self::at(0.0, speed, 0.0, limits.turn_acceleration)
        }
    }

    /// The turn that drives it.
    #[must_use]
    pub fn turn(&self) -> AxisCommand {
        AxisCommand {
            distance: self.angle,
            speed: self.turn_speed,
            acceleration: self.turn_acceleration,
        }
    }

    /// k = a_α/v_s² of its clothoids, 1/m², with the sign of δ.
    #[must_use]
    pub fn sharpness(&self) -> f32 {
        sign(self.angle) * self.turn_acceleration / (self.speed * self.speed)
    }
}

/// (−1)ᵏ/((2k)! (4k + 1)), from the last term to the first.
const COSINES: [f32; 6] = [
    -1.0 / 76_204_800.0,
    1.0 / 685_440.0,
    -1.0 / 9360.0,
    1.0 / 216.0,
    -0.1,
    1.0,
];

/// (−1)ᵏ/((2k + 1)! (4k + 3)), from the last term to the first.
const SINES: [f32; 6] = [
    -1.0 / 918_086_400.0,
    1.0 / 6_894_720.0,
    -1.0 / 75_600.0,
    1.0 / 1320.0,
    -1.0 / 42.0,
    1.0 / 3.0,
];

/// Fresnel's integrals ∫ cos(x u²) du and ∫ sin(x u²) du over u = 0 … 1, for 0 ≤ x ≤ π/2: no ramp sweeps more than half of a half turn.
///
/// By series: the first terms left out are 2e-8 and 2e-9. A quadrature as good would take six sines and cosines.
fn fresnel(x: f32) -> (f32, f32) {
    let square = x * x;
    (polynomial(square, &COSINES), x * polynomial(square, &SINES))
}

/// Horner's scheme. One loop for both, of a length that nobody unrolls.
#[inline(never)]
fn polynomial(x: f32, coefficients: &[f32]) -> f32 {
    coefficients.iter().fold(0.0, |sum, c| sum * x + c)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fresnel_is_an_integral() {
        for step in 0..=50 {
            let x = core::f64::consts::FRAC_PI_2 * f64::from(step) / 50.0;
            // Simpson in f64 with 2000 panels: 1e-13.
            let (mut c, mut s) = (0.0, 0.0);
            for i in 0..=2000 {
                let u = f64::from(i) / 2000.0;
                let weight = match i {
                    0 | 2000 => 1.0,
                    _ if i % 2 == 1 => 4.0,
                    _ => 2.0,
                } / 6000.0;
                c += weight * libm::cos(x * u * u);
                s += weight * libm::sin(x * u * u);
            }
            let (is_c, is_s) = fresnel(x as f32);
            // The term left out, an ulp of 1 for each of a handful of sums, and half an ulp of x.
            assert!((f64::from(is_c) - c).abs() < 2.5e-7, "{x}: {is_c} {c}");
            assert!((f64::from(is_s) - s).abs() < 2.5e-7, "{x}: {is_s} {s}");
        }
    }
}
