//! The Python environment of the external serial client: a client that shares no code with this project.

use std::path::Path;
use std::time::Duration;

use anyhow::Result;

use crate::machine::PYTHON3;
use crate::run::{Outcome, Session, succeeds};

const FOLDER: &str = "target/pyserial-venv";
const PIP: &str = "-m pip --disable-pip-version-check install --quiet --retries 1 pyserial==3.5";
const CHECK: &str = "import serial; assert serial.VERSION == '3.5'";
const LIMIT: Duration = Duration::from_secs(120);

/// Makes the environment unless it is there, and tells the tests its interpreter.
pub fn prepare(session: &mut Session) -> Result<Outcome> {
    let interpreter = if cfg!(windows) {
        "Scripts/python.exe"
    } else {
        "bin/python"
    };
    let python = session.root.join(FOLDER).join(interpreter);
    if !has_pyserial(session, &python) {
        // An environment half made, or of a Python since removed, is made anew.
        let mut venv = session.command(PYTHON3, ["-m", "venv", "--clear", FOLDER]);
        let mut pip = session.command(&python, PIP.split_whitespace());
        if matches!(session.run(&mut venv)?, Outcome::Passed) {
            session.run(&mut pip)?;
        }
    }
    if !has_pyserial(session, &python) {
        let why = "pyserial cannot be had from PyPI: the external-client test is left out";
        return Ok(Outcome::Skipped(why.into()));
    }
    println!("pyserial is in {FOLDER}");
    session.set("PYSERIAL_PYTHON", python);
    Ok(Outcome::Passed)
}

fn has_pyserial(session: &Session, python: &Path) -> bool {
    succeeds(session.command(python, ["-c", CHECK]), LIMIT)
}
