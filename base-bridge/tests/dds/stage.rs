//! A simulated base, its serial port, and the bridge's program.

use crate::common::cable::Usb;
use crate::common::{Base, sleep};
use assert_cmd::cargo::cargo_bin;
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use std::path::PathBuf;
use std::process::{Child, Command, ExitStatus, Stdio};
use tempfile::TempDir;

/// At rest: what encoders' steps leave, m/s.
pub const REST: f64 = 5e-3;

/// The base, at its port.
pub struct Stage {
    pub base: Base,
    port: PathBuf,
    // It is pulled before the folder goes that its link is in.
    _usb: Usb,
    pub folder: TempDir,
}

impl Stage {
    /// A base that is on.
    pub fn set() -> Self {
        let base = Base::start("default", 1, &[]);
        let folder = tempfile::tempdir().unwrap();
        let port = folder.path().join("ttyACM0");
        let mut usb = Usb::new(&base, &port);
        usb.plug();
        Self {
            base,
            folder,
            port,
            _usb: usb,
        }
    }

    /// The bridge at its port, as the robot `r1`, on loopback alone.
    pub fn bridge(&self, arguments: &[&str]) -> Running {
        self.bridge_everywhere(&[arguments, &["--localhost-only"]].concat())
    }

    /// The same on every network there is.
    pub fn bridge_everywhere(&self, arguments: &[&str]) -> Running {
        Running::bridge(
            &[
                &["--namespace", "r1", "--port", self.port.to_str().unwrap()],
                arguments,
            ]
            .concat(),
        )
    }

    /// Waits until it drives faster than this, m/s.
    pub fn wait_for_speed(&self, speed: f64) {
        for _ in 0..500 {
            if self.base.speed().0 > speed {
                return;
            }
            sleep(0.01);
        }
        panic!("{:?} is no {speed} m/s", self.base.speed());
    }
}

/// A program that runs.
pub struct Running(pub Child);

impl Running {
    /// The bridge.
    fn bridge(arguments: &[&str]) -> Self {
        let bridge = Command::new(cargo_bin!("base-bridge"))
            .args(arguments)
            .stdin(Stdio::null())
            .spawn();
        Self(bridge.unwrap())
    }

    /// As when its computer loses its power.
    pub fn kill(mut self) {
        self.0.kill().unwrap();
        self.0.wait().unwrap();
    }

    /// As `systemctl stop` does.
    pub fn terminate(mut self) -> ExitStatus {
        kill(Pid::from_raw(self.0.id() as i32), Signal::SIGTERM).unwrap();
        self.0.wait().unwrap()
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}
