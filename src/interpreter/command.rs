//! From a line's text to a command, in SI and radians.

use super::error::Error;
use super::keyword::{Keyword, Subject};
use super::map::{self, MapCommand};
use super::number::{self, Number};
use super::telemetry::Fields;
use crate::controller::{Observation, Pose};
use crate::params::{DEGREES, Id};
use crate::trajectory::Posture;
use nalgebra::{Matrix3, RowVector3, Vector3};

/// The numbers of a move or turn; what is left out keeps its last value.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MotionArgs {
    /// d, m or rad.
    pub distance: Option<f32>,
    /// v, m/s or rad/s.
    pub speed: Option<f32>,
    /// a, m/s² or rad/s².
    pub acceleration: Option<f32>,
}

/// A command, read.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(
    clippy::large_enum_variant,
    reason = "there is no allocator, and four of them are kept"
)]
pub enum Command {
    /// `move`, m.
    Move(MotionArgs),
    /// `turn`, rad.
    Turn(MotionArgs),
    /// CorrectPos: ΔP (m, m, rad) and K.
    CorrectPos(Vector3<f64>, Matrix3<f64>),
    /// ResetPos: pose and covariance.
    ResetPos(Pose, Matrix3<f64>),
    /// ObservePos or ObserveScalar, with its age in s.
    Observe(Observation, f32),
    /// Stream: period in s, and what to send.
    Stream(f32, Fields),
    /// Help.
    Help(Subject),
    /// GetParam.
    GetParam(Id),
    /// SetParam, in the parameter's unit.
    SetParam(Id, f32),
    /// A command without parameters.
    Plain(Keyword),
    /// Of the gains.
    Calibrate(Calibrate),
    /// Of the map.
    Map(MapCommand),
    /// Of paths.
    Path(PathCommand),
}

/// GoTo, Follow or Chase.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PathCommand {
    /// GoTo.
    GoTo(Posture),
    /// Follow with a posture.
    Append(Posture),
    /// Follow start.
    Start,
    /// Follow clear.
    Clear,
    /// Chase.
    Chase(Posture),
}

/// What Calibrate does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Calibrate {
    /// Observations correct the gains, or only consider them.
    Learn(bool),
    /// Forget what was learned.
    Reset,
    /// The last move was so long, m.
    Straight(f64),
}

impl Command {
    /// True if it may move the base, or let it.
    pub fn may_move(&self) -> bool {
        matches!(
            self,
            Self::Move(_)
                | Self::Turn(_)
                | Self::Plain(Keyword::ClearFault | Keyword::Enable)
                | Self::Path(PathCommand::GoTo(_) | PathCommand::Start | PathCommand::Chase(_))
        )
    }
}

/// The words of a line: separated by blanks, or one comma with optional blanks.
pub(super) struct Words<'a> {
    rest: &'a [u8],
    /// A word is due: the beginning of the parameters, or a comma, came before.
    after_comma: bool,
}

impl<'a> Words<'a> {
    pub(super) fn next(&mut self) -> Result<Option<&'a [u8]>, Error> {
        const EMPTY: Error = Error::Syntax("empty parameter");
        let rest = self.rest.trim_ascii_start();
        if rest.is_empty() {
            self.rest = rest;
            return if self.after_comma {
                Err(EMPTY)
            } else {
                Ok(None)
            };
        }
        let length = rest
            .iter()
            .position(|b| matches!(b, b' ' | b'\t' | b','))
            .unwrap_or(rest.len());
        let Some((word, rest)) = rest.split_at_checked(length) else {
            return Err(EMPTY);
        };
        if word.is_empty() {
            return Err(EMPTY);
        }
        let rest = rest.trim_ascii_start();
        (self.rest, self.after_comma) = match rest {
            [b',', rest @ ..] => (rest, true),
            _ => (rest, false),
        };
        Ok(Some(word))
    }

    fn end(&mut self) -> Result<(), Error> {
        match self.next()? {
            None => Ok(()),
            Some(_) => Err(Error::Syntax("too many parameters")),
        }
    }

    /// The next number, if there is one.
    pub(super) fn optional(&mut self, range: &Range) -> Result<Option<f64>, Error> {
        let Some(word) = self.next()? else {
            return Ok(None);
        };
        let out_of_range = Error::Range {
            name: range.name,
            min: range.min,
            max: range.max,
            unit: range.unit,
        };
        match number::parse(word) {
            None => Err(Error::Syntax("malformed number")),
            Some(Number::Infinite(x)) if range.endless => Ok(Some(x)),
            Some(Number::Infinite(_)) => Err(Error::Syntax("inf is only a distance")),
            // As f32, which the limits are: the number 0.8 is not below the limit 0.8.
            Some(Number::Finite(x)) if (range.min..=range.max).contains(&(x as f32)) => Ok(Some(x)),
            Some(_) => Err(out_of_range),
        }
    }

    /// The same, where `-` stands for a number that is left out though another one comes behind.
    fn unless_dash(&mut self, range: &Range) -> Result<Option<f64>, Error> {
        if self.dash()? {
            return Ok(None);
        }
        self.optional(range)
    }

    /// Takes the next word if it is `-`.
    pub(super) fn dash(&mut self) -> Result<bool, Error> {
        let before = (self.rest, self.after_comma);
        let is_dash = self.next()? == Some(b"-");
        if !is_dash {
            (self.rest, self.after_comma) = before;
        }
        Ok(is_dash)
    }

    pub(super) fn number(&mut self, range: &Range) -> Result<f64, Error> {
        self.optional(range)?.ok_or(TOO_FEW)
    }

    fn numbers<const N: usize>(&mut self, ranges: &[Range; N]) -> Result<[f64; N], Error> {
        let mut values = [0.0; N];
        for (value, range) in values.iter_mut().zip(ranges) {
            *value = self.number(range)?;
        }
        Ok(values)
    }
}

