//! The protocol's commands, as its page says them: what a line without tag and check asks for, or what is wrong with it.

use vehicle_controller::params::{Id, Params};

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

/// What a line asks for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Ask {
    /// Move (0) or turn (1): d, v, a in the protocol's units.
    Motion(usize, [Option<f64>; 3]),
    /// CorrectPos.
    CorrectPos,
    /// ResetPos: x, y, θ, and the upper triangle of the covariance.
    ResetPos([f64; 3], [f64; 6]),
    /// ObservePos or ObserveScalar; whether it has an age.
    Observe(bool),
    /// Stream.
    Stream,
    /// Help.
    Help,
    /// GetParam.
    GetParam(Id),
    /// SetParam.
    SetParam(Id, f64),
    /// Calibrate.
    Calibrate(Calibrate),
    /// Of the map, by its name in the table below; whether it is of one place only.
    Map(&'static str, bool),
    /// A command without parameters, by its name in the table below.
    Plain(&'static str),
}

/// What of the gains.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Calibrate {
    /// Observations correct them, or do not.
    Learn(bool),
    /// They are forgotten.
    Reset,
    /// The last move was so long.
    Straight,
}

impl Ask {
    /// True if it has numbers beyond any parameter's range.
    pub fn is_huge(self) -> bool {
        let is = |x: &Option<f64>| x.is_some_and(|x| x.abs() > 1e8);
        matches!(self, Self::Motion(_, [_, v, a]) if is(&v) || is(&a))
    }

    /// True if it may move the base, or let it.
    pub fn may_move(self) -> bool {
        matches!(
            self,
            Self::Motion(..) | Self::Plain("ClearFault" | "Enable")
        )
    }
}

const PLAIN: [&str; 21] = [
    "GetMap",
    "ForgetMap",
    "Stop",
    "GetGains",
    "GetEstPos",
    "GetEstSpeed",
    "GetStatus",
    "GetState",
    "GetTime",
    "GetBattery",
    "GetSteering",
    "GetWheels",
    "Version",
    "EStop",
    "ClearFault",
    "Enable",
    "Disable",
    "ListParams",
    "SaveParams",
    "LoadParams",
    "ResetParams",
];

const MAP: [&str; 7] = [
    "Mark", "AmIThere", "Sight", "Label", "Freeway", "Route", "Crosses",
];

const WITH_PARAMETERS: [&str; 12] = [
    "Calibrate",
    "m",
    "move",
    "t",
    "turn",
    "CorrectPos",
    "ResetPos",
    "ObservePos",
    "ObserveScalar",
    "Stream",
    "GetParam",
    "SetParam",
];

const TOPICS: [&str; 7] = [
    "map",
    "motion",
    "position",
    "calibration",
    "state",
    "safety",
    "parameters",
];

const FIELDS: [&str; 31] = [
    "t",
    "x",
    "y",
    "theta",
    "cxx",
    "cxy",
    "cxt",
    "cyy",
    "cyt",
    "ctt",
    "v_s",
    "v_alpha",
    "s",
    "s_ref",
    "v_s_ref",
    "alpha",
    "alpha_ref",
    "v_alpha_ref",
    "move_state",
    "turn_state",
    "left_count",
    "right_count",
    "left_speed",
    "right_speed",
    "left_duty",
    "right_duty",
    "battery",
    "left_current",
    "right_current",
    "fault",
    "dropped",
];

