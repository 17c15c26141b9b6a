//! The estimate as the tick carries it: in numbers of 48 bits, two f32 each (theory sections 2 and 3).
//!
//! The covariance needs more digits than an f32 has: after a kilometre straight on, the variance along the path is a millionth of that across it, and at
//! any heading but the axes' it is the difference of numbers that large. An f64 would do; on the Cortex-M4F it would take some 3000 instructions
//! a step, this takes 700.

use super::belief::Leverage;
use super::compound::Compound;
use super::estimator::{Noise, Pose};
use crate::math::{Factor, Sum, larger, reduced, sin_cos};
use crate::vehicle::gains::OFFSET;
use crate::vehicle::{GAINS, Influence, Spread, Twist};
use nalgebra::Matrix3;

/// A pose: x, y (m), θ (rad, unwrapped).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct WidePose {
    pub(super) x: Sum,
    pub(super) y: Sum,
    pub(super) theta: Sum,
}

impl WidePose {
    /// P := P + ΔP; returns Δx and Δy.
    pub(super) fn advance(&mut self, motion: &Compound) -> (f32, f32) {
        let (sin, cos) = sin_cos(reduced(self.theta));
        let (ahead, aside, turned) = motion.reached();
        let (dx, dy) = (ahead * cos - aside * sin, ahead * sin + aside * cos);
        self.x.add(dx);
        self.y.add(dy);
        self.theta = self.theta.plus(turned);
        (dx, dy)
    }
}

/// A pose with its own covariance and the gains' leverage.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Reckoning {
    pub(super) pose: WidePose,
    /// Cxx Cxy Cxθ Cyy Cyθ Cθθ.
    covariance: [Sum; 6],
    leverage: WideLeverage,
}

impl Reckoning {
    /// At the origin, and certain of it.
    pub(super) const START: Self = Self {
        pose: WidePose {
            x: Sum::new(0.0),
            y: Sum::new(0.0),
            theta: Sum::new(0.0),
        },
        covariance: [Sum::new(0.0); 6],
        leverage: WideLeverage([[Sum::new(0.0); 3]; GAINS]),
    };

    /// Propagates over a compound motion [C §5], corrected as in theory section 3.
    ///
    /// ```text
    ///     C := F C Fᵀ + Φ_S q_S Φ_Sᵀ + Φ_α q_α Φ_αᵀ        F = [1 0 −Δy; 0 1 Δx; 0 0 1]
    ///     Φ_S = [cos θ_m, sin θ_m, 0]ᵀ                      Φ_α = [−Δy/2, Δx/2, 1]ᵀ
    ///     q_S = κ_S |ΔS|     q_α = κ_drift |ΔS| + κ_rot |Δα|     θ_m = θ + Δα/2
    /// ```
    ///
    /// A vehicle that steers adds e q_φ eᵀ, with e = Φ_S ∂ΔS/∂φ + Φ_α ∂Δα/∂φ and q_φ the variance of the steering angle's mean over the window: with a random
    /// part that is white along the path, ∫δφ dS has the variance κ_steer |ΔS|, the mean (1/ΔS) ∫δφ dS that of κ_steer/|ΔS|. What was travelled is the
    /// variation of S, without the encoders' flicker, hence q_φ = κ_steer V/ΔS²; or κ_steer/V, where it has turned back.
    pub(super) fn propagate(&mut self, motion: &Compound, noise: &Noise, influence: &Influence) {
        let heading = reduced(self.pose.theta);
        let (dx, dy) = self.pose.advance(motion);
        let (_, _, turned) = motion.reached();
        let variation = motion.variation();
        let q_s = noise.translation * variation.translation;
        let q_a = noise.drift * variation.translation + noise.rotation * variation.rotation;
        let (sin, cos) = sin_cos(heading + 0.5 * turned.get());
        let (phi_x, phi_y) = (-0.5 * dy, 0.5 * dx);
        let effects = influence.of(motion.increment());
        self.leverage.propagate(effects, (dx, dy), (sin, cos));
        // C := F C Fᵀ: of the 54 products of two matrix multiplications, 6 are not with 0 or 1.
        let (dx, dy) = (Factor::new(dx), Factor::new(dy));
        let [xx, xy, xt, yy, yt, tt] = self.covariance;
        let next_xt = xt.minus(tt.times(dy));
        let next_yt = yt.plus(tt.times(dx));
        self.covariance = [
            xx.minus(xt.plus(next_xt).times(dy)),
            xy.plus(next_xt.times(dx)).minus(yt.times(dy)),
            next_xt,
            yy.plus(yt.plus(next_yt).times(dx)),
            next_yt,
            tt,
        ];
        // … + Φ_S q_S Φ_Sᵀ + Φ_α q_α Φ_αᵀ
        let added = [
            cos * cos * q_s + phi_x * phi_x * q_a,
            cos * sin * q_s + phi_x * phi_y * q_a,
            phi_x * q_a,
            sin * sin * q_s + phi_y * phi_y * q_a,
            phi_y * q_a,
            q_a,
        ];
        for (element, added) in self.covariance.iter_mut().zip(added) {
            element.add(added);
        }
        for (offset, steering) in effects.iter().skip(OFFSET).zip(noise.steering) {
            let (s, a) = (offset.translation, offset.rotation);
            let effect = [cos * s + phi_x * a, sin * s + phi_y * a, a];
            // What the steered wheel rolls is the path as long as it points ahead; where it points aside, ∂ΔS/∂φ is.
            let rolled = larger(variation.translation, s.abs());
            let distance = larger(motion.increment().translation.abs(), rolled);
            if distance > 0.0 {
                self.add_outer(steering * rolled, effect.map(|effect| effect / distance));
            }
        }
    }

