//! Parameters: named numbers in the protocol's units, and the configuration in SI that is built from them.
//!
//! They are stored as they were written (degrees stay degrees), so that a value reads back as it was set. [`Params::build`] makes the active
//! form, in SI and radians, once per change.

mod restore;
pub mod store;
mod table;

pub use restore::{Fallback, Fallbacks, Restored};
pub use table::{Id, Kind, Spec};

use crate::controller::{AxisConfig, Config, Limits, Noise, Sensing};
use crate::math::sqrt;
use crate::supervisor::{self, MotorModel};
use crate::time::Duration;
use crate::vehicle::gains::{ROOT, of_each};
use crate::vehicle::{self, Calibration, Spread, differential, servo};
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

/// A complete, valid set of parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Params {
    values: [f32; Id::COUNT],
}

impl Default for Params {
    fn default() -> Self {
        Self {
            values: Id::ALL.map(|id| id.spec().default),
        }
    }
}

/// The gains, in the order of [`Calibration`]: of the right wheel, the left wheel, the wheel base.
pub const GAINS: [Id; 3] = [Id::GainRight, Id::GainLeft, Id::GainBase];
/// The root of their covariance, in the order of [`Spread`]: by rows.
pub const SPREAD: [Id; 6] = [
    Id::SpreadRr,
    Id::SpreadLr,
    Id::SpreadLl,
    Id::SpreadBr,
    Id::SpreadBl,
    Id::SpreadBb,
];

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
        }
    }

    /// The active configuration, for a tick of the given period.
    #[must_use]
    pub fn build(&self, period: Duration) -> Config<differential::Config> {
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
                // A differential drive does not steer.
                ..Noise::default()
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
            vehicle: self.vehicle(),
        }
    }

    /// What is known of the gains: what was learned, or the prior (theory section 6).
    pub(crate) fn calibration(&self) -> Calibration {
        let root = SPREAD.map(|id| self.get(id));
        let spread = if root == [0.0; 6] {
            self.prior()
        } else {
            spread_of(root)
        };
        Calibration {
            gains: self.gains(),
            spread,
        }
    }

    /// A differential drive has no offset.
    fn gains(&self) -> [f32; vehicle::GAINS] {
        of_each(GAINS.map(|id| self.get(id)), 0.0)
    }

    /// K_drift makes the wheels differ, K_scale is common to both, K_rot is the base's: Var k_r = Var k_l = σ_d² + σ_δ², Cov = σ_d² − σ_δ²,
    /// σ_δ = w √K_drift / 2.
    fn prior(&self) -> Spread {
        let different = 0.5 * self.get(Id::WheelBase) * radians(1.0) * sqrt(self.get(Id::KDrift));
        let (different, common) = (different * different, self.get(Id::KScale));
        let wheel = sqrt(common + different);
        let over = |a: f32| if wheel > 0.0 { a / wheel } else { 0.0 };
        spread_of([
            wheel,
            over(common - different),
            // The variance that is left: (a + b) − (a − b)²/(a + b) = 4ab/(a + b).
            over(2.0 * sqrt(common * different)),
            0.0,
            0.0,
            sqrt(self.get(Id::KRot)),
        ])
    }

    /// Takes over what has been learned of the gains.
    pub fn learn(&mut self, calibration: &Calibration) {
        for (id, gain) in GAINS.into_iter().zip(calibration.gains) {
            self.put(id, gain);
        }
        for (id, element) in SPREAD.into_iter().zip(calibration.spread.root) {
            self.put(id, element);
        }
    }

    /// Forgets it.
    pub fn unlearn(&mut self) {
        self.learn(&Calibration::default());
    }

    /// The gains are what they are, but as uncertain as if nothing had been learned.
    pub fn doubt_gains(&mut self) {
        for id in SPREAD {
            self.put(id, 0.0);
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

    /// The vehicle's part of the configuration.
    #[inline(never)]
    #[must_use]
    pub fn vehicle(&self) -> differential::Config {
        let servo = |reversed| servo::Config {
            static_friction: self.get(Id::MotorFriction),
            speed_gain: self.get(Id::MotorSpeedGain),
            acceleration_gain: self.get(Id::MotorAccelGain),
            proportional: self.get(Id::ServoP),
            integral: self.get(Id::ServoI),
            integral_limit: self.get(Id::ServoILimit),
            max_duty: self.get(Id::MaxDuty),
            reversed,
        };
        // K = 2πR r/N; the gear ratio is part of the counts per turn of the wheel.
        let per_count = |diameter| {
            core::f64::consts::PI * f64::from(self.get(diameter))
                / f64::from(self.get(Id::CountsPerTurn))
        };
        differential::Config {
            geometry: differential::Geometry::new(
                f64::from(self.get(Id::WheelBase)),
                per_count(Id::LeftDiameter),
                per_count(Id::RightDiameter),
                self.gains(),
            ),
            max_wheel_speed: self.get(Id::MaxWheelSpeed),
            observer_bandwidth: 2.0 * PI * self.get(Id::ObserverBandwidth),
            encoder_reversed: [
                self.is_on(Id::LeftEncoderReversed),
                self.is_on(Id::RightEncoderReversed),
            ],
            servo: [
                servo(self.is_on(Id::LeftMotorReversed)),
                servo(self.is_on(Id::RightMotorReversed)),
            ],
        }
    }
}

/// With the first three gains' root; the offset is known.
fn spread_of(first: [f32; 6]) -> Spread {
    let mut root = [0.0; ROOT];
    for (element, first) in root.iter_mut().zip(first) {
        *element = first;
    }
    Spread { root }
}

/// Degrees in a radian: the protocol's unit of angles, which ends here and in the interpreter.
pub const DEGREES: f64 = 180.0 / core::f64::consts::PI;

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
        let config = Params::default().build(Duration::millis(1));
        // π 0.084 / 2796.8
        assert!((config.vehicle.geometry.per_count()[0] - 9.435_6e-5).abs() < 1e-9);
        assert!((config.noise.drift - 0.01 * (PI / 180.0) * (PI / 180.0)).abs() < 1e-4);
    }
}
