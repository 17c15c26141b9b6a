//! The parameters of a differential drive.

use super::gains::GainIds;
use super::{Blueprint, Id, Params, Shape, radians};
use crate::math::sqrt;
use crate::vehicle::gains::{ROOT, of_each};
use crate::vehicle::{self, Spread, differential};

impl Blueprint for differential::Config {
    #[inline(never)]
    fn build(params: &Params) -> Self {
        Self {
            geometry: differential::Geometry::new(
                f64::from(params.get(Id::WheelBase)),
                params.metres_per_count(Id::LeftDiameter),
                params.metres_per_count(Id::RightDiameter),
                params.gain_values(),
            ),
            max_wheel_speed: params.get(Id::MaxWheelSpeed),
            observer_bandwidth: params.observer_bandwidth(),
            encoder_reversed: [
                params.is_on(Id::LeftEncoderReversed),
                params.is_on(Id::RightEncoderReversed),
            ],
            servo: [Id::LeftMotorReversed, Id::RightMotorReversed].map(|id| params.servo(id)),
        }
    }
}

/// k_r, k_l, k_b.
pub(super) fn gains_of(_: vehicle::Kind) -> GainIds {
    of_each([Id::GainRight, Id::GainLeft, Id::GainBase].map(Some), None)
}

/// As the table has them.
pub(super) fn own_defaults(_: vehicle::Kind) -> &'static [(Id, f32)] {
    &[]
}

/// Of the wheels at the distance `wheel_base`.
pub(super) fn prior(params: &Params) -> Spread {
    prior_of_wheels(params, Id::WheelBase)
}

/// K_drift makes the wheels differ, K_scale is common to both, K_rot is the base's: Var k_r = Var k_l = σ_d² + σ_δ², Cov = σ_d² − σ_δ²,
/// σ_δ = w √K_drift / 2.
pub(super) fn prior_of_wheels(params: &Params, base: Id) -> Spread {
    let different = 0.5 * params.get(base) * radians(1.0) * sqrt(params.get(Id::KDrift));
    let (different, common) = (different * different, params.get(Id::KScale));
    let wheel = sqrt(common + different);
    let over = |a: f32| if wheel > 0.0 { a / wheel } else { 0.0 };
    let first = [
        wheel,
        over(common - different),
        // The variance that is left: (a + b) − (a − b)²/(a + b) = 4ab/(a + b).
        over(2.0 * sqrt(common * different)),
        0.0,
        0.0,
        sqrt(params.get(Id::KRot)),
    ];
    let mut root = [0.0; ROOT];
    for (element, first) in root.iter_mut().zip(first) {
        *element = first;
    }
    Spread { root }
}

/// Nothing is steered.
pub(super) fn steering_noise(_: &Params) -> f32 {
    0.0
}

/// Nothing but its wheels bounds a path.
pub(super) fn shape(params: &Params) -> Shape {
    Shape {
        max_curvature: f32::INFINITY,
        curvature_rate: f32::INFINITY,
        half_track: 0.5 * params.get(Id::WheelBase),
    }
}

/// It always does.
pub(super) fn turns_in_place(_: &Params) -> bool {
    true
}
