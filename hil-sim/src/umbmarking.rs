//! `umbmark`: the square path experiment, its closed form, and what the filter makes of the same squares.

use crate::options::{bar, told};
use anyhow::{Context, Result, ensure};
use clap::Args;
use hil_sim::calibrate::{Fixes, Learner, Taken, set_gains};
use hil_sim::plot::{self, Returns};
use hil_sim::rig::Rig;
use hil_sim::robot::Robot;
use hil_sim::umbmark::{ClosedForm, Directions, Squares, drive};
use std::fmt::Write as _;
use std::io::Write;
use std::path::{Path, PathBuf};
use vehicle_controller::params::{Id, Params};
use vehicle_controller::vehicle::gains::of_each;
use vehicle_controller::vehicle::{Calibration, Spread};

/// Which squares, on what.
#[derive(Args)]
pub struct Options {
    /// A robot's name (see `robots`) or the path of its .toml file
    #[arg(long, default_value = "uncalibrated")]
    robot: String,
    /// Seed of everything random
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Sides of the square
    #[arg(long, default_value_t = 4.0, value_name = "M")]
    side: f64,
    /// Squares each way
    #[arg(long, default_value_t = 5, value_name = "N")]
    runs: usize,
    /// Set a parameter; may be given again
    #[arg(long, value_name = "NAME=VALUE")]
    set: Vec<String>,
    /// How well the filter's fix at the end of a square knows x and y: standard deviation
    #[arg(long, default_value_t = 0.002, value_name = "M")]
    fix_position: f64,
    /// How well it knows the heading: standard deviation
    #[arg(long, default_value_t = 0.2, value_name = "DEG")]
    fix_heading: f64,
    /// Write the return error of each square before and after (CSV)
    #[arg(long, value_name = "F.csv")]
    out: Option<PathBuf>,
    /// Draw the return errors before and after
    #[arg(long, value_name = "F.svg|F.png")]
    plot: Option<PathBuf>,
}

/// Drives, calculates, learns, reports.
pub fn umbmark_command(options: &Options) -> Result<()> {
    let robot = told(&options.robot, &options.set)?;
    robot.ensure_differential("the square test")?;
    let fixes = Fixes {
        every: None,
        position: options.fix_position,
        heading: options.fix_heading.to_radians(),
        delay: 0.0,
    };
    if let Some(picture) = &options.plot {
        plot::check_name(picture)?;
    }
    let wheel_base = robot.params.get(Id::WheelBase);
    ensure!(
        options.side >= f64::from(wheel_base),
        "the sides must be at least as long as the wheel base, {wheel_base} m"
    );
    let mut learner = Learner::new(&robot, &robot.params, &fixes)?;
    let mut base = Rig::new(&robot, options.seed)?;
    let bar = bar(2 * options.runs as u64, "squares");
    let squares = drive(&mut base, options.side, options.runs, &|| bar.inc(1))?;
    bar.finish_and_clear();
    for log in squares.in_turn() {
        learner.learn(log)?;
    }
    let found = Found::of(options, &robot, &squares, &learner)?;
    let report = report(options, &robot, &squares, &found)?;
    write!(std::io::stdout(), "{report}").context("standard output")?;
    if options.out.is_none() && options.plot.is_none() {
        return Ok(());
    }
    let returns = found.returns(&robot, &squares)?;
    if let Some(out) = &options.out {
        write_returns(out, &returns)?;
    }
    if let Some(picture) = &options.plot {
        let title = format!("Squares of {} m on {}", options.side, options.robot);
        plot::plot_returns(&returns, &title, picture)?;
    }
    Ok(())
}

/// What the squares tell of.
const GAINS: [Id; 3] = [Id::GainRight, Id::GainLeft, Id::GainBase];

/// What the squares tell.
struct Found {
    errors: Directions<[f64; 2]>,
    closed: ClosedForm,
    /// Gains: before, by the closed form, by the filter.
    before: [f64; 3],
    calculated: [f64; 3],
    learned: Calibration,
    fixes: Taken,
}

impl Found {
    fn of(options: &Options, robot: &Robot, squares: &Squares, learner: &Learner) -> Result<Self> {
        let params = &robot.params;
        let nominal = |id| f64::from(params.get(id));
        let errors = squares.return_errors(robot, params)?;
        // What the base took for its wheel base.
        let base = nominal(Id::WheelBase) * nominal(Id::GainBase);
        let closed = ClosedForm::of(&errors, options.side, base);
        let before = GAINS.map(nominal);
        let factors = closed.gains();
        Ok(Self {
            errors,
            closed,
            before,
            calculated: [0, 1, 2].map(|i| before[i] * factors[i]),
            learned: learner.calibration(),
            fixes: learner.taken(),
        })
    }

