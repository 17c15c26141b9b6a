//! `consistency` and `propagate`: many bases, or many particles, with a bar and a summary.

use crate::journey::journey;
use crate::options::{Every, Told, bar};
use anyhow::{Context, Result, bail, ensure};
use clap::{Args, ValueEnum};
use hil_sim::consistency::{Plan, consistency};
use hil_sim::plot;
use hil_sim::propagation::{self, Shape, propagate};
use std::io::Write;
use std::path::PathBuf;
use vehicle_controller::time::Duration;

/// Many bases.
#[derive(Args)]
pub struct Consistency {
    /// How many bases
    #[arg(long, default_value_t = 400, value_name = "N")]
    runs: u64,
    /// How long each drives
    #[arg(long, default_value_t = 60.0, value_name = "S")]
    seconds: f64,
    /// Time from one fix of the pose to the next
    #[arg(long, default_value = "none", value_name = "S|none", value_parser = Every::or_none)]
    fix_every: Every,
    /// How well a fix knows x and y: standard deviation
    #[arg(long, default_value_t = 0.01, value_name = "M")]
    fix_position: f64,
    /// How well a fix knows the heading: standard deviation
    #[arg(long, default_value_t = 0.5, value_name = "DEG")]
    fix_heading: f64,
    /// Fixes correct the gains, too (`Calibrate on`)
    #[arg(long)]
    learn: bool,
    /// Rate of the control loop
    #[arg(long, default_value_t = 100, value_name = "HZ", value_parser = clap::value_parser!(u32).range(10..=1000))]
    rate: u32,
    #[command(flatten)]
    told: Told,
    /// Seed of everything random
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Write a row per moment (CSV)
    #[arg(long, value_name = "F.csv")]
    out: Option<PathBuf>,
    /// Draw where the bases truly are, the ellipse and the banana
    #[arg(long, value_name = "F.svg|F.png")]
    plot: Option<PathBuf>,
}

/// Runs them.
pub fn consistency_command(options: &Consistency) -> Result<()> {
    let robot = options.told.load()?;
    if let Some(picture) = &options.plot {
        plot::check_name(picture)?;
    }
    ensure!(
        options.fix_every.0.is_some() || !options.learn,
        "without fixes there is nothing to learn from: --fix-every S"
    );
    let plan = Plan {
        runs: options.runs,
        seconds: options.seconds,
        fix_every: options.fix_every.0,
        fix_deviations: [options.fix_position, options.fix_heading.to_radians()],
        learns: options.learn,
        period: Duration::from_ticks(1_000_000 / u64::from(options.rate)),
        seed: options.seed,
    };
    let bar = bar(plan.runs, "runs");
    let report = consistency(&plan, &robot, &|| bar.inc(1))?;
    bar.finish_and_clear();
    write!(std::io::stdout(), "on {}, {report}", options.told.robot).context("standard output")?;
    if let Some(out) = &options.out {
        report.write(out)?;
    }
    if let Some(picture) = &options.plot {
        let fixes = plan
            .fix_every
            .map_or("no fixes".into(), |every| format!("a fix every {every} s"));
        let title = format!(
            "{} bases like {} after {} s, {fixes}",
            plan.runs, options.told.robot, plan.seconds
        );
        plot::plot_cloud(&report.cloud(), &title, picture)?;
    }
    Ok(())
}

/// Many particles.
#[derive(Args)]
pub struct Propagate {
    /// Logs (as `replay` takes them), or scripts, which are run first
    #[arg(required = true, value_name = "LOG.csv|SCRIPT")]
    journeys: Vec<PathBuf>,
    /// How many particles
    #[arg(long, default_value_t = 100_000, value_name = "N")]
    particles: usize,
    /// What the priors of the radii and the wheel base look like
    #[arg(long, value_enum, default_value_t = Prior::Gaussian, value_name = "SHAPE")]
    prior: Prior,
    #[command(flatten)]
    told: Told,
    /// Seed of everything random
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Draw the particles, their covariance and the estimator's; one journey only
    #[arg(long, value_name = "F.svg|F.png")]
    plot: Option<PathBuf>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Prior {
    Gaussian,
    Uniform,
}

/// Sends them.
pub fn propagate_command(options: &Propagate) -> Result<()> {
    let robot = options.told.load()?;
    if let Some(picture) = &options.plot {
        plot::check_name(picture)?;
        if options.journeys.len() > 1 {
            bail!("--plot is for one journey");
        }
    }
    let plan = propagation::Plan {
        particles: options.particles,
        shape: match options.prior {
            Prior::Gaussian => Shape::Gaussian,
            Prior::Uniform => Shape::Uniform,
        },
        seed: options.seed,
    };
    for path in &options.journeys {
        let log = journey(path, &robot, options.seed)?;
        let bar = bar(plan.particles as u64, "particles");
        let propagation = propagate(&log, &robot, plan, &|particles| bar.inc(particles))?;
        bar.finish_and_clear();
        write!(
            std::io::stdout(),
            "on {}, {propagation}",
            options.told.robot
        )
        .context("standard output")?;
        if let Some(picture) = &options.plot {
            let title = format!("{} on {}", log.name, options.told.robot);
            plot::plot_cloud(&propagation.cloud(), &title, picture)?;
        }
    }
    Ok(())
}
