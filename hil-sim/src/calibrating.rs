//! `calibrate`: gains from logs with ground truth, and what they are worth.

use crate::journey::journey;
use crate::options::{Every, Told};
use anyhow::{Context, Result};
use clap::Args;
use hil_sim::calibrate::{
    Fixes, Learner, NamedGain, Point, Verdict, named_gains, set_calibration, verdict,
};
use hil_sim::plot;
use hil_sim::replay::{Errors, Log};
use hil_sim::statistics::CHI_SQUARE_3_99;
use std::fmt::Write as _;
use std::io::Write;
use std::path::{Path, PathBuf};
use vehicle_controller::params::Params;

/// What to calibrate on, and how.
#[derive(Args)]
pub struct Options {
    /// Logs to calibrate on, one after another (CSV with columns t,left,right,x,y,theta, or of vehicles that steer t,drive,steer,x,y,theta and
    /// t,left,right,steer,x,y,theta: counts since the row before, the steering angle in rad, and the truth), or scripts, which are run first
    #[arg(required = true, value_name = "LOG.csv|SCRIPT")]
    journeys: Vec<PathBuf>,
    /// Logs or scripts to test the result on; they are not learned from
    #[arg(long, value_name = "LOG.csv|SCRIPT", num_args = 1..)]
    test: Vec<PathBuf>,
    #[command(flatten)]
    told: Told,
    /// Seed of everything random in the scripts' runs
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Time from one fix of the pose to the next; `end`: one at each log's end
    #[arg(long, default_value = "2", value_name = "S|end", value_parser = Every::or_end)]
    fix_every: Every,
    /// How well a fix knows x and y: standard deviation
    #[arg(long, default_value_t = 0.01, value_name = "M")]
    fix_position: f64,
    /// How well a fix knows the heading: standard deviation
    #[arg(long, default_value_t = 0.5, value_name = "DEG")]
    fix_heading: f64,
    /// How late a fix arrives, up to 1.5 s
    #[arg(long, default_value_t = 0.0, value_name = "S")]
    fix_delay: f64,
    /// Write the gains after each fix (CSV)
    #[arg(long, value_name = "F.csv")]
    out: Option<PathBuf>,
    /// Draw how the gains converge, and the last log before and after
    #[arg(long, value_name = "F.svg|F.png")]
    plot: Option<PathBuf>,
}

/// Calibrates, tests, reports.
pub fn calibrate_command(options: &Options) -> Result<()> {
    let robot = options.told.load()?;
    let params = robot.params;
    let fixes = Fixes {
        every: options.fix_every.0,
        position: options.fix_position,
        heading: options.fix_heading.to_radians(),
        delay: options.fix_delay,
    };
    if let Some(picture) = &options.plot {
        plot::check_name(picture)?;
    }
    let load = |paths: &[PathBuf]| -> Result<Vec<Log>> {
        let load = |path: &PathBuf| journey(path, &robot, options.seed);
        paths.iter().map(load).collect()
    };
    let (logs, tests) = (load(&options.journeys)?, load(&options.test)?);
    let mut out = std::io::stdout();
    let mut learner = Learner::new(&robot, &params, &fixes)?;
    let names = logs
        .iter()
        .chain(&tests)
        .map(|log| log.name.chars().count());
    let width = names.max().unwrap_or_default().max(12);
    let mut text = heading(options, &fixes);
    let names: Vec<_> = named_gains(&params)
        .iter()
        .map(|gain| format!("{:21}", gain.name))
        .collect();
    writeln!(
        text,
        "{:width$}  fixes  refused  d2/3  {}",
        "gains",
        names.concat().trim_end()
    )?;
    let calibration = learner.calibration();
    writeln!(
        text,
        "{:width$}  {:22}{}",
        "before",
        "",
        gains(&calibration, &params)
    )?;
    for log in &logs {
        let taken = learner.learn(log)?;
        let ratio = taken
            .distance()
            .map_or_else(|| "-".into(), |distance| format!("{:.2}", distance / 3.0));
        writeln!(
            text,
            "{:width$}  {:5}  {:7}  {ratio:>4}  {}",
            log.name,
            taken.taken,
            taken.refused,
            gains(&learner.calibration(), &params)
        )?;
    }
    let mut learned = params;
    learned.learn(&learner.learned()?);
    write!(
        text,
        "\nfor a base with these parameters:\n{}",
        set_calibration(&learned)
    )?;
    let judge = |logs: &[Log]| -> Result<Vec<Verdict>> {
        let verdict = |log| verdict(log, &robot, &params, &learned, &fixes);
        logs.iter().map(verdict).collect()
    };
    let (own, others) = (judge(&logs)?, judge(&tests)?);
    text += &table("calibrated on", &own, width)?;
    if !others.is_empty() {
        text += &table("tested on", &others, width)?;
    }
    write!(out, "{text}").context("standard output")?;
    if let Some(path) = &options.out {
        write_points(path, &logs, learner.points(), &params)?;
    }
    if let Some(picture) = &options.plot {
        let title = format!("Calibration of {}", options.told.robot);
        let last = others.last().or(own.last());
        let shown = last.map(|verdict| (&verdict.before, &verdict.after));
        plot::plot_convergence(learner.points(), &params, shown, &title, picture)?;
    }
    Ok(())
}

