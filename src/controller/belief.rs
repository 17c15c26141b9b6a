//! What is known of the pose, apart from the gains.
//!
//! The error of the estimate is e + Γ g: e is the pose's own, g that of the gains, and the two know nothing of each other. Γ, the leverage, is what a
//! gain that is wrong by 1 has done to the pose. Between corrections P, the covariance of g, stands still; C, that of e, grows by what is random; and Γ
//! goes along with the motion. So the covariance that is reported, C + Γ P Γᵀ, is positive semi-definite whatever rounding does, and the control
//! interrupt carries three numbers more for each gain, not a covariance of all. (The two-stage filter of B. Friedland, 1969.)

use super::estimator::{Estimate, Pose};
use super::reckoning::Reckoning;
use crate::math::{product, product_transposed, sum};
use crate::vehicle::{GAINS, Spread};
use nalgebra::{Matrix3, SMatrix};

/// Γ: a column for each gain, m, m, rad.
pub type Leverage = SMatrix<f64, 3, GAINS>;

/// A pose with its own covariance, and what the gains do to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Belief {
    /// x, y (m), θ (rad).
    pub pose: Pose,
    /// C, of e: m², m·rad, rad².
    pub own: Matrix3<f64>,
    /// Γ.
    pub leverage: Leverage,
}

impl Belief {
    /// Γ P Γᵀ: what the gains add to the covariance.
    #[must_use]
    pub fn shared(&self, spread: &Spread) -> Matrix3<f64> {
        let root = product(&self.leverage, &spread.matrix());
        product_transposed(&root, &root)
    }

    /// What the gains have done to the pose becomes its own: they are others from here on.
    pub fn absorb(&mut self, spread: &Spread) {
        self.own = sum(&self.own, 1.0, &self.shared(spread));
        self.leverage = Leverage::zeros();
    }

    /// The estimate, for gains that are known as well as this.
    #[must_use]
    pub fn estimate(&self, spread: &Spread) -> Estimate {
        Estimate {
            pose: self.pose,
            covariance: sum(&self.own, 1.0, &self.shared(spread)),
        }
    }
}

impl From<Estimate> for Belief {
    /// Of a pose that has nothing to do with the gains.
    fn from(estimate: Estimate) -> Self {
        Self {
            pose: estimate.pose,
            own: estimate.covariance,
            leverage: Leverage::zeros(),
        }
    }
}

impl From<&Belief> for Reckoning {
    fn from(belief: &Belief) -> Self {
        Self::new(&belief.pose, &belief.own, &belief.leverage)
    }
}

impl From<&Reckoning> for Belief {
    fn from(reckoning: &Reckoning) -> Self {
        let (pose, own, leverage) = reckoning.to_f64();
        Self {
            pose,
            own,
            leverage,
        }
    }
}
