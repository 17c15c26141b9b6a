//! The table of commands: keyword, usage, meaning. Help prints it.

/// What is known of a command.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Entry {
    /// The command.
    pub keyword: Keyword,
    /// What it is about: Help lists by topics, since not all names fit a line.
    pub topic: &'static str,
    /// How it is written.
    pub name: &'static str,
    /// A shorter way to write it.
    pub short: Option<&'static str>,
    /// Its parameters and what it does.
    pub help: &'static str,
}

macro_rules! keywords {
    ($($keyword:ident $topic:ident $name:literal $short:expr, $help:literal;)*) => {
        /// A command's keyword.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[allow(missing_docs, reason = "they are named as in the protocol")]
        pub enum Keyword {
            $($keyword,)*
        }

        /// Every command.
        pub const ALL: &[Entry] = &[
            $(Entry { keyword: Keyword::$keyword, topic: stringify!($topic), name: $name, short: $short, help: $help },)*
        ];
    };
}

keywords! {
    Move motion "move" Some("m"), "[d [v [a]]]: translate by d m (inf: no end) at v m/s with a m/s2; v 0 stops this axis";
    Turn motion "turn" Some("t"), "[d [v [a]]]: rotate by d deg (inf: no end) at v deg/s with a deg/s2; v 0 stops this axis";
    Stop motion "Stop" None, ": both axes decelerate and hold";
    GoTo path "GoTo" None, "x y [theta]: go to a posture";
    Follow path "Follow" None, "x y [theta or - [v]], start or clear: add a posture to the path; follow it; forget it";
    GetPath path "GetPath" None, ": number of postures left and what the base is about; then ~ n x y theta v of each";
    Chase path "Chase" None, "x y [theta]: head to a posture that moves; say so at 1 to 50 Hz";
    GetEstPos position "GetEstPos" None, ": x y theta Cxx Cxy Cxt Cyy Cyt Ctt in m and deg";
    GetEstSpeed position "GetEstSpeed" None, ": v_s (m/s) v_alpha (deg/s)";
    CorrectPos position "CorrectPos" None, "dx dy dtheta K11 K12 K13 K21 ... K33: P += K dP, C -= K C, of the last GetEstPos";
    ResetPos position "ResetPos" None, "x y theta [Cxx Cxy Cxt Cyy Cyt Ctt]: set pose and covariance";
    ObservePos position "ObservePos" None, "x y theta Cxx Cxy Cxt Cyy Cyt Ctt [age]: correct by an observed pose";
    ObserveScalar position "ObserveScalar" None, "nu R h1 h2 h3 [age]: correct by an innovation nu with variance R and row h";
    Calibrate calibration "Calibrate" None, "on, off, reset or straight m: learn the gains from observations; forget them; the last move was m long";
    GetGains calibration "GetGains" None, ": k_r k_l k_b and their standard deviations";
    Mark map "Mark" None, "name [r]: this is a place with a meadow of r m (0.5), or the base is back in it";
    AmIThere map "AmIThere" None, "[place]: yes-maybe or no, and the probability";
    Sight map "Sight" None, "landmark [bearing bound [range [bound]]]: a landmark in sight, in deg and m";
    Label map "Label" None, "place landmark: the landmark is seen from the place";
    Freeway map "Freeway" None, "a b width: a straight corridor of width m along the arc from a to b";
    Route map "Route" None, "a b width: the shortest way through freeways of at least width m";
    Crosses map "Crosses" None, "a b c d: do the ways a-b and c-d cross: must, may or cannot";
    GetMap map "GetMap" None, ": places and arcs as ~ lines";
    ForgetMap map "ForgetMap" None, "[here]: forget places and arcs, or only where the base is";
    GetStatus state "GetStatus" None, ": move state, turn state, enabled or disabled, fault";
    GetState state "GetState" None, ": t S S' S'' alpha alpha' alpha''";
    GetTime state "GetTime" None, ": seconds since boot";
    GetBattery state "GetBattery" None, ": volts";
    GetWheels state "GetWheels" None, ": counts, speeds (m/s) and duties, left and right";
    GetSteering state "GetSteering" None, ": steering angle (deg)";
    Stream state "Stream" None, "period [fields]: telemetry every period s, 0 off; default t x y theta v_s v_alpha";
    Version state "Version" None, ": name, version, target, protocol version";
    Help state "Help" None, "[topic or command]: topics, the commands of a topic, or what a command takes and does";
    EStop safety "EStop" None, ": motors off at once, fault estop";
    ClearFault safety "ClearFault" None, ": clear the latched fault if its cause is gone";
    Enable safety "Enable" None, ": motor power on";
    Disable safety "Disable" None, ": stop, then motor power off";
    GetParam parameters "GetParam" None, "name: value and unit";
    SetParam parameters "SetParam" None, "name value: set, effective at once";
    ListParams parameters "ListParams" None, ": all parameters as ~ name value min max unit";
    SaveParams parameters "SaveParams" None, ": keep the parameters over power-off";
    LoadParams parameters "LoadParams" None, ": take the kept parameters";
    ResetParams parameters "ResetParams" None, ": take the defaults";
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

/// The topics.
pub const TOPICS: [&str; 8] = [
    "motion",
    "path",
    "position",
    "calibration",
    "map",
    "state",
    "safety",
    "parameters",
];

/// What help is wanted of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Subject {
    /// Everything.
    Topics,
    /// The commands of a topic.
    Topic(&'static str),
    /// A command.
    Command(Entry),
}

impl Subject {
    /// The topic or command that a word names, in any case.
    #[must_use]
    pub fn find(word: &[u8]) -> Option<Self> {
        let topic = TOPICS
            .into_iter()
            .find(|topic| word.eq_ignore_ascii_case(topic.as_bytes()));
        topic
            .map(Self::Topic)
            .or_else(|| Keyword::find(word).map(Self::Command))
    }
}
