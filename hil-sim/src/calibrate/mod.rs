//! Calibration: recorded counts and fixes of the pose through the whole controller, which learns its gains from them as it would on the floor.

mod commands;
mod named;
mod seen;
mod verdict;

pub use commands::{set_calibration, set_gains};
pub use named::{NamedGain, named_gains};
pub use verdict::{Verdict, verdict};

use crate::peripherals::Harness;
use crate::replay::{Log, Row};
use crate::rig::PERIOD;
use crate::robot::Robot;
use crate::vehicle::{Desk, Vehicle, vehicle};
use anyhow::{Context, Result, anyhow, bail, ensure};
use nalgebra::{Matrix3, Vector3};
use std::collections::VecDeque;
use vehicle_controller::controller::{
    Controller, CorrectionError, Inputs, Interface, MAX_AGE, Observation, Pose, Refusal,
};
use vehicle_controller::params::{Id, Params};
use vehicle_controller::time::{self, Duration, Instant};
use vehicle_controller::vehicle::gains::GainMatrix;
use vehicle_controller::vehicle::{Calibration, GAINS, Kind};

/// Fixes of the pose, taken from a log's truth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fixes {
    /// Time from one to the next, s; none: the last row of a log gives the only one.
    pub every: Option<f64>,
    /// How well a fix knows x and y: standard deviation, m.
    pub position: f64,
    /// How well it knows the heading: standard deviation, rad.
    pub heading: f64,
    /// How late it arrives, s.
    pub delay: f64,
}

impl Fixes {
    /// The covariance of a fix: m², m·rad, rad².
    #[must_use]
    pub fn covariance(&self) -> Matrix3<f64> {
        let Self {
            position, heading, ..
        } = self;
        Matrix3::from_diagonal(&Vector3::new(
            position * position,
            position * position,
            heading * heading,
        ))
    }

    /// # Errors
    /// If there can be no such fixes.
    fn check(&self) -> Result<()> {
        ensure!(
            self.every.is_none_or(|every| every > 0.0),
            "fixes must be more than 0 s apart"
        );
        ensure!(
            self.position > 0.0 && self.heading > 0.0,
            "a fix must have deviations above 0"
        );
        let longest = f64::from(time::seconds(MAX_AGE));
        ensure!(
            (0.0..=longest).contains(&self.delay),
            "a fix can be 0 to {longest} s late"
        );
        Ok(())
    }
}

/// What was known of the gains at some time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Seconds since the first log's start; the logs follow each other without a gap.
    pub t: f64,
    /// Which log, from 0.
    pub log: usize,
    /// In the order of [`Calibration`].
    pub gains: [f64; GAINS],
    /// Their covariance.
    pub covariance: GainMatrix,
    /// The squared Mahalanobis distance of the fix that was taken; none at a log's start.
    pub distance: Option<f64>,
}

impl Point {
    /// Standard deviations of the gains.
    #[must_use]
    pub fn deviations(&self) -> [f64; GAINS] {
        self.covariance
            .diagonal()
            .map(|variance| variance.max(0.0).sqrt())
            .into()
    }
}

/// What became of fixes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Taken {
    /// So many were taken …
    pub taken: usize,
    /// … and so many lay beyond the gate.
    pub refused: usize,
    /// The sum of the squared Mahalanobis distances of those that were taken.
    sum: f64,
}

impl Taken {
    /// The mean squared Mahalanobis distance of those that were taken: 3, if the estimate knows how wrong it is. None, if none was.
    #[must_use]
    pub fn distance(&self) -> Option<f64> {
        (self.taken > 0).then(|| self.sum / self.taken as f64)
    }
}

/// A fix on its way.
struct Late {
    /// When it was measured, s since the log's start.
    measured: f64,
    pose: Pose,
}