fn find(names: &[&'static str], word: &[u8]) -> Option<&'static str> {
    names
        .iter()
        .copied()
        .find(|name| name.as_bytes().eq_ignore_ascii_case(word))
}

/// Reads a line's body. Without an ask, something must be wrong.
pub fn read(body: &[u8]) -> (Option<Ask>, Doubts) {
    let mut doubts = Doubts::default();
    let end = body.iter().position(|b| b" \t,".contains(b));
    let (keyword, rest) = body.split_at(end.unwrap_or(body.len()));
    let mut words = Words {
        rest,
        doubts: &mut doubts,
    };
    let ask = command(keyword, &mut words);
    words.end();
    if ask.is_none() && doubts.must.is_empty() {
        doubts.must.add(Codes::SYNTAX);
    }
    (ask, doubts)
}

fn command(keyword: &[u8], words: &mut Words<'_, '_>) -> Option<Ask> {
    if let Some(plain) = find(&PLAIN, keyword) {
        return Some(Ask::Plain(plain));
    }
    if keyword.eq_ignore_ascii_case(b"Help") {
        if let Some(word) = words.next() {
            let known = find(&TOPICS, word)
                .or_else(|| find(&PLAIN, word))
                .or_else(|| find(&WITH_PARAMETERS, word))
                .or_else(|| find(&MAP, word))
                .is_some()
                || word.eq_ignore_ascii_case(b"Help");
            words.doubts.must.add_if(!known, Codes::SYNTAX);
        }
        return Some(Ask::Help);
    }
    if let Some(name) = find(&MAP, keyword) {
        return map(name, words);
    }
    let Some(name) = find(&WITH_PARAMETERS, keyword) else {
        // Its parameters are nobody's.
        words.rest = &[];
        return None;
    };
    match name {
        "m" | "move" => Some(Ask::Motion(0, words.motion())),
        "t" | "turn" => Some(Ask::Motion(1, words.motion())),
        "CorrectPos" => {
            words.pose();
            for _ in 0..9 {
                let k = words.number()?;
                words.doubts.size(k, 1e6);
            }
            Some(Ask::CorrectPos)
        }
        "ResetPos" => {
            let pose = words.pose();
            let mut covariance = [0.0; 6];
            if words.more() {
                covariance = words.covariance();
            }
            Some(Ask::ResetPos(pose, covariance))
        }
        "ObservePos" => {
            words.pose();
            words.covariance();
            Some(Ask::Observe(words.age()))
        }
        "ObserveScalar" => {
            let [nu, r, h1, h2, h3] = [(); 5].map(|()| words.number().unwrap_or(0.0));
            for x in [nu, h1, h2, h3] {
                words.doubts.size(x, 1e6);
            }
            words.doubts.size(r, 1e9);
            if r < 0.0 {
                words.doubts.must.add(Codes::RANGE);
            }
            Some(Ask::Observe(words.age()))
        }
        "Calibrate" => {
            let words_known = ["on", "off", "reset", "straight"];
            let what = words.next().and_then(|word| find(&words_known, word));
            words.doubts.must.add_if(what.is_none(), Codes::SYNTAX);
            Some(Ask::Calibrate(match what? {
                "reset" => Calibrate::Reset,
                "straight" => {
                    let length = words.number()?;
                    words.doubts.limit(length, 0.1, 1000.0);
                    Calibrate::Straight
                }
                switch => Calibrate::Learn(switch == "on"),
            }))
        }
        "Stream" => {
            let period = words.number()?;
            if period != 0.0 {
                words.doubts.limit(period, 0.001, 3600.0);
            }
            words.fields();
            Some(Ask::Stream)
        }
        "GetParam" => words.parameter().map(Ask::GetParam),
        _ => {
            let id = words.parameter();
            let value = words.number();
            Some(Ask::SetParam(id?, value?))
        }
    }
}

/// A command of the map.
fn map(name: &'static str, words: &mut Words<'_, '_>) -> Option<Ask> {
    let names = match name {
        "Crosses" => 4,
        "Label" | "Freeway" | "Route" => 2,
        "AmIThere" => usize::from(words.more()),
        _ => 1,
    };
    for _ in 0..names {
        words.name()?;
    }
    match name {
        "Mark" if words.more() => {
            words.within(0.0, 1000.0)?;
        }
        "Freeway" | "Route" => {
            words.within(0.0, 1000.0)?;
        }
        "Sight" => {
            if words.more() {
                words.within(-360.0, 360.0)?;
                words.within(0.0, 180.0)?;
            }
            for _ in 0..2 {
                if words.more() {
                    words.within(0.0, 1000.0)?;
                }
            }
        }
        _ => {}
    }
    Some(Ask::Map(name, names == 1))
}

/// What follows a keyword, and what is wrong with it.
struct Words<'a, 'b> {
    rest: &'a [u8],
    doubts: &'b mut Doubts,
}

impl<'a> Words<'a, '_> {
    fn blanks(&mut self) {
        while let [b' ' | b'\t', rest @ ..] = self.rest {
            self.rest = rest;
        }
    }

    fn more(&mut self) -> bool {
        self.blanks();
        !self.rest.is_empty()
    }

    fn next(&mut self) -> Option<&'a [u8]> {
        self.blanks();
        if self.rest.is_empty() {
            return None;
        }
        let end = self.rest.iter().position(|b| b" \t,".contains(b));
        let (word, rest) = self.rest.split_at(end.unwrap_or(self.rest.len()));
        self.doubts.must.add_if(word.is_empty(), Codes::SYNTAX);
        self.rest = rest;
        self.blanks();
        if let [b',', rest @ ..] = self.rest {
            self.rest = rest;
            // After a comma a parameter is due.
            let due = self.more();
            self.doubts.must.add_if(!due, Codes::SYNTAX);
        }
        Some(word)
    }

    fn end(&mut self) {
        let more = self.more();
        self.doubts.must.add_if(more, Codes::SYNTAX);
    }

    /// A number that must be there; nothing if it is none.
    fn number(&mut self) -> Option<f64> {
        match self.optional() {
            Some(x) if x.is_finite() => Some(x),
            Some(_) | None => {
                // `inf` is only for distances.
                self.doubts.must.add(Codes::SYNTAX);
                None
            }
        }
    }

    /// A number between two limits.
    fn within(&mut self, min: f64, max: f64) -> Option<f64> {
        let x = self.number()?;
        self.doubts.limit(x, min, max);
        Some(x)
    }

    /// A number or infinity, if there is a word.
    fn optional(&mut self) -> Option<f64> {
        let word = self.next()?;
        let x = number(word);
        match x {
            None => self.doubts.must.add(Codes::SYNTAX),
            Some(x) if x.is_finite() => {
                let max = f64::from(f32::MAX);
                self.doubts.must.add_if(x.abs() > max, Codes::RANGE);
            }
            Some(_) => {}
        }
        // What was wrong is noted: any number will do from here.
        Some(x.unwrap_or(0.0))
    }

    /// A name: 1 to 15 letters, digits, - _ or .
    fn name(&mut self) -> Option<&'a [u8]> {
        let word = self.next();
        let is_good = |word: &&[u8]| {
            let known = |byte: &u8| byte.is_ascii_alphanumeric() || b"-_.".contains(byte);
            word.len() <= 15 && word.iter().all(known)
        };
        let name = word.filter(is_good);
        self.doubts.must.add_if(name.is_none(), Codes::SYNTAX);
        name
    }

    fn motion(&mut self) -> [Option<f64>; 3] {
        let d = self.optional();
        if let Some(d) = d.filter(|d| d.is_finite()) {
            self.doubts.size(d, 1e5);
        }
        let mut rest = [None; 2];
        for slot in &mut rest {
            if self.more() {
                *slot = self.number();
            }
        }
        [d, rest[0], rest[1]]
    }

    fn pose(&mut self) -> [f64; 3] {
        [(); 3].map(|()| {
            let x = self.number().unwrap_or(0.0);
            self.doubts.size(x, 1e6);
            x
        })
    }

    fn covariance(&mut self) -> [f64; 6] {
        [(); 6].map(|()| {
            let x = self.number().unwrap_or(0.0);
            self.doubts.size(x, 1e9);
            x
        })
    }

    fn age(&mut self) -> bool {
        if !self.more() {
            return false;
        }
        let age = self.number().unwrap_or(0.0);
        if !(0.0..=1e-30).contains(&age) {
            self.doubts.limit(age, 0.0, 1.5);
        }
        true
    }

    fn fields(&mut self) {
        let mut given = [false; FIELDS.len()];
        let mut count = 0;
        while let Some(word) = self.next() {
            let field = FIELDS
                .iter()
                .position(|name| name.as_bytes().eq_ignore_ascii_case(word));
            let twice = field.is_none_or(|field| core::mem::replace(&mut given[field], true));
            self.doubts.must.add_if(twice, Codes::SYNTAX);
            count += 1;
        }
        self.doubts.must.add_if(count > 16, Codes::RANGE);
    }

    fn parameter(&mut self) -> Option<Id> {
        let Some(name) = self.next() else {
            self.doubts.must.add(Codes::SYNTAX);
            return None;
        };
        let id = Params::default()
            .ids()
            .find(|id| id.spec().name.as_bytes().eq_ignore_ascii_case(name));
        self.doubts.must.add_if(id.is_none(), Codes::UNKNOWN);
        id
    }
}

