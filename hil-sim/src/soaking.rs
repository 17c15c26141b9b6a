//! `soak`: hours of random driving, with a bar and a summary.

use crate::options::bar;
use anyhow::{Context, Result, ensure};
use clap::Args;
use hil_sim::soak::{Mode, Plan, soak};
use std::io::Write;
use std::path::PathBuf;
use std::time::Instant;

const TICKS_PER_HOUR: f64 = 3.6e6;

/// What to soak.
#[derive(Args)]
pub struct Options {
    /// Simulated hours, in all; healthy driving and driving with faults have half of them each
    #[arg(long, default_value_t = 1.0)]
    hours: f64,
    /// Simulated minutes, in place of hours
    #[arg(long, conflicts_with = "hours")]
    minutes: Option<f64>,
    /// Seed of everything random
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// One robot only; all that have motors otherwise
    #[arg(long)]
    robot: Option<String>,
    /// Only healthy driving: nothing breaks
    #[arg(long, conflicts_with = "faults")]
    healthy: bool,
    /// Only driving with faults
    #[arg(long)]
    faults: bool,
    /// Run this image of the firmware on emulated boards
    #[arg(long, value_name = "F.elf")]
    image: Option<PathBuf>,
    /// Pushes so many times as strong: how much is there to spare?
    #[arg(long, default_value_t = 1.0, value_name = "X")]
    push: f64,
    /// Repeat one shard only, such as one with a finding
    #[arg(long)]
    shard: Option<u64>,
    /// So many at once; as many as there are processors otherwise
    #[arg(long)]
    threads: Option<usize>,
}

/// Runs it; fails if anything was found.
pub fn soak_command(options: &Options) -> Result<()> {
    let hours = options
        .minutes
        .map_or(options.hours, |minutes| minutes / 60.0);
    ensure!(
        hours > 0.0 && hours <= 1e6,
        "a soak takes some time, and not for ever"
    );
    let modes = match (options.healthy, options.faults) {
        (true, _) => vec![Mode::Healthy],
        (_, true) => vec![Mode::Faults],
        _ => vec![Mode::Healthy, Mode::Faults],
    };
    let plan = Plan {
        ticks: (hours * TICKS_PER_HOUR).ceil() as u64,
        seed: options.seed,
        modes,
        robot: options.robot.clone(),
        image: options.image.clone(),
        push: options.push,
        shard: options.shard,
        threads: options
            .threads
            .unwrap_or_else(|| std::thread::available_parallelism().map_or(1, usize::from)),
    };
    let bar = bar(plan.total()?, "soak");
    let start = Instant::now();
    let tally = soak(&plan, &|ticks| bar.inc(ticks))?;
    bar.finish_and_clear();
    let seconds = start.elapsed().as_secs_f64();
    let simulated = tally.ticks.iter().sum::<u64>() as f64 * 1e-3;
    writeln!(
        std::io::stdout(),
        "{tally}it took {seconds:.1} s, {:.0} times as fast as real time",
        simulated / seconds
    )
    .context("standard output")?;
    ensure!(
        tally.is_good(),
        "{} false trips, {} violations; seed {}",
        tally.false_trips,
        tally.violations,
        options.seed
    );
    Ok(())
}
