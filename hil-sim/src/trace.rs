//! The trace of a run: one CSV row per sample, in SI units and radians.

use std::io::Write;
use std::path::Path;

use anyhow::{Context, anyhow, bail, ensure};
use serde::{Deserialize, Serialize};

/// The columns, in the order of the file.
pub const COLUMNS: [&str; 33] = [
    "t",
    "true_x",
    "true_y",
    "true_theta",
    "est_x",
    "est_y",
    "est_theta",
    "cxx",
    "cxy",
    "cxt",
    "cyy",
    "cyt",
    "ctt",
    "s",
    "s_ref",
    "v_s",
    "v_s_ref",
    "alpha",
    "alpha_ref",
    "v_alpha",
    "v_alpha_ref",
    "move_state",
    "turn_state",
    "left_count",
    "right_count",
    "left_speed",
    "right_speed",
    "left_duty",
    "right_duty",
    "left_current",
    "right_current",
    "battery",
    "fault",
];
/// Further columns at the end, where the vehicle has what they tell.
pub const FURTHER: [&str; 4] = [
    "steer",
    "true_steer",
    "front_left_count",
    "front_right_count",
];

/// The names of the states of an axis.
pub const STATES: [&str; 4] = ["HOLD", "ACCEL", "MOVE", "DECCEL"];

/// One sample of a run.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Time since the start of the run, s.
    pub t: f64,
    /// True position along x, m.
    pub true_x: f64,
    /// True position along y, m.
    pub true_y: f64,
    /// True heading, rad.
    pub true_theta: f64,
    /// Estimated position along x, m.
    pub est_x: f64,
    /// Estimated position along y, m.
    pub est_y: f64,
    /// Estimated heading, rad.
    pub est_theta: f64,
    /// Variance of the estimated x, m².
    pub cxx: f64,
    /// Covariance of the estimated x and y, m².
    pub cxy: f64,
    /// Covariance of the estimated x and heading, m·rad.
    pub cxt: f64,
    /// Variance of the estimated y, m².
    pub cyy: f64,
    /// Covariance of the estimated y and heading, m·rad.
    pub cyt: f64,
    /// Variance of the estimated heading, rad².
    pub ctt: f64,
    /// Distance travelled, m.
    pub s: f64,
    /// Reference of the distance travelled, m.
    pub s_ref: f64,
    /// Translation speed, m/s.
    pub v_s: f64,
    /// Reference of the translation speed, m/s.
    pub v_s_ref: f64,
    /// Angle turned, rad.
    pub alpha: f64,
    /// Reference of the angle turned, rad.
    pub alpha_ref: f64,
    /// Rotation speed, rad/s.
    pub v_alpha: f64,
    /// Reference of the rotation speed, rad/s.
    pub v_alpha_ref: f64,
    /// State of the translation axis: one of [`STATES`], no unit.
    pub move_state: String,
    /// State of the rotation axis: one of [`STATES`], no unit.
    pub turn_state: String,
    /// Count of the left encoder, encoder counts.
    pub left_count: i64,
    /// Count of the right encoder, encoder counts.
    pub right_count: i64,
    /// Speed of the left wheel, m/s.
    pub left_speed: f64,
    /// Speed of the right wheel, m/s.
    pub right_speed: f64,
    /// Duty of the left motor, -1 to 1, no unit.
    pub left_duty: f64,
    /// Duty of the right motor, -1 to 1, no unit.
    pub right_duty: f64,
    /// Current of the left motor, A.
    pub left_current: f64,
    /// Current of the right motor, A.
    pub right_current: f64,
    /// Voltage of the battery, V.
    pub battery: f64,
    /// Name of the fault, or `none`; no unit.
    pub fault: String,
    /// Steering angle as its sensor says, without the offset that is learned, rad.
    #[serde(skip_serializing)]
    pub steer: Option<f64>,
    /// True steering angle, rad.
    #[serde(skip_serializing)]
    pub true_steer: Option<f64>,
    /// Count of the encoder of a car's left front wheel, encoder counts.
    #[serde(skip_serializing)]
    pub front_left_count: Option<i64>,
    /// Count of the encoder of a car's right front wheel, encoder counts.
    #[serde(skip_serializing)]
    pub front_right_count: Option<i64>,
}

