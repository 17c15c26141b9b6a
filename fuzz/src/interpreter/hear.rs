//! What the base says, line by line, and whether it had to say that.

use vehicle_controller::params::{Id, Params};

use super::reply::{code, either, unchecked};
use super::{Due, Heard, Late, Rows, Session, shown, stops};
use crate::grammar::{self, Codes, Doubts};
use crate::protocol::{Damage, Line};
use crate::replies;

impl Session<'_> {
    /// Hears what the base says.
    pub(super) fn hear(&mut self) -> Heard {
        self.received.clear();
        let mut received = core::mem::take(&mut self.received);
        received.extend(std::iter::from_fn(|| self.base.interpreter.transmit()));
        let required = self.params.is_on(Id::RequireCrc);
        let mut heard = Heard {
            anything: !received.is_empty(),
            ..Heard::default()
        };
        for line in replies::lines(&received) {
            let text = str::from_utf8(line).unwrap_or_default();
            if matches!(line, [b'!' | b'~', ..]) {
                self.hear_unsolicited(text, required);
            } else {
                let reply = self.hear_reply(text, required);
                heard.obeyed |= reply.obeyed;
                heard.accepted |= reply.accepted;
            }
        }
        self.received = received;
        heard
    }

    fn hear_unsolicited(&mut self, line: &str, required: bool) {
        // A command that was obeyed in this same poll may have changed what is required.
        let now = self.base.interpreter.params().is_on(Id::RequireCrc);
        let line = if required == now && !self.stale {
            unchecked(line, required)
        } else {
            either(line)
        };
        if self.hear_row(line) {
            return;
        }
        if !self.framing_only {
            replies::unsolicited(line);
            self.hear_event(line);
        }
    }

    /// Hears a row of the list under way; false if it is none.
    fn hear_row(&mut self, line: &str) -> bool {
        let name = line.split(' ').nth(1).unwrap_or_default();
        if line.starts_with('~') && ["place", "landmark", "arc", "there", "route"].contains(&name) {
            assert!(self.map_rows > 0, "nobody asked for {line}");
            self.map_rows -= 1;
            replies::map_row(line);
            return true;
        }
        match self.rows {
            _ if !line.starts_with("~ ") => false,
            Rows::None => false,
            Rows::Params(left) => {
                let params = Params::default();
                let id = params.ids().nth(params.count() - left);
                let Some(id) = id.filter(|id| id.spec().name == name) else {
                    return false;
                };
                self.rows = match left {
                    1 => Rows::None,
                    _ => Rows::Params(left - 1),
                };
                if !self.stale {
                    replies::row(line, &self.params, id);
                }
                true
            }
            // There is no telemetry within a list: what has no room is dropped.
            Rows::Path(next, left) => {
                let number = replies::posture(line);
                assert!(
                    next.is_none_or(|next| next == number),
                    "{line}, not {next:?}"
                );
                self.rows = match left {
                    1 => Rows::None,
                    _ => Rows::Path(Some(number + 1), left - 1),
                };
                true
            }
        }
    }

    /// Hears a reply.
    fn hear_reply(&mut self, reply: &str, required: bool) -> Heard {
        assert_eq!(self.rows, Rows::None, "a reply within a list: {reply}");
        assert_eq!(self.map_rows, 0, "a reply within a list: {reply}");
        let Some(due) = self.due.pop_front() else {
            panic!("nobody asked for {reply}");
        };
        let Due { line, late, .. } = due;
        let reply = if self.stale && !line.has_check {
            either(reply)
        } else {
            unchecked(reply, line.has_check || required)
        };
        let reply = match line.tag {
            None => reply,
            Some(tag) => reply
                .strip_prefix('@')
                .and_then(|reply| reply.split_once(' '))
                .filter(|(echoed, _)| *echoed == tag.to_string())
                .map_or_else(|| panic!("@{tag} is answered {reply}"), |(_, reply)| reply),
        };
        let code = code(reply);
        let (ask, mut doubts) = match line.body {
            Ok(body) => grammar::read(body),
            Err(damage) => {
                let must = Codes::named(damage.code().as_bytes());
                let may = Codes::NONE;
                (None, Doubts { must, may })
            }
        };
        if let Some(ask) = ask {
            let stopped = due.stopped && ask.may_move();
            if due.unsure || !stopped {
                self.judge(ask, &mut doubts);
            }
            // What could not be read is refused as that.
            if due.unsure {
                doubts.may.add_if(stopped, Codes::FAULT);
            } else if doubts.must.is_empty() {
                doubts.must.add_if(stopped, Codes::FAULT);
            }
            // Or as what no parameter could allow.
            doubts.may.add_if(stopped && ask.is_huge(), Codes::RANGE);
        }
        let missing = !line.has_check && !stops(&line);
        let damaged = matches!(line.body, Err(Damage::TooLong | Damage::BadByte));
        if missing && !damaged && (required || self.stale) {
            let certain = if self.stale {
                &mut doubts.may
            } else {
                doubts.must = Codes::NONE;
                &mut doubts.must
            };
            certain.add(Codes::CHECKSUM);
        }
        let mixes = |letters: [bool; 2]| letters == [true; 2];
        let counts = matches!(line.body, Ok(_) | Err(Damage::Tag)) && !stops(&line);
        let together = self.letters.map(|letters| both(letters, line.letters));
        let refused = mixes(line.letters) || together.is_some_and(mixes);
        if counts && self.stale {
            // What was required then is not known.
            doubts.may.add(Codes::CHECKSUM);
        } else if counts && required && refused {
            doubts.must = Codes::CHECKSUM;
        } else if counts && required && together.is_none() {
            doubts.may.add(Codes::CHECKSUM);
        }
        match late {
            Late::No => {}
            Late::Yes if stops(&line) => {}
            Late::Yes => doubts.must = Codes::BUSY,
            Late::Maybe => doubts.may.add(Codes::BUSY),
        }
        match code {
            Some(code) => assert!(
                doubts.must.has(code) || doubts.may.has(code),
                "{} is answered {reply}; {doubts:?}",
                shown(&line)
            ),
            None => assert!(
                doubts.must.is_empty() || self.framing_only && line.body.is_ok(),
                "{} is answered {reply}; {doubts:?}",
                shown(&line)
            ),
        }
        let obeyed = match (code, ask) {
            (None, Some(ask)) => self.obeyed(ask, reply),
            _ => false,
        };
        if code.is_none() {
            self.note_letters(&line, late);
        }
        Heard {
            anything: true,
            accepted: code.is_none(),
            obeyed,
        }
    }

    /// A line was obeyed, with this check: from here the case of its letters counts.
    fn note_letters(&mut self, line: &Line<'_>, late: Late) {
        if late != Late::No {
            // What stops the base decides nothing when it comes too late, and something when not.
            self.letters = self.letters.filter(|_| late == Late::Yes);
            return;
        }
        if self.stale {
            self.letters = None;
            return;
        }
        let [upper, lower] = line.letters;
        self.letters = match self.letters {
            _ if !self.params.is_on(Id::RequireCrc) => Some([false; 2]),
            Some(letters) if both(letters, line.letters) != [true; 2] => {
                Some(both(letters, line.letters))
            }
            None if upper != lower && !stops(line) => Some(line.letters),
            unchanged => unchanged,
        };
    }
}

fn both(a: [bool; 2], b: [bool; 2]) -> [bool; 2] {
    [a[0] || b[0], a[1] || b[1]]
}
