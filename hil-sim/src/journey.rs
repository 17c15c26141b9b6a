//! Journeys to look at afterwards: recorded by a real base, or by a simulated one that runs a script.

use crate::run::{self, Watcher};
use crate::trace_file::TraceFile;
use anyhow::{Result, ensure};
use hil_sim::replay::{Log, Row};
use hil_sim::rig::Rig;
use hil_sim::robot::Robot;
use hil_sim::script::Script;
use std::path::Path;

/// A script's log has a row this often, s.
const PERIOD: f64 = 0.01;

/// The log of that name, if it ends in `.csv`; otherwise the log of the script's run, which knows the truth.
pub fn journey(path: &Path, robot: &Robot, seed: u64) -> Result<Log> {
    let extension = path.extension().unwrap_or_default();
    if extension.eq_ignore_ascii_case("csv") {
        return Log::load(path);
    }
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    simulated(&Script::load(path)?, &name, robot, seed)
}

/// The log of a script's run.
pub fn simulated(script: &Script, name: &str, robot: &Robot, seed: u64) -> Result<Log> {
    let mut base = Rig::new(robot, seed)?;
    let mut trace = TraceFile::create(None, true, PERIOD)?;
    let mut said = Vec::new();
    let mut watchers: Vec<&mut dyn Watcher> = Vec::new();
    watchers.extend(trace.as_mut().map(|trace| trace as &mut dyn Watcher));
    run::run(&mut base, script, seed, &mut watchers, &mut said)?;
    // What is learned of a base that stood, nobody should take for a drive.
    for line in String::from_utf8_lossy(&said).lines() {
        let is_trouble = line.contains("\t! fault") || line.contains("\tERR");
        ensure!(
            !is_trouble,
            "{name}: the base said `{}`",
            line.replace('\t', " s ")
        );
    }
    let rows = trace.map_or(Ok(Vec::new()), TraceFile::into_rows)?;
    Log::recorded(name.to_owned(), rows.iter().map(Row::from))
}
