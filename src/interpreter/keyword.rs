//! The table of commands: keyword, usage, meaning. Help prints it.

/// What is known of a command.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Entry {
    /// The command.
    pub keyword: Keyword,
    /// How it is written.
    pub name: &'static str,
    /// A shorter way to write it.
    pub short: Option<&'static str>,
    /// Its parameters and what it does.
    pub help: &'static str,
}

macro_rules! keywords {
    ($($keyword:ident $name:literal $short:expr, $help:literal;)*) => {
        /// A command's keyword.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[allow(missing_docs, reason = "they are named as in the protocol")]
        pub enum Keyword {
            $($keyword,)*
        }

        /// Every command.
        pub const ALL: &[Entry] = &[
            $(Entry { keyword: Keyword::$keyword, name: $name, short: $short, help: $help },)*
        ];
    };
}

keywords! {
    Move "move" Some("m"), "[d [v [a]]]: translate by d m (inf: no end) at v m/s with a m/s2; v 0 stops this axis";
    Turn "turn" Some("t"), "[d [v [a]]]: rotate by d deg (inf: no end) at v deg/s with a deg/s2; v 0 stops this axis";
    Stop "Stop" None, ": both axes decelerate and hold";
    GetEstPos "GetEstPos" None, ": x y theta Cxx Cxy Cxt Cyy Cyt Ctt in m and deg";
    GetEstSpeed "GetEstSpeed" None, ": v_s (m/s) v_alpha (deg/s)";
    CorrectPos "CorrectPos" None, "dx dy dtheta K11 K12 K13 K21 ... K33: P += K dP, C -= K C, of the last GetEstPos";
    ResetPos "ResetPos" None, "x y theta [Cxx Cxy Cxt Cyy Cyt Ctt]: set pose and covariance";
    ObservePos "ObservePos" None, "x y theta Cxx Cxy Cxt Cyy Cyt Ctt [age]: correct by an observed pose";
    ObserveScalar "ObserveScalar" None, "nu R h1 h2 h3 [age]: correct by an innovation nu with variance R and row h";
    GetStatus "GetStatus" None, ": move state, turn state, enabled or disabled, fault";
    GetState "GetState" None, ": t S S' S'' alpha alpha' alpha''";
    GetTime "GetTime" None, ": seconds since boot";
    GetBattery "GetBattery" None, ": volts";
    GetWheels "GetWheels" None, ": counts, speeds (m/s) and duties, left and right";
    Stream "Stream" None, "period [fields]: telemetry every period s, 0 off; default t x y theta v_s v_alpha";
    Version "Version" None, ": name, version, target, protocol version";
    Help "Help" None, "[command]: this";
    EStop "EStop" None, ": motors off at once, fault estop";
    ClearFault "ClearFault" None, ": clear the latched fault if its cause is gone";
    Enable "Enable" None, ": motor power on";
    Disable "Disable" None, ": stop, then motor power off";
    GetParam "GetParam" None, "name: value and unit";
    SetParam "SetParam" None, "name value: set, effective at once";
    ListParams "ListParams" None, ": all parameters as ~ name value min max unit";
    SaveParams "SaveParams" None, ": keep the parameters over power-off";
    LoadParams "LoadParams" None, ": take the kept parameters";
    ResetParams "ResetParams" None, ": take the defaults";
}

impl Keyword {
    /// The keyword that a word is, in any case.
    #[must_use]
    pub fn find(word: &[u8]) -> Option<Entry> {
        ALL.iter().copied().find(|entry| {
            word.eq_ignore_ascii_case(entry.name.as_bytes())
                || entry
                    .short
                    .is_some_and(|short| word.eq_ignore_ascii_case(short.as_bytes()))
        })
    }
}