pub(super) const TOO_FEW: Error = Error::Syntax("too few parameters");

/// What a number may be.
#[derive(Clone, Copy)]
pub(super) struct Range {
    name: &'static str,
    min: f32,
    max: f32,
    unit: &'static str,
    /// `inf` is allowed.
    endless: bool,
}

pub(super) const fn range(name: &'static str, min: f32, max: f32, unit: &'static str) -> Range {
    Range {
        name,
        min,
        max,
        unit,
        endless: false,
    }
}

/// A number whose size is judged by what becomes of it.
const fn any(name: &'static str) -> Range {
    range(name, -1e9, 1e9, "")
}

/// A thousand kilometres: S is kept in 48 bits, so a micrometre of it is still seen.
const FAR: f32 = 1e6;
const COORDINATE: f32 = 1e7;
const ANGLE: f32 = 1e7;

const POSE: [Range; 3] = [
    range("x", -COORDINATE, COORDINATE, "m"),
    range("y", -COORDINATE, COORDINATE, "m"),
    range("theta", -ANGLE, ANGLE, "deg"),
];

/// An element of a covariance: enough for any ignorance, and what driving adds to it stays finite in f32.
const fn element(name: &'static str) -> Range {
    range(name, -1e12, 1e12, "")
}

/// Telemetry comes at most once a tick, s.
const MIN_PERIOD: f64 = 0.001;

const AGE: Range = range("age", 0.0, 1.5, "s");

/// Reads a command.
///
/// # Errors
/// [`Error::Syntax`], [`Error::Range`] or [`Error::Unknown`].
// What it has on the stack is not under what carries commands out.
#[inline(never)]
pub fn parse(body: &[u8]) -> Result<Command, Error> {
    let length = body
        .iter()
        .position(|b| matches!(b, b' ' | b'\t' | b','))
        .unwrap_or(body.len());
    let (word, rest) = body
        .split_at_checked(length)
        .ok_or(Error::Syntax("no command"))?;
    let Some(entry) = Keyword::find(word) else {
        return Err(Error::Syntax("unknown command, try Help"));
    };
    let mut words = Words {
        rest,
        after_comma: false,
    };
    let command = read(entry.keyword, &mut words)?;
    words.end()?;
    Ok(command)
}

fn read(keyword: Keyword, words: &mut Words<'_>) -> Result<Command, Error> {
    Ok(match keyword {
        Keyword::Move => Command::Move(motion(words, 1.0, ["m", "m/s", "m/s2"])?),
        Keyword::Turn => Command::Turn(motion(words, DEGREES, ["deg", "deg/s", "deg/s2"])?),
        Keyword::CorrectPos => {
            let [x, y, t] = words.numbers(&POSE)?;
            let [a, b, c, d, e, f, g, h, i] = words.numbers(&[any("K"); 9])?;
            #[rustfmt::skip]
            // K13 and K23 are in m/°, K31 and K32 in °/m.
            let gain = Matrix3::new(
                a, b, c * DEGREES,
                d, e, f * DEGREES,
                g / DEGREES, h / DEGREES, i,
            );
            Command::CorrectPos(Vector3::new(x, y, t / DEGREES), gain)
        }
        Keyword::ResetPos => {
            let pose = pose(words)?;
            let covariance = match words.optional(&element("Cxx"))? {
                Some(xx) => covariance(xx, words)?,
                None => Matrix3::zeros(),
            };
            Command::ResetPos(pose, covariance)
        }
        Keyword::ObservePos => {
            let pose = pose(words)?;
            let xx = words.number(&element("Cxx"))?;
            let covariance = covariance(xx, words)?;
            Command::Observe(Observation::Pose { pose, covariance }, age(words)?)
        }
        Keyword::ObserveScalar => {
            let [innovation] = words.numbers(&[any("nu")])?;
            let [variance] = words.numbers(&[range("R", 0.0, 1e12, "")])?;
            let [h1, h2, h3] = words.numbers(&[any("h"); 3])?;
            let observation = Observation::Scalar {
                innovation,
                variance,
                row: RowVector3::new(h1, h2, h3 * DEGREES),
            };
            Command::Observe(observation, age(words)?)
        }
        Keyword::Stream => {
            let period = words.number(&range("period", 0.0, 3600.0, "s"))?;
            let mut fields = Fields::default();
            while let Some(word) = words.next()? {
                fields.add(word)?;
            }
            if period != 0.0 && period < MIN_PERIOD {
                return Err(Error::Range {
                    name: "period",
                    min: MIN_PERIOD as f32,
                    max: 3600.0,
                    unit: "s, or 0",
                });
            }
            Command::Stream(period as f32, fields)
        }
        Keyword::Help => Command::Help(match words.next()? {
            None => Subject::Topics,
            Some(word) => Subject::find(word).ok_or(Error::Syntax("no such topic or command"))?,
        }),
        Keyword::GetParam => Command::GetParam(parameter(words)?),
        Keyword::SetParam => {
            let id = parameter(words)?;
            let spec = id.spec();
            let value = words.number(&range(spec.name, spec.min, spec.max, spec.unit))?;
            Command::SetParam(id, value as f32)
        }
        Keyword::Calibrate => Command::Calibrate(calibrate(words)?),
        Keyword::GoTo | Keyword::Chase | Keyword::Follow => {
            Command::Path(path_command(keyword, words)?)
        }
        keyword => match map::read(keyword, words)? {
            Some(command) => Command::Map(command),
            None => Command::Plain(keyword),
        },
    })
}

