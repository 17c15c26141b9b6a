//! Fuzzing: the targets of `fuzz/` under libFuzzer, on stable Rust.
//!
//! cargo-fuzz wants a nightly compiler for its sanitizers; here the library has no unsafe code, and what remains of it is a few flags: LLVM's coverage
//! pass for the engine's eyes, in a target directory of its own, so that nothing else is built again.

use std::ffi::OsString;
use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context, Result, bail, ensure};

use crate::run::{Outcome, Session, capture};

/// All targets.
pub const TARGETS: [&str; 4] = ["lines", "interpreter", "tick", "store"];

/// Edges with counters, seen by libFuzzer.
const INSTRUMENTATION: &str = "-C passes=sancov-module -C llvm-args=-sanitizer-coverage-level=3 \
    -C llvm-args=-sanitizer-coverage-inline-8bit-counters -C llvm-args=-sanitizer-coverage-pc-table";

/// What to run.
#[derive(clap::Args)]
pub struct Options {
    /// The target; without one, all of them
    #[arg(value_parser = TARGETS)]
    target: Option<String>,
    /// How long each target runs
    #[arg(long, default_value_t = 30, conflicts_with_all = ["runs", "input"])]
    seconds: u64,
    /// How many executions each target makes, instead
    #[arg(long, conflicts_with = "input")]
    runs: Option<u64>,
    /// Where the random numbers begin
    #[arg(long, default_value_t = 1992)]
    seed: u32,
    /// Keep what was found in fuzz/corpus, as few and short inputs as cover the same
    #[arg(long, conflicts_with = "input")]
    keep: bool,
    /// Run one input only, such as one that failed
    #[arg(long, requires = "target")]
    input: Option<PathBuf>,
}

impl Options {
    /// As the verification runs them.
    pub fn usual() -> Self {
        Self {
            target: None,
            seconds: 30,
            runs: None,
            seed: 1992,
            keep: false,
            input: None,
        }
    }
}

/// Runs targets, all of them even after one has failed.
pub fn run(session: &Session, options: &Options) -> Result<Outcome> {
    let programs = build(session)?;
    if let (Some(target), Some(input)) = (&options.target, &options.input) {
        let mut command = Command::new(programs.join(target));
        command.arg(input);
        return session.run(&mut command);
    }
    let mut failed = Vec::new();
    for target in TARGETS {
        if options.target.as_deref().is_none_or(|only| only == target) {
            let fuzzer = Fuzzer::new(session, &programs, target)?;
            if let Some(input) = fuzzer.fuzz(options)? {
                failed.push(format!("{target} ({input})"));
            } else if options.keep {
                fuzzer.keep()?;
            }
        }
    }
    Ok(if failed.is_empty() {
        Outcome::Passed
    } else {
        Outcome::Failed(failed.join(", "))
    })
}

/// Builds the instrumented programs; where they are.
fn build(session: &Session) -> Result<PathBuf> {
    let host = host(session)?;
    let directory = session.root.join("target/fuzz");
    // With a target, build scripts and macros are not instrumented.
    let mut command = session.cargo("build --package fuzz --features engine --profile fuzz");
    command
        .args(["--target", &host, "--target-dir"])
        .arg(&directory)
        .env("RUSTFLAGS", INSTRUMENTATION);
    if let Outcome::Failed(why) = session.run(&mut command)? {
        bail!("the targets cannot be built: {why}");
    }
    Ok(directory.join(host).join("fuzz"))
}

fn host(session: &Session) -> Result<String> {
    let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let (_, version) = capture(
        session.command(rustc, ["-vV"]),
        std::time::Duration::from_secs(20),
    )?;
    let host = version.lines().find_map(|line| line.strip_prefix("host: "));
    Ok(host.context("rustc does not say its host")?.to_owned())
}

/// One target's program and files.
struct Fuzzer<'a> {
    session: &'a Session,
    target: &'static str,
    program: PathBuf,
    /// Inputs of this run and earlier ones.
    found: PathBuf,
    /// Inputs that the repository keeps: what fuzzing found …
    kept: PathBuf,
    /// … and what people wrote, which nothing takes away.
    seeds: PathBuf,
    /// Inputs that fail.
    failures: PathBuf,
}

