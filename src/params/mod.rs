//! Parameters: named numbers in the protocol's units, and the configuration in SI that is built from them.
//!
//! They are stored as they were written (degrees stay degrees), so that a value reads back as it was set. [`Params::build`] makes the active
//! form, in SI and radians, once per change.

mod differential;
mod gains;
#[cfg(feature = "vehicles")]
mod others;
mod restore;
pub mod store;
mod table;

pub use restore::{Fallback, Fallbacks, Restored};
pub use table::{Id, Kind, Kinds, Spec};

// What depends on the vehicle: a firmware for the differential drive alone knows no other.
#[cfg(not(feature = "vehicles"))]
use differential::{gains_of, own_defaults, prior, shape, steering_noise, turns_in_place};
#[cfg(feature = "vehicles")]
use others::{gains_of, own_defaults, prior, shape, steering_noise, turns_in_place};

use crate::controller::{AxisConfig, Config, Limits, Noise, Sensing};
use crate::supervisor::{self, MotorModel};
use crate::time::{self, Duration};
use crate::trajectory::{KinematicLimits, Settings, Tolerance};
use crate::vehicle::gains::OFFSETS;
use crate::vehicle::{self, servo};
use core::f32::consts::PI;

/// Why a parameter was refused. Nothing has changed.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ParamError {
    /// Outside its range, not a number, or a switch that is neither 0 nor 1.
    Range(Id),
    /// Larger than this other parameter, or smaller where it must not be.
    Conflict(Id, Id),
}

impl core::fmt::Display for ParamError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Range(id) => write!(f, "{} is out of range", id.spec().name),
            Self::Conflict(small, large) => write!(
                f,
                "{} must not exceed {}",
                small.spec().name,
                large.spec().name
            ),
        }
    }
}
impl core::error::Error for ParamError {}

/// A complete, valid set of parameters of a vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Params {
    vehicle: vehicle::Kind,
    values: [f32; Id::COUNT],
}

/// Those of a new differential drive.
impl Default for Params {
    fn default() -> Self {
        Self::of(vehicle::Kind::Differential)
    }
}

/// What of a vehicle's shape bounds its paths.
struct Shape {
    /// 1/m.
    max_curvature: f32,
    /// 1/(m s).
    curvature_rate: f32,
    /// m; see [`KinematicLimits`].
    half_track: f32,
}

/// A vehicle's configuration, which is built from its parameters.
pub trait Blueprint: Copy {
    /// The active form: in SI and radians. The parameters are those of this vehicle.
    fn build(params: &Params) -> Self;
}

/// Pairs of which the first must not exceed the second.
const ORDERED: [(Id, Id); 6] = [
    (Id::MoveSpeed, Id::MaxSpeed),
    (Id::MoveAccel, Id::MaxAccel),
    (Id::StopAccel, Id::MaxAccel),
    (Id::TurnSpeed, Id::MaxTurnSpeed),
    (Id::TurnAccel, Id::MaxTurnAccel),
    (Id::StopTurnAccel, Id::MaxTurnAccel),
];

/// An axis has come to rest below 5 mm/s …
const REST_SPEED: f32 = 0.005;
/// … or 3 °/s: what the same wheels make of it, near enough.
const REST_TURN_SPEED: f32 = 3.0;
/// A battery that is not measured is this much off its nominal voltage, full or empty; so are the speeds that its motors make.
const GUESSED_SUPPLY: f32 = 0.15;

impl Params {
    /// Those of a new vehicle.
    #[must_use]
    pub fn of(vehicle: vehicle::Kind) -> Self {
        let mut params = Self {
            vehicle,
            values: Id::ALL.map(|id| id.spec().default),
        };
        for (id, value) in own_defaults(vehicle) {
            params.put(*id, *value);
        }
        params
    }

    /// Whose they are.
    #[must_use]
    pub fn vehicle(&self) -> vehicle::Kind {
        self.vehicle
    }

    /// The parameters that this vehicle has, in the order in which they are listed.
    pub fn ids(&self) -> impl Iterator<Item = Id> + use<> {
        let vehicle = self.vehicle;
        Id::ALL.iter().copied().filter(move |id| id.is_of(vehicle))
    }

    /// How many that are.
    #[must_use]
    pub fn count(&self) -> usize {
        self.ids().count()
    }

    /// The value, in the parameter's unit.
    #[must_use]
    pub fn get(&self, id: Id) -> f32 {
        self.values.get(id as usize).copied().unwrap_or_default()
    }

    /// True for a switch that is on.
    #[must_use]
    pub fn is_on(&self, id: Id) -> bool {
        self.get(id) != 0.0
    }

    /// Sets a value in the parameter's unit.
    ///
    /// # Errors
    /// [`ParamError`] if the value is outside its range or at odds with another parameter.
    pub fn set(&mut self, id: Id, value: f32) -> Result<(), ParamError> {
        self.set_all(&[(id, value)])
    }

