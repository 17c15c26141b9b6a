//! What is said to a base when the line to it has just been opened.
//!
//! ```text
//! (empty line)     ends whatever half a line is left on the wire
//! Stop             whatever it was told before, by whomever, is over: a base that runs on must not find signs of life in what follows
//! Stream 0         so that the answers need not wait for telemetry
//! Version, ListParams, GetStatus
//! Stream …         from here on it is known
//! ```
//! Each is asked again when its answer does not come; after a few times the line is given up, and opened anew.

use super::knowledge::Knowledge;
use super::telemetry::{self, Field};
use crate::client::{Answer, Ask, Client, Outcome};

/// An answer that does not come so often: there is no base at this line, or none that speaks this protocol.
const TRIES: u32 = 4;
/// The list of parameters is 4 kB at most: it takes less than this, s, at 115 200 baud.
const LIST_PATIENCE: f64 = 2.0;
/// The client sends a Stop until it is answered: that long, s.
const STOP_PATIENCE: f64 = 2.5;
/// The protocol that this bridge speaks.
const PROTOCOL: &str = "1";

#[derive(Clone, Debug, PartialEq)]
enum Step {
    Stop,
    Quiet,
    Version,
    Params,
    /// The list is under way: so many entries, until then.
    List(usize, f64),
    Status,
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
    version: String,
    knowledge: Knowledge,
    fields: Vec<Field>,
}

impl Handshake {
    /// Begins one; telemetry will come every `period` s. The caller has sent the empty line.
    pub fn begin(client: &mut Client, period: f64, now: f64) -> Self {
        let mut handshake = Self {
            begun: now,
            step: Step::Stop,
            tries: 0,
            number: 0,
            period,
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
            Step::Params => {
                self.knowledge = Knowledge::default();
                client.ask(Ask::Params, "ListParams")
            }
            Step::Status => client.ask(Ask::Status, "GetStatus"),
            Step::Stream(fields, _) => {
                let line = telemetry::stream(self.period, fields);
                client.ask(Ask::Stream, line)
            }
            Step::List(..) | Step::Done => return,
        };
    }

