//! The program in a folder of its own.
#![allow(dead_code, reason = "each test uses a part of it")]

use assert_cmd::Command;
use assert_cmd::assert::Assert;
use assert_cmd::cargo::cargo_bin_cmd;
use std::fs;
use std::path::PathBuf;
use std::time::Duration;
use tempfile::TempDir;

/// Every command here ends within seconds; one that hangs fails.
const PATIENCE: Duration = Duration::from_secs(60);

/// A folder with a script, in which commands run.
pub struct Desk(pub TempDir);

impl Desk {
    /// A folder with this script, `a.script`.
    pub fn new(script: &str) -> Self {
        let desk = Self(tempfile::tempdir().unwrap());
        desk.put("a.script", script);
        desk
    }

    /// Writes a file.
    pub fn put(&self, name: &str, text: &str) {
        fs::write(self.path(name), text).unwrap();
    }

    /// A file's path.
    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// A file's content.
    pub fn read(&self, name: &str) -> Vec<u8> {
        fs::read(self.path(name)).unwrap()
    }

    /// Runs `hil-sim` with arguments separated by blanks.
    pub fn hil_sim(&self, arguments: &str) -> Assert {
        let mut command = hil_sim();
        command.current_dir(self.0.path());
        command.args(arguments.split_whitespace()).assert()
    }

    /// Runs it and expects it to work; what it prints.
    pub fn prints(&self, arguments: &str) -> String {
        text(&self.hil_sim(arguments).success().get_output().stdout)
    }

    /// Runs it and expects exit status 2; its message.
    pub fn refuses(&self, arguments: &str) -> String {
        text(&self.hil_sim(arguments).code(2).get_output().stderr)
    }

    /// The cells of a trace without its header.
    pub fn trace(&self, name: &str) -> Vec<Vec<String>> {
        let cells = |line: &str| line.split(',').map(str::to_owned).collect();
        text(&self.read(name)).lines().skip(1).map(cells).collect()
    }
}

/// The program.
pub fn hil_sim() -> Command {
    let mut command = cargo_bin_cmd!("hil-sim");
    command.timeout(PATIENCE);
    command
}

/// What a program printed.
pub fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}