impl Row {
    /// The cells of the row, in the order of [`COLUMNS`].
    fn cells(&self) -> [String; COLUMNS.len()] {
        [
            format!("{:.6}", positive_zero(self.t)),
            compact(self.true_x),
            compact(self.true_y),
            compact(self.true_theta),
            compact(self.est_x),
            compact(self.est_y),
            compact(self.est_theta),
            compact(self.cxx),
            compact(self.cxy),
            compact(self.cxt),
            compact(self.cyy),
            compact(self.cyt),
            compact(self.ctt),
            compact(self.s),
            compact(self.s_ref),
            compact(self.v_s),
            compact(self.v_s_ref),
            compact(self.alpha),
            compact(self.alpha_ref),
            compact(self.v_alpha),
            compact(self.v_alpha_ref),
            self.move_state.clone(),
            self.turn_state.clone(),
            self.left_count.to_string(),
            self.right_count.to_string(),
            compact(self.left_speed),
            compact(self.right_speed),
            compact(self.left_duty),
            compact(self.right_duty),
            compact(self.left_current),
            compact(self.right_current),
            compact(self.battery),
            self.fault.clone(),
        ]
    }

    /// The cells of the row that only some vehicles have, in the order of [`FURTHER`].
    fn further_cells(&self) -> [Option<String>; FURTHER.len()] {
        [
            self.steer.map(compact),
            self.true_steer.map(compact),
            self.front_left_count.map(|count| count.to_string()),
            self.front_right_count.map(|count| count.to_string()),
        ]
    }
}

/// A negative zero would make two equal runs differ in their text.
fn positive_zero(value: f64) -> f64 {
    if value == 0.0 { 0.0 } else { value }
}

/// Nine significant digits: below a micrometre in a kilometre, and still short.
fn compact(value: f64) -> String {
    let rounded = format!("{value:.8e}").parse().unwrap_or(value);
    positive_zero(rounded).to_string()
}

/// Whether the cell suits its column; the error says what it should be.
fn check_cell(column: &str, cell: &str) -> anyhow::Result<()> {
    let problem = match column {
        "move_state" | "turn_state" => (!STATES.contains(&cell)).then_some("is not a state"),
        "left_count" | "right_count" | "front_left_count" | "front_right_count" => {
            cell.parse::<i64>().err().map(|_| "is not an integer")
        }
        "fault" => cell.is_empty().then_some("is not a fault's name or `none`"),
        _ => match cell.parse::<f64>() {
            Ok(number) if number.is_finite() => None,
            Ok(_) => Some("is not a finite number"),
            Err(_) => Some("is not a number"),
        },
    };
    problem.map_or(Ok(()), |problem| {
        Err(anyhow!("column `{column}`: `{cell}` {problem}"))
    })
}

/// Writes a trace.
pub struct Writer<W: Write> {
    csv: csv::Writer<W>,
    /// Which of [`FURTHER`] there are: those of the first row. None before it.
    further: Option<[bool; FURTHER.len()]>,
}

impl<W: Write> Writer<W> {
    /// A writer of a trace into `sink`, which it buffers.
    pub fn new(sink: W) -> Self {
        Self {
            csv: csv::Writer::from_writer(sink),
            further: None,
        }
    }

    fn write_header(&mut self, further: [bool; FURTHER.len()]) -> anyhow::Result<()> {
        if self.further.is_none() {
            let further_columns = FURTHER.iter().zip(further).filter(|(_, there)| *there);
            let columns = COLUMNS.iter().chain(further_columns.map(|(name, _)| name));
            self.csv.write_record(columns)?;
            self.further = Some(further);
        }
        Ok(())
    }

