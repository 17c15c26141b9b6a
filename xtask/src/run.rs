//! Running commands, and saying which.

use std::ffi::{OsStr, OsString};
use std::fmt;
use std::io::{self, IsTerminal, Read};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::mpsc;
use std::thread;
use std::time::Duration;

use anyhow::{Context, Result, bail};

/// How a step ended; what went wrong or was missing is a line for the summary.
pub enum Outcome {
    Passed,
    Failed(String),
    Skipped(String),
}

impl From<Result<Outcome>> for Outcome {
    fn from(result: Result<Outcome>) -> Self {
        result.unwrap_or_else(|error| Outcome::Failed(format!("{error:#}")))
    }
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Outcome::Passed => write!(f, "passed"),
            Outcome::Failed(why) => write!(f, "failed: {why}"),
            Outcome::Skipped(why) => write!(f, "skipped: {why}"),
        }
    }
}

/// Where commands run, and what they find in their environment.
pub struct Session {
    pub root: PathBuf,
    cargo: OsString,
    env: Vec<(&'static str, OsString)>,
}

impl Session {
    pub fn new() -> Self {
        // Asked at run time: a path compiled in would be wrong after the tree has moved.
        let root = std::env::var_os("CARGO_MANIFEST_DIR")
            .and_then(|xtask| Path::new(&xtask).parent().map(Path::to_owned))
            .unwrap_or_else(|| PathBuf::from("."));
        let mut session = Self {
            root,
            cargo: std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()),
            env: Vec::new(),
        };
        if std::env::var_os("CARGO_TERM_COLOR").is_none() {
            let color = if io::stdout().is_terminal() {
                "always"
            } else {
                "never"
            };
            session.set("CARGO_TERM_COLOR", color);
        }
        session
    }

    /// Sets an environment variable for every later command.
    pub fn set(&mut self, name: &'static str, value: impl Into<OsString>) {
        self.env.push((name, value.into()));
    }

    /// A command in the repository's root.
    pub fn command<'a>(
        &self,
        program: impl AsRef<OsStr>,
        arguments: impl IntoIterator<Item = &'a str>,
    ) -> Command {
        let mut command = Command::new(program);
        command.args(arguments).current_dir(&self.root);
        command.envs(self.env.iter().map(|(name, value)| (name, value)));
        command
    }

    /// The cargo that runs this program, with arguments separated by blanks.
    pub fn cargo(&self, arguments: &str) -> Command {
        self.command(&self.cargo, arguments.split_whitespace())
    }

    /// Runs a step's command in full view.
    pub fn run(&self, command: &mut Command) -> Result<Outcome> {
        let line = self.line(command);
        println!("$ {line}");
        let status = command
            .status()
            .with_context(|| format!("cannot start `{line}`"))?;
        Ok(if status.success() {
            Outcome::Passed
        } else {
            Outcome::Failed(status.to_string())
        })
    }

    /// A command as one would type it in the repository's root.
    fn line(&self, command: &Command) -> String {
        let mut words = Vec::new();
        for (name, value) in command.get_envs() {
            if name != "CARGO_TERM_COLOR" {
                words.push(format!(
                    "{}={}",
                    name.display(),
                    quoted(value.unwrap_or_default())
                ));
            }
        }
        let program = command.get_program();
        words.push(quoted(if program == self.cargo {
            "cargo".as_ref()
        } else {
            program
        }));
        words.extend(command.get_args().map(quoted));
        words.join(" ")
    }
}

fn quoted(word: &OsStr) -> String {
    let word = word.display();
    if word.to_string().contains(' ') {
        format!("\"{word}\"")
    } else {
        word.to_string()
    }
}

/// Whether a command can be started and ends well; nothing of it is seen.
pub fn succeeds(mut command: Command, limit: Duration) -> bool {
    command.stderr(Stdio::null());
    capture(command, limit).is_ok_and(|(good, _)| good)
}

/// Runs a command for at most `limit`: whether it ended well, and what it printed to stdout.
pub fn capture(mut command: Command, limit: Duration) -> Result<(bool, String)> {
    let mut child = command
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .spawn()?;
    let mut stdout = child.stdout.take().context("no stdout")?;
    let (sender, receiver) = mpsc::channel();
    thread::spawn(move || {
        let mut bytes = Vec::new();
        // Nobody listens any more once the limit has passed.
        let _ = sender.send(stdout.read_to_end(&mut bytes).map(|_| bytes));
    });
    // The end of stdout stands for the end of the command: std has no wait with a limit.
    let Ok(bytes) = receiver.recv_timeout(limit) else {
        child.kill()?;
        child.wait()?;
        bail!("not done after {} s", limit.as_secs());
    };
    let text = String::from_utf8_lossy(&bytes?).into_owned();
    Ok((child.wait()?.success(), text))
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    fn bash(command: &str, limit: Duration) -> Result<(bool, String)> {
        capture(Session::new().command("bash", ["-c", command]), limit)
    }

    #[test]
    fn captures_stdout_and_how_it_ended() {
        let (good, stdout) =
            bash("echo out; echo err >&2; exit 3", Duration::from_secs(60)).unwrap();
        assert_eq!((good, stdout.as_str()), (false, "out\n"));
    }

    #[test]
    fn stops_at_the_limit() {
        assert!(bash("exec sleep 60", Duration::from_millis(50)).is_err());
    }
}
