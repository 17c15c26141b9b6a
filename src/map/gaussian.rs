//! The Gaussian compound beside a bound: how likely a pose is that the bound admits.

use super::Cylinder;
use crate::math::{larger, sin_cos, smaller, sqrt};

/// A pose as seen from another one, with the covariance of (x, y, θ); m and rad. Of the two the bound is the guarantee, this the expectation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Gaussian {
    /// x, y (m), θ (rad).
    pub mean: [f32; 3],
    /// Cxx Cxy Cxθ Cyy Cyθ Cθθ.
    pub covariance: [f32; 6],
}

type Matrix = [[f32; 3]; 3];

impl Gaussian {
    /// The pose itself.
    pub const HERE: Self = Self {
        mean: [0.0; 3],
        covariance: [0.0; 6],
    };

    /// Of a bound within which every pose is as likely as any other: r²/4 in x and y, α²/3.
    #[must_use]
    pub fn about(bound: &Cylinder) -> Self {
        let (radius, half) = (bound.disc.radius as f32, bound.heading.half() as f32);
        let variance = 0.25 * radius * radius;
        Self {
            mean: [bound.disc.x, bound.disc.y, bound.heading.centre()].map(|number| number as f32),
            covariance: [variance, 0.0, 0.0, variance, 0.0, half * half / 3.0],
        }
    }

    /// Of the position: the sum of both variances, m².
    #[must_use]
    pub fn variance(&self) -> f32 {
        let [xx, _, _, yy, _, _] = self.covariance;
        xx + yy
    }

    /// This pose and then another one. Their errors have nothing to do with each other.
    ///
    /// ```text
    ///     x = x₁ + R(θ₁) x₂     C = J₁ C₁ J₁ᵀ + J₂ C₂ J₂ᵀ     J₁ = [I, R'(θ₁) x₂; 0, 1]     J₂ = [R(θ₁), 0; 0, 1]
    /// ```
    #[must_use]
    pub fn then(&self, next: &Self) -> Self {
        let [x, y, theta] = self.mean;
        let [ahead, aside, turned] = next.mean;
        let (sin, cos) = sin_cos(theta);
        let (dx, dy) = (cos * ahead - sin * aside, sin * ahead + cos * aside);
        let first = [[1.0, 0.0, -dy], [0.0, 1.0, dx], [0.0, 0.0, 1.0]];
        let second = [[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]];
        let mut covariance = carried(&self.covariance, &first);
        for (sum, term) in covariance
            .iter_mut()
            .zip(carried(&next.covariance, &second))
        {
            *sum += term;
        }
        Self {
            mean: [x + dx, y + dy, wrapped(theta + turned)],
            covariance,
        }
    }

    /// Of the frame as seen from the pose.
    #[must_use]
    pub fn inverse(&self) -> Self {
        let [x, y, theta] = self.mean;
        let (sin, cos) = sin_cos(theta);
        let (u, v) = (cos * x + sin * y, cos * y - sin * x);
        let derivative = [[-cos, -sin, -v], [sin, -cos, u], [0.0, 0.0, -1.0]];
        Self {
            mean: [-u, -v, -theta],
            covariance: carried(&self.covariance, &derivative),
        }
    }

