//! The parameters of a line, word by word.

use vehicle_controller::params::{Id, Params};

use super::codes::{Codes, Doubts};
use super::find;

const FIELDS: [&str; 32] = [
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
    "tick_load",
];

/// What follows a keyword, and what is wrong with it.
pub(super) struct Words<'a, 'b> {
    pub(super) rest: &'a [u8],
    pub(super) doubts: &'b mut Doubts,
}

impl<'a> Words<'a, '_> {
    fn blanks(&mut self) {
        while let [b' ' | b'\t', rest @ ..] = self.rest {
            self.rest = rest;
        }
    }

    pub(super) fn more(&mut self) -> bool {
        self.blanks();
        !self.rest.is_empty()
    }

    pub(super) fn next(&mut self) -> Option<&'a [u8]> {
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

    pub(super) fn end(&mut self) {
        let more = self.more();
        self.doubts.must.add_if(more, Codes::SYNTAX);
    }

    /// A number that must be there; nothing if it is none.
    pub(super) fn number(&mut self) -> Option<f64> {
        match self.optional() {
            Some(x) if x.is_finite() => Some(x),
            Some(_) | None => {
                // `inf` is only for distances.
                self.doubts.must.add(Codes::SYNTAX);
                None
            }
        }
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

    /// A number between two limits.
    pub(super) fn within(&mut self, min: f64, max: f64) -> Option<f64> {
        let x = self.number()?;
        self.doubts.limit(x, min, max);
        Some(x)
    }

    /// A name: 1 to 15 letters, digits, - _ or .
    pub(super) fn name(&mut self) -> Option<&'a [u8]> {
        let word = self.next();
        let is_good = |word: &&[u8]| {
            let known = |byte: &u8| byte.is_ascii_alphanumeric() || b"-_.".contains(byte);
            word.len() <= 15 && word.iter().all(known)
        };
        let name = word.filter(is_good);
        self.doubts.must.add_if(name.is_none(), Codes::SYNTAX);
        name
    }

    pub(super) fn motion(&mut self) -> [Option<f64>; 3] {
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

    pub(super) fn pose(&mut self) -> [f64; 3] {
        [(); 3].map(|()| {
            let x = self.number().unwrap_or(0.0);
            self.doubts.size(x, 1e6);
            x
        })
    }

    /// x and y, and a heading that may be left out, or be `-`.
    pub(super) fn posture(&mut self) {
        for _ in 0..2 {
            let x = self.number().unwrap_or(0.0);
            self.doubts.size(x, 1e6);
        }
        if self.one_of(&["-"]).is_none() && self.more() {
            let theta = self.number().unwrap_or(0.0);
            self.doubts.size(theta, 1e6);
        }
    }

    /// The next word if it is one of these.
    pub(super) fn one_of(&mut self, names: &[&'static str]) -> Option<&'static str> {
        let before = (self.rest, *self.doubts);
        let found = self.next().and_then(|word| find(names, word));
        if found.is_none() {
            (self.rest, *self.doubts) = before;
        }
        found
    }

    pub(super) fn covariance(&mut self) -> [f64; 6] {
        [(); 6].map(|()| {
            let x = self.number().unwrap_or(0.0);
            self.doubts.size(x, 1e9);
            x
        })
    }

    pub(super) fn age(&mut self) -> bool {
        if !self.more() {
            return false;
        }
        let age = self.number().unwrap_or(0.0);
        if !(0.0..=1e-30).contains(&age) {
            self.doubts.limit(age, 0.0, 1.5);
        }
        true
    }

    pub(super) fn fields(&mut self) {
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

    pub(super) fn parameter(&mut self) -> Option<Id> {
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