    /// Appends a row.
    ///
    /// # Errors
    ///
    /// A cell that [`read`] would refuse (a number that is not finite, an unknown state), another vehicle's columns than in the first row, or a failure to
    /// write.
    pub fn write(&mut self, row: &Row) -> anyhow::Result<()> {
        let further = row.further_cells();
        let there = further.each_ref().map(Option::is_some);
        self.write_header(there)?;
        ensure!(
            self.further == Some(there),
            "trace row at t = {} s: other columns than those before",
            row.t
        );
        let cells = row.cells();
        let columns = COLUMNS.iter().zip(cells.iter().map(Some));
        let columns = columns.chain(FURTHER.iter().zip(further.iter().map(Option::as_ref)));
        let mut record = csv::StringRecord::new();
        for (column, cell) in columns {
            let Some(cell) = cell else { continue };
            check_cell(column, cell).with_context(|| format!("trace row at t = {} s", row.t))?;
            record.push_field(cell);
        }
        self.csv
            .write_record(&record)
            .context("cannot write the trace")
    }

    /// Writes what is still buffered.
    ///
    /// # Errors
    ///
    /// A failure to write.
    pub fn flush(&mut self) -> anyhow::Result<()> {
        self.csv.flush().context("cannot write the trace")
    }

    /// Writes what is still buffered and gives the sink back.
    ///
    /// # Errors
    ///
    /// A failure to write.
    pub fn finish(mut self) -> anyhow::Result<W> {
        self.write_header([false; FURTHER.len()])?;
        let mut sink = self
            .csv
            .into_inner()
            .map_err(|error| anyhow!("cannot write the trace: {}", error.error()))?;
        sink.flush().context("cannot write the trace")?;
        Ok(sink)
    }
}

/// Reads a whole trace; columns may stand in any order and others are ignored.
///
/// # Errors
///
/// A file that cannot be read, a missing column, a cell that does not suit its column, a time before that of the
/// previous row, or no row at all. The message starts with the file and, where it applies, the line.
pub fn read(path: &Path) -> anyhow::Result<Vec<Row>> {
    let name = path.display();
    let mut csv = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        // Rows of another length are reported below, with the words of this format.
        .flexible(true)
        .from_path(path)
        .with_context(|| format!("{name}: cannot open the trace"))?;
    let header = csv
        .headers()
        .with_context(|| format!("{name}:1: cannot read the header"))?
        .clone();
    ensure!(!header.is_empty(), "{name}: the trace is empty");
    for column in COLUMNS {
        let count = header.iter().filter(|found| *found == column).count();
        ensure!(count > 0, "{name}:1: column `{column}` is missing");
        ensure!(count == 1, "{name}:1: column `{column}` appears twice");
    }
    for column in FURTHER {
        let count = header.iter().filter(|found| *found == column).count();
        ensure!(count <= 1, "{name}:1: column `{column}` appears twice");
    }
    let mut rows: Vec<Row> = Vec::new();
    for record in csv.records() {
        let record = record.map_err(|error| {
            let line = error.position().map_or(0, csv::Position::line);
            anyhow!("{name}:{line}: {error}")
        })?;
        let line = record.position().map_or(0, csv::Position::line);
        let row = parse_row(&header, &record, rows.last())
            .map_err(|error| anyhow!("{name}:{line}: {error:#}"))?;
        rows.push(row);
    }
    ensure!(!rows.is_empty(), "{name}: the trace has no row");
    Ok(rows)
}

fn parse_row(
    header: &csv::StringRecord,
    record: &csv::StringRecord,
    previous: Option<&Row>,
) -> anyhow::Result<Row> {
    if record.len() != header.len() {
        bail!("{} cells instead of {}", record.len(), header.len());
    }
    for (column, cell) in header.iter().zip(record) {
        if COLUMNS.contains(&column) || FURTHER.contains(&column) {
            check_cell(column, cell)?;
        }
    }
    let row: Row = record.deserialize(Some(header))?;
    if let Some(previous) = previous {
        ensure!(
            row.t >= previous.t,
            "column `t`: {} is before {} of the previous row",
            row.t,
            previous.t
        );
    }
    Ok(row)
}

#[cfg(test)]
mod tests;
