//! Replay: recorded counts through the real vehicle and estimator.

use crate::peripherals::Harness;
use crate::plot::ReplayPath;
use crate::robot::Robot;
use crate::trace;
use crate::vehicle::{configuration, vehicle};
use anyhow::{Context, Result, anyhow, bail};
use nalgebra::Matrix3;
use std::collections::BTreeMap;
use std::path::Path;
use vehicle_controller::controller::{Belief, Estimate, Estimator, Pose};
use vehicle_controller::math::{upper_triangle, wrap};
use vehicle_controller::params::Params;
use vehicle_controller::vehicle::{Kind, VirtualVehicle};

/// A row of a log.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// Time, s.
    pub t: f64,
    /// Counts since the row before, of the motors: left first.
    pub counts: [i64; 2],
    /// Counts since the row before of a car's front wheels, left first.
    pub front: [i64; 2],
    /// The steering angle, rad, where there is one.
    pub steer: Option<f64>,
    /// x, y (m), θ (rad), where known.
    pub truth: Option<[f64; 3]>,
}

impl From<&trace::Row> for Row {
    /// With the counts since power-on, as [`Log::recorded`] takes them.
    fn from(row: &trace::Row) -> Self {
        Self {
            t: row.t,
            counts: [row.left_count, row.right_count],
            front: [row.front_left_count, row.front_right_count].map(Option::unwrap_or_default),
            steer: row.steer,
            truth: Some([row.true_x, row.true_y, row.true_theta]),
        }
    }
}

impl Row {
    /// Lets the encoders count on, and the steering point, as it says.
    pub fn show(&self, harness: &Harness) {
        let wheels = harness.wheels.iter().zip(self.counts);
        for (wires, counts) in wheels.chain(harness.front.iter().zip(self.front)) {
            wires.edges.set(wires.edges.get() + counts);
        }
        self.show_steering(harness);
    }

    /// Lets the steering point as it says.
    fn show_steering(&self, harness: &Harness) {
        harness
            .steering
            .angle
            .set(self.steer.map(|angle| angle as f32));
    }
}

/// A recorded log.
#[derive(Clone, Debug)]
pub struct Log {
    /// The file's name without its extension.
    pub name: String,
    rows: Vec<Row>,
    /// It is of one motor only: a tricycle's.
    has_one_motor: bool,
}