fn motion(words: &mut Words<'_>, unit: f64, names: [&'static str; 3]) -> Result<MotionArgs, Error> {
    let [distance, speed, acceleration] = names;
    let si = |x: Option<f64>| x.map(|x| (x / unit) as f32);
    Ok(MotionArgs {
        distance: si(words.optional(&Range {
            endless: true,
            ..range("d", -FAR, FAR, distance)
        })?),
        // How fast is the controller's to judge.
        speed: si(words.optional(&range("v", -1e9, 1e9, speed))?),
        acceleration: si(words.optional(&range("a", -1e9, 1e9, acceleration))?),
    })
}

fn calibrate(words: &mut Words<'_>) -> Result<Calibrate, Error> {
    let word = words.next()?.ok_or(TOO_FEW)?;
    let is = |name: &str| word.eq_ignore_ascii_case(name.as_bytes());
    Ok(if is("on") {
        Calibrate::Learn(true)
    } else if is("off") {
        Calibrate::Learn(false)
    } else if is("reset") {
        Calibrate::Reset
    } else if is("straight") {
        Calibrate::Straight(words.number(&range("metres", 0.1, 1e3, "m"))?)
    } else {
        return Err(Error::Syntax("on, off, reset or straight"));
    })
}

#[inline(never)]
fn path_command(keyword: Keyword, words: &mut Words<'_>) -> Result<PathCommand, Error> {
    match keyword {
        Keyword::GoTo => posture(words).map(PathCommand::GoTo),
        Keyword::Chase => posture(words).map(PathCommand::Chase),
        _ => follow(words),
    }
}

fn posture(words: &mut Words<'_>) -> Result<Posture, Error> {
    let [x, y, angle] = &POSE;
    let (x, y) = (words.number(x)?, words.number(y)?);
    let heading = words.unless_dash(angle)?;
    Ok(Posture {
        x,
        y,
        heading: heading.map(|angle| crate::math::wrap(angle / DEGREES) as f32),
        speed: None,
    })
}

fn follow(words: &mut Words<'_>) -> Result<PathCommand, Error> {
    let before = (words.rest, words.after_comma);
    let word = words.next()?.ok_or(TOO_FEW)?;
    if word.eq_ignore_ascii_case(b"start") {
        return Ok(PathCommand::Start);
    }
    if word.eq_ignore_ascii_case(b"clear") {
        return Ok(PathCommand::Clear);
    }
    (words.rest, words.after_comma) = before;
    let posture = posture(words)?;
    // How fast is the base's to judge.
    let speed = words.optional(&range("v", f32::MIN, f32::MAX, "m/s"))?;
    Ok(PathCommand::Append(Posture {
        speed: speed.map(|speed| speed as f32),
        ..posture
    }))
}

fn pose(words: &mut Words<'_>) -> Result<Pose, Error> {
    let [x, y, theta] = words.numbers(&POSE)?;
    Ok(Pose {
        x,
        y,
        theta: theta / DEGREES,
    })
}

/// The covariance of which Cxx has been read, from m², m·° and °².
fn covariance(xx: f64, words: &mut Words<'_>) -> Result<Matrix3<f64>, Error> {
    let [xy, xt, yy, yt, tt] = words.numbers(&["Cxy", "Cxt", "Cyy", "Cyt", "Ctt"].map(element))?;
    let (xt, yt, tt) = (xt / DEGREES, yt / DEGREES, tt / DEGREES / DEGREES);
    Ok(Matrix3::new(xx, xy, xt, xy, yy, yt, xt, yt, tt))
}

fn age(words: &mut Words<'_>) -> Result<f32, Error> {
    Ok(words.optional(&AGE)?.unwrap_or(0.0) as f32)
}

fn parameter(words: &mut Words<'_>) -> Result<Id, Error> {
    let name = words.next()?.ok_or(TOO_FEW)?;
    Id::find(name).ok_or(Error::Unknown)
}
