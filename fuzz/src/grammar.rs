//! The protocol's commands, as its page says them: what a line without tag and check asks for, or what is wrong with it.

mod codes;
mod words;

pub use codes::{Codes, Doubts};

use vehicle_controller::params::Id;
use words::Words;

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
    /// GoTo, Follow or Chase.
    Route(Route),
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

/// What of paths.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Route {
    /// To a posture, and all others are forgotten.
    GoTo,
    /// One more; v.
    Append(Option<f64>),
    /// The path through all of them is followed.
    Start,
    /// They are forgotten.
    Clear,
    /// After a posture that moves.
    Chase,
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
            Self::Motion(..)
                | Self::Plain("ClearFault" | "Enable")
                | Self::Route(Route::GoTo | Route::Start | Route::Chase)
        )
    }
}

const PLAIN: [&str; 21] = [
    "GetMap",
    "Stop",
    "GetPath",
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

const MAP: [&str; 8] = [
    "Mark",
    "AmIThere",
    "Sight",
    "Label",
    "Freeway",
    "Route",
    "Crosses",
    "ForgetMap",
];

const WITH_PARAMETERS: [&str; 15] = [
    "Calibrate",
    "GoTo",
    "Follow",
    "Chase",
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

const TOPICS: [&str; 8] = [
    "map",
    "motion",
    "path",
    "position",
    "calibration",
    "state",
    "safety",
    "parameters",
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
            words.doubts.must.add_if(!is_subject(word), Codes::SYNTAX);
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
        "GoTo" => {
            words.posture();
            Some(Ask::Route(Route::GoTo))
        }
        "Chase" => {
            words.posture();
            Some(Ask::Route(Route::Chase))
        }
        "Follow" => Some(Ask::Route(match words.one_of(&["start", "clear"]) {
            Some("start") => Route::Start,
            Some(_) => Route::Clear,
            None => {
                words.posture();
                let speed = words.more().then(|| words.number().unwrap_or(1.0));
                Route::Append(speed)
            }
        })),
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

/// What Help tells of.
fn is_subject(word: &[u8]) -> bool {
    let known = find(&TOPICS, word)
        .or_else(|| find(&PLAIN, word))
        .or_else(|| find(&WITH_PARAMETERS, word))
        .or_else(|| find(&MAP, word));
    known.is_some() || word.eq_ignore_ascii_case(b"Help")
}

/// A command of the map.
fn map(name: &'static str, words: &mut Words<'_, '_>) -> Option<Ask> {
    let names = match name {
        "Crosses" => 4,
        "Label" | "Freeway" | "Route" => 2,
        "AmIThere" => usize::from(words.more()),
        "ForgetMap" => 0,
        _ => 1,
    };
    for _ in 0..names {
        words.name()?;
    }
    match name {
        "Mark" if words.more() => {
            words.within(0.0, 1000.0)?;
        }
        "ForgetMap" => drop(words.one_of(&["here"])),
        "Freeway" if words.one_of(&["-"]).is_some() => {}
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