impl Log {
    /// Reads a log: CSV with the columns `t,left,right` and optionally `x,y,theta`, in any order; others are left out. Of a tricycle or a synchro drive it has
    /// `drive` instead of `left` and `right`; of a vehicle that steers `steer`, the steering angle in rad; of a synchro drive `turn`, the steering's counts; of a car
    /// with four encoders `front_left` and `front_right`, too.
    ///
    /// # Errors
    /// With file and line, if it cannot be read or is wrong.
    pub fn load(path: &Path) -> Result<Self> {
        let shown = path.display();
        let file = std::fs::File::open(path).with_context(|| shown.to_string())?;
        let mut reader = csv::ReaderBuilder::new()
            .trim(csv::Trim::All)
            .from_reader(file);
        let headers = reader
            .headers()
            .with_context(|| format!("{shown}:1"))?
            .clone();
        let columns: BTreeMap<&str, usize> = headers
            .iter()
            .enumerate()
            .map(|(i, name)| (name, i))
            .collect();
        let column = |name: &str| columns.get(name).copied();
        let required = |name: &str| {
            column(name).ok_or_else(|| anyhow!("{shown}:1: there is no column `{name}`"))
        };
        let t = required("t")?;
        let motors = match (column("drive"), column("left")) {
            (Some(drive), None) => [Some(drive), column("turn")],
            (None, Some(left)) => [Some(left), Some(required("right")?)],
            (Some(_), Some(_)) => bail!("{shown}:1: there are columns `drive` and `left`"),
            (None, None) => bail!("{shown}:1: there is no column `left` (or `drive`)"),
        };
        let front = [column("front_left"), column("front_right")];
        if front[0].is_some() != front[1].is_some() {
            bail!("{shown}:1: of front_left and front_right there must be both or none");
        }
        let steer = column("steer");
        let truth = match [column("x"), column("y"), column("theta")] {
            [Some(x), Some(y), Some(theta)] => Some([x, y, theta]),
            [None, None, None] => None,
            _ => bail!("{shown}:1: of x, y and theta there must be all or none"),
        };
        let mut rows: Vec<Row> = Vec::new();
        for record in reader.records() {
            let record = record.map_err(|error| {
                let line = error.position().map_or(0, csv::Position::line);
                anyhow!("{shown}:{line}: {error}")
            })?;
            let line = record.position().map_or(0, csv::Position::line);
            let number = |index: usize| -> Result<f64> {
                let word = record.get(index).unwrap_or_default();
                match word.parse::<f64>() {
                    Ok(number) if number.is_finite() => Ok(number),
                    _ => bail!(
                        "{shown}:{line}: column `{}`: `{word}` is not a number",
                        &headers[index]
                    ),
                }
            };
            let count = |index: Option<usize>| -> Result<i64> {
                let Some(index) = index else { return Ok(0) };
                let counts = number(index)?;
                if counts.fract() != 0.0 || counts.abs() > f64::from(i32::MAX) {
                    bail!(
                        "{shown}:{line}: column `{}`: {counts} is not a count",
                        &headers[index]
                    );
                }
                Ok(counts as i64)
            };
            let row = Row {
                t: number(t)?,
                counts: [count(motors[0])?, count(motors[1])?],
                front: [count(front[0])?, count(front[1])?],
                steer: steer.map(number).transpose()?,
                truth: match truth {
                    Some([x, y, theta]) => Some([number(x)?, number(y)?, number(theta)?]),
                    None => None,
                },
            };
            if rows.last().is_some_and(|last| row.t < last.t) {
                bail!("{shown}:{line}: t goes backwards");
            }
            rows.push(row);
        }
        if rows.is_empty() {
            bail!("{shown}: the log has no rows");
        }
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        Ok(Self {
            has_one_motor: motors[1].is_none(),
            ..Self::new(name.into_owned(), rows)?
        })
    }

    /// A log of these rows: at least one, their times not falling.
    ///
    /// # Errors
    /// If there is none, or a time goes backwards.
    pub fn new(name: String, rows: Vec<Row>) -> Result<Self> {
        if rows.is_empty() {
            bail!("{name}: the log has no rows");
        }
        if !rows.is_sorted_by(|a, b| a.t <= b.t) {
            bail!("{name}: t goes backwards");
        }
        Ok(Self {
            name,
            rows,
            has_one_motor: false,
        })
    }

    /// # Errors
    /// If it is not of such a vehicle: one that steers has steering angles, and no other has; a single motor is a tricycle's.
    pub fn check(&self, vehicle: Kind) -> Result<()> {
        let (name, steers) = (
            &self.name,
            matches!(vehicle, Kind::Tricycle | Kind::BiSteerable),
        );
        if steers && self.rows.iter().any(|row| row.steer.is_none()) {
            bail!("{name}: there is no column `steer`, and the robot steers");
        }
        if !steers && self.rows.iter().any(|row| row.steer.is_some()) {
            bail!("{name}: there is a column `steer`, and the robot does not steer: see --robot");
        }
        if self.has_one_motor && vehicle != Kind::Tricycle {
            bail!("{name}: it is a tricycle's, with one motor, and the robot is none: see --robot");
        }
        Ok(())
    }

    /// Its rows, at least one.
    #[must_use]
    pub fn rows(&self) -> &[Row] {
        &self.rows
    }

