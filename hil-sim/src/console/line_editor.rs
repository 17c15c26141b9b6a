//! A person at a terminal: line editing, history and completion.

use super::{Port, say};
use anyhow::Result;
use rustyline::completion::{Completer, Pair};
use rustyline::error::ReadlineError;
use rustyline::history::DefaultHistory;
use rustyline::{Context, Editor, ExternalPrinter, Helper, Highlighter, Hinter, Validator};
use std::path::PathBuf;
use std::sync::mpsc;
use vehicle_controller::interpreter::commands;
use vehicle_controller::params::Params;
use vehicle_controller::vehicle::Kind;

/// Completes commands, and the names of parameters behind the commands that take one.
#[derive(Helper, Hinter, Highlighter, Validator)]
struct Words {
    vehicle: Kind,
}

impl Completer for Words {
    type Candidate = Pair;

    fn complete(
        &self,
        line: &str,
        position: usize,
        _: &Context<'_>,
    ) -> rustyline::Result<(usize, Vec<Pair>)> {
        Ok(complete(self.vehicle, line, position))
    }
}

fn complete(vehicle: Kind, line: &str, position: usize) -> (usize, Vec<Pair>) {
    let before = line.get(..position).unwrap_or(line);
    let start = before.rfind(' ').map_or(0, |blank| blank + 1);
    let (head, word) = before.split_at(start);
    let starts = |name: &str| {
        name.get(..word.len())
            .is_some_and(|begin| begin.eq_ignore_ascii_case(word))
    };
    let names: Vec<&str> = match head.trim().to_ascii_lowercase().as_str() {
        "" | "help" => commands().collect(),
        "getparam" | "setparam" => {
            let ids = Params::of(vehicle).ids();
            ids.map(|id| id.spec().name).collect()
        }
        _ => Vec::new(),
    };
    let pair = |name: &str| Pair {
        display: name.to_owned(),
        replacement: format!("{name} "),
    };
    (
        start,
        names
            .into_iter()
            .filter(|name| starts(name))
            .map(pair)
            .collect(),
    )
}

fn history_file() -> Option<PathBuf> {
    let home = std::env::var_os("HOME").or_else(|| std::env::var_os("USERPROFILE"))?;
    Some(PathBuf::from(home).join(".hil-sim-history"))
}

/// Opens an editor on the terminal; Ctrl-C sends Stop, Ctrl-D leaves.
pub fn open(vehicle: Kind) -> Result<Port> {
    let mut editor: Editor<Words, DefaultHistory> = Editor::new()?;
    editor.set_helper(Some(Words { vehicle }));
    let history = history_file();
    if let Some(file) = &history {
        // There is none the first time.
        let _ = editor.load_history(file);
    }
    let mut printer = editor.create_external_printer()?;
    let (sender, input) = mpsc::sync_channel(16);
    say(format_args!(
        "Type commands: m 1, t 90, GetEstPos, Help. Tab completes, Ctrl-C stops the base, Ctrl-D leaves.\nWith --web you see it drive, in a browser."
    ))?;
    std::thread::spawn(move || {
        loop {
            let line = match editor.readline("> ") {
                Ok(line) => line,
                Err(ReadlineError::Interrupted) => "Stop".into(),
                Err(_) => break,
            };
            // A line that cannot be remembered can still be sent.
            let _ = editor.add_history_entry(&line);
            if sender.send(format!("{line}\n").into_bytes()).is_err() {
                break;
            }
        }
        if let Some(file) = &history {
            // A history that cannot be written is not worth a word on leaving.
            let _ = editor.save_history(file);
        }
    });
    let mut partial = Vec::new();
    Ok(Port {
        input: Box::new(move || input.try_recv()),
        output: Box::new(move |bytes| {
            partial.extend(bytes.iter().copied().filter(|b| *b != b'\r'));
            // Whole lines only: the printer redraws the prompt below each.
            if let Some(end) = partial.iter().rposition(|b| *b == b'\n') {
                let lines: Vec<u8> = partial.drain(..=end).collect();
                printer.print(String::from_utf8_lossy(&lines).into_owned())?;
            }
            Ok(())
        }),
        impatient: false,
        max_on_the_way: usize::MAX,
        beside: None,
    })
}

#[cfg(test)]
mod tests {
    use super::{Kind, complete};

    #[test]
    fn completes_commands_and_parameters() {
        let of = |vehicle: Kind, line: &str| -> Vec<String> {
            let (_, pairs) = complete(vehicle, line, line.len());
            pairs.into_iter().map(|pair| pair.display).collect()
        };
        let names = |line: &str| of(Kind::Differential, line);
        assert_eq!(names("gete"), ["GetEstPos", "GetEstSpeed"]);
        assert_eq!(names("GetParam wheel"), ["wheel_base"]);
        assert_eq!(of(Kind::Synchro, "GetParam wheel"), ["wheel_diameter"]);
        assert!(names("m 1").is_empty());
    }
}