    /// Names and gains.
    fn gains(&self) -> [(&'static str, [f64; 3]); 3] {
        let [right, left, base, ..] = self.learned.gains;
        [
            ("before", self.before),
            ("closed form", self.calculated),
            ("filter", [right, left, base].map(f64::from)),
        ]
    }

    fn returns(&self, robot: &Robot, squares: &Squares) -> Result<Vec<Returns>> {
        let returns = |(name, gains): (&str, [f64; 3])| {
            Ok(Returns {
                name: name.into(),
                errors: squares.returns(robot, &with_gains(&robot.params, gains))?,
            })
        };
        self.gains().into_iter().map(returns).collect()
    }
}

fn write_returns(path: &Path, all: &[Returns]) -> Result<()> {
    let shown = || path.display().to_string();
    let mut writer = csv::Writer::from_path(path).with_context(shown)?;
    writer.write_record(["gains", "direction", "run", "x", "y"])?;
    for Returns { name, errors } in all {
        for (direction, errors) in [
            ("clockwise", &errors.clockwise),
            ("counter-clockwise", &errors.counter_clockwise),
        ] {
            for (run, [x, y]) in (1..).zip(errors) {
                writer.write_record([
                    name.clone(),
                    direction.into(),
                    format!("{run}"),
                    format!("{x:.6}"),
                    format!("{y:.6}"),
                ])?;
            }
        }
    }
    writer.flush().with_context(shown)
}

/// True over nominal diameters and wheel base.
fn true_gains(robot: &Robot) -> [f64; 3] {
    let wheels = &robot.physics.wheels;
    let over = |truth: f64, id: Id| truth / f64::from(robot.params.get(id));
    [
        over(wheels.diameter_right, Id::RightDiameter),
        over(wheels.diameter_left, Id::LeftDiameter),
        over(wheels.base, Id::WheelBase),
    ]
}

fn report(options: &Options, robot: &Robot, squares: &Squares, found: &Found) -> Result<String> {
    let params = &robot.params;
    let Found { errors, closed, .. } = found;
    let mut text = format!(
        "on {}, {} squares of {} m each way, seed {}: the filter has a fix of {:.1} cm and {:.2} deg at each end\n",
        options.robot,
        options.runs,
        options.side,
        options.seed,
        100.0 * options.fix_position,
        options.fix_heading
    );
    for (name, [x, y]) in [
        ("clockwise", errors.clockwise),
        ("counter-clockwise", errors.counter_clockwise),
    ] {
        writeln!(text, "{name:19}mean return error  x {x:.4} m  y {y:.4} m")?;
    }
    writeln!(
        text,
        "{:19}alpha {:.4} deg  beta {:.4} deg  E_d {:.6}  E_b {:.6}",
        "closed form",
        closed.alpha.to_degrees(),
        closed.beta.to_degrees(),
        closed.unequal_diameters,
        closed.wheel_base
    )?;
    text.push('\n');
    writeln!(
        text,
        "{:19}k_r       k_l       k_b       k_r/k_l   k_b/k_d   E_max,syst (m)  max error (m)",
        "gains"
    )?;
    let truth = [("true", true_gains(robot))];
    for (name, gains) in truth.into_iter().chain(found.gains()) {
        let [right, left, base] = gains;
        let params = with_gains(params, gains);
        writeln!(
            text,
            "{name:19}{right:.6}  {left:.6}  {base:.6}  {:.6}  {:.6}  {:<14.5}  {:.5}",
            right / left,
            base / f64::midpoint(right, left),
            squares.return_errors(robot, &params)?.largest(),
            squares.worst(robot, &params)?
        )?;
    }
    let [right, left, base, ..] = found.learned.spread.deviations();
    writeln!(
        text,
        "{:19}{right:.6}  {left:.6}  {base:.6}",
        "filter's deviation"
    )?;
    let Taken { taken, refused, .. } = found.fixes;
    if refused > 0 {
        writeln!(
            text,
            "{:19}of {} fixes, {refused} lay beyond the gate: it did not learn from them",
            "filter's fixes",
            taken + refused
        )?;
    }
    text += &to_set(params, found.calculated);
    Ok(text)
}

/// What makes a base have these gains, whichever it has now: the wheel base and the diameters in its parameters stay as they are.
fn to_set(params: &Params, gains: [f64; 3]) -> String {
    let [min, max] = Calibration::RANGE;
    let beyond: Vec<_> = GAINS
        .into_iter()
        .zip(gains)
        .filter(|(_, gain)| !(min..=max).contains(&(*gain as f32)))
        .map(|(id, gain)| format!("{} {gain:.6}", id.spec().name))
        .collect();
    if beyond.is_empty() {
        let lines = set_gains(&with_gains(params, gains));
        return format!("\nthe closed form's gains, for this base:\n{lines}");
    }
    format!(
        "\nno base takes the closed form's {}, beyond {min} to {max}: measure its wheels and wheel base, set these, and drive again\n",
        beyond.join(", ")
    )
}

fn with_gains(params: &Params, gains: [f64; 3]) -> Params {
    let mut params = *params;
    params.learn(&Calibration {
        gains: of_each(gains.map(|gain| gain as f32), 0.0),
        spread: Spread::NONE,
    });
    params
}
