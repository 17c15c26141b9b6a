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

/// Oldest node that the page's tools work with.
const NODE: u32 = 18;
const PACKAGES: &str = "nodejs npm chromium";
const PROBE: Duration = Duration::from_secs(20);

/// How the long run is.
#[derive(Args)]
pub struct Soak {
    /// How long the page is watched
    #[arg(long, default_value_t = 60.0)]
    minutes: f64,
}

/// Whether the tools are there, or can be had.
///
/// # Errors
/// With what is missing, and how to get it.
pub fn tools(session: &Session) -> Result<()> {
    let Some(missing) = missing(session) else {
        return Ok(());
    };
    let elsewhere =
        format!("install node {NODE} or newer with npm, and Chromium (CHROMIUM says where it is)");
    debian::install(session, PACKAGES, &missing, &elsewhere)?;
    match self::missing(session) {
        None => Ok(()),
        Some(missing) => bail!("{missing}, and apt-get could not install it: {elsewhere}"),
    }
}

fn missing(session: &Session) -> Option<String> {
    let version = capture(session.command("node", ["--version"]), PROBE);
    let version = version.map(|(_, text)| text).unwrap_or_default();
    match major(&version) {
        None => return Some("no node".into()),
        Some(major) if major < NODE => {
            return Some(format!("node {} is too old", version.trim()));
        }
        Some(_) => {}
    }
    if !succeeds(session.command(NPM, ["--version"]), PROBE) {
        return Some("no npm".into());
    }
    chromium(session).is_none().then(|| "no Chromium".into())
}

/// `v20.19.2` is 20.
fn major(version: &str) -> Option<u32> {
    let version = version.trim().strip_prefix('v')?;
    version.split('.').next()?.parse().ok()
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

/// Gets exactly the packages that the page was made with.
pub fn packages(session: &Session) -> Result<Outcome> {
    session.run(&mut npm(session, "ci --no-audit --no-fund"))
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
    tools(session)?;
    if !has_packages(session) {
        packages(session)?;
    }
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
    session.root.join(FOLDER).join("node_modules").is_dir()
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
    use super::major;

    #[test]
    fn node_says_its_version() {
        assert_eq!(major("v18.20.4\n"), Some(18));
        assert_eq!(major("v20.19.2"), Some(20));
        assert_eq!(major(""), None);
        assert_eq!(major("20"), None);
    }
}