/// What is done.
fn heading(options: &Options, fixes: &Fixes) -> String {
    let every = fixes
        .every
        .map_or("at each end".into(), |every| format!("every {every} s"));
    format!(
        "on {}, logs to learn from: {}, to test on: {}; a fix of {:.1} cm and {:.2} deg {every}, {} s late\n",
        options.told.robot,
        options.journeys.len(),
        options.test.len(),
        100.0 * fixes.position,
        fixes.heading.to_degrees(),
        fixes.delay
    )
}

fn gains(calibration: &vehicle_controller::vehicle::Calibration, params: &Params) -> String {
    let deviations = calibration.spread.deviations();
    let words: Vec<_> = named_gains(params)
        .iter()
        .map(|NamedGain { place, unit, .. }| {
            let (gain, deviation) = (calibration.gains[*place], deviations[*place]);
            let (gain, deviation) = (f64::from(gain) * unit, f64::from(deviation) * unit);
            format!("{gain:.5} ± {deviation:.5}")
        })
        .collect();
    words.join("    ")
}

/// Errors before and after, a line for each log, and their means and maxima.
fn table(title: &str, verdicts: &[Verdict], width: usize) -> Result<String> {
    type Column = fn(&Errors) -> f64;
    let columns: [(Column, usize); 4] = [
        (|errors| errors.max_position, 4),
        (|errors| errors.final_position, 4),
        (|errors| errors.max_heading.to_degrees(), 2),
        (|errors| errors.final_heading.to_degrees(), 2),
    ];
    let mut text = format!("\n{:width$}  ", "");
    for name in [
        "max position (m)",
        "final position",
        "max heading (deg)",
        "final heading",
    ] {
        write!(text, "{name:18}")?;
    }
    write!(text, "d2 of the\n{title:width$}  ")?;
    for name in ["before", "after"].repeat(4) {
        write!(text, "{name:9}")?;
    }
    writeln!(text, "final pose (99 %: {CHI_SQUARE_3_99:.2})")?;
    let line = |name: &str, value: &dyn Fn(Column) -> [f64; 2]| -> Result<String> {
        let mut text = format!("{name:width$}  ");
        for (column, decimals) in columns {
            for number in value(column) {
                write!(text, "{number:<9.decimals$}")?;
            }
        }
        Ok(text)
    };
    for verdict in verdicts {
        let errors = [verdict.errors_before, verdict.errors_after];
        text += &line(&verdict.after.name, &|column| errors.map(|e| column(&e)))?;
        writeln!(text, "{:.2}", verdict.distance)?;
    }
    let over = |fold: &dyn Fn(&mut dyn Iterator<Item = f64>) -> f64, column: Column| {
        let mut before = verdicts.iter().map(|v| column(&v.errors_before));
        let mut after = verdicts.iter().map(|v| column(&v.errors_after));
        [fold(&mut before), fold(&mut after)]
    };
    let mean = |values: &mut dyn Iterator<Item = f64>| values.sum::<f64>() / verdicts.len() as f64;
    let worst = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, f64::max);
    text += &line("mean", &|column| over(&mean, column))?;
    let distances = || verdicts.iter().map(|verdict| verdict.distance);
    writeln!(text, "{:.2}", mean(&mut distances()))?;
    text += &line("worst", &|column| over(&worst, column))?;
    writeln!(text, "{:.2}", worst(&mut distances()))?;
    Ok(text)
}

fn write_points(path: &Path, logs: &[Log], points: &[Point], params: &Params) -> Result<()> {
    let shown = || path.display().to_string();
    let mut writer = csv::Writer::from_path(path).with_context(shown)?;
    let mut header = vec!["t".to_owned(), "log".to_owned()];
    let all = named_gains(params);
    header.extend(all.iter().map(|gain| gain.name.to_owned()));
    header.extend(all.iter().map(|gain| {
        let short = gain.name.strip_prefix("k_").unwrap_or(gain.name);
        format!("sd_{short}")
    }));
    header.push("d2".to_owned());
    writer.write_record(header)?;
    for point in points {
        let mut record = vec![format!("{:.6}", point.t), logs[point.log].name.clone()];
        let deviations = point.deviations();
        let value = |gain: &NamedGain| format!("{:.8}", point.gains[gain.place] * gain.unit);
        record.extend(all.iter().map(value));
        let deviation = |gain: &NamedGain| format!("{:.4e}", deviations[gain.place] * gain.unit);
        record.extend(all.iter().map(deviation));
        record.push(
            point
                .distance
                .map_or_else(String::new, |d| format!("{d:.4}")),
        );
        writer.write_record(record)?;
    }
    writer.flush().with_context(shown)
}
