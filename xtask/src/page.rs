//! The live page: its packages, its checks, that the file in the repository is what its sources make, and a real browser that drives a base by it.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use anyhow::{Context, Result, bail};
use clap::Args;

use crate::debian;
use crate::run::{Outcome, Session, capture, succeeds};

const FOLDER: &str = "web";
/// What `hil-sim` serves; it is in the repository, so that nobody needs node to run the simulator.
const BUILT: &str = "web/dist/index.html";

/// The oldest node that the page's tools work with: the first of its line that takes a loader by `--import`.
const NODE: (u32, u32) = (18, 19);
/// So does this one of the next line, and everything after it.
const NODE_20: (u32, u32) = (20, 6);
/// What npm has installed, in npm's own words, is kept here.
const INSTALLED: &str = "web/node_modules/.package-lock.installed.json";
const LOCK: &str = "web/package-lock.json";
const PROBE: Duration = Duration::from_secs(20);

/// How long the long run is.
#[derive(Args)]
pub struct Soak {
    /// How long the page is watched
    #[arg(long, default_value_t = 60.0)]
    minutes: f64,
}

/// Whether node and npm are there, or can be had.
///
/// # Errors
/// With what is missing, and how to get it.
pub fn node(session: &Session) -> Result<()> {
    let (major, minor) = NODE;
    let elsewhere = format!("install node {major}.{minor} or newer with npm");
    get(session, no_node, &elsewhere)
}

/// Whether Chromium is there, or can be had.
///
/// # Errors
/// With what is missing, and how to get it.
pub fn browser(session: &Session) -> Result<()> {
    let elsewhere = "install Chromium, or say by CHROMIUM where it is";
    get(session, no_browser, elsewhere)
}

/// What is missing, and Debian's packages for it.
struct Missing {
    what: String,
    packages: &'static str,
}

fn get(session: &Session, missing: fn(&Session) -> Option<Missing>, elsewhere: &str) -> Result<()> {
    let Some(Missing { what, packages }) = missing(session) else {
        return Ok(());
    };
    debian::install(session, packages, &what, elsewhere)?;
    match missing(session) {
        None => Ok(()),
        Some(Missing { what, .. }) => {
            bail!("{what}, and apt-get could not install it: {elsewhere}")
        }
    }
}

/// Only what is missing is installed: a node from elsewhere brings an npm of its own, and stands in the way of Debian's.
fn no_node(session: &Session) -> Option<Missing> {
    let version = capture(session.command("node", ["--version"]), PROBE);
    let version = version.map(|(_, text)| text).unwrap_or_default();
    let what = match number(&version) {
        None => "no node".to_owned(),
        Some(number) if is_too_old(number) => format!("node {} is too old", version.trim()),
        Some(_) if succeeds(session.command(NPM, ["--version"]), PROBE) => return None,
        Some(_) => {
            return Some(Missing {
                what: "no npm".into(),
                packages: "npm",
            });
        }
    };
    Some(Missing {
        what,
        packages: "nodejs npm",
    })
}

fn is_too_old(number: (u32, u32)) -> bool {
    let (line, _) = NODE;
    number < NODE || ((line + 1, 0)..NODE_20).contains(&number)
}

fn no_browser(session: &Session) -> Option<Missing> {
    chromium(session).is_none().then(|| Missing {
        what: "no Chromium".into(),
        packages: "chromium",
    })
}

/// `v20.19.2` is 20 and 19.
fn number(version: &str) -> Option<(u32, u32)> {
    let version = version.trim().strip_prefix('v')?;
    let mut numbers = version.split('.').map(str::parse);
    Some((numbers.next()?.ok()?, numbers.next()?.ok()?))
}

const NPM: &str = if cfg!(windows) { "npm.cmd" } else { "npm" };

/// Chromium: the one that is given, or one that is found by its usual names.
fn chromium(session: &Session) -> Option<OsString> {
    let given = std::env::var_os("CHROMIUM").into_iter();
    let usual = ["chromium", "chromium-browser", "google-chrome"];
    given
        .chain(usual.map(OsString::from))
        .find_map(|name| in_path(&name))
        .filter(|browser| succeeds(session.command(browser, ["--version"]), PROBE))
        .map(PathBuf::into_os_string)
}

/// Where a program is that is given by its path or by its name: the tests' driver takes nothing but a path.
fn in_path(name: &OsString) -> Option<PathBuf> {
    if Path::new(name).components().count() > 1 {
        return Some(name.into());
    }
    let folders = std::env::var_os("PATH")?;
    std::env::split_paths(&folders)
        .map(|folder| folder.join(name))
        .find(|file| file.is_file())
}

