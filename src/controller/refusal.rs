//! Why an interface procedure was refused.

use super::correction::CorrectionError;
use crate::supervisor::Fault;

/// Why a procedure was refused. Nothing has changed.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Refusal {
    /// The request before is not carried out yet, or a correction not carried through: wait for a snapshot.
    Busy,
    /// A distance is not a number.
    Distance,
    /// A speed is negative, not a number, or above its limit (m/s or rad/s).
    Speed(f32),
    /// An acceleration is not positive or above its limit (m/s² or rad/s²).
    Acceleration(f32),
    /// The age of an observation is negative, not a number or above 1.5 s.
    Age,
    /// An observation is older than what is remembered, so many seconds: since start-up, or since the pose was reset.
    TooOld(f32),
    /// A number is not finite, or beyond any place on earth.
    NotFinite,
    /// A fault is latched, or its cause persists.
    Fault(Fault),
    /// The motors are disabled.
    Disabled,
    /// The vehicle moves.
    Moving,
    /// The vehicle turns only while it moves, and stands.
    Standing,
    /// There was no run of at least 0.1 m since the gains have last changed.
    Run,
    /// A correction was not acceptable.
    Correction(CorrectionError),
}

impl core::fmt::Display for Refusal {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Busy => "the request before is not carried out yet",
            Self::Distance => "the distance is not a number",
            Self::Run => "there was no run that could be measured",
            Self::Speed(_) => "the speed is out of range",
            Self::Acceleration(_) => "the acceleration is out of range",
            Self::Age | Self::TooOld(_) => "the age is out of range",
            Self::NotFinite => "a number is not finite",
            Self::Fault(_) => "a fault is latched",
            Self::Disabled => "the motors are disabled",
            Self::Moving => "the vehicle moves",
            Self::Standing => "the vehicle turns only while it moves",
            Self::Correction(error) => return error.fmt(f),
        })
    }
}
impl core::error::Error for Refusal {}

impl From<CorrectionError> for Refusal {
    fn from(error: CorrectionError) -> Self {
        Self::Correction(error)
    }
}
