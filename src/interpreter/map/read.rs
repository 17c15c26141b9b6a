//! From a line's text to a command of the map.

use crate::interpreter::command::{Range, TOO_FEW, Words, range};
use crate::interpreter::error::Error;
use crate::interpreter::keyword::Keyword;
use crate::map::{Bounds, FARTHEST, Name, Sighting};
use crate::params::DEGREES;

/// A command of the map; m and rad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MapCommand {
    /// Mark: a name, and the radius of its meadow.
    Mark(Name, Option<f64>),
    /// AmIThere: of one place, or of all.
    AmIThere(Option<Name>),
    /// Sight.
    Sight(Name, Option<Sight>),
    /// Label: a place and a landmark.
    Label(Name, Name),
    /// Freeway: between two places, and how wide; or none.
    Freeway(Name, Name, Option<f32>),
    /// Route: from one place to another, and how wide.
    Route(Name, Name, f32),
    /// Crosses: the ends of two ways.
    Crosses([Name; 4]),
    /// GetMap.
    List,
    /// ForgetMap: all of it, or where the base is.
    Forget(bool),
}

/// Where a landmark is seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sight {
    /// Bearing and its bound, rad.
    bearing: [f64; 2],
    /// Range and its bound, m.
    range: Option<(f64, Option<f64>)>,
}

/// A meadow's radius and a freeway's width.
const RADIUS: Range = range("r", 0.0, 1000.0, "m");
const WIDTH: Range = range("width", 0.0, 1000.0, "m");
const BEARING: Range = range("bearing", -360.0, 360.0, "deg");
const BEARING_BOUND: Range = range("bound", 0.0, 180.0, "deg");
const REACH: Range = range("range", 0.0, 1000.0, "m");
const REACH_BOUND: Range = range("bound", 0.0, 1000.0, "m");

/// Reads a command of the map; `None` if the keyword is none.
///
/// # Errors
/// [`Error::Syntax`] or [`Error::Range`].
pub(in crate::interpreter) fn read(
    keyword: Keyword,
    words: &mut Words<'_>,
) -> Result<Option<MapCommand>, Error> {
    Ok(Some(match keyword {
        Keyword::Mark => MapCommand::Mark(name(words)?, words.optional(&RADIUS)?),
        Keyword::AmIThere => MapCommand::AmIThere(optional_name(words)?),
        Keyword::Sight => MapCommand::Sight(name(words)?, sight(words)?),
        Keyword::Label => MapCommand::Label(name(words)?, name(words)?),
        Keyword::Freeway => MapCommand::Freeway(name(words)?, name(words)?, freeway(words)?),
        Keyword::Route => {
            MapCommand::Route(name(words)?, name(words)?, words.number(&WIDTH)? as f32)
        }
        Keyword::Crosses => {
            MapCommand::Crosses([name(words)?, name(words)?, name(words)?, name(words)?])
        }
        Keyword::GetMap => MapCommand::List,
        Keyword::ForgetMap => MapCommand::Forget(!here(words)?),
        _ => return Ok(None),
    }))
}

fn name(words: &mut Words<'_>) -> Result<Name, Error> {
    optional_name(words)?.ok_or(TOO_FEW)
}

fn optional_name(words: &mut Words<'_>) -> Result<Option<Name>, Error> {
    const NO_NAME: Error = Error::Syntax("a name has 1 to 15 letters, digits, - _ or .");
    let Some(word) = words.next()? else {
        return Ok(None);
    };
    let is_good = |byte: &u8| byte.is_ascii_alphanumeric() || b"-_.".contains(byte);
    let text = core::str::from_utf8(word).ok();
    let text = text.filter(|_| word.iter().all(is_good)).ok_or(NO_NAME)?;
    Name::try_from(text).map(Some).map_err(|_| NO_NAME)
}

fn here(words: &mut Words<'_>) -> Result<bool, Error> {
    match words.next()? {
        None => Ok(false),
        Some(word) if word.eq_ignore_ascii_case(b"here") => Ok(true),
        Some(_) => Err(Error::Syntax("here, or nothing")),
    }
}

/// `-` is no freeway.
fn freeway(words: &mut Words<'_>) -> Result<Option<f32>, Error> {
    if words.dash()? {
        return Ok(None);
    }
    Ok(Some(words.number(&WIDTH)? as f32))
}

fn sight(words: &mut Words<'_>) -> Result<Option<Sight>, Error> {
    let Some(bearing) = words.optional(&BEARING)? else {
        return Ok(None);
    };
    let bound = words.number(&BEARING_BOUND)?;
    let range = match words.optional(&REACH)? {
        Some(range) => Some((range, words.optional(&REACH_BOUND)?)),
        None => None,
    };
    Ok(Some(Sight {
        bearing: [bearing / DEGREES, bound / DEGREES],
        range,
    }))
}

impl Sight {
    /// A range without a bound of its own has that of a run.
    pub(super) fn sighting(&self, bounds: &Bounds) -> Sighting {
        let [bearing, bearing_bound] = self.bearing;
        let range = self.range.map(|(range, bound)| {
            let bound = bound.unwrap_or(bounds.distance + bounds.distance_share * range);
            let nearest = range - bound;
            [if nearest > 0.0 { nearest } else { 0.0 }, range + bound]
        });
        Sighting {
            bearing,
            bearing_bound,
            range: range.filter(|[_, farthest]| *farthest <= FARTHEST),
        }
    }
}