    /// Sets several values that may be at odds one by one, but not together.
    ///
    /// # Errors
    /// [`ParamError`] as for [`set`](Self::set); then nothing is changed.
    pub fn set_all(&mut self, values: &[(Id, f32)]) -> Result<(), ParamError> {
        let mut changed = *self;
        for (id, value) in values {
            if !id.allows(*value) {
                return Err(ParamError::Range(*id));
            }
            changed.put(*id, *value);
        }
        for (small, large) in ORDERED {
            if changed.get(small) > changed.get(large) {
                return Err(ParamError::Conflict(small, large));
            }
        }
        *self = changed;
        Ok(())
    }

    /// Sets a value that is known to be allowed.
    fn put(&mut self, id: Id, value: f32) {
        if let Some(slot) = self.values.get_mut(id as usize) {
            *slot = value;
        }
    }

    /// What commands may ask for, in SI and radians.
    #[must_use]
    pub fn limits(&self) -> Limits {
        Limits {
            speed: self.get(Id::MaxSpeed),
            acceleration: self.get(Id::MaxAccel),
            turn_speed: radians(self.get(Id::MaxTurnSpeed)),
            turn_acceleration: radians(self.get(Id::MaxTurnAccel)),
            turns_in_place: turns_in_place(self),
        }
    }

    /// How paths are driven: with the speeds and accelerations that a command has which gives none. `period` is the tick's.
    #[must_use]
    pub fn trajectory(&self, period: Duration) -> Settings {
        /// The slowest corner, as a share of the speed on a leg: less, and it is turned on the spot.
        const SLOWEST: f32 = 0.15;
        /// Of what a wheel can roll: the rest is for the servo, to take out what is left of errors.
        const HEADROOM: f32 = 0.95;
        let speed = self.get(Id::MoveSpeed);
        let shape = shape(self);
        Settings {
            corner: self.get(Id::Corner),
            tolerance: Tolerance {
                distance: self.get(Id::Arrival),
                heading: radians(self.get(Id::ArrivalTurn)),
            },
            chase_timeout: self.get(Id::ChaseTimeout),
            limits: KinematicLimits {
                speed,
                acceleration: self.get(Id::MoveAccel),
                turn_speed: radians(self.get(Id::TurnSpeed)),
                turn_acceleration: radians(self.get(Id::TurnAccel)),
                max_curvature: shape.max_curvature,
                curvature_rate: shape.curvature_rate,
                wheel_speed: HEADROOM * self.get(Id::MaxWheelSpeed),
                half_track: shape.half_track,
                slowest: SLOWEST * speed,
                turns_in_place: turns_in_place(self),
            },
            period: time::seconds(period),
        }
    }

    /// The active configuration, for a tick of the given period.
    #[must_use]
    pub fn build<C: Blueprint>(&self, period: Duration) -> Config<C> {
        let axis = |gain, lag, tolerance, rest_speed| AxisConfig {
            gain,
            max_error: lag,
            tolerance,
            rest_speed,
        };
        Config {
            period,
            translation: axis(
                self.get(Id::MoveGain),
                self.get(Id::MoveLag),
                self.get(Id::MoveTolerance),
                REST_SPEED,
            ),
            rotation: axis(
                self.get(Id::TurnGain),
                radians(self.get(Id::TurnLag)),
                radians(self.get(Id::TurnTolerance)),
                radians(REST_TURN_SPEED),
            ),
            stop_acceleration: self.get(Id::StopAccel),
            stop_turn_acceleration: radians(self.get(Id::StopTurnAccel)),
            noise: Noise {
                translation: self.get(Id::NoiseS),
                drift: radians(radians(self.get(Id::NoiseDrift))),
                // °²/° is °, and rad²/rad is rad.
                rotation: radians(self.get(Id::NoiseRot)),
                steering: [steering_noise(self); OFFSETS],
            },
            calibration: self.calibration(),
            anew: false,
            sensing: Sensing {
                nominal_supply: self.get(Id::Supply),
                battery_divider: self.get(Id::BatteryDivider),
                current_scale: self.get(Id::CurrentScale),
                current_zero: self.get(Id::CurrentZero),
                estop_input: self.is_on(Id::EstopInput),
            },
            supervision: self.supervision(),
            vehicle: C::build(self),
        }
    }

