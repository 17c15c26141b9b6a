//! What is said to a base when the line to it has just been opened.
//!
//! ```text
//! *                ends whatever half a line is left on the wire; a base refuses a star without a check, and what stands before it
//! Stop             whatever it was told before, by whomever, is over: a base that runs on must not find signs of life in what follows
//! Stream 0         so that the answers need not wait for telemetry
//! SetParam …       if all lines are to have checks, its own ones, too
//! Version
//! GetParam …       what the bridge needs to know. The rows of ListParams have no checks, and a wheel of the wrong size is no small thing
//! Stream …         from here on it is known
//! ```
//! Each is asked again when its answer does not come; after a few times the line is given up, and opened anew.

use super::Knowledge;
use super::telemetry::{self, Field};
use crate::client::{Answer, Ask, Client, Outcome};

/// An answer that does not come so often: there is no base at this line, or none that speaks this protocol.
const TRIES: u32 = 6;
/// The client sends a Stop until it is answered: that long, s.
const STOP_PATIENCE: f64 = 2.5;
/// The protocol that this bridge speaks.
const PROTOCOL: &str = "1";
/// Parameters that the bridge needs; a vehicle has those that it has.
const NEEDED: [&str; 20] = [
    "track",
    "steer_max",
    "turn_counts",
    "wheel_base",
    "left_diameter",
    "right_diameter",
    "wheel_diameter",
    "turn_lever",
    "counts_per_turn",
    "max_speed",
    "max_turn_speed",
    "max_wheel_speed",
    "noise_s",
    "noise_rot",
    "noise_drift",
    "k_scale",
    "k_rot",
    "k_drift",
    "observer_bandwidth",
    "deadman",
];

#[derive(Clone, Debug, PartialEq)]
enum Step {
    Stop,
    Quiet,
    Checks,
    Version,
    /// The parameter of this number.
    Param(usize),
    Stream(Vec<Field>, bool),
    Done,
}

/// How far it has come.
#[derive(Clone, Debug, PartialEq)]
pub enum Progress {
    /// There is more to say.
    Going,
    /// The base is known, and streams.
    Done,
    /// There is nobody to talk to, and why.
    Failed(String),
}

/// The first lines.
#[derive(Clone, Debug)]
pub struct Handshake {
    begun: f64,
    step: Step,
    tries: u32,
    /// The question that is under way.
    number: u64,
    period: f64,
    checks: bool,
    version: String,
    knowledge: Knowledge,
    fields: Vec<Field>,
}

impl Handshake {
    /// Begins one; telemetry will come every `period` s, with checks or without. The caller has sent the star.
    pub fn begin(client: &mut Client, period: f64, checks: bool, now: f64) -> Self {
        let mut handshake = Self {
            begun: now,
            step: Step::Stop,
            tries: 0,
            number: 0,
            period,
            checks,
            version: String::new(),
            knowledge: Knowledge::default(),
            fields: Vec::new(),
        };
        handshake.ask(client);
        handshake
    }

    fn ask(&mut self, client: &mut Client) {
        self.number = match &self.step {
            Step::Stop => client.stop(),
            Step::Quiet => client.ask(Ask::Stream, "Stream 0"),
            Step::Version => client.ask(Ask::Version, "Version"),
            Step::Checks => client.ask(Ask::Params, "SetParam require_crc 1"),
            Step::Param(n) => client.ask(Ask::Params, format!("GetParam {}", NEEDED[*n])),
            Step::Stream(fields, _) => {
                let line = telemetry::stream(self.period, fields);
                client.ask(Ask::Stream, line)
            }
            Step::Done => return,
        };
    }

    fn go(&mut self, step: Step, client: &mut Client) -> Progress {
        self.step = match step {
            Step::Stream(_, knows_tick_load) => {
                let fields = telemetry::fields(self.knowledge.vehicle(), knows_tick_load);
                Step::Stream(fields, knows_tick_load)
            }
            step => step,
        };
        self.tries = 0;
        self.ask(client);
        if self.step == Step::Done {
            Progress::Done
        } else {
            Progress::Going
        }
    }

    fn again(&mut self, step: Step, what: &str, client: &mut Client) -> Progress {
        self.tries += 1;
        if self.tries >= TRIES {
            return Progress::Failed(what.to_owned());
        }
        self.step = step;
        self.ask(client);
        Progress::Going
    }

    /// Takes an answer of the client.
    pub fn hear(&mut self, answer: &Answer, client: &mut Client) -> Progress {
        if answer.number != self.number {
            return Progress::Going;
        }
        let step = self.step.clone();
        let reply = match &answer.outcome {
            Outcome::Reply(reply) => reply,
            Outcome::Refused(why) => {
                return match step {
                    Step::Param(n) if why.starts_with("unknown") => self.go(after(n), client),
                    Step::Stream(_, true) => self.go(Step::Stream(Vec::new(), false), client),
                    step => self.again(step, &format!("refused: {why}"), client),
                };
            }
            _ => return self.again(step, "no answer", client),
        };
        match step {
            Step::Stop => self.go(Step::Quiet, client),
            Step::Quiet if self.checks => self.go(Step::Checks, client),
            Step::Quiet | Step::Checks => self.go(Step::Version, client),
            Step::Version => {
                let protocol = reply.rsplit(' ').next().unwrap_or_default();
                if !reply.starts_with("Version ") || protocol != PROTOCOL {
                    return Progress::Failed(format!("not protocol {PROTOCOL}: {reply}"));
                }
                reply["Version ".len()..].clone_into(&mut self.version);
                self.go(Step::Param(0), client)
            }
            Step::Param(n) => match reply.strip_prefix("Param ") {
                Some(row) if self.knowledge.note(row) => self.go(after(n), client),
                _ => self.again(step, "no parameter", client),
            },
            Step::Stream(fields, _) => {
                self.fields = fields;
                self.go(Step::Done, client)
            }
            Step::Done => Progress::Going,
        }
    }