    /// The probability that the position lies within `radius` (m) of the frame: good to 1e-3.
    ///
    /// In the axes of the covariance, σ₁ ≥ σ₂, the circle's chord at u along the second one is 2w long, w = √(r² − u²):
    ///
    /// ```text
    ///     P = ∫ φ((u − μ₂)/σ₂)/σ₂ · [Φ((w − μ₁)/σ₁) − Φ((−w − μ₁)/σ₁)] du     u = r sin t, by Simpson's rule
    /// ```
    #[must_use]
    #[inline(never)]
    pub fn within(&self, radius: f32) -> f32 {
        /// Half the number of intervals.
        const PAIRS: u8 = 16;
        /// So many σ₂ to either side of μ₂ count.
        const TAIL: f32 = 5.0;
        /// No deviation is less, in units of the radius: beyond it, the rule would see steps.
        const LEAST: f32 = 1e-3;
        if radius.is_nan() || radius <= 0.0 {
            return 0.0;
        }
        let [xx, xy, _, yy, _, _] = self.covariance;
        let [x, y, _] = self.mean;
        let (middle, half) = (0.5 * (xx + yy), 0.5 * (xx - yy));
        let apart = sqrt(half * half + xy * xy);
        let angle = 0.5 * libm::atan2f(xy, half);
        let (sin, cos) = sin_cos(angle);
        let deviation = |variance| larger(sqrt(variance) / radius, LEAST);
        let (major, minor) = (deviation(middle + apart), deviation(middle - apart));
        let (along, across) = ((cos * x + sin * y) / radius, (cos * y - sin * x) / radius);
        let edge = |u: f32| {
            let u = smaller(larger(u, -1.0), 1.0);
            libm::asinf(u)
        };
        let (low, high) = (edge(across - TAIL * minor), edge(across + TAIL * minor));
        let step = (high - low) / (2.0 * f32::from(PAIRS));
        let integrand = |index: u8| {
            let (u, w) = sin_cos(low + step * f32::from(index));
            let off = (u - across) / minor;
            let density = libm::expf(-0.5 * off * off) * 0.398_942_3 / minor;
            let chord = normal((w - along) / major) - normal((-w - along) / major);
            density * chord * w
        };
        let mut sum = integrand(0) - integrand(2 * PAIRS);
        for pair in 0..PAIRS {
            sum += 4.0 * integrand(2 * pair + 1) + 2.0 * integrand(2 * pair + 2);
        }
        smaller(larger(sum * step / 3.0, 0.0), 1.0)
    }
}

/// Φ, the normal distribution.
fn normal(x: f32) -> f32 {
    0.5 * libm::erfcf(-x * core::f32::consts::FRAC_1_SQRT_2)
}

/// J C Jᵀ.
fn carried(covariance: &[f32; 6], derivative: &Matrix) -> [f32; 6] {
    let [xx, xy, xt, yy, yt, tt] = *covariance;
    let rows = [[xx, xy, xt], [xy, yy, yt], [xt, yt, tt]];
    let product = |[a, b, c]: [f32; 3]| rows.map(|[x, y, t]| a * x + b * y + c * t);
    let inner = |[a, b, c]: [f32; 3], [x, y, t]: [f32; 3]| a * x + b * y + c * t;
    let [first, second, third] = *derivative;
    let (left, middle, right) = (product(first), product(second), product(third));
    [
        inner(left, first),
        inner(left, second),
        inner(left, third),
        inner(middle, second),
        inner(middle, third),
        inner(right, third),
    ]
}

/// Within ±π but for rounding.
fn wrapped(angle: f32) -> f32 {
    crate::math::reduced(crate::math::Sum::new(angle))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_a_round_one_in_the_middle_it_is_known() {
        // 1 − exp(−r²/2σ²), Rayleigh's.
        for sigma in [0.01_f32, 0.1, 0.3, 1.0, 3.0] {
            let round = Gaussian {
                mean: [0.0; 3],
                covariance: [sigma * sigma, 0.0, 0.0, sigma * sigma, 0.0, 0.1],
            };
            let exact = 1.0 - (-0.5 * (0.5 / sigma).powi(2)).exp();
            assert!((round.within(0.5) - exact).abs() < 1e-3, "{sigma}");
        }
    }

    #[test]
    fn of_a_line_it_is_that_of_an_interval() {
        // σ₂ = 0: Φ of the chord's ends. On the line y = 0.3 the chord of a circle of 0.5 m is ±0.4 m long.
        for (mean, exact) in [(0.0, 0.682_69), (0.4, 0.477_25), (1.2, 0.022_72)] {
            let line = Gaussian {
                mean: [mean, 0.3, 0.0],
                covariance: [0.16, 0.0, 0.0, 0.0, 0.0, 0.1],
            };
            let is = line.within(0.5);
            assert!((is - exact).abs() < 1e-3, "{mean}: {is}");
        }
        // Certain.
        let at = |x| Gaussian {
            mean: [x, 0.0, 0.0],
            ..Gaussian::HERE
        };
        assert!(at(0.3).within(0.5) > 0.999 && at(0.6).within(0.5) < 0.001);
        assert_eq!(at(0.0).within(0.0), 0.0);
    }

    #[test]
    fn there_and_back_is_here() {
        let pose = Gaussian {
            mean: [1.0, 2.0, 0.7],
            ..Gaussian::HERE
        };
        let back = pose.then(&pose.inverse());
        assert!(back.mean.iter().all(|x| x.abs() < 1e-6), "{back:?}");
    }
}
