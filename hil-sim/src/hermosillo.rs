//! `hermosillo`: the experiment of [H] for a car: what odometry makes of its path by each relation of the steered axle, before and after a calibration.

use crate::journey::simulated;
use crate::options::Told;
use anyhow::{Context, Result, ensure};
use clap::Args;
use hil_sim::calibrate::{Fixes, Learner, named_gains, set_calibration};
use hil_sim::plant::Chassis;
use hil_sim::plot;
use hil_sim::replay::{Log, Replay};
use hil_sim::robot::Robot;
use hil_sim::script::Script;
use hil_sim::steered_axle::{Relation, odometry};
use std::fmt::Write as _;
use std::io::Write;
use std::path::PathBuf;
use vehicle_controller::params::{Id, Params};
use vehicle_controller::vehicle::Kind;

/// The path of the paper.
const PATH: &str = include_str!("../scenarios/hermosillo.script");

/// Which car, and how it is seen.
#[derive(Args)]
pub struct Options {
    /// A car's name (see `robots`) or the path of its .toml file
    #[arg(long, default_value = "cycab-uncalibrated")]
    robot: String,
    /// Set a parameter; may be given again
    #[arg(long, value_name = "NAME=VALUE")]
    set: Vec<String>,
    /// Seed of everything random, the fixes' errors among it
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Time from one fix of the pose to the next
    #[arg(long, default_value_t = 0.1, value_name = "S")]
    fix_every: f64,
    /// How well a fix knows x and y: standard deviation
    #[arg(long, default_value_t = 0.01, value_name = "M")]
    fix_position: f64,
    /// How well it knows the heading: standard deviation
    #[arg(long, default_value_t = 0.2, value_name = "DEG")]
    fix_heading: f64,
    /// Draw odometry before the calibration (the paper's figure 4)
    #[arg(long, value_name = "F.svg|F.png")]
    before: Option<PathBuf>,
    /// Draw odometry after the calibration (its figure 8)
    #[arg(long, value_name = "F.svg|F.png")]
    after: Option<PathBuf>,
}

/// Drives, learns, compares.
pub fn hermosillo_command(options: &Options) -> Result<()> {
    let told = Told {
        robot: options.robot.clone(),
        set: options.set.clone(),
    };
    let robot = told.load()?;
    ensure!(
        robot.params.vehicle() == Kind::BiSteerable,
        "the experiment is a car's: --robot cycab-uncalibrated"
    );
    for picture in [&options.before, &options.after].into_iter().flatten() {
        plot::check_name(picture)?;
    }
    let fixes = Fixes {
        every: Some(options.fix_every),
        position: options.fix_position,
        heading: options.fix_heading.to_radians(),
        delay: 0.0,
    };
    let script = Script::parse(PATH, "hermosillo")?;
    let log = simulated(&script, "hermosillo", &robot, options.seed)?;
    let mut learner = Learner::new(&robot, &robot.params, &fixes)?;
    learner.learn(&log.seen(&fixes, options.seed)?)?;
    let mut learned = robot.params;
    learned.learn(&learner.learned()?);
    let before = replays(&log, &robot, &robot.params)?;
    let after = replays(&log, &robot, &learned)?;
    let mut text = format!(
        "on {}, seed {}: a fix of {:.1} cm and {:.2} deg every {} s\n",
        options.robot,
        options.seed,
        100.0 * fixes.position,
        options.fix_heading,
        options.fix_every
    );
    text += &gains(&robot, &learner, &learned)?;
    text += &errors(&before, &after)?;
    write!(
        text,
        "\nfor a base with these parameters:\n{}",
        set_calibration(&learned)
    )?;
    write!(std::io::stdout(), "{text}").context("standard output")?;
    for (picture, replays, when) in [
        (&options.before, &before, "before"),
        (&options.after, &after, "after"),
    ] {
        if let Some(picture) = picture {
            let paths: Vec<_> = replays.iter().map(seen_from_above).collect();
            let title = format!("Odometry of {} {when} the calibration", options.robot);
            plot::plot_replay(&paths, &title, picture)?;
        }
    }
    Ok(())
}

fn replays(log: &Log, robot: &Robot, params: &Params) -> Result<Vec<Replay>> {
    let replay = |relation| odometry(log, robot, params, relation);
    Relation::ALL.into_iter().map(replay).collect()
}

/// Relations differ by less than their ellipses; and 20 rows for each second are enough to look at.
fn seen_from_above(replay: &Replay) -> plot::ReplayPath {
    const EVERY: usize = 5;
    let path = replay.path();
    plot::ReplayPath {
        t: path.t.into_iter().step_by(EVERY).collect(),
        estimated: path.estimated.into_iter().step_by(EVERY).collect(),
        truth: path
            .truth
            .map(|truth| truth.into_iter().step_by(EVERY).collect()),
        covariance: Vec::new(),
        ..path
    }
}

/// The gains that were learned, and the true ones.
fn gains(robot: &Robot, learner: &Learner, learned: &Params) -> Result<String> {
    let deviations = learner.calibration().spread.deviations();
    let mut text = String::from("gains             true       learned                error\n");
    for gain in named_gains(learned) {
        let value = f64::from(learned.get(gain.id));
        let deviation = f64::from(deviations[gain.place]) * gain.unit;
        let truth = true_gain(robot, gain.id);
        writeln!(
            text,
            "{:16}  {truth:8.5}  {value:8.5} ± {deviation:.5}  {:9.5}",
            gain.name,
            value - truth
        )?;
    }
    Ok(text)
}

/// True over nominal; of the steering, the true offset in degrees.
fn true_gain(robot: &Robot, id: Id) -> f64 {
    let wheels = &robot.physics.wheels;
    let over = |truth: f64, id| truth / f64::from(robot.params.get(id));
    match id {
        Id::GainRight => over(wheels.diameter_right, Id::RightDiameter),
        Id::GainLeft => over(wheels.diameter_left, Id::LeftDiameter),
        Id::GainBase => over(wheels.base, Id::Track),
        _ => match &robot.physics.chassis {
            Chassis::Bisteerable(car) => car.servo.steer_offset.to_degrees(),
            _ => 0.0,
        },
    }
}

/// What each relation leaves.
fn errors(before: &[Replay], after: &[Replay]) -> Result<String> {
    let mut text = format!(
        "\n{:10}{:20}{:18}{:20}final heading\nodometry  ",
        "", "max position (m)", "final position", "max heading (deg)"
    );
    for name in ["before", "after"].repeat(4) {
        write!(text, "{name:9} ")?;
    }
    text.push('\n');
    for (before, after) in before.iter().zip(after) {
        let unknown = || anyhow::anyhow!("{}: the truth is not known", before.name);
        let (b, a) = (
            before.errors().ok_or_else(unknown)?,
            after.errors().ok_or_else(unknown)?,
        );
        writeln!(
            text,
            "{:10}{:<9.4} {:<9.4} {:<9.4} {:<9.4} {:<9.2} {:<9.2} {:<9.2} {:<9.2}",
            before.name,
            b.max_position,
            a.max_position,
            b.final_position,
            a.final_position,
            b.max_heading.to_degrees(),
            a.max_heading.to_degrees(),
            b.final_heading.to_degrees(),
            a.final_heading.to_degrees()
        )?;
    }
    Ok(text)
}
