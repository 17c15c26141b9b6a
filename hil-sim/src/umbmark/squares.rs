//! The squares, driven on a simulated base.

use super::Directions;
use crate::base::Base;
use crate::replay::{Errors, Log, Row, replay};
use crate::robot::Robot;
use anyhow::{Context, Result, anyhow, bail, ensure};
use vehicle_controller::params::Params;

/// Logs of squares, in both directions.
#[derive(Clone, Debug)]
pub struct Squares {
    /// A log for each square, counts and truth.
    pub logs: Directions<Vec<Log>>,
}

/// A row of a log, every so many ticks.
const ROW_TICKS: u32 = 50;
/// The base comes to rest before its next motion, ticks.
const REST_TICKS: u32 = 500;
/// No motion takes longer, ticks.
const PATIENCE_TICKS: u32 = 600_000;

/// The shortest side, m: on a shorter one, what bends it is lost in how the base starts and stops.
const SHORTEST: f64 = 0.5;

/// Drives `runs` squares with sides of `side` m to the right, and as many to the left. `driven` is called after each.
///
/// # Errors
/// If the base refuses, or does not get there; if sides are shorter than half a metre or longer than a kilometre.
pub fn drive(base: &mut dyn Base, side: f64, runs: usize, driven: &dyn Fn()) -> Result<Squares> {
    ensure!(
        (SHORTEST..=1e3).contains(&side),
        "a square has sides of {SHORTEST} m to 1 km"
    );
    ensure!(runs > 0, "at least one square each way");
    let mut square = |name: &str, turn: f64| -> Result<Vec<Log>> {
        let one = |run: usize| {
            let rows = drive_one(base, side, turn).with_context(|| format!("{name} {run}"))?;
            driven();
            Log::recorded(format!("{name}-{run}"), rows)
        };
        (1..=runs).map(one).collect()
    };
    let clockwise = square("clockwise", -90.0)?;
    let counter_clockwise = square("counter-clockwise", 90.0)?;
    Ok(Squares {
        logs: Directions {
            clockwise,
            counter_clockwise,
        },
    })
}

fn drive_one(base: &mut dyn Base, side: f64, turn: f64) -> Result<Vec<Row>> {
    let mut recorder = Recorder::new(base);
    recorder.rest()?;
    recorder.rows.clear();
    recorder.note()?;
    for _ in 0..4 {
        recorder.motion(&format!("m {side}"), "! move done")?;
        recorder.motion(&format!("t {turn}"), "! turn done")?;
    }
    recorder.note()?;
    Ok(recorder.rows)
}

struct Recorder<'a> {
    base: &'a mut dyn Base,
    rows: Vec<Row>,
    tick: u32,
    line: Vec<u8>,
}

impl<'a> Recorder<'a> {
    fn new(base: &'a mut dyn Base) -> Self {
        Self {
            base,
            rows: Vec::new(),
            tick: 0,
            line: Vec::new(),
        }
    }

    fn note(&mut self) -> Result<()> {
        self.rows.push(Row::from(&self.base.row()?));
        Ok(())
    }

    /// A tick; the line that it completed.
    fn tick(&mut self) -> Result<Option<String>> {
        self.base.tick()?;
        self.tick += 1;
        if self.tick.is_multiple_of(ROW_TICKS) {
            self.note()?;
        }
        let mut complete = None;
        for byte in self.base.receive() {
            if byte == b'\n' {
                let line = String::from_utf8_lossy(&self.line).trim().to_owned();
                self.line.clear();
                complete = Some(line);
            } else {
                self.line.push(byte);
            }
        }
        Ok(complete)
    }

    fn rest(&mut self) -> Result<()> {
        for _ in 0..REST_TICKS {
            self.tick()?;
        }
        Ok(())
    }

    /// Commands a motion, waits until the base says that it is done, and until it rests.
    fn motion(&mut self, command: &str, done: &str) -> Result<()> {
        self.base.send(format!("{command}\n").as_bytes())?;
        for _ in 0..PATIENCE_TICKS {
            let Some(line) = self.tick()? else { continue };
            if line.starts_with(done) {
                return self.rest();
            }
            if line.starts_with("ERR") || line.starts_with("! fault") {
                bail!("`{command}`: {line}");
            }
        }
        Err(anyhow!("`{command}` did not end"))
    }
}

impl Squares {
    /// All logs, clockwise and counter-clockwise in turn.
    pub fn in_turn(&self) -> impl Iterator<Item = &Log> {
        let Directions {
            clockwise,
            counter_clockwise,
        } = &self.logs;
        clockwise
            .iter()
            .zip(counter_clockwise)
            .flat_map(|(right, left)| [right, left])
    }

    /// The mean return errors of the odometry with these parameters, true minus calculated position in the frame of the start, m: the centres of gravity of
    /// the two clusters.
    ///
    /// # Errors
    /// None: the fakes never refuse.
    pub fn return_errors(&self, robot: &Robot, params: &Params) -> Result<Directions<[f64; 2]>> {
        let all = self.returns(robot, params)?;
        let centre = |errors: &[[f64; 2]]| {
            let mean = |axis: usize| {
                errors.iter().map(|error| error[axis]).sum::<f64>() / errors.len() as f64
            };
            [mean(0), mean(1)]
        };
        Ok(Directions {
            clockwise: centre(&all.clockwise),
            counter_clockwise: centre(&all.counter_clockwise),
        })
    }

    /// The return errors of each square.
    ///
    /// # Errors
    /// None: the fakes never refuse.
    pub fn returns(&self, robot: &Robot, params: &Params) -> Result<Directions<Vec<[f64; 2]>>> {
        let each = |logs: &[Log]| -> Result<Vec<[f64; 2]>> {
            logs.iter()
                .map(|log| return_error(log, robot, params))
                .collect()
        };
        Ok(Directions {
            clockwise: each(&self.logs.clockwise)?,
            counter_clockwise: each(&self.logs.counter_clockwise)?,
        })
    }

    /// The largest error of all squares, anywhere along them.
    ///
    /// # Errors
    /// None: the fakes never refuse.
    pub fn worst(&self, robot: &Robot, params: &Params) -> Result<f64> {
        self.in_turn().try_fold(0.0_f64, |worst, log| {
            let errors = replay(log, robot, params)?.errors();
            Ok(worst.max(errors.map_or(0.0, |Errors { max_position, .. }| max_position)))
        })
    }
}

fn return_error(log: &Log, robot: &Robot, params: &Params) -> Result<[f64; 2]> {
    let replayed = replay(log, robot, params)?;
    let pose = replayed.last().pose;
    let truth = |row: &Row| row.truth.ok_or_else(|| anyhow!("the truth is not known"));
    let [_, _, heading] = truth(&log.rows()[0])?;
    let [x, y, _] = truth(&log.rows()[log.len() - 1])?;
    let (dx, dy) = (x - pose.x, y - pose.y);
    let (sin, cos) = heading.sin_cos();
    Ok([dx * cos + dy * sin, dy * cos - dx * sin])
}

impl Directions<[f64; 2]> {
    /// E_max,syst: the larger distance of the two centres of gravity, m.
    #[must_use]
    pub fn largest(&self) -> f64 {
        let distance = |[x, y]: [f64; 2]| x.hypot(y);
        distance(self.clockwise).max(distance(self.counter_clockwise))
    }
}
