//! From two wheels to the virtual vehicle and back.

use super::super::Twist;
use super::super::gains::{GAINS, Influence, of_each};
use crate::math::{Factor, Split, Sum, larger};

/// The geometry: wheel base and what one count is worth. All that the tick needs of it is worked out here, once.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Geometry {
    /// w, K_left and K_right as they are said to be.
    nominal: [Sum; 3],
    gains: [f32; GAINS],
    half_base: f32,
    /// 1/w.
    curvature: f32,
    per_count: [f32; 2],
    resolution: Twist,
    translation: [Split; 2],
    rotation: [Split; 2],
}

impl Geometry {
    /// A geometry of nominal wheel base w (distance of the wheels' contacts, m) and K_left, K_right (m per count), and the gains k_r, k_l, k_b, all above 0.
    #[must_use]
    pub fn new(wheel_base: f64, left: f64, right: f64, gains: [f32; GAINS]) -> Self {
        let mut geometry = Self {
            nominal: [wheel_base, left, right].map(Sum::from_f64),
            ..Self::default()
        };
        geometry.set_gains(gains);
        geometry
    }

    /// Takes other gains over. The tick does it, so in numbers of 48 bits: in f64 it would take 2000 instructions.
    #[inline(never)]
    pub fn set_gains(&mut self, gains: [f32; GAINS]) {
        self.gains = gains;
        let [right, left, base, ..] = gains.map(Factor::new);
        let [nominal_base, nominal_left, nominal_right] = self.nominal;
        let (left, right) = (nominal_left.times(left), nominal_right.times(right));
        let wheel_base = nominal_base.times(base);
        self.half_base = 0.5 * wheel_base.get();
        self.curvature = 1.0 / wheel_base.get();
        self.per_count = [left.get(), right.get()];
        let coarser = larger(left.get(), right.get());
        self.resolution = Twist {
            translation: coarser,
            rotation: coarser * self.curvature,
        };
        // ΔS = (ΔS_right + ΔS_left)/2      Δα = (ΔS_right − ΔS_left)/w
        let half = Factor::new(0.5);
        self.translation = [Split::new(left.times(half)), Split::new(right.times(half))];
        self.rotation = [left, right].map(|wheel| Split::new(wheel.over(wheel_base)));
    }

    /// With S_r = ΔS + Δα w/2 and S_l = ΔS − Δα w/2 (theory section 6):
    ///
    /// ```text
    ///     ∂ΔS/∂k_r = S_r/(2 k_r)     ∂ΔS/∂k_l = S_l/(2 k_l)      ∂ΔS/∂k_b = 0
    ///     ∂Δα/∂k_r = S_r/(k_r w)     ∂Δα/∂k_l = −S_l/(k_l w)     ∂Δα/∂k_b = −Δα/k_b
    /// ```
    #[must_use]
    pub fn influence(&self) -> Influence {
        let [right, left, base, ..] = self.gains;
        let wheel = |gain: f32, half_base: f32| {
            let half = 0.5 / gain;
            [half, half * half_base, half / half_base, half]
        };
        Influence {
            by_gain: of_each(
                [
                    wheel(right, self.half_base),
                    wheel(left, -self.half_base),
                    [0.0, 0.0, 0.0, -1.0 / base],
                ],
                [0.0; 4],
            ),
        }
    }

    /// w, m.
    #[must_use]
    pub fn wheel_base(&self) -> f64 {
        let [wheel_base, ..] = self.nominal;
        let [_, _, by_base, ..] = self.gains;
        wheel_base.to_f64() * f64::from(by_base)
    }

    /// K_left and K_right, m per count.
    #[must_use]
    pub fn per_count(&self) -> [f64; 2] {
        let [_, left, right] = self.nominal;
        let [by_right, by_left, ..] = self.gains;
        [
            left.to_f64() * f64::from(by_left),
            right.to_f64() * f64::from(by_right),
        ]
    }

    /// What one count amounts to.
    #[must_use]
    pub fn resolution(&self) -> Twist {
        self.resolution
    }

    /// How far the circumferences have moved, m.
    pub(in crate::vehicle) fn rolled(&self, [left, right]: [i32; 2]) -> [f32; 2] {
        [
            left as f32 * self.per_count[0],
            right as f32 * self.per_count[1],
        ]
    }

    /// v_left = v_s − v_α w/2, v_right = v_s + v_α w/2 (theory section 1).
    #[must_use]
    pub fn wheel_speeds(&self, twist: Twist) -> [f32; 2] {
        let sideways = twist.rotation * self.half_base;
        [twist.translation - sideways, twist.translation + sideways]
    }

    /// The inverse of [`Self::wheel_speeds`].
    #[must_use]
    pub fn twist(&self, [left, right]: [f32; 2]) -> Twist {
        Twist {
            translation: 0.5 * (right + left),
            rotation: (right - left) * self.curvature,
        }
    }
}

/// What rounding has taken from ΔS and Δα, carried to the next cycle.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::vehicle) struct Carry(Twist);

impl Carry {
    /// ΔS and Δα for counts of the two wheels. However many there are, they sum up to K_left Σn_left and K_right Σn_right.
    pub(in crate::vehicle) fn advance(
        &mut self,
        geometry: &Geometry,
        [left, right]: [i32; 2],
    ) -> Twist {
        Twist {
            translation: combine(
                &geometry.translation,
                [left, right],
                &mut self.0.translation,
            ),
            rotation: combine(
                &geometry.rotation,
                [left.saturating_neg(), right],
                &mut self.0.rotation,
            ),
        }
    }
}

#[inline]
fn combine(weights: &[Split; 2], [left, right]: [i32; 2], carry: &mut f32) -> f32 {
    let (left, left_rest) = weights[0].times(left);
    let (right, right_rest) = weights[1].times(right);
    let sum = left + right;
    let taken = sum - left;
    let lost = (left - (sum - taken)) + (right - taken);
    let rest = lost + left_rest + right_rest + *carry;
    let increment = sum + rest;
    *carry = (sum - increment) + rest;
    increment
}