    /// A log of rows whose counts are those since power-on.
    ///
    /// # Errors
    /// As for [`Log::new`].
    pub fn recorded(name: String, rows: impl IntoIterator<Item = Row>) -> Result<Self> {
        let mut last = None;
        let difference = |now: [i64; 2], then: [i64; 2]| [now[0] - then[0], now[1] - then[1]];
        let since = |row: Row| {
            let before = last.replace(row).unwrap_or(row);
            Row {
                counts: difference(row.counts, before.counts),
                front: difference(row.front, before.front),
                ..row
            }
        };
        Self::new(name, rows.into_iter().map(since).collect())
    }

    /// Where the estimate starts: x, y (m), θ (rad).
    #[must_use]
    pub fn start(&self) -> [f64; 3] {
        self.rows[0].truth.unwrap_or_default()
    }

    /// Left and right counts of each row after the first, whose own were before the start.
    pub fn counts(&self) -> impl Iterator<Item = [i64; 2]> {
        self.rows.iter().skip(1).map(|row| row.counts)
    }

    /// How many rows it has.
    #[must_use]
    #[allow(clippy::len_without_is_empty, reason = "a log is never empty")]
    pub fn len(&self) -> usize {
        self.rows.len()
    }
}

/// What a replay gave.
#[derive(Clone, Debug)]
pub struct Replay {
    /// The log's name.
    pub name: String,
    /// Time of each row, s.
    pub t: Vec<f64>,
    /// The estimate at each row.
    pub estimates: Vec<Estimate>,
    /// The truth at each row, where known: x, y (m), θ (rad).
    pub truth: Option<Vec<[f64; 3]>>,
}

/// Errors of a replay against the truth, m and rad.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Errors {
    /// Largest distance.
    pub max_position: f64,
    /// Largest heading error.
    pub max_heading: f64,
    /// Distance at the end.
    pub final_position: f64,
    /// Heading error at the end.
    pub final_heading: f64,
}

/// Feeds a log through the vehicle and the estimator. The estimate starts at the first row's truth (or the origin), certain of it; the counts of the
/// first row were before that.
///
/// # Errors
/// None: the fakes never refuse.
pub fn replay(log: &Log, robot: &Robot, params: &Params) -> Result<Replay> {
    replay_from(log, robot, params, Matrix3::zeros())
}

/// The same, when the first row's truth is only known so well: its covariance, m², m·rad, rad².
///
/// # Errors
/// None: the fakes never refuse.
pub fn replay_from(
    log: &Log,
    robot: &Robot,
    params: &Params,
    covariance: Matrix3<f64>,
) -> Result<Replay> {
    log.check(params.vehicle())?;
    let harness = Harness::default();
    // A log's row may hold more counts than a narrow counter can.
    let robot = Robot {
        narrow_counters: false,
        ..robot.clone()
    };
    log.rows[0].show_steering(&harness);
    let mut vehicle = vehicle(&harness, &robot, params)?;
    let config = configuration(params, crate::rig::PERIOD);
    let mut estimator = Estimator::new(config.noise);
    let [x, y, theta] = log.start();
    let pose = Pose { x, y, theta };
    let start = Estimate { pose, covariance };
    let correction = estimator.correction(&Belief::from(start), config.calibration);
    estimator.apply(&correction, vehicle.influence());

    let mut estimates = vec![estimator.present()];
    for rows in log.rows.windows(2) {
        rows[1].show(&harness);
        let motion = vehicle.sense((rows[1].t - rows[0].t) as f32);
        estimator.set_influence(vehicle.influence());
        estimator.advance(motion.increment, vehicle.resolution());
        estimates.push(estimator.present());
    }
    Ok(Replay {
        name: log.name.clone(),
        t: log.rows.iter().map(|row| row.t).collect(),
        estimates,
        truth: log.rows.iter().map(|row| row.truth).collect(),
    })
}

impl Replay {
    /// The estimate at the end.
    #[must_use]
    pub fn last(&self) -> &Estimate {
        &self.estimates[self.estimates.len() - 1]
    }

