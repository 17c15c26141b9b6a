//! What the verification would like to find on this machine, what goes without it, and how to get it.

use std::path::{Path, PathBuf};
use std::time::Duration;

use crate::image::toolchain::Toolchain;
use crate::page;
use crate::run::{Session, succeeds};

/// Something a machine may lack.
pub struct Need {
    pub name: &'static str,
    present: fn(&Session) -> bool,
    /// What happens when it is missing.
    pub without: &'static str,
    get: &'static str,
}

pub const NEXTEST: Need = Need {
    name: "cargo-nextest",
    present: |session| succeeds(session.cargo("nextest --version"), PROBE),
    without: "the tests run with cargo test",
    get: "cargo install --locked cargo-nextest",
};

pub const FIRMWARE_TARGET: Need = Need {
    name: "Rust for thumbv7em-none-eabihf",
    present: |session| {
        let toolchain = Toolchain::get(session);
        if let Err(error) = &toolchain {
            println!("{error:#}");
        }
        toolchain.is_ok()
    },
    without: "the firmware is neither built nor checked nor emulated",
    get: "rustup target add thumbv7em-none-eabihf, or as above",
};

pub const PYTHON: Need = Need {
    name: "python3 with venv and pip",
    present: |session| {
        succeeds(
            session.command(PYTHON3, ["-c", "import venv, ensurepip"]),
            PROBE,
        )
    },
    without: "clients of the serial line and peers on a ROS 2 network are left out",
    get: "apt install python3-venv, or https://www.python.org",
};

pub const CXX: Need = Need {
    name: "a C++ compiler",
    present: |session| {
        let compiler = std::env::var_os("CXX").unwrap_or_else(|| "c++".into());
        cfg!(unix) && succeeds(session.command(compiler, ["--version"]), PROBE)
    },
    without: "nothing is fuzzed; the kept inputs run among the tests",
    get: "apt install g++",
};

pub const BASH: Need = Need {
    name: "bash",
    present: |session| succeeds(session.command("bash", ["-c", ":"]), PROBE),
    without: "the commands of README.md are not run",
    get: "a Unix-like system, with the package bash",
};

pub const LOGS: Need = Need {
    name: "logs of real robots",
    present: |session| logs(&session.root).is_dir(),
    without: "the tests on real logs are left out",
    get: "put them into ../shared/data, or set VEHICLE_CONTROLLER_SHARED to their folder",
};

pub const NODE: Need = Need {
    name: "node and npm",
    present: |session| said(&page::node(session)),
    without: "the live page is neither checked nor built; what is in the repository is served",
    get: "as above",
};

pub const BROWSER: Need = Need {
    name: "Chromium",
    present: |session| said(&page::browser(session)),
    without: "the live page is not driven by a browser",
    get: "as above",
};

/// Whether it is there; if not, why.
fn said(found: &anyhow::Result<()>) -> bool {
    if let Err(error) = found {
        println!("{error:#}");
    }
    found.is_ok()
}

/// All of them.
pub const NEEDS: &[&Need] = &[
    &NEXTEST,
    &FIRMWARE_TARGET,
    &CXX,
    &PYTHON,
    &BASH,
    &LOGS,
    &NODE,
    &BROWSER,
];

/// Python 3 goes by another name on Windows.
pub const PYTHON3: &str = if cfg!(windows) { "python" } else { "python3" };

const PROBE: Duration = Duration::from_secs(20);

/// What turned out to be missing.
pub struct Machine {
    missing: Vec<&'static str>,
}

impl Machine {
    /// Looks for these once, and prints what there is.
    pub fn look(session: &Session, needs: &[&Need]) -> Self {
        println!("== this machine");
        let mut missing = Vec::new();
        for need in needs {
            if (need.present)(session) {
                println!("found    {}", need.name);
            } else {
                println!(
                    "missing  {}: {}; to get it: {}",
                    need.name, need.without, need.get
                );
                missing.push(need.name);
            }
        }
        Self { missing }
    }

    pub fn has(&self, need: &Need) -> bool {
        !self.missing.contains(&need.name)
    }
}

fn logs(root: &Path) -> PathBuf {
    let elsewhere = std::env::var_os("VEHICLE_CONTROLLER_SHARED").map(PathBuf::from);
    root.join(elsewhere.unwrap_or_else(|| "../shared/data".into()))
}