impl<'a> Fuzzer<'a> {
    fn new(session: &'a Session, programs: &Path, target: &'static str) -> Result<Self> {
        let fuzzer = Self {
            session,
            target,
            program: programs.join(target),
            found: session.root.join("target/fuzz/found").join(target),
            kept: session.root.join("fuzz/corpus").join(target),
            seeds: session.root.join("fuzz/seeds").join(target),
            failures: session.root.join("target/fuzz/failures"),
        };
        // What an earlier run found is no part of this one: the same seed does the same.
        if fuzzer.found.exists() {
            fs::remove_dir_all(&fuzzer.found)?;
        }
        for directory in [&fuzzer.found, &fuzzer.kept, &fuzzer.seeds, &fuzzer.failures] {
            fs::create_dir_all(directory)
                .with_context(|| format!("cannot create {}", directory.display()))?;
        }
        Ok(fuzzer)
    }

    /// Fuzzes; the path of an input that failed, if one did.
    fn fuzz(&self, options: &Options) -> Result<Option<String>> {
        let limit = match options.runs {
            Some(runs) => format!("-runs={runs}"),
            None => format!("-max_total_time={}", options.seconds),
        };
        let prefix: OsString = [
            self.failures.as_os_str(),
            format!("/{}-", self.target).as_ref(),
        ]
        .into_iter()
        .collect();
        let mut artifacts = OsString::from("-artifact_prefix=");
        artifacts.push(prefix);
        let mut command = Command::new(&self.program);
        command.current_dir(&self.session.root).args([
            &limit,
            &format!("-seed={}", options.seed),
            "-max_len=160",
            // Its schedule by rarity costs more than these targets do.
            "-entropic=0",
            "-reload=0",
            "-print_funcs=0",
            "-print_final_stats=1",
        ]);
        command
            .args([&artifacts])
            .args([&self.found, &self.kept, &self.seeds]);
        println!("{}: {}", self.target, limit.trim_start_matches('-'));
        let report = follow(&mut command)?;
        println!(
            "{}: {} executions, {} a second",
            self.target, report.executions, report.per_second
        );
        if report.good {
            return Ok(None);
        }
        for line in &report.last {
            println!("    {line}");
        }
        let input = report.input.unwrap_or_else(|| "no input".into());
        println!(
            "{} fails: cargo xtask fuzz {} --input {input}",
            self.target, self.target
        );
        Ok(Some(input))
    }

    /// Keeps the fewest and shortest inputs that cover what all cover.
    fn keep(&self) -> Result<()> {
        let least = self.found.with_extension("least");
        if least.exists() {
            fs::remove_dir_all(&least)?;
        }
        fs::create_dir_all(&least)?;
        let mut command = Command::new(&self.program);
        command
            .args(["-set_cover_merge=1", "-use_counters=0", "-print_funcs=0"])
            .args([&least, &self.kept, &self.found])
            .stderr(Stdio::null());
        ensure!(command.status()?.success(), "the corpus cannot be merged");
        fs::remove_dir_all(&self.kept)?;
        fs::create_dir_all(&self.kept)?;
        let (mut files, mut bytes) = (0, 0);
        for entry in fs::read_dir(&least)? {
            let entry = entry?;
            bytes += fs::copy(entry.path(), self.kept.join(entry.file_name()))?;
            files += 1;
        }
        println!("{}: {files} inputs kept, {bytes} bytes", self.target);
        Ok(())
    }
}

/// What a run of libFuzzer said.
#[derive(Default)]
struct Report {
    good: bool,
    executions: String,
    per_second: String,
    /// What was said of the failure.
    last: Vec<String>,
    input: Option<String>,
}

/// Runs libFuzzer to its end and reads along.
fn follow(command: &mut Command) -> Result<Report> {
    let mut child = command
        .stderr(Stdio::piped())
        .spawn()
        .with_context(|| format!("cannot start {}", command.get_program().display()))?;
    let stderr = child.stderr.take().context("no stderr")?;
    let mut report = Report::default();
    let mut failing = false;
    for line in BufReader::new(stderr).split(b'\n') {
        let line = String::from_utf8_lossy(&line?).into_owned();
        failing |= line.contains("panicked at");
        if line.starts_with("stack backtrace") {
            failing = false;
        }
        if let Some((_, path)) = line.split_once("Test unit written to ") {
            report.input = Some(path.to_owned());
        } else if let Some(count) = line.strip_prefix("stat::number_of_executed_units:") {
            count.trim().clone_into(&mut report.executions);
        } else if let Some(rate) = line.strip_prefix("stat::average_exec_per_sec:") {
            rate.trim().clone_into(&mut report.per_second);
        } else if failing || line.contains("ERROR: libFuzzer") {
            report.last.push(line);
        }
    }
    report.good = child.wait()?.success();
    Ok(report)
}
