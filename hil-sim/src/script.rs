//! Scripts: what is sent to the base, and what happens to it, at which time.

use crate::faults::{Fault, number};
use anyhow::{Context, Result, anyhow, bail};
use std::path::Path;

/// Something that a script does.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    /// Sends a protocol line.
    Send(String),
    /// Pushes the base: N along it, N·m about it, for so many seconds.
    Push {
        /// N.
        force: f64,
        /// N·m.
        torque: f64,
        /// s.
        seconds: f64,
    },
    /// Lets something go wrong.
    Fault(Fault),
    /// All that was wrong is well.
    Clear,
    /// Puts a landmark up: x, y, m.
    Landmark(String, [f64; 2]),
    /// A sensor of the base sights a landmark: the bearing is wrong by so many degrees at most, the range by such a share of itself.
    Sight(String, f64, f64),
    /// Ends the run.
    End,
}

/// An action and its time.
#[derive(Clone, Debug, PartialEq)]
pub struct Step {
    /// Seconds since power-on.
    pub time: f64,
    /// What happens.
    pub action: Action,
}

/// A script.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Script {
    /// In the order of their times.
    pub steps: Vec<Step>,
}

impl Script {
    /// Reads a script's file.
    ///
    /// # Errors
    /// With file and line, if it cannot be read or is wrong.
    pub fn load(path: &Path) -> Result<Self> {
        let name = path.display().to_string();
        let text = std::fs::read_to_string(path).with_context(|| name.clone())?;
        Self::parse(&text, &name)
    }

    /// Reads a script from text; `name` is for messages. Blank lines and lines that begin with `#` are left out.
    ///
    /// # Errors
    /// With `name` and line, if a line is wrong or earlier than the one before.
    pub fn parse(text: &str, name: &str) -> Result<Self> {
        let mut steps: Vec<Step> = Vec::new();
        for (number, line) in text.lines().enumerate() {
            let line = line.trim_start();
            if line.trim().is_empty() || line.starts_with('#') {
                continue;
            }
            let at = format!("{name}:{}", number + 1);
            let step = parse_step(line).map_err(|error| anyhow!("{at}: {error}"))?;
            if let Some(last) = steps.last() {
                if step.time < last.time {
                    bail!(
                        "{at}: time {} is before the line before ({})",
                        step.time,
                        last.time
                    );
                }
                if last.action == Action::End {
                    bail!("{at}: after !end");
                }
            }
            steps.push(step);
        }
        if steps.is_empty() {
            bail!("{name}: the script is empty");
        }
        Ok(Self { steps })
    }
}

fn parse_step(line: &str) -> Result<Step> {
    let (time, rest) = line.split_once([' ', '\t']).unwrap_or((line, ""));
    let seconds = number(time).with_context(|| "a line begins with its time in seconds")?;
    if seconds < 0.0 {
        bail!("time {seconds} is negative");
    }
    let rest = rest.trim_start();
    let action = if let Some(directive) = rest.strip_prefix('!') {
        parse_directive(directive)?
    } else if rest.trim().is_empty() {
        bail!("nothing to send after the time");
    } else {
        Action::Send(rest.to_owned())
    };
    Ok(Step {
        time: seconds,
        action,
    })
}

fn parse_directive(directive: &str) -> Result<Action> {
    let words: Vec<&str> = directive.split_whitespace().collect();
    match words.as_slice() {
        ["end"] => Ok(Action::End),
        ["push", force, torque, seconds] => {
            let push = Action::Push {
                force: number(force)?,
                torque: number(torque)?,
                seconds: number(seconds)?,
            };
            if number(seconds)? < 0.0 {
                bail!("a push lasts 0 s or longer");
            }
            Ok(push)
        }
        ["fault", fault @ ..] => Ok(Action::Fault(Fault::parse(fault)?)),
        ["clear"] => Ok(Action::Clear),
        ["landmark", name, x, y] => Ok(Action::Landmark(
            (*name).to_owned(),
            [number(x)?, number(y)?],
        )),
        ["sight", name, errors @ ..] if errors.len() <= 2 => {
            let error = |index: usize, default: f64, most: f64| -> Result<f64> {
                let error = errors.get(index).map_or(Ok(default), |word| number(word))?;
                if !(0.0..=most).contains(&error) {
                    bail!("a sighting is wrong by 0 to {most}, not {error}");
                }
                Ok(error)
            };
            Ok(Action::Sight(
                (*name).to_owned(),
                error(0, 1.0, 90.0)?,
                error(1, 0.02, 0.5)?,
            ))
        }
        ["landmark", ..] => bail!("!landmark takes a name, x and y (m)"),
        ["sight", ..] => {
            bail!("!sight takes a landmark, and how wrong it is seen (deg, share of the range)")
        }
        ["clear", ..] => bail!("!clear takes nothing"),
        ["push", ..] => bail!("!push takes a force (N), a torque (N·m) and a time (s)"),
        ["end", ..] => bail!("!end takes nothing"),
        [other, ..] => bail!(
            "no directive !{other}: there are !push, !fault, !clear, !landmark, !sight and !end"
        ),
        [] => bail!("no directive after !"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::faults::{EncoderFault, Side};

    #[test]
    fn a_script() {
        let script = Script::parse("# drive\n0 m 1 0.3\n\n2.5 !push 5 0 1\n4 !end\n", "s").unwrap();
        assert_eq!(script.steps.len(), 3);
        assert_eq!(script.steps[0].action, Action::Send("m 1 0.3".into()));
        let script = Script::parse("1 !fault both encoder jump -5\n2 !clear\n", "s").unwrap();
        let jump = Fault::Encoder(Side::Both, EncoderFault::Jump(-5));
        assert_eq!(script.steps[0].action, Action::Fault(jump));
        assert_eq!(script.steps[1].action, Action::Clear);
    }

    #[test]
    fn mistakes_are_told_with_their_line() {
        for (text, message) in [
            ("", "s: the script is empty"),
            (
                "0 m 1\nx m 1",
                "s:2: a line begins with its time in seconds",
            ),
            ("1 m 1\n0 m 1", "s:2: time 0 is before the line before (1)"),
            ("-1 m 1", "s:1: time -1 is negative"),
            ("0", "s:1: nothing to send after the time"),
            ("0 !push 1", "s:1: !push takes"),
            ("0 !push 1 2 x", "s:1: `x` is not a number"),
            (
                "0 !fault left encoder\n",
                "s:1: an encoder's fault is stuck",
            ),
            ("0 m 1\n1 !fault left encoder jump x", "s:2: `x` is not a"),
            ("0 !fault", "s:1: !fault takes `left|right|both"),
            ("0 !clear all", "s:1: !clear takes nothing"),
            ("0 !landmark lamp 1", "s:1: !landmark takes a name"),
            ("0 !sight", "s:1: !sight takes a landmark"),
            ("0 !sight lamp 91", "s:1: a sighting is wrong by 0 to 90"),
            ("0 !jump", "s:1: no directive !jump"),
            ("0 !end\n1 m", "s:2: after !end"),
            ("nan m", "s:1: a line begins"),
        ] {
            let error = Script::parse(text, "s").unwrap_err().to_string();
            assert!(error.starts_with(message), "{text:?}: {error}");
        }
    }
}