    /// C := C + q v vᵀ.
    fn add_outer(&mut self, q: f32, [x, y, theta]: [f32; 3]) {
        let added = [x * x, x * y, x * theta, y * y, y * theta, theta * theta];
        for (element, added) in self.covariance.iter_mut().zip(added) {
            element.add(q * added);
        }
    }

    /// What the gains have done to the pose becomes its own: C := C + Γ P Γᵀ, Γ := 0. They are others from here on.
    pub(super) fn absorb(&mut self, spread: &Spread) {
        let [x, y, theta] = self.leverage.times(spread);
        let added = [
            inner(x, x),
            inner(x, y),
            inner(x, theta),
            inner(y, y),
            inner(y, theta),
            inner(theta, theta),
        ];
        for (element, added) in self.covariance.iter_mut().zip(added) {
            element.add(added);
        }
        self.leverage = WideLeverage::default();
    }

    /// True if every number is one, and none infinite: then so is their sum, unless they are beyond use all the same.
    pub(super) fn is_finite(&self) -> bool {
        let WidePose { x, y, theta } = self.pose;
        let covariance: f32 = self.covariance.iter().map(Sum::get).sum();
        (x.get() + y.get() + theta.get() + covariance).is_finite() && self.leverage.is_finite()
    }

    pub(super) fn new(pose: &Pose, own: &Matrix3<f64>, leverage: &Leverage) -> Self {
        let c = own;
        Self {
            pose: WidePose {
                x: Sum::from_f64(pose.x),
                y: Sum::from_f64(pose.y),
                theta: Sum::from_f64(pose.theta),
            },
            covariance: [c.m11, c.m12, c.m13, c.m22, c.m23, c.m33].map(Sum::from_f64),
            leverage: (*leverage).into(),
        }
    }

    /// The pose, C and Γ.
    pub(super) fn to_f64(self) -> (Pose, Matrix3<f64>, Leverage) {
        let WidePose { x, y, theta } = self.pose;
        let [xx, xy, xt, yy, yt, tt] = self.covariance.map(|element| element.to_f64());
        let pose = Pose {
            x: x.to_f64(),
            y: y.to_f64(),
            theta: theta.to_f64(),
        };
        let own = Matrix3::new(xx, xy, xt, xy, yy, yt, xt, yt, tt);
        (pose, own, self.leverage.into())
    }
}

fn inner(a: [f32; GAINS], b: [f32; GAINS]) -> f32 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Γ by its columns, one for each gain: x, y, θ.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct WideLeverage([[Sum; 3]; GAINS]);

impl WideLeverage {
    /// Γ := F Γ + Φ_S ∂ΔS/∂k + Φ_α ∂Δα/∂k.
    fn propagate(&mut self, effects: [Twist; GAINS], (dx, dy): (f32, f32), (sin, cos): (f32, f32)) {
        let (phi_x, phi_y) = (-0.5 * dy, 0.5 * dx);
        for ([x, y, theta], effect) in self.0.iter_mut().zip(effects) {
            let (s, a) = (effect.translation, effect.rotation);
            let before = theta.get();
            x.add(cos * s + phi_x * a - dy * before);
            y.add(sin * s + phi_y * a + dx * before);
            theta.add(a);
        }
    }

    /// The rows of Γ L.
    fn times(&self, spread: &Spread) -> [[f32; GAINS]; 3] {
        let mut product = [[0.0; GAINS]; 3];
        for (column, row_of_l) in self.0.iter().zip(spread.rows()) {
            for (row, element) in product.iter_mut().zip(column) {
                for (sum, l) in row.iter_mut().zip(row_of_l) {
                    *sum += element.get() * l;
                }
            }
        }
        product
    }

    fn is_finite(&self) -> bool {
        let sum: f32 = self.0.iter().flatten().map(Sum::get).sum();
        sum.is_finite()
    }
}

impl From<Leverage> for WideLeverage {
    fn from(leverage: Leverage) -> Self {
        Self(leverage.data.0.map(|column| column.map(Sum::from_f64)))
    }
}

impl From<WideLeverage> for Leverage {
    fn from(leverage: WideLeverage) -> Self {
        Self::from(leverage.0.map(|column| column.map(|s| s.to_f64())))
    }
}