/// Decimal, with optional sign, fraction and exponent; or `inf`.
fn number(word: &[u8]) -> Option<f64> {
    let unsigned = match word {
        [b'+' | b'-', rest @ ..] => rest,
        _ => word,
    };
    let exponent = unsigned.iter().position(|b| b"eE".contains(b));
    let is_infinite = unsigned.eq_ignore_ascii_case(b"inf");
    let (mantissa, exponent) = unsigned.split_at(exponent.unwrap_or(unsigned.len()));
    let digits = mantissa.iter().filter(|b| b.is_ascii_digit()).count();
    let has_point = mantissa.contains(&b'.');
    let good_mantissa = digits > 0 && digits + usize::from(has_point) == mantissa.len();
    let good_exponent = match exponent {
        [] => true,
        [_, b'+' | b'-', rest @ ..] | [_, rest @ ..] => {
            !rest.is_empty() && rest.iter().all(u8::is_ascii_digit)
        }
    };
    if is_infinite || good_mantissa && good_exponent {
        let x: f64 = str::from_utf8(word).ok()?.parse().ok()?;
        // Too large for an f64 is not infinite, but too large.
        Some(if is_infinite {
            x
        } else {
            x.clamp(-f64::MAX, f64::MAX)
        })
    } else {
        None
    }
}
