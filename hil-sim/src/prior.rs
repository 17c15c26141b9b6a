//! What a base's parameters say of its gains, to draw bases from (theory section 6). Written from the equations: the controller's own is not asked.

use nalgebra::{Matrix4, Vector4};
use vehicle_controller::params::{Id, Params};
use vehicle_controller::vehicle::Kind;

/// What is known of the gains: k_r or k_d, k_l, k_b or k_α, and the steering's offset (rad) or the drift (rad/m).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prior {
    /// Their mean.
    pub gains: Vector4<f64>,
    /// A root of their covariance: what three independent errors of variance 1 make of them.
    root: Matrix4<f64>,
}

impl Prior {
    /// The priors K_drift, K_scale, K_rot and those of the offset; or, where the parameters hold what was learned, that.
    #[must_use]
    pub fn of(params: &Params) -> Self {
        let get = |id| f64::from(params.get(id));
        let degrees = |id| get(id).sqrt().to_radians();
        let mut gains = Vector4::new(1.0, 1.0, 1.0, 0.0);
        for (place, id) in params.gains().into_iter().enumerate() {
            if let Some(id) = id {
                gains[place] = if place == 3 {
                    get(id).to_radians()
                } else {
                    get(id)
                };
            }
        }
        // By rows, as it is stored.
        let mut learned = Matrix4::zeros();
        let mut elements = Params::spread().into_iter();
        for row in 0..4 {
            for (column, id) in (0..=row).zip(&mut elements) {
                learned[(row, column)] = get(id);
            }
        }
        if learned != Matrix4::zeros() {
            return Self {
                gains,
                root: learned,
            };
        }
        let common = get(Id::KScale).sqrt();
        // A straight metre turns the base by (k_r − k_l)/w.
        let differ = |base| 0.5 * get(base) * degrees(Id::KDrift);
        let (differ, offset) = match params.vehicle() {
            Kind::Differential => (differ(Id::WheelBase), 0.0),
            Kind::BiSteerable => (differ(Id::Track), degrees(Id::KSteer)),
            Kind::Tricycle => (0.0, degrees(Id::KSteer)),
            Kind::Synchro => (0.0, degrees(Id::KTurnDrift)),
        };
        let mut root = Matrix4::zeros();
        root[(0, 1)] = common;
        if matches!(params.vehicle(), Kind::Differential | Kind::BiSteerable) {
            root[(0, 0)] = differ;
            root[(1, 0)] = -differ;
            root[(1, 1)] = common;
        }
        root[(2, 2)] = get(Id::KRot).sqrt();
        root[(3, 3)] = offset;
        Self { gains, root }
    }

    /// The gains for four errors of variance 1.
    #[must_use]
    pub fn sample(&self, errors: [f64; 4]) -> Vector4<f64> {
        self.gains + self.root * Vector4::from(errors)
    }

    /// Standard deviations of the gains.
    #[must_use]
    pub fn deviations(&self) -> Vector4<f64> {
        (self.root * self.root.transpose())
            .diagonal()
            .map(f64::sqrt)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rig::PERIOD;
    use crate::vehicle::configuration;

    #[test]
    fn the_controller_has_the_same_prior() {
        for vehicle in [
            Kind::Differential,
            Kind::Synchro,
            Kind::Tricycle,
            Kind::BiSteerable,
        ] {
            let mut params = Params::of(vehicle);
            for (k_drift, k_scale, k_rot) in [(1.0, 1e-4, 1.93e-4), (0.04, 0.0, 1e-4)] {
                for (id, value) in [
                    (Id::KDrift, k_drift),
                    (Id::KScale, k_scale),
                    (Id::KRot, k_rot),
                    (Id::KSteer, 0.3),
                    (Id::KTurnDrift, 0.5),
                ] {
                    if id.is_of(vehicle) {
                        params.set_all(&[(id, value)]).unwrap();
                    }
                }
                let root = Prior::of(&params).root;
                let theirs = configuration(&params, PERIOD).calibration;
                let difference = root * root.transpose() - theirs.spread.covariance();
                // They store the root in f32, where variances nearly cancel.
                assert!(difference.abs().max() < 1e-9, "{vehicle:?}: {difference}");
                assert_eq!(
                    Prior::of(&params).gains,
                    Vector4::from(theirs.gains.map(f64::from))
                );
            }
        }
    }
}
