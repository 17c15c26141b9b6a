//! Why a line is refused: the protocol's codes, and how sure each is.

/// A set of the protocol's codes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Codes(u16);

impl Codes {
    /// None.
    pub const NONE: Self = Self(0);
    /// Unknown keyword, malformed number, too few or too many parameters.
    pub const SYNTAX: Self = Self(1);
    /// A number outside its range.
    pub const RANGE: Self = Self(1 << 1);
    /// No such parameter.
    pub const UNKNOWN: Self = Self(1 << 2);
    /// A fault is latched.
    pub const FAULT: Self = Self(1 << 3);
    /// The motors are disabled.
    pub const DISABLED: Self = Self(1 << 4);
    /// The vehicle moves.
    pub const MOVING: Self = Self(1 << 5);
    /// An observation beyond the gate.
    pub const GATE: Self = Self(1 << 6);
    /// No covariance.
    pub const NOT_PSD: Self = Self(1 << 7);
    /// No storage.
    pub const STORAGE: Self = Self(1 << 8);
    /// More than four lines unanswered.
    pub const BUSY: Self = Self(1 << 9);
    /// Wrong check, or none.
    pub const CHECKSUM: Self = Self(1 << 10);
    /// Line too long.
    pub const TOO_LONG: Self = Self(1 << 11);
    /// Not printable.
    pub const BAD_BYTE: Self = Self(1 << 12);
    /// No room.
    pub const FULL: Self = Self(1 << 13);

    /// The map's bounds exclude it.
    pub const CONTRADICTION: Self = Self(1 << 14);

    /// The code of that name.
    pub fn named(name: &[u8]) -> Self {
        match name {
            b"syntax" => Self::SYNTAX,
            b"range" => Self::RANGE,
            b"unknown" => Self::UNKNOWN,
            b"fault" => Self::FAULT,
            b"disabled" => Self::DISABLED,
            b"moving" => Self::MOVING,
            b"gate" => Self::GATE,
            b"not-psd" => Self::NOT_PSD,
            b"storage" => Self::STORAGE,
            b"busy" => Self::BUSY,
            b"checksum" => Self::CHECKSUM,
            b"too-long" => Self::TOO_LONG,
            b"bad-byte" => Self::BAD_BYTE,
            b"full" => Self::FULL,
            b"contradiction" => Self::CONTRADICTION,
            _ => Self::NONE,
        }
    }

    /// Adds codes.
    pub fn add(&mut self, other: Self) {
        self.0 |= other.0;
    }

    /// Adds codes if something holds.
    pub fn add_if(&mut self, holds: bool, other: Self) {
        if holds {
            self.add(other);
        }
    }

    /// True if one of `other`'s is in it.
    pub fn has(self, other: Self) -> bool {
        self.0 & other.0 != 0
    }

    /// True if there is none.
    pub fn is_empty(self) -> bool {
        self == Self::NONE
    }
}

/// Why a line must be refused, and why it may be: where the page leaves a limit open, and where rounding decides.
///
/// The page gives no order in which several faults of a line are found, so a refusal may tell any.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Doubts {
    /// One of these at least.
    pub must: Codes,
    /// Or none.
    pub may: Codes,
}

impl Doubts {
    /// A number must be between two limits, in f32's precision.
    pub fn limit(&mut self, x: f64, min: f64, max: f64) {
        let slack = |limit: f64| limit.abs() * 1e-6 + 1e-30;
        let outside = x < min - slack(min) || x > max + slack(max);
        let edge = (x - min).abs() <= slack(min) || (x - max).abs() <= slack(max);
        self.must.add_if(outside, Codes::RANGE);
        self.may.add_if(edge, Codes::RANGE);
    }

    /// A number may be too large, as the page does not say what is.
    pub fn size(&mut self, x: f64, harmless: f64) {
        self.may.add_if(x.abs() > harmless, Codes::RANGE);
    }
}
