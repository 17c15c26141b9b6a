//! What a base's parameters say of its gains, to draw bases from (theory section 6). Written from the equations: the controller's own is not asked.

use nalgebra::{Matrix3, Vector3};
use vehicle_controller::params::{Id, Params};

/// What is known of k_r, k_l and k_b.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prior {
    /// Their mean.
    pub gains: Vector3<f64>,
    /// A root of their covariance: what three independent errors of variance 1 make of them.
    root: Matrix3<f64>,
}

impl Prior {
    /// The priors K_drift, K_scale and K_rot; or, where the parameters hold what was learned, that.
    #[must_use]
    pub fn of(params: &Params) -> Self {
        let get = |id| f64::from(params.get(id));
        let gains = Vector3::from([Id::GainRight, Id::GainLeft, Id::GainBase].map(get));
        let [rr, lr, ll, br, bl, bb, ..] = Params::spread().map(get);
        let learned = Matrix3::new(rr, 0.0, 0.0, lr, ll, 0.0, br, bl, bb);
        if learned != Matrix3::zeros() {
            return Self {
                gains,
                root: learned,
            };
        }
        // A straight metre turns the base by (k_r − k_l)/w.
        let differ = 0.5 * get(Id::WheelBase) * get(Id::KDrift).sqrt().to_radians();
        let common = get(Id::KScale).sqrt();
        let root = Matrix3::new(
            differ,
            common,
            0.0,
            -differ,
            common,
            0.0,
            0.0,
            0.0,
            get(Id::KRot).sqrt(),
        );
        Self { gains, root }
    }

    /// The gains for three errors of variance 1.
    #[must_use]
    pub fn sample(&self, errors: [f64; 3]) -> Vector3<f64> {
        self.gains + self.root * Vector3::from(errors)
    }

    /// Standard deviations of the gains.
    #[must_use]
    pub fn deviations(&self) -> Vector3<f64> {
        (self.root * self.root.transpose())
            .diagonal()
            .map(f64::sqrt)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vehicle_controller::time::Duration;
    use vehicle_controller::vehicle::differential;

    #[test]
    fn the_controller_has_the_same_prior() {
        let mut params = Params::default();
        for (k_drift, k_scale, k_rot) in [(1.0, 1e-4, 1.93e-4), (0.04, 0.0, 1e-4)] {
            params
                .set_all(&[
                    (Id::KDrift, k_drift),
                    (Id::KScale, k_scale),
                    (Id::KRot, k_rot),
                ])
                .unwrap();
            let root = Prior::of(&params).root;
            let theirs = params
                .build::<differential::Config>(Duration::millis(1))
                .calibration
                .spread;
            let difference = root * root.transpose() - theirs.covariance().fixed_view::<3, 3>(0, 0);
            // They store the root in f32, where variances nearly cancel.
            assert!(difference.abs().max() < 1e-9, "{difference}");
        }
    }
}
