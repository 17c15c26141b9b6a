//! Environments of Python for peers that share no code with this project.

use std::time::Duration;

use anyhow::Result;

use crate::machine::PYTHON3;
use crate::run::{Outcome, Session, succeeds};

/// An environment.
pub struct Environment {
    folder: &'static str,
    packages: &'static str,
    /// A program that only runs where these are there.
    check: &'static str,
    /// Tells the tests its interpreter.
    variable: &'static str,
    without: &'static str,
}

/// Of the serial client.
pub const PYSERIAL: Environment = Environment {
    folder: "target/pyserial-venv",
    packages: "pyserial==3.5",
    check: "import serial; assert serial.VERSION == '3.5'",
    variable: "PYSERIAL_PYTHON",
    without: "pyserial cannot be had from PyPI: the external-client test is left out",
};

/// Of nodes on a ROS 2 network, and readers of its logs.
pub const ROS: Environment = Environment {
    folder: "target/ros-venv",
    packages: "cyclonedds==11.0.1 mcap==1.6.0 mcap-ros2-support==0.6.0 rosbags==0.11.9",
    check: "import cyclonedds, mcap, mcap_ros2, rosbags; from importlib.metadata import version; assert [version(p) for p in ('cyclonedds', 'mcap', 'mcap-ros2-support', 'rosbags')] == ['11.0.1', '1.6.0', '0.6.0', '0.11.9']",
    variable: "ROS_PYTHON",
    without: "cyclonedds, mcap or rosbags cannot be had from PyPI: base-bridge is not tried against them",
};

const PIP: &str = "-m pip --disable-pip-version-check install --quiet --retries 1";
const LIMIT: Duration = Duration::from_secs(120);

/// Makes the environment unless it is there, and tells the tests its interpreter.
pub fn prepare(session: &mut Session, environment: &Environment) -> Result<Outcome> {
    let interpreter = if cfg!(windows) {
        "Scripts/python.exe"
    } else {
        "bin/python"
    };
    let folder = environment.folder;
    let python = session.root.join(folder).join(interpreter);
    let is_there =
        |session: &Session| succeeds(session.command(&python, ["-c", environment.check]), LIMIT);
    if !is_there(session) {
        // An environment half made, or of a Python since removed, is made anew.
        let mut venv = session.command(PYTHON3, ["-m", "venv", "--clear", folder]);
        let packages = environment.packages.split_whitespace();
        let mut pip = session.command(&python, PIP.split_whitespace().chain(packages));
        if matches!(session.run(&mut venv)?, Outcome::Passed) {
            session.run(&mut pip)?;
        }
    }
    if !is_there(session) {
        return Ok(Outcome::Skipped(environment.without.into()));
    }
    println!("{} in {folder}", environment.packages);
    session.set(environment.variable, python);
    Ok(Outcome::Passed)
}
