//! Python environments under `target/` with packages of exact versions from PyPI, for tests against code that is not the project's.

use std::path::Path;
use std::time::Duration;

use anyhow::Result;

use crate::machine::PYTHON3;
use crate::run::{Outcome, Session, succeeds};

/// An environment.
pub struct Venv {
    /// Where it is, from the root.
    pub folder: &'static str,
    /// What is in it: `name==version`, separated by blanks.
    pub packages: &'static str,
    /// What its programs import.
    pub imports: &'static str,
    /// The environment variable by which the tests find its interpreter.
    pub variable: &'static str,
    /// What is left out without it.
    pub without: &'static str,
}

const PIP: &str =
    "-m pip --disable-pip-version-check install --quiet --retries 1 --only-binary :all:";
const LIMIT: Duration = Duration::from_secs(120);

impl Venv {
    /// Makes the environment unless it is there, and tells the tests its interpreter.
    pub fn prepare(&self, session: &mut Session) -> Result<Outcome> {
        let interpreter = if cfg!(windows) {
            "Scripts/python.exe"
        } else {
            "bin/python"
        };
        let python = session.root.join(self.folder).join(interpreter);
        if !self.is_complete(session, &python) {
            // An environment half made, or of a Python since removed, is made anew.
            let mut venv = session.command(PYTHON3, ["-m", "venv", "--clear", self.folder]);
            let words = PIP
                .split_whitespace()
                .chain(self.packages.split_whitespace());
            let mut pip = session.command(&python, words);
            if matches!(session.run(&mut venv)?, Outcome::Passed) {
                session.run(&mut pip)?;
            }
        }
        if !self.is_complete(session, &python) {
            return Ok(Outcome::Skipped(format!(
                "{} cannot be had from PyPI: {}",
                self.packages, self.without
            )));
        }
        println!("{} in {}", self.packages, self.folder);
        session.set(self.variable, python);
        Ok(Outcome::Passed)
    }

    /// Whether each package is there in its version and can be imported.
    fn is_complete(&self, session: &Session, python: &Path) -> bool {
        let check = format!(
            "from importlib.metadata import version\nimport {}\nfor package in '{}'.split(): name, wanted = package.split('=='); assert version(name) == wanted",
            self.imports, self.packages
        );
        succeeds(session.command(python, ["-c", check.as_str()]), LIMIT)
    }
}