/// A base that is carried along recorded paths: its motors stand still, its encoders count what the log says.
#[derive(Debug)]
pub struct Learner {
    harness: Harness,
    controller: Controller<Vehicle>,
    vehicle: Kind,
    desk: Desk,
    fixes: Fixes,
    gate: f32,
    /// The controller's time at the start of the log …
    begin: Instant,
    /// … and the seconds of the logs before.
    elapsed: f64,
    points: Vec<Point>,
    logs: usize,
    /// The fixes of all logs.
    all: Taken,
}

impl Learner {
    /// A base with these parameters: their gains, and how well those are known, are what it begins with.
    ///
    /// # Errors
    /// If there can be no such fixes.
    pub fn new(robot: &Robot, params: &Params, fixes: &Fixes) -> Result<Self> {
        fixes.check()?;
        let harness = Harness::default();
        // A log's row may hold more counts than a narrow counter can.
        let robot = Robot {
            narrow_counters: false,
            ..robot.clone()
        };
        let vehicle = vehicle(&harness, &robot, params)?;
        let mut controller = Controller::new(vehicle, params.build(PERIOD), None);
        let begin = Instant::from_ticks(0);
        controller.tick(begin, &Inputs::default());
        let mut desk = Interface::new(controller.snapshot(), params.limits());
        desk.learn(true);
        Ok(Self {
            harness,
            controller,
            vehicle: params.vehicle(),
            desk,
            fixes: *fixes,
            gate: params.get(Id::Gate),
            begin,
            elapsed: 0.0,
            points: Vec::new(),
            logs: 0,
            all: Taken::default(),
        })
    }

    /// What is known of the gains.
    #[must_use]
    pub fn calibration(&self) -> Calibration {
        *self.desk.calibration()
    }

    /// What became of the fixes of all logs.
    #[must_use]
    pub fn taken(&self) -> Taken {
        self.all
    }

    /// What was learned.
    ///
    /// # Errors
    /// If there was nothing to learn from: no fix was taken.
    pub fn learned(&self) -> Result<Calibration> {
        ensure!(
            self.all.taken > 0,
            match self.all.refused {
                0 => "no fix was taken: the logs end before the first".to_owned(),
                refused => format!("no fix was taken: all {refused} lay beyond the gate"),
            }
        );
        Ok(self.calibration())
    }

    /// What was known at each log's start and after each fix.
    #[must_use]
    pub fn points(&self) -> &[Point] {
        &self.points
    }

    /// Carries the base along a log: at its start it is told where it is, later there are the fixes. It stands at the end until the last has arrived.
    ///
    /// # Errors
    /// If the truth is not known, the wheels were faster than they can be, or a fix is refused for anything but the gate.
    pub fn learn(&mut self, log: &Log) -> Result<Taken> {
        log.check(self.vehicle)?;
        let (first, last) = (log.rows()[0], log.rows()[log.len() - 1]);
        // Whatever is still under way, such as the last log's last fix, is done by then.
        self.begin = time::after(self.controller.snapshot().time, Duration::millis(1));
        self.note(0.0, None);
        let length = last.t - first.t;
        let mut next = self.fixes.every.unwrap_or(length);
        let mut on_the_way = VecDeque::new();
        let mut taken = Taken::default();
        for (index, row) in log.rows().iter().enumerate() {
            let now = row.t - first.t;
            let place = || format!("{}, {} s", log.name, row.t);
            let pose = pose(row).ok_or_else(|| anyhow!("{}: the truth is not known", log.name))?;
            if index > 0 {
                row.show(&self.harness);
            }
            self.tick(now);
            if let Some(fault) = self.controller.snapshot().fault {
                bail!("{}: fault {}", place(), fault.name());
            }
            if index == 0 {
                self.desk
                    .reset_pos(pose, &self.fixes.covariance())
                    .map_err(|refusal| anyhow!("{}: {refusal}", place()))?;
                continue;
            }
            if now >= next - ROUNDING {
                on_the_way.push_back(Late {
                    measured: now,
                    pose,
                });
                next += self.fixes.every.unwrap_or(f64::INFINITY);
            }
            self.hear(&mut on_the_way, now, &mut taken)
                .with_context(place)?;
        }
        let mut end = length;
        // The base has come to rest, and time goes on until the last fix has arrived.
        while let Some(late) = on_the_way.front() {
            let arrival = late.measured + self.fixes.delay;
            end = arrival.clamp(end + MOMENT, end + STEP);
            self.tick(end);
            self.hear(&mut on_the_way, end, &mut taken)
                .with_context(|| format!("{}, {end:.3} s after its start", log.name))?;
        }
        self.tick(end + MOMENT);
        self.elapsed += end;
        self.logs += 1;
        self.all.taken += taken.taken;
        self.all.refused += taken.refused;
        self.all.sum += taken.sum;
        Ok(taken)
    }