/// npm in the page's folder.
fn npm(session: &Session, arguments: &str) -> Command {
    let mut command = session.command(NPM, arguments.split(' '));
    command.current_dir(session.root.join(FOLDER));
    command
}

/// Gets exactly the packages that the page was made with, unless they are there.
pub fn packages(session: &Session) -> Result<Outcome> {
    let lock = std::fs::read(session.root.join(LOCK)).with_context(|| LOCK.to_owned())?;
    let installed = session.root.join(INSTALLED);
    if std::fs::read(&installed).is_ok_and(|installed| installed == lock) {
        println!("what {LOCK} names is installed");
        return Ok(Outcome::Passed);
    }
    let outcome = session.run(&mut npm(session, "ci --no-audit --no-fund"))?;
    match outcome {
        Outcome::Passed => {
            std::fs::write(&installed, &lock).with_context(|| INSTALLED.to_owned())?;
            Ok(outcome)
        }
        // A lock file that is wrong is a mistake; a network that is not there is none.
        _ if !succeeds(npm(session, "ping"), PROBE) => Ok(Outcome::Skipped(
            "npm's registry cannot be reached: the page is neither checked nor driven".into(),
        )),
        outcome => Ok(outcome),
    }
}

/// Format, lints, types and unit tests.
pub fn checks(session: &Session) -> Result<Outcome> {
    with_packages(session, || session.run(&mut npm(session, "run check")))
}

/// Builds the page, and sees that this makes no difference to what is in the repository.
pub fn built(session: &Session) -> Result<Outcome> {
    with_packages(session, || {
        let file = session.root.join(BUILT);
        let before = std::fs::read(&file).with_context(|| BUILT.to_owned())?;
        let outcome = session.run(&mut npm(session, "run build"))?;
        let after = std::fs::read(&file).unwrap_or_default();
        if before != after {
            // What is being verified stays as it was.
            std::fs::write(&file, &before).with_context(|| BUILT.to_owned())?;
        }
        match outcome {
            Outcome::Passed if before != after => bail!(
                "{BUILT} is not what its sources make: run `npm run build` in {FOLDER}, and commit it"
            ),
            outcome => Ok(outcome),
        }
    })
}

/// A real browser drives a simulated base.
pub fn end_to_end(session: &Session) -> Result<Outcome> {
    with_packages(session, || {
        in_browser(session, &mut npm(session, "run e2e"))
    })
}

/// The same for a long time, with an eye on memory and frames.
pub fn soak(session: &Session, options: &Soak) -> Result<Outcome> {
    node(session)?;
    browser(session)?;
    packages(session)?;
    let mut soak = npm(session, "run soak");
    soak.env("SOAK_MINUTES", options.minutes.to_string());
    with_packages(session, || in_browser(session, &mut soak))
}

/// Runs a command that wants a simulator and a browser.
fn in_browser(session: &Session, command: &mut Command) -> Result<Outcome> {
    let build = session.run(&mut session.cargo("build --release --package hil-sim"))?;
    if !matches!(build, Outcome::Passed) {
        return Ok(build);
    }
    let browser = chromium(session).context("no Chromium")?;
    command.env("HIL_SIM", simulator(session)?);
    command.env("CHROMIUM", browser);
    session.run(command)
}

/// The simulator, wherever cargo has put it.
fn simulator(session: &Session) -> Result<PathBuf> {
    let folder = std::env::var_os("CARGO_TARGET_DIR").unwrap_or_else(|| "target".into());
    let name = format!("hil-sim{}", std::env::consts::EXE_SUFFIX);
    let program = session.root.join(folder).join("release").join(name);
    let program = program.canonicalize();
    program.context("the simulator that was just built is not where it should be")
}

fn has_packages(session: &Session) -> bool {
    session.root.join(INSTALLED).is_file()
}

fn with_packages(session: &Session, work: impl FnOnce() -> Result<Outcome>) -> Result<Outcome> {
    if has_packages(session) {
        return work();
    }
    Ok(Outcome::Skipped(
        "the page's packages could not be installed".into(),
    ))
}

#[cfg(test)]
mod tests {
    use super::{is_too_old, number};

    #[test]
    fn node_says_its_version() {
        assert_eq!(number("v18.20.4\n"), Some((18, 20)));
        for (version, old) in [
            ("v16.20.2", true),
            ("v18.18.2", true),
            ("v18.19.0", false),
            ("v19.9.0", true),
            ("v20.5.1", true),
            ("v20.6.0", false),
            ("v24.0.1", false),
        ] {
            assert_eq!(number(version).map(is_too_old), Some(old), "{version}");
        }
        for none in ["", "20", "v20", "vx.1"] {
            assert_eq!(number(none), None, "{none}");
        }
    }
}
