//! Why a line is refused: the protocol's codes, each with a text for people.

use super::text::Text;
use crate::controller::{CorrectionError, Refusal};
use crate::map::MapError;
use crate::params::ParamError;
use crate::params::store::StoreError;
use crate::supervisor::Fault;
use crate::trajectory::{PathError, Unable};
use crate::vehicle::Calibration;

/// A refusal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Error {
    /// Not a command; the text says what was expected.
    Syntax(&'static str),
    /// A number outside its range: its name, the range, the unit.
    Range {
        /// Which number.
        name: &'static str,
        /// The smallest allowed.
        min: f32,
        /// The largest allowed.
        max: f32,
        /// Their unit.
        unit: &'static str,
    },
    /// A parameter that must not exceed another one.
    Order(&'static str, &'static str),
    /// Longer than 255 bytes.
    TooLong,
    /// A byte that is not printable.
    BadByte,
    /// The check is wrong, or missing where it is required.
    Checksum,
    /// More than four lines unanswered.
    Busy,
    /// A fault is latched.
    Fault(Fault),
    /// An observation beyond the gate; its squared distance.
    Gate(f32),
    /// The motors are disabled.
    Disabled,
    /// The vehicle moves.
    Moving,
    /// The vehicle turns only while it moves, and stands.
    Standing,
    /// No room for another posture.
    Full,
    /// A path that the vehicle cannot drive.
    Path(PathError),
    /// No such parameter.
    Unknown,
    /// Not a covariance, or not a gain.
    NotPsd,
    /// No storage.
    Storage,
    /// The storage has failed, or has nothing.
    Store(StoreError),
    /// The map stayed as it was.
    Map(MapError),
}

impl Error {
    /// Writes `ERR <code> <text>`.
    pub fn write(&self, text: &mut Text) {
        text.str("ERR ");
        match self {
            Self::Syntax(expected) => {
                text.str("syntax ").str(expected);
            }
            Self::Range {
                name,
                min,
                max,
                unit,
            } => {
                text.str("range ").str(name).shortest(*min).word("to");
                text.shortest(*max);
                if !unit.is_empty() {
                    text.word(unit);
                }
            }
            Self::Order(small, large) => {
                text.str("range ")
                    .str(small)
                    .word("must not exceed")
                    .word(large);
            }
            Self::TooLong => {
                text.str("too-long a line has at most 255 bytes");
            }
            Self::BadByte => {
                text.str("bad-byte only printable ASCII and tab");
            }
            Self::Checksum => {
                text.str("checksum the check is wrong or missing");
            }
            Self::Busy => {
                text.str("busy more than 4 lines unanswered");
            }
            Self::Fault(fault) => {
                text.str("fault ").str(fault.name());
            }
            Self::Gate(distance) => {
                text.str("gate d2").fixed(f64::from(*distance), 3);
            }
            Self::Disabled => {
                text.str("disabled the motors are disabled");
            }
            Self::Moving => {
                text.str("moving not while the vehicle moves");
            }
            Self::Standing => {
                text.str("standing turns only while it moves");
            }
            Self::Full => {
                text.str("full there is no room for another posture");
            }
            Self::Path(error) => path(text, *error),
            Self::Unknown => {
                text.str("unknown no such parameter");
            }
            Self::NotPsd => {
                text.str("not-psd not symmetric positive semi-definite");
            }
            Self::Storage => {
                text.str("storage this base has no parameter storage");
            }
            Self::Store(error) => {
                text.str("storage ").str(error.text());
            }
            Self::Map(error) => {
                let code = match error {
                    MapError::Full => "full",
                    MapError::Contradiction => "contradiction",
                    MapError::Place
                    | MapError::Arc
                    | MapError::Landmark
                    | MapError::Route
                    | MapError::Lost => "unknown",
                };
                text.str(code).word(error.text());
            }
        }
    }
}

fn path(text: &mut Text, error: PathError) {
    let (number, what) = match error {
        PathError::Full | PathError::Still => {
            text.str("range move_speed or turn_speed is 0");
            return;
        }
        PathError::Range(n) => (n, "is none, or too far"),
        PathError::Start(n) => (
            n,
            "does not lie ahead, and the vehicle cannot turn in place",
        ),
        PathError::Sharp(n) => (
            n,
            "takes too sharp a turn: the vehicle cannot turn in place",
        ),
    };
    text.str("range posture")
        .integer(number as i64 + 1)
        .word(what);
}

/// What a refused path is answered with.
pub fn refuse_path(error: Unable) -> Error {
    match error {
        Unable::Motion(refusal) => refuse(refusal),
        Unable::Path(PathError::Full) => Error::Full,
        Unable::Path(error) => Error::Path(error),
    }
}

/// What a refused parameter is answered with.
pub fn refuse_param(error: ParamError) -> Error {
    match error {
        ParamError::Range(id) => {
            let spec = id.spec();
            Error::Range {
                name: spec.name,
                min: spec.min,
                max: spec.max,
                unit: spec.unit,
            }
        }
        ParamError::Conflict(small, large) => Error::Order(small.spec().name, large.spec().name),
    }
}

/// What a refused motion is answered with. `unit` is how many of the protocol's units an SI unit has.
pub fn refuse_motion(refusal: Refusal, unit: f64, name: &'static str) -> Error {
    let range = |what, max: f32, metres, degrees| Error::Range {
        name: what,
        min: 0.0,
        max: (f64::from(max) * unit) as f32,
        unit: if name == "m" { metres } else { degrees },
    };
    match refusal {
        Refusal::Speed(max) => range("v", max, "m/s", "deg/s"),
        Refusal::Acceleration(max) => range("a", max, "m/s2", "deg/s2"),
        other => refuse(other),
    }
}

/// What a refused procedure is answered with.
// Within `refuse_motion` the compiler would leave a trap in its table for what cannot come here.
#[inline(never)]
pub fn refuse(refusal: Refusal) -> Error {
    match refusal {
        Refusal::Busy => Error::Busy,
        Refusal::Fault(fault) => Error::Fault(fault),
        Refusal::Disabled => Error::Disabled,
        Refusal::Moving => Error::Moving,
        Refusal::Standing => Error::Standing,
        Refusal::Correction(CorrectionError::Gate(distance)) => Error::Gate(distance),
        Refusal::Correction(CorrectionError::NotPositive) => Error::NotPsd,
        Refusal::Correction(CorrectionError::Gains) => Error::Range {
            name: "a gain",
            min: Calibration::RANGE[0],
            max: Calibration::RANGE[1],
            unit: "",
        },
        Refusal::Run => Error::Range {
            name: "the last move",
            min: 0.1,
            max: 1e3,
            unit: "m",
        },
        Refusal::Age => age_range(1.5),
        Refusal::TooOld(reach) => age_range(reach),
        // The parser lets no such number through; the interface may still be called by others.
        Refusal::Correction(CorrectionError::NotFinite)
        | Refusal::NotFinite
        | Refusal::Distance
        | Refusal::Speed(_)
        | Refusal::Acceleration(_) => not_finite(),
    }
}

fn age_range(max: f32) -> Error {
    Error::Range {
        name: "age",
        min: 0.0,
        max,
        unit: "s",
    }
}

/// A pose or covariance beyond use.
fn not_finite() -> Error {
    Error::Range {
        name: "the result's size",
        min: 0.0,
        max: 1e7,
        unit: "m or deg",
    }
}