    fn supervision(&self) -> supervisor::Config {
        let nominal = self.get(Id::Supply);
        let is_measured = self.get(Id::BatteryDivider) > 0.0;
        let gains = [Id::MotorFriction, Id::MotorSpeedGain, Id::MotorAccelGain];
        let tolerance =
            self.get(Id::MotorTolerance) + if is_measured { 0.0 } else { GUESSED_SUPPLY };
        let endless = |value: f32| if value > 0.0 { value } else { f32::INFINITY };
        supervisor::Config {
            motor: MotorModel::new(
                gains.map(|id| self.get(id)),
                self.get(Id::MotorResistance),
                tolerance,
                nominal,
            ),
            max_wheel_speed: self.get(Id::MaxWheelSpeed),
            max_current: endless(self.get(Id::MaxCurrent)),
            supply: if is_measured {
                [Id::SupplyMin, Id::SupplyMax].map(|id| self.get(id) * nominal)
            } else {
                [f32::NEG_INFINITY, f32::INFINITY]
            },
            deadman: endless(self.get(Id::Deadman)),
        }
    }

    /// The servo of one motor.
    fn servo(&self, reversed: Id) -> servo::Config {
        servo::Config {
            static_friction: self.get(Id::MotorFriction),
            speed_gain: self.get(Id::MotorSpeedGain),
            acceleration_gain: self.get(Id::MotorAccelGain),
            proportional: self.get(Id::ServoP),
            integral: self.get(Id::ServoI),
            integral_limit: self.get(Id::ServoILimit),
            max_duty: self.get(Id::MaxDuty),
            reversed: self.is_on(reversed),
        }
    }

    /// K = 2πR r/N, m per count; the gear ratio is part of the counts per turn of the wheel.
    fn metres_per_count(&self, diameter: Id) -> f64 {
        core::f64::consts::PI * f64::from(self.get(diameter))
            / f64::from(self.get(Id::CountsPerTurn))
    }

    /// Bandwidth of the speed observers, rad/s.
    fn observer_bandwidth(&self) -> f32 {
        2.0 * PI * self.get(Id::ObserverBandwidth)
    }
}

/// Degrees in a radian: the protocol's unit of angles, which ends here and in the interpreter.
pub const DEGREES: f64 = 180.0 / core::f64::consts::PI;

/// Radians to degrees.
#[must_use]
pub fn degrees(radians: f32) -> f32 {
    (f64::from(radians) * DEGREES) as f32
}

/// Degrees to radians.
#[must_use]
pub fn radians(degrees: f32) -> f32 {
    (f64::from(degrees) / DEGREES) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn defaults_are_valid_and_names_unique() {
        let mut params = Params::default();
        for id in Id::ALL {
            let spec = id.spec();
            assert!(spec.min < spec.max, "{}", spec.name);
            assert_eq!(params.set(id, spec.default), Ok(()), "{}", spec.name);
            assert_eq!(Id::find(spec.name.as_bytes()), Some(id));
        }
    }

    #[test]
    fn refusals_change_nothing() {
        let mut params = Params::default();
        for value in [f32::NAN, f32::INFINITY, -1.0, 1e9] {
            assert_eq!(
                params.set(Id::WheelBase, value),
                Err(ParamError::Range(Id::WheelBase))
            );
        }
        assert_eq!(
            params.set(Id::RequireCrc, 0.5),
            Err(ParamError::Range(Id::RequireCrc))
        );
        assert_eq!(
            params.set(Id::MoveSpeed, params.get(Id::MaxSpeed) + 0.1),
            Err(ParamError::Conflict(Id::MoveSpeed, Id::MaxSpeed))
        );
        assert_eq!(params, Params::default());
    }

    #[test]
    fn several_at_once_may_pass_each_other() {
        let mut params = Params::default();
        let values = [(Id::MoveSpeed, 3.0), (Id::MaxSpeed, 4.0)];
        assert_eq!(params.set_all(&values), Ok(()));
        assert_eq!(params.get(Id::MoveSpeed), 3.0);
        let before = params;
        assert_eq!(
            params.set_all(&[(Id::MaxSpeed, 1.0)]),
            Err(ParamError::Conflict(Id::MoveSpeed, Id::MaxSpeed))
        );
        assert_eq!(params, before);
    }

    #[test]
    fn keys_are_unique_and_stay() {
        let mut keys: std::vec::Vec<_> = Id::ALL.iter().map(|id| id.key()).collect();
        keys.sort_unstable();
        keys.dedup();
        assert_eq!(keys.len(), Id::COUNT);
        assert!(!keys.contains(&0) && !keys.contains(&u32::MAX));
        // As zlib's crc32 has it: what is stored must still be found by later firmware.
        assert_eq!(Id::WheelBase.key(), 0x75A4_AEF0);
    }

    #[test]
    fn geometry_of_the_default_robot() {
        let config: Config<vehicle::differential::Config> =
            Params::default().build(Duration::millis(1));
        // π 0.084 / 2796.8
        assert!((config.vehicle.geometry.per_count()[0] - 9.435_6e-5).abs() < 1e-9);
        assert!((config.noise.drift - 0.01 * (PI / 180.0) * (PI / 180.0)).abs() < 1e-4);
    }
}