    /// Takes the next fix, if it has arrived: a base hears of one thing at a time.
    fn hear(&mut self, on_the_way: &mut VecDeque<Late>, now: f64, taken: &mut Taken) -> Result<()> {
        let arrived = |late: &Late| now >= late.measured + self.fixes.delay - ROUNDING;
        if !on_the_way.front().is_some_and(arrived) {
            return Ok(());
        }
        let Some(Late { measured, pose }) = on_the_way.pop_front() else {
            return Ok(());
        };
        match self.observe(pose, now - measured) {
            Ok(distance) => {
                let distance = f64::from(distance);
                taken.taken += 1;
                taken.sum += distance;
                self.note(now, Some(distance));
            }
            Err(Refusal::Correction(CorrectionError::Gate(_))) => taken.refused += 1,
            Err(Refusal::Correction(why)) => bail!("a fix was refused: {why}"),
            Err(refusal) => bail!("a fix was refused: {refusal}"),
        }
        Ok(())
    }

    /// A cycle of the controller at so many seconds after the log's start; then the corrections go on as they do on a board that has time.
    fn tick(&mut self, seconds: f64) {
        while let Some(request) = self.desk.take_request() {
            // There is room: a desk has one under way.
            let _ = self.controller.request(request);
        }
        let since = Duration::from_ticks((seconds * 1e6).round() as u64);
        self.controller
            .tick(time::after(self.begin, since), &Inputs::default());
        self.desk.update(self.controller.snapshot());
        while self.desk.work() {}
    }

    fn observe(&mut self, pose: Pose, age: f64) -> Result<f32, Refusal> {
        let observation = Observation::Pose {
            pose,
            covariance: self.fixes.covariance(),
        };
        self.desk.observe(&observation, age as f32, self.gate)
    }

    fn note(&mut self, since_start: f64, distance: Option<f64>) {
        let Calibration { gains, spread } = self.calibration();
        self.points.push(Point {
            t: self.elapsed + since_start,
            log: self.logs,
            gains: gains.map(f64::from),
            covariance: spread.covariance(),
            distance,
        });
    }
}

/// A row's time may be off by this much, s: sums of decimal fractions.
const ROUNDING: f64 = 1e-6;
/// After a log's end, the controller ticks this often, s: the past that it remembers is finer than its spacing.
const STEP: f64 = 0.01;
/// And never more often than this, s.
const MOMENT: f64 = 1e-3;

fn pose(row: &Row) -> Option<Pose> {
    row.truth.map(|[x, y, theta]| Pose { x, y, theta })
}

/// The parameters with what is learned from some logs, one after another.
///
/// # Errors
/// As for [`Learner`], whose fixes must not all have been refused.
pub fn calibrate(logs: &[Log], robot: &Robot, params: &Params, fixes: &Fixes) -> Result<Params> {
    let mut learner = Learner::new(robot, params, fixes)?;
    for log in logs {
        learner.learn(log)?;
    }
    let mut learned = *params;
    learned.learn(&learner.learned()?);
    Ok(learned)
}
