//! Runs the commands a README shows, and compares what they print.
//!
//! In a block fenced as `console`, a line after `$ ` is a command (a `\` at its end continues it), and the lines below
//! are its stdout. `console no-run` is only shown; in `console fails` every command must fail.

use std::fs;
use std::path::Path;
use std::time::Duration;

use anyhow::{Context, Result, bail, ensure};

use crate::diff::diff;
use crate::run::{Outcome, Session, capture};

const LIMIT: Duration = Duration::from_secs(600);

/// A command, and what the README says of it.
#[derive(Debug, PartialEq)]
struct Example {
    line: usize,
    command: String,
    stdout: Vec<String>,
    fails: bool,
}

/// Runs every command of the file.
pub fn check(session: &Session, file: &Path) -> Result<Outcome> {
    if !cfg!(unix) {
        return Ok(Outcome::Skipped(
            "its commands are for a Unix system".into(),
        ));
    }
    let name = file.strip_prefix(&session.root).unwrap_or(file).display();
    let text = fs::read_to_string(file).with_context(|| format!("cannot read {name}"))?;
    let examples = parse(&text).with_context(|| name.to_string())?;
    ensure!(!examples.is_empty(), "{name} has no command to run");
    let mut wrong = 0;
    for example in &examples {
        println!("{name}:{}: $ {}", example.line, example.command);
        if let Err(error) = run(session, example) {
            println!("{error:#}");
            wrong += 1;
        }
    }
    Ok(match wrong {
        0 => Outcome::Passed,
        _ => Outcome::Failed(format!(
            "{wrong} of {} commands of {name} differ",
            examples.len()
        )),
    })
}

fn run(session: &Session, example: &Example) -> Result<()> {
    let (good, stdout) = capture(session.command("bash", ["-c", &example.command]), LIMIT)?;
    let expected = trimmed(example.stdout.iter().map(String::as_str));
    if let Some(diff) = diff(&expected, &trimmed(stdout.lines())) {
        bail!("prints something else (- missing, + extra):\n{diff}");
    }
    ensure!(good || example.fails, "fails");
    ensure!(!good || !example.fails, "does not fail");
    Ok(())
}

/// Lines without blanks at their ends and without empty lines at the end.
fn trimmed<'a>(lines: impl Iterator<Item = &'a str>) -> Vec<&'a str> {
    let mut lines: Vec<_> = lines.map(str::trim_end).collect();
    let end = lines
        .iter()
        .rposition(|line| !line.is_empty())
        .map_or(0, |last| last + 1);
    lines.truncate(end);
    lines
}

fn parse(text: &str) -> Result<Vec<Example>> {
    let mut examples: Vec<Example> = Vec::new();
    let mut lines = (1..).zip(text.lines());
    while let Some((number, line)) = lines.next() {
        let Some((indent, fence, info)) = opening(line) else {
            continue;
        };
        // Blocks of other kinds are read too: a fence may be shown inside one.
        let block = lines.by_ref().take_while(|(_, line)| !closes(fence, line));
        let block: Vec<_> = block
            .map(|(number, line)| (number, unindented(line, indent)))
            .collect();
        let mut words = info.split_whitespace();
        if words.next() != Some("console") {
            continue;
        }
        let fails = match words.collect::<Vec<_>>()[..] {
            [] => false,
            ["fails"] => true,
            ["no-run"] => continue,
            _ => bail!(
                "line {number}: `{info}` is not `console`, `console fails` or `console no-run`"
            ),
        };
        let first = examples.len();
        for (line, content) in block {
            let previous = examples[first..].last_mut();
            match (content.strip_prefix("$ "), previous) {
                (Some(command), _) => {
                    examples.push(Example {
                        line,
                        command: command.into(),
                        stdout: Vec::new(),
                        fails,
                    });
                }
                (None, Some(example))
                    if example.stdout.is_empty() && example.command.ends_with('\\') =>
                {
                    example.command = format!("{}\n{content}", example.command);
                }
                (None, Some(example)) => example.stdout.push(content.into()),
                (None, None) => {
                    bail!("line {line}: a `console` block starts with a command after `$ `")
                }
            }
        }
    }
    Ok(examples)
}

/// The indentation, the fence and the info string of a line that opens a block.
fn opening(line: &str) -> Option<(usize, &str, &str)> {
    let content = line.trim_start();
    let mark = content.chars().next().filter(|mark| "`~".contains(*mark))?;
    let info = content.trim_start_matches(mark);
    let fence = &content[..content.len() - info.len()];
    (fence.len() >= 3 && !info.contains('`'))
        .then(|| (line.len() - content.len(), fence, info.trim()))
}

fn closes(fence: &str, line: &str) -> bool {
    let line = line.trim();
    line.starts_with(fence) && line.trim_start_matches(&fence[..1]).is_empty()
}

/// A line of a block without the indentation of the block's fence.
fn unindented(line: &str, indent: usize) -> &str {
    let blanks = line.len() - line.trim_start().len();
    &line[indent.min(blanks)..]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn example(line: usize, command: &str, stdout: &[&str], fails: bool) -> Example {
        let stdout = stdout.iter().map(|&line| line.into()).collect();
        Example {
            line,
            command: command.into(),
            stdout,
            fails,
        }
    }

    #[test]
    fn commands_and_what_they_print() {
        let text = "# Title\n```console\n$ one\na\n\nb\n$ two \\\n  more\nc\n```\n~~~console fails\n$ three\n~~~\n";
        let expected = [
            example(3, "one", &["a", "", "b"], false),
            example(7, "two \\\n  more", &["c"], false),
            example(12, "three", &[], true),
        ];
        assert_eq!(parse(text).unwrap(), expected);
    }

    #[test]
    fn other_blocks_are_not_run() {
        let text = "$ prose\n```console no-run\n$ no\n```\n```sh\n$ no\n```\n````md\n```console\n$ no\n```\n````\n``$ no``\n";
        assert_eq!(parse(text).unwrap(), []);
    }

    #[test]
    fn a_block_in_a_list() {
        let text = "- item\n  ```console\n  $ one\n    a\n  ```\n";
        assert_eq!(parse(text).unwrap(), [example(3, "one", &["  a"], false)]);
    }

    #[test]
    fn mistakes_are_named() {
        for (text, line) in [
            ("```console norun\n$ a\n```", "line 1"),
            ("```console\n$ a\n```\n```console\na\n```", "line 5"),
        ] {
            assert!(parse(text).unwrap_err().to_string().starts_with(line));
        }
    }

    #[test]
    fn blanks_at_the_ends_do_not_count() {
        assert_eq!(trimmed("a  \n\nb\n \n\n".lines()), ["a", "", "b"]);
        assert!(trimmed("\n\n".lines()).is_empty());
    }
}