    fn go(&mut self, step: Step, client: &mut Client) -> Progress {
        self.step = step;
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
    pub fn hear(&mut self, answer: &Answer, now: f64, client: &mut Client) -> Progress {
        if answer.number != self.number {
            return Progress::Going;
        }
        let step = self.step.clone();
        let reply = match &answer.outcome {
            Outcome::Reply(reply) => reply,
            Outcome::Refused(why) => {
                return match step {
                    Step::Stream(_, true) => {
                        let fields = telemetry::fields(self.knowledge.vehicle(), false);
                        self.go(Step::Stream(fields, false), client)
                    }
                    step => self.again(step, &format!("refused: {why}"), client),
                };
            }
            _ => return self.again(step, "no answer", client),
        };
        match step {
            Step::Stop => self.go(Step::Quiet, client),
            Step::Quiet => self.go(Step::Version, client),
            Step::Version => {
                let protocol = reply.rsplit(' ').next().unwrap_or_default();
                if !reply.starts_with("Version ") || protocol != PROTOCOL {
                    return Progress::Failed(format!("not protocol {PROTOCOL}: {reply}"));
                }
                reply["Version ".len()..].clone_into(&mut self.version);
                self.go(Step::Params, client)
            }
            Step::Params => match reply.strip_prefix("Params ").map(str::parse) {
                Some(Ok(count)) => {
                    self.step = Step::List(count, now + LIST_PATIENCE);
                    self.listed(client)
                }
                _ => self.again(Step::Params, "no list of parameters", client),
            },
            Step::Status => {
                let fields = telemetry::fields(self.knowledge.vehicle(), true);
                self.go(Step::Stream(fields, true), client)
            }
            Step::Stream(fields, _) => {
                self.fields = fields;
                self.go(Step::Done, client)
            }
            Step::List(..) | Step::Done => Progress::Going,
        }
    }

    /// Takes a row. Telemetry of a stream that an earlier client has asked for is none of the list.
    pub fn row(&mut self, row: &str, client: &mut Client) -> Progress {
        let listing = matches!(self.step, Step::Params | Step::List(..));
        if listing && self.knowledge.note(row) {
            return self.listed(client);
        }
        Progress::Going
    }

    fn listed(&mut self, client: &mut Client) -> Progress {
        match self.step {
            Step::List(count, _) if self.knowledge.len() >= count => self.go(Step::Status, client),
            _ => Progress::Going,
        }
    }

    /// Looks at the time: a list of which a line was lost never becomes complete.
    pub fn look(&mut self, now: f64, client: &mut Client) -> Progress {
        match self.step {
            Step::Stop if now >= self.begun + STOP_PATIENCE => {
                Progress::Failed("no answer".to_owned())
            }
            Step::List(_, until) if now >= until => {
                self.again(Step::Params, "half a list of parameters", client)
            }
            _ => Progress::Going,
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::client::{Heard, check};

    /// A base that answers by rule, and hears what is said.
    fn talk(answer: impl Fn(&str, usize) -> Vec<String>) -> (Progress, Handshake, Vec<String>) {
        let mut client = Client::new(0, 115_200);
        let mut handshake = Handshake::begin(&mut client, 0.02, 0.0);
        let (mut now, mut said) = (0.0, Vec::<String>::new());
        for _ in 0..200 {
            let mut heard = Vec::new();
            while let Some(line) = client.next(now) {
                let line = String::from_utf8(line).unwrap();
                let (tagged, _) = line.split_once('*').unwrap();
                let (tag, text) = tagged.split_once(' ').unwrap();
                let before = said.iter().filter(|line| *line == text).count();
                said.push(text.to_owned());
                for (at, line) in answer(text, before).into_iter().enumerate() {
                    let line = if at == 0 {
                        check::with(&format!("{tag} {line}"))
                    } else {
                        line
                    };
                    heard.push(client.hear(&line));
                }
            }
            now += 0.1;
            heard.push(Heard::Answers(client.ended(now)));
            let mut all = vec![handshake.look(now, &mut client)];
            for heard in heard {
                match heard {
                    Heard::Answers(answers) => {
                        for answer in answers {
                            all.push(handshake.hear(&answer, now, &mut client));
                        }
                    }
                    Heard::Row(row) => all.push(handshake.row(&row, &mut client)),
                    _ => {}
                }
            }
            if let Some(end) = all.into_iter().find(|p| *p != Progress::Going) {
                return (end, handshake, said);
            }
        }
        (Progress::Going, handshake, said)
    }

    fn base(line: &str) -> Vec<String> {
        let lines: &[&str] = match line {
            "Version" => &["Version vehicle-controller 0.1.0 test 1"],
            "ListParams" => &[
                "Params 2",
                "~ max_speed 0.7 0 20 m/s",
                "~ 12.5 1 2 3",
                "~ deadman 1 0 60 s",
            ],
            "GetStatus" => &["Status HOLD HOLD enabled none"],
            _ => &["OK"],
        };
        lines.iter().map(|line| (*line).to_owned()).collect()
    }

    #[test]
    fn a_base_is_stopped_and_known() {
        let (end, handshake, said) = talk(|line, _| base(line));
        assert_eq!(end, Progress::Done);
        assert_eq!(
            said[..5],
            ["Stop", "Stream 0", "Version", "ListParams", "GetStatus"]
        );
        assert!(said[5].starts_with("Stream 0.02 t x y theta v_s v_alpha "));
        assert_eq!(handshake.version(), "vehicle-controller 0.1.0 test 1");
        assert_eq!(handshake.knowledge().get("max_speed"), Some(0.7));
        assert!(handshake.fields().contains(&Field::TickLoad));
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
            ("Version", 0) => vec![],
            ("ListParams", 0) => base(line)[..2].to_vec(),
            _ => base(line),
        });
        assert_eq!(end, Progress::Done);
        assert_eq!(handshake.knowledge().len(), 2);
        assert_eq!(said.iter().filter(|line| *line == "ListParams").count(), 2);
    }

    #[test]
    fn something_else_at_the_line_is_told() {
        let (end, ..) = talk(|line, _| match line {
            "Version" => vec!["Version something 3.0 else 7".into()],
            _ => base(line),
        });
        assert!(matches!(end, Progress::Failed(_)));
        for silent in ["Stop", "Version"] {
            let (end, ..) = talk(|line, _| if line == silent { vec![] } else { base(line) });
            assert_eq!(end, Progress::Failed("no answer".into()), "{silent}");
        }
        let (end, ..) = talk(|line, _| match line {
            "ListParams" => base(line)[..2].to_vec(),
            _ => base(line),
        });
        assert_eq!(end, Progress::Failed("half a list of parameters".into()));
    }
}
