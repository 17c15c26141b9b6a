//! The parameters of the other vehicles, and what differs from one vehicle to the other.

use super::gains::GainIds;
use super::{Blueprint, Id, Params, Shape, differential, radians};
use crate::math::{sin_cos, sqrt};
use crate::vehicle::{Kind, Relation, Spread, bisteerable, steering, synchro, tricycle};
use core::f32::consts::TAU;

impl Blueprint for synchro::Config {
    fn build(params: &Params) -> Self {
        Self {
            metres_per_count: params.metres_per_count(Id::WheelDiameter) as f32,
            radians_per_count: TAU / params.get(Id::TurnCounts),
            lever: params.get(Id::TurnLever),
            gains: params.gain_values(),
            max_wheel_speed: params.get(Id::MaxWheelSpeed),
            observer_bandwidth: params.observer_bandwidth(),
            encoder_reversed: [Id::LeftEncoderReversed, Id::RightEncoderReversed]
                .map(|id| params.is_on(id)),
            servo: [Id::LeftMotorReversed, Id::RightMotorReversed].map(|id| params.servo(id)),
        }
    }
}

impl Blueprint for tricycle::Config {
    fn build(params: &Params) -> Self {
        Self {
            wheel_base: params.get(Id::WheelBase),
            metres_per_count: params.metres_per_count(Id::WheelDiameter) as f32,
            gains: params.gain_values(),
            max_wheel_speed: params.get(Id::MaxWheelSpeed),
            observer_bandwidth: params.observer_bandwidth(),
            encoder_reversed: params.is_on(Id::LeftEncoderReversed),
            servo: params.servo(Id::LeftMotorReversed),
            steering: params.steering(),
        }
    }
}

impl Blueprint for bisteerable::Config {
    fn build(params: &Params) -> Self {
        Self {
            wheel_base: params.get(Id::WheelBase),
            track: params.get(Id::Track),
            rear_steering: if params.is_on(Id::RearSteered) {
                bisteerable::RearSteering::Opposite
            } else {
                bisteerable::RearSteering::Fixed
            },
            relation: if params.is_on(Id::PrintedRelation) {
                Relation::Printed
            } else {
                Relation::Exact
            },
            odometry: match params.get(Id::Odometry) {
                choice if choice < 0.5 => bisteerable::Odometry::Rear,
                choice if choice < 1.5 => bisteerable::Odometry::Front,
                _ => bisteerable::Odometry::Four,
            },
            metres_per_count: [Id::LeftDiameter, Id::RightDiameter]
                .map(|id| params.metres_per_count(id)),
            gains: params.gain_values(),
            max_wheel_speed: params.get(Id::MaxWheelSpeed),
            observer_bandwidth: params.observer_bandwidth(),
            encoder_reversed: [Id::LeftEncoderReversed, Id::RightEncoderReversed]
                .map(|id| params.is_on(id)),
            servo: [Id::LeftMotorReversed, Id::RightMotorReversed].map(|id| params.servo(id)),
            steering: params.steering(),
        }
    }
}

impl Params {
    fn steering(&self) -> steering::Config {
        const MICROSECOND: f32 = 1e-6;
        let per_radian = radians(1.0);
        steering::Config {
            max_angle: radians(self.get(Id::SteerMax)),
            max_rate: radians(self.get(Id::SteerRate)),
            offset: radians(self.get(Id::SteerOffset)),
            pulse_centre: self.get(Id::ServoCentre) * MICROSECOND,
            pulse_per_radian: self.get(Id::ServoScale) * MICROSECOND / per_radian,
            volts_centre: self.get(Id::PotCentre),
            radians_per_volt: radians(self.get(Id::PotScale)),
            radians_per_count: steering::Config::per_count(self.get(Id::SteerCounts)),
        }
    }
}