    /// Looks at the time.
    pub fn look(&mut self, now: f64) -> Progress {
        if self.step == Step::Stop && now >= self.begun + STOP_PATIENCE {
            Progress::Failed("no answer".to_owned())
        } else {
            Progress::Going
        }
    }

    /// What it is: name, version, target and protocol.
    pub fn version(&self) -> &str {
        &self.version
    }

    /// Its parameters.
    pub fn knowledge(&self) -> &Knowledge {
        &self.knowledge
    }

    /// What its telemetry has.
    pub fn fields(&self) -> &[Field] {
        &self.fields
    }
}

/// What follows the parameter of this number. The stream's fields are known when it is asked for.
fn after(n: usize) -> Step {
    if n + 1 < NEEDED.len() {
        Step::Param(n + 1)
    } else {
        Step::Stream(Vec::new(), true)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::client::{Heard, check};

    /// A base that answers by rule, and hears what is said.
    fn talk(answer: impl Fn(&str, usize) -> Vec<String>) -> (Progress, Handshake, Vec<String>) {
        talk_with(false, answer)
    }

    fn talk_with(
        checks: bool,
        answer: impl Fn(&str, usize) -> Vec<String>,
    ) -> (Progress, Handshake, Vec<String>) {
        let mut client = Client::new(0, 115_200);
        let mut handshake = Handshake::begin(&mut client, 0.02, checks, 0.0);
        let (mut now, mut said) = (0.0, Vec::<String>::new());
        for _ in 0..200 {
            let mut heard = Vec::new();
            while let Some(line) = client.next(now) {
                let line = String::from_utf8(line).unwrap();
                let (tagged, _) = line.split_once('*').unwrap();
                let (tag, text) = tagged.split_once(' ').unwrap();
                let before = said.iter().filter(|line| *line == text).count();
                said.push(text.to_owned());
                for line in answer(text, before) {
                    let line = check::with(&format!("{tag} {line}"));
                    heard.push(client.hear(&line));
                }
            }
            now += 0.1;
            heard.push(Heard::Answers(client.ended(now)));
            let mut all = vec![handshake.look(now)];
            for heard in heard {
                if let Heard::Answers(answers) = heard {
                    for answer in answers {
                        all.push(handshake.hear(&answer, &mut client));
                    }
                }
            }
            if let Some(end) = all.into_iter().find(|p| *p != Progress::Going) {
                return (end, handshake, said);
            }
        }
        (Progress::Going, handshake, said)
    }

    fn base(line: &str) -> Vec<String> {
        vec![match line {
            "Version" => "Version vehicle-controller 0.1.0 test 1".to_owned(),
            "GetParam max_speed" => "Param max_speed 0.7 m/s".to_owned(),
            "GetParam wheel_base" => "Param wheel_base 0.2 m".to_owned(),
            line if line.starts_with("GetParam") => "ERR unknown no such parameter".to_owned(),
            _ => "OK".to_owned(),
        }]
    }

    #[test]
    fn a_base_is_stopped_and_known() {
        let (end, handshake, said) = talk(|line, _| base(line));
        assert_eq!(end, Progress::Done);
        assert_eq!(said[..4], ["Stop", "Stream 0", "Version", "GetParam track"]);
        assert!(
            said.last()
                .unwrap()
                .starts_with("Stream 0.02 t x y theta v_s v_alpha ")
        );
        assert_eq!(said.len(), 4 + NEEDED.len());
        assert_eq!(handshake.version(), "vehicle-controller 0.1.0 test 1");
        assert_eq!(handshake.knowledge().get("max_speed"), Some(0.7));
        assert_eq!(handshake.knowledge().len(), 2);
        assert!(handshake.fields().contains(&Field::TickLoad));
        let (end, _, said) = talk_with(true, |line, _| base(line));
        assert_eq!(end, Progress::Done);
        assert_eq!(said[2], "SetParam require_crc 1");
    }

    #[test]
    fn an_older_base_is_asked_for_less() {
        let (end, handshake, _) = talk(|line, _| {
            if line.contains("tick_load") {
                vec!["ERR syntax no such field".into()]
            } else {
                base(line)
            }
        });
        assert_eq!(end, Progress::Done);
        assert!(!handshake.fields().contains(&Field::TickLoad));
    }

    #[test]
    fn lost_lines_are_asked_for_again() {
        let (end, handshake, said) = talk(|line, before| match (line, before) {
            ("Version" | "GetParam max_speed", 0) => vec![],
            ("GetParam wheel_base", 0) => vec!["ERR checksum".into()],
            _ => base(line),
        });
        assert_eq!(end, Progress::Done);
        assert_eq!(handshake.knowledge().len(), 2);
        assert_eq!(said.len(), 4 + NEEDED.len() + 3);
    }

    #[test]
    fn something_else_at_the_line_is_told() {
        let (end, ..) = talk(|line, _| match line {
            "Version" => vec!["Version something 3.0 else 7".into()],
            _ => base(line),
        });
        assert!(matches!(end, Progress::Failed(_)));
        for silent in ["Stop", "Version", "GetParam k_rot"] {
            let (end, ..) = talk(|line, _| if line == silent { vec![] } else { base(line) });
            assert_eq!(end, Progress::Failed("no answer".into()), "{silent}");
        }
    }
}
