//! Why a line is refused: the protocol's codes, each with a text for people.

use super::text::Text;
use crate::supervisor::Fault;

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
    /// No such parameter.
    Unknown,
    /// Not a covariance, or not a gain.
    NotPsd,
    /// No storage.
    Storage,
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
            Self::Unknown => {
                text.str("unknown no such parameter");
            }
            Self::NotPsd => {
                text.str("not-psd not symmetric positive semi-definite");
            }
            Self::Storage => {
                text.str("storage this base has no parameter storage");
            }
        }
    }
}