    /// Position and heading error of each row, m and rad, where the truth is known.
    #[must_use]
    pub fn errors_by_row(&self) -> Option<Vec<(f64, f64)>> {
        let truth = self.truth.as_ref()?;
        let error = |(estimate, [x, y, theta]): (&Estimate, &[f64; 3])| {
            let pose = &estimate.pose;
            (
                (pose.x - x).hypot(pose.y - y),
                wrap(pose.theta - theta).abs(),
            )
        };
        Some(self.estimates.iter().zip(truth).map(error).collect())
    }

    /// The largest and the final errors, where the truth is known.
    #[must_use]
    pub fn errors(&self) -> Option<Errors> {
        let rows = self.errors_by_row()?;
        let (final_position, final_heading) = *rows.last()?;
        Some(Errors {
            max_position: rows.iter().fold(0.0, |max, row| row.0.max(max)),
            max_heading: rows.iter().fold(0.0, |max, row| row.1.max(max)),
            final_position,
            final_heading,
        })
    }

    /// A report for people: final pose and covariance, and the errors.
    #[must_use]
    pub fn report(&self) -> String {
        let Estimate { pose, covariance } = self.last();
        let [xx, xy, xt, yy, yt, tt] = upper_triangle(covariance);
        let degrees = f64::to_degrees(1.0);
        let mut lines = vec![
            format!(
                "{}: {} rows, {:.2} s",
                self.name,
                self.t.len(),
                self.t[self.t.len() - 1] - self.t[0]
            ),
            format!(
                "  final pose   x {:.4} m  y {:.4} m  theta {:.3} deg",
                pose.x,
                pose.y,
                wrap(pose.theta) * degrees
            ),
            format!(
                "  deviations   x {:.4} m  y {:.4} m  theta {:.3} deg",
                xx.sqrt(),
                yy.sqrt(),
                tt.sqrt() * degrees
            ),
            format!(
                "  covariance   {xx:.5e} {xy:.5e} {:.5e} {yy:.5e} {:.5e} {:.5e} (m, deg)",
                xt * degrees,
                yt * degrees,
                tt * degrees * degrees
            ),
        ];
        if let Some(errors) = self.errors() {
            lines.push(format!(
                "  error        max {:.4} m {:.3} deg   final {:.4} m {:.3} deg",
                errors.max_position,
                errors.max_heading * degrees,
                errors.final_position,
                errors.final_heading * degrees
            ));
        }
        lines.push(String::new());
        lines.join("\n")
    }

    /// Writes a row per log row.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn write(&self, path: &Path) -> Result<()> {
        let shown = || path.display().to_string();
        let mut writer = csv::Writer::from_path(path).with_context(shown)?;
        let mut header = vec![
            "t", "x", "y", "theta", "cxx", "cxy", "cxt", "cyy", "cyt", "ctt",
        ];
        let errors = self.errors_by_row();
        if errors.is_some() {
            header.extend(["position_error", "heading_error"]);
        }
        writer.write_record(header)?;
        for (row, (t, estimate)) in self.t.iter().zip(&self.estimates).enumerate() {
            let Pose { x, y, theta } = estimate.pose;
            let mut record = vec![format!("{t:.6}")];
            record.extend([x, y, theta].map(|value| format!("{value:.9}")));
            record.extend(upper_triangle(&estimate.covariance).map(|c| format!("{c:.6e}")));
            if let Some(errors) = &errors {
                let (position, heading) = errors[row];
                record.extend([position, heading].map(|value| format!("{value:.9}")));
            }
            writer.write_record(record)?;
        }
        writer.flush().with_context(shown)
    }

    /// What the plot wants to know.
    #[must_use]
    pub fn path(&self) -> ReplayPath {
        let estimated = |e: &Estimate| [e.pose.x, e.pose.y, e.pose.theta];
        ReplayPath {
            name: self.name.clone(),
            t: self.t.clone(),
            estimated: self.estimates.iter().map(estimated).collect(),
            truth: self.truth.clone(),
            covariance: self
                .estimates
                .iter()
                .map(|e| upper_triangle(&e.covariance))
                .collect(),
        }
    }
}
