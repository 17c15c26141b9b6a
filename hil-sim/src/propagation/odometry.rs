//! Odometry of each vehicle with gains of its own, in f64 and written from the equations (theory sections 1, 5 and 6): the library's is not asked.

use crate::replay::Row;
use std::f64::consts::{PI, TAU};
use vehicle_controller::params::{Id, Params};
use vehicle_controller::vehicle::Kind;

/// What the encoders and the steering's sensor say of a moment.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Reading {
    /// Right and left wheel, by the nominal diameters, m; of one driven wheel, that and nothing; of a synchro drive, the drive (m) and the steering (rad).
    pub rolled: [f64; 2],
    /// Of a car's front wheels, right and left, m.
    pub front: [f64; 2],
    /// φ as measured, rad.
    pub steer: f64,
}

/// ΔS (m) and Δα (rad) of the reference point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moved {
    /// ΔS.
    pub ahead: f64,
    /// Δα.
    pub turned: f64,
}

/// The gains: k_r or k_d, k_l, k_b or k_α, and φ₀ (rad) or the drift (rad/m).
pub type Gains = [f64; 4];

/// What a vehicle's counts amount to.
#[derive(Clone, Copy, Debug)]
pub struct Odometry {
    geometry: Geometry,
    /// For each count of `rolled`.
    per_count: [f64; 2],
}

#[derive(Clone, Copy, Debug)]
enum Geometry {
    /// w, m.
    Differential(f64),
    Synchro,
    /// L, m.
    Tricycle(f64),
    Car(Car),
}

/// A car: two axles that are steered by φ and f(φ).
#[derive(Clone, Copy, Debug)]
struct Car {
    /// L, m.
    length: f64,
    /// B, m.
    track: f64,
    /// f(φ) = slope φ: 0 or −1.
    slope: f64,
    /// What the rear axle and the front axle have to say in it.
    axles: [bool; 2],
    /// The relation to the first order in B/ρ.
    printed: bool,
}

impl Odometry {
    /// That of a vehicle with these parameters.
    #[must_use]
    pub fn of(params: &Params) -> Self {
        let get = |id| f64::from(params.get(id));
        let metres = |diameter| PI * get(diameter) / get(Id::CountsPerTurn);
        let two = [Id::RightDiameter, Id::LeftDiameter].map(metres);
        let one = metres(Id::WheelDiameter);
        let (geometry, per_count) = match params.vehicle() {
            Kind::Differential => (Geometry::Differential(get(Id::WheelBase)), two),
            Kind::Synchro => (Geometry::Synchro, [one, TAU / get(Id::TurnCounts)]),
            Kind::Tricycle => (Geometry::Tricycle(get(Id::WheelBase)), [one, 0.0]),
            Kind::BiSteerable => {
                let choice = get(Id::Odometry);
                let car = Car {
                    length: get(Id::WheelBase),
                    track: get(Id::Track),
                    slope: if params.is_on(Id::RearSteered) {
                        -1.0
                    } else {
                        0.0
                    },
                    axles: [!(0.5..1.5).contains(&choice), choice >= 0.5],
                    printed: params.is_on(Id::PrintedRelation),
                };
                (Geometry::Car(car), two)
            }
        };
        Self {
            geometry,
            per_count,
        }
    }

    /// What a log's row says.
    #[must_use]
    pub fn reading(&self, row: &Row) -> Reading {
        // Rows have the left wheel first, or the only one, or the drive.
        let ordered = |[first, second]: [i64; 2]| match self.geometry {
            Geometry::Differential(_) | Geometry::Car(_) => [second, first],
            Geometry::Synchro | Geometry::Tricycle(_) => [first, second],
        };
        let scaled = |counts| {
            let [first, second] = ordered(counts);
            [
                first as f64 * self.per_count[0],
                second as f64 * self.per_count[1],
            ]
        };
        Reading {
            rolled: scaled(row.counts),
            front: scaled(row.front),
            steer: row.steer.unwrap_or_default(),
        }
    }

    /// What a count amounts to: m, rad.
    #[must_use]
    pub fn resolution(&self) -> [f64; 2] {
        let [first, second] = self.per_count;
        match self.geometry {
            Geometry::Differential(base) | Geometry::Car(Car { track: base, .. }) => {
                let count = first.max(second);
                [count, count / base]
            }
            Geometry::Synchro => [first, second],
            Geometry::Tricycle(length) => [first, first / length],
        }
    }

