//! Whether the search for panics finds one: a copy of the repository gets an index that may be out of range, in code
//! that runs for every line of the protocol, and the search has to name it.

use std::fs;
use std::path::Path;
use std::time::Duration;

use anyhow::{Context, Result, ensure};

use super::build::{compile, target_folder};
use super::elf::Image;
use super::panics;
use super::source::Sources;
use super::vehicle::Vehicle;
use crate::run::{Outcome, Session, capture};

/// The file and the function that gets it, as its first statement.
const FILE: &str = "src/interpreter/mod.rs";
const FUNCTION: &str = "pub fn poll<";
/// Nothing the compiler could know to be in range.
const PANIC: &str = "core::hint::black_box([0_u8; 4][core::hint::black_box(4_usize)]);";

const LISTING: Duration = Duration::from_secs(60);

pub fn check(session: &Session) -> Result<Outcome> {
    let listing = session.command(
        "git",
        [
            "ls-files",
            "-z",
            "--cached",
            "--others",
            "--exclude-standard",
        ],
    );
    let Ok((true, files)) = capture(listing, LISTING) else {
        let why = "not a git repository: what to copy is unknown";
        return Ok(Outcome::Skipped(why.into()));
    };
    let copy = target_folder(session).join("artificial-panic");
    if copy.exists() {
        fs::remove_dir_all(&copy)?;
    }
    for file in files.split_terminator('\0') {
        let from = session.root.join(file);
        // Files deleted since the last commit are still listed.
        if from.is_file() {
            let to = copy.join(file);
            if let Some(folder) = to.parent() {
                fs::create_dir_all(folder)?;
            }
            fs::copy(from, to)?;
        }
    }
    let line = insert(&copy.join(FILE))?;
    println!("{PANIC}\nis inserted at {FILE}:{line}");
    let image = Image::read(&compile(session, Vehicle::default(), &copy)?)?;
    let report = panics::report(&image, &Sources::new(&image, copy.clone())?)?;
    fs::remove_dir_all(&copy)?;
    print!("{}", report.text);
    let named = format!("{FILE}:{line} ");
    let found = report
        .offences
        .iter()
        .any(|offence| offence.contains(&named));
    ensure!(
        found,
        "the search for panics does not find the one at {named}"
    );
    Ok(Outcome::Passed)
}

/// Puts the panic in; its line.
fn insert(file: &Path) -> Result<usize> {
    let text = fs::read_to_string(file).with_context(|| format!("cannot read {FILE}"))?;
    let body = text
        .find(FUNCTION)
        .and_then(|start| Some(start + text[start..].find("{\n")? + 2))
        .with_context(|| format!("no `{FUNCTION}` in {FILE}"))?;
    let (before, after) = text.split_at(body);
    fs::write(file, format!("{before}{PANIC}\n{after}"))?;
    Ok(before.lines().count() + 1)
}
