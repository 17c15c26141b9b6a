//! `consistency` and `propagate`: many bases, or many particles, with a bar and a summary.

use crate::run;
use crate::trace_file::TraceFile;
use anyhow::{Context, Result, bail};
use clap::{Args, ValueEnum};
use hil_sim::consistency::{Plan, consistency};
use hil_sim::propagation::{self, Shape, propagate};
use hil_sim::replay::Log;
use hil_sim::rig::Rig;
use hil_sim::robot::Robot;
use hil_sim::script::Script;
use hil_sim::{plot, settings};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use vehicle_controller::time::Duration;

/// A script's log has a row this often, s.
const LOG_PERIOD: f64 = 0.01;

/// How often a fix comes.
#[derive(Clone, Copy, Debug)]
struct Every(Option<f64>);

impl FromStr for Every {
    type Err = anyhow::Error;

    fn from_str(text: &str) -> Result<Self> {
        if text == "none" {
            return Ok(Self(None));
        }
        match text.parse::<f64>() {
            Ok(seconds) if seconds > 0.0 && seconds.is_finite() => Ok(Self(Some(seconds))),
            _ => bail!("write seconds above 0, or none"),
        }
    }
}

/// Many bases.
#[derive(Args)]
pub struct Consistency {
    /// How many bases
    #[arg(long, default_value_t = 400)]
    runs: u64,
    /// How long each drives, s
    #[arg(long, default_value_t = 60.0, value_name = "S")]
    seconds: f64,
    /// A fix of the pose this often, s
    #[arg(long, default_value = "none", value_name = "S|none")]
    fix_every: Every,
    /// Standard deviations of a fix: of x and of y (m), of the heading (deg)
    #[arg(long, num_args = 2, default_values_t = [0.01, 0.5], value_names = ["M", "DEG"])]
    fix_deviations: Vec<f64>,
    /// Fixes correct the gains, too
    #[arg(long)]
    learn: bool,
    /// Rate of the control loop, Hz
    #[arg(long, default_value_t = 100, value_name = "HZ", value_parser = clap::value_parser!(u32).range(10..=1000))]
    rate: u32,
    /// A robot's name or the path of its .toml file
    #[arg(long, default_value = "default")]
    robot: String,
    /// Set a parameter: `k_drift`, `k_rot`, `k_scale` are the priors, `noise_s`, `noise_drift`, `noise_rot` the random errors
    #[arg(long, value_name = "name=value")]
    set: Vec<String>,
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

fn bar(length: u64, of: &str) -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(length), ProgressDrawTarget::stderr());
    let template = format!("{{wide_bar}} {{percent}} % of the {of}, {{eta}} left");
    bar.set_style(
        ProgressStyle::with_template(&template).unwrap_or_else(|_| ProgressStyle::default_bar()),
    );
    bar
}

/// Runs them.
pub fn consistency_command(options: &Consistency) -> Result<()> {
    let mut robot = Robot::load(&options.robot)?;
    settings::apply(&mut robot.params, &options.set)?;
    if let Some(picture) = &options.plot {
        plot::check_name(picture)?;
    }
    let [along, angle] = options.fix_deviations[..] else {
        bail!("--fix-deviations takes two numbers");
    };
    let plan = Plan {
        runs: options.runs,
        seconds: options.seconds,
        fix_every: options.fix_every.0,
        fix_deviations: [along, angle.to_radians()],
        learns: options.learn,
        period: Duration::from_ticks(1_000_000 / u64::from(options.rate)),
        seed: options.seed,
    };
    let bar = bar(plan.runs, "runs");
    let report = consistency(&plan, &robot, &|| bar.inc(1))?;
    bar.finish_and_clear();
    write!(std::io::stdout(), "{report}").context("standard output")?;
    if let Some(out) = &options.out {
        report.write(out)?;
    }
    if let Some(picture) = &options.plot {
        let fixes = plan
            .fix_every
            .map_or("no fixes".into(), |every| format!("a fix every {every} s"));
        let title = format!(
            "{} bases like {} after {} s, {fixes}",
            plan.runs, options.robot, plan.seconds
        );
        plot::plot_cloud(&report.cloud(), &title, picture)?;
    }
    Ok(())
}

/// Many particles.
#[derive(Args)]
pub struct Propagate {
    /// Logs (CSV with columns t,left,right and optionally x,y,theta), or scripts, which are run first
    #[arg(required = true, value_name = "LOG.csv|SCRIPT")]
    journeys: Vec<PathBuf>,
    /// How many particles
    #[arg(long, default_value_t = 100_000)]
    particles: usize,
    /// What the priors of the radii and the wheel base look like
    #[arg(long, value_enum, default_value_t = Prior::Gaussian)]
    prior: Prior,
    /// A robot's name or the path of its .toml file
    #[arg(long, default_value = "default")]
    robot: String,
    /// Set a parameter
    #[arg(long, value_name = "name=value")]
    set: Vec<String>,
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
    let mut robot = Robot::load(&options.robot)?;
    settings::apply(&mut robot.params, &options.set)?;
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
        let log = if path.extension().is_some_and(|extension| extension == "csv") {
            Log::load(path)?
        } else {
            driven(path, &robot, options.seed)?
        };
        let bar = bar(plan.particles as u64, "particles");
        let propagation = propagate(&log, &robot, plan, &|particles| bar.inc(particles))?;
        bar.finish_and_clear();
        write!(std::io::stdout(), "{propagation}").context("standard output")?;
        if let Some(picture) = &options.plot {
            let title = format!("{} on {}", log.name, options.robot);
            plot::plot_cloud(&propagation.cloud(), &title, picture)?;
        }
    }
    Ok(())
}

/// The log of a script's run.
fn driven(path: &Path, robot: &Robot, seed: u64) -> Result<Log> {
    let script = Script::load(path)?;
    let mut base = Rig::new(robot, seed)?;
    let trace = TraceFile::create(None, true, LOG_PERIOD)?;
    let trace = run::run(&mut base, &script, trace, &mut std::io::sink())?;
    let rows = trace.map_or(Ok(Vec::new()), TraceFile::into_rows)?;
    let counts: Vec<_> = rows
        .iter()
        .map(|row| (row.t, [row.left_count, row.right_count]))
        .collect();
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    Log::recorded(name.into_owned(), &counts)
}