/// Of the driven wheel, of the rotation; the steering's offset, or the drift.
pub(super) fn gains_of(vehicle: Kind) -> GainIds {
    match vehicle {
        Kind::Differential => differential::gains_of(vehicle),
        Kind::Synchro => [
            Some(Id::GainDrive),
            None,
            Some(Id::GainTurn),
            Some(Id::TurnDrift),
        ],
        Kind::Tricycle => [
            Some(Id::GainDrive),
            None,
            Some(Id::GainBase),
            Some(Id::SteerOffset),
        ],
        Kind::BiSteerable => [Id::GainRight, Id::GainLeft, Id::GainBase, Id::SteerOffset].map(Some),
    }
}

/// A steering follows with some lag, so the heading is held more gently than by two wheels.
const STEERED: &[(Id, f32)] = &[(Id::TurnGain, 4.0), (Id::TurnLag, 10.0)];

/// Where a vehicle differs from the table.
pub(super) fn own_defaults(vehicle: Kind) -> &'static [(Id, f32)] {
    match vehicle {
        Kind::Differential | Kind::Synchro => differential::own_defaults(vehicle),
        Kind::Tricycle | Kind::BiSteerable => STEERED,
    }
}

/// What is known of the gains before anything was learned.
pub(super) fn prior(params: &Params) -> Spread {
    let deviation = |id: Id| sqrt(params.get(id));
    // One wheel, or one gear: no gains of pairs.
    let single = |offset: f32| {
        let mut spread = Spread::NONE;
        let [drive, _, _, _, _, turn, .., last] = &mut spread.root;
        *drive = deviation(Id::KScale);
        *turn = deviation(Id::KRot);
        *last = offset;
        spread
    };
    match params.vehicle() {
        Kind::Differential => differential::prior(params),
        Kind::Synchro => single(radians(deviation(Id::KTurnDrift))),
        Kind::Tricycle => single(radians(deviation(Id::KSteer))),
        Kind::BiSteerable => {
            let mut spread = differential::prior_of_wheels(params, Id::Track);
            let [.., last] = &mut spread.root;
            *last = radians(deviation(Id::KSteer));
            spread
        }
    }
}

/// κ_steer, rad² m.
pub(super) fn steering_noise(params: &Params) -> f32 {
    match params.vehicle() {
        Kind::Differential | Kind::Synchro => differential::steering_noise(params),
        Kind::Tricycle | Kind::BiSteerable => radians(radians(params.get(Id::NoiseSteer))),
    }
}

/// Of a car, that of its steering: dκ = dφ/(ℓ cos² φ), at its slowest straight ahead. A wheel ahead of the axle goes √(v_s² + (ℓ v_α)²), which is no more than
/// v_s + ℓ v_α.
pub(super) fn shape(params: &Params) -> Shape {
    let steered = |length: f32, track: f32| {
        let (sin, cos) = sin_cos(radians(params.get(Id::SteerMax)));
        Shape {
            max_curvature: if turns_in_place(params) {
                f32::INFINITY
            } else {
                sin / (cos * length)
            },
            curvature_rate: radians(params.get(Id::SteerRate)) / length,
            half_track: length + 0.5 * track,
        }
    };
    let wheel_base = params.get(Id::WheelBase);
    match params.vehicle() {
        Kind::Differential => differential::shape(params),
        // Its wheels turn all together.
        Kind::Synchro => Shape {
            half_track: 0.0,
            ..differential::shape(params)
        },
        Kind::Tricycle => steered(wheel_base, 0.0),
        Kind::BiSteerable => {
            let to_front = if params.is_on(Id::RearSteered) {
                0.5 * wheel_base
            } else {
                wheel_base
            };
            steered(to_front, params.get(Id::Track))
        }
    }
}

/// A car does not; a tricycle does whose wheel turns so far that it rolls around the rear axle.
pub(super) fn turns_in_place(params: &Params) -> bool {
    match params.vehicle() {
        Kind::Differential | Kind::Synchro => differential::turns_in_place(params),
        Kind::Tricycle => radians(params.get(Id::SteerMax)) >= tricycle::ASIDE,
        Kind::BiSteerable => false,
    }
}