    /// How far a motion goes for the steering's noise, m: its way, or if it points aside, that of the wheel about the rear axle.
    #[must_use]
    pub fn steered_way(&self, way: f64, turned: f64) -> f64 {
        match self.geometry {
            Geometry::Tricycle(length) => way.max((length * turned).abs()),
            _ => way,
        }
    }

    /// The motion, if these are the gains and the steering is off by `skew` (rad) beside its offset.
    #[must_use]
    pub fn moved(&self, reading: &Reading, gains: &Gains, skew: f64) -> Moved {
        let [k_first, k_left, k_base, offset] = *gains;
        let [first, second] = reading.rolled;
        let phi = reading.steer + offset + skew;
        match self.geometry {
            Geometry::Differential(base) => {
                let (right, left) = (k_first * first, k_left * second);
                Moved {
                    ahead: 0.5 * (right + left),
                    turned: (right - left) / (k_base * base),
                }
            }
            Geometry::Synchro => {
                let ahead = k_first * first;
                Moved {
                    ahead,
                    turned: k_base * second + offset * ahead,
                }
            }
            Geometry::Tricycle(length) => {
                let (sin, cos) = phi.sin_cos();
                Moved {
                    ahead: k_first * first * cos,
                    turned: k_first * first * sin / (k_base * length),
                }
            }
            Geometry::Car(car) => car.moved(reading, [k_first, k_left], k_base, phi),
        }
    }
}

impl Car {
    /// The wheels say how far, the steering on what circle: S* of theory section 5 with the curvature that φ prescribes, κ = tan φ/(L − r) at the reference
    /// point. What an axle's middle goes along the car is the same for all points of its axis: ΔS cos a. Two axles count by the reciprocals of their variances.
    fn moved(&self, reading: &Reading, gains: [f64; 2], k_base: f64, phi: f64) -> Moved {
        let track = k_base * self.track;
        let curvature = phi.tan() / (self.length * (1.0 + 0.5 * self.slope));
        let axles = [
            (reading.rolled, self.slope * phi, self.axles[0]),
            (reading.front, phi, self.axles[1]),
        ];
        let (mut ahead, mut turned) = ([0.0; 2], [0.0; 2]);
        for ([right, left], angle, counts) in axles {
            if !counts {
                continue;
            }
            let cos = angle.cos();
            let x = 0.5 * curvature * cos * track;
            // S*/S of a wheel, with x for the right one and −x for the left one.
            let starred = |x: f64| {
                if self.printed {
                    1.0
                } else {
                    (1.0 + x).abs() / (1.0 + 2.0 * x * cos + x * x).sqrt()
                }
            };
            let right = gains[0] * right * starred(x);
            let left = gains[1] * left * starred(-x);
            let width = if self.printed { track * cos } else { track };
            let weights = [1.0 / (cos * cos), (track * cos).powi(2)];
            ahead[0] += weights[0] * 0.5 * (right + left) * cos;
            ahead[1] += weights[0];
            turned[0] += weights[1] * (right - left) / width;
            turned[1] += weights[1];
        }
        Moved {
            ahead: ahead[0] / ahead[1],
            turned: turned[0] / turned[1],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ways of the right and the left wheel, on circles about the common centre: it lies `radius` to the left of the car's axis, and the wheels `x` ahead of it.
    fn ways(turned: f64, radius: f64, x: f64, track: f64) -> [f64; 2] {
        [0.5, -0.5].map(|side| turned * (radius + side * track).hypot(x))
    }

    #[test]
    fn a_car_on_a_circle_goes_on_that_circle() {
        let (length, track, phi) = (1.2, 1.2, 0.3_f64);
        for (slope, axles) in [
            (0.0, [true, false]),
            (0.0, [false, true]),
            (0.0, [true, true]),
            (-1.0, [true, false]),
            (-1.0, [false, true]),
            (-1.0, [true, true]),
        ] {
            let car = Car {
                length,
                track,
                slope,
                axles,
                printed: false,
            };
            let behind = -0.5 * slope * length;
            let radius = (length - behind) / phi.tan();
            let turned = 0.02 / radius;
            let reading = Reading {
                rolled: ways(turned, radius, -behind, track),
                front: ways(turned, radius, length - behind, track),
                steer: phi,
            };
            let moved = car.moved(&reading, [1.0; 2], 1.0, phi);
            assert!((moved.ahead / 0.02 - 1.0).abs() < 1e-12, "{moved:?}");
            assert!((moved.turned / turned - 1.0).abs() < 1e-12, "{moved:?}");
        }
    }
}
