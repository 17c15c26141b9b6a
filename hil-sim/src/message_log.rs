//! The messages of a run: what `base-bridge` would publish of the base, and the truth beside it, as an MCAP file that Foxglove and `ros2 bag` open.

use crate::run::Watcher;
use anyhow::{Context, Result};
use hil_sim::base::Base;
use hil_sim::rig::PERIOD;
use hil_sim::robot::Robot;
use hil_sim::trace::Row;
use ros_messages::base::covariance::{SpeedNoise, spatial};
use ros_messages::base::frames::{Frames, Pose, Reading, wrapped};
use ros_messages::base::joints::{Turned, joints};
use ros_messages::base::knowledge::Knowledge;
use ros_messages::base::messages::odometry;
use ros_messages::base::recorder::Recorder;
use ros_messages::base::{Level, Motion, Names, Report, Status};
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;
use vehicle_controller::params::Id;

/// Where the base truly is, and how fast.
const GROUND_TRUTH: &str = "/ground_truth";
/// As often as `base-bridge` publishes, unless it is told otherwise: odometry, tf and joints every 20 ms, the supply and diagnostics every second.
const FAST: u64 = 20_000 / PERIOD.ticks();
const SLOW: u64 = 1_000_000 / PERIOD.ticks();
/// A step of the estimate that is off by more than this from where the speeds lead, m and rad, or by this share, was a correction. What is smaller, odom takes
/// for motion; the speeds of encoders, between two rows, are off by a quarter of this.
const STEP: (f64, f64) = (2e-3, 5e-3);
const SHARE: f64 = 0.1;

/// Writes messages down.
pub struct MessageLog {
    recorder: Recorder<BufWriter<File>>,
    names: Names,
    base: Knowledge,
    noise: SpeedNoise,
    frames: Frames,
    last: Option<Row>,
    fault: String,
    ticks: u64,
}

impl MessageLog {
    /// A new file; one of that name is replaced.
    ///
    /// # Errors
    /// If it cannot be made.
    pub fn create(path: &Path, robot: &Robot) -> Result<Self> {
        let mut base = Knowledge::default();
        for id in robot.params.ids() {
            base.insert(id.spec().name, f64::from(robot.params.get(id)));
        }
        let make = || -> Result<_> {
            let file = BufWriter::new(File::create(path)?);
            let library = concat!("hil-sim ", env!("CARGO_PKG_VERSION"));
            Ok(Recorder::new(file, library, Names::default())?)
        };
        Ok(Self {
            recorder: make().with_context(|| path.display().to_string())?,
            names: Names::default(),
            noise: SpeedNoise::of(&base),
            base,
            frames: Frames::new(f64::from(robot.params.get(Id::MaxSpeed))),
            last: None,
            fault: "none".into(),
            ticks: 0,
        })
    }

    fn motion(&mut self, row: &Row) -> Motion {
        let estimate = Pose::new(row.est_x, row.est_y, row.est_theta);
        let corrected = self
            .last
            .as_ref()
            .is_some_and(|last| is_correction(last, row));
        self.frames.advance(
            Reading {
                time: row.t,
                estimate,
                v: row.v_s,
                omega: row.v_alpha,
            },
            corrected,
        );
        let [xx, xy, xt] = [row.cxx, row.cxy, row.cxt];
        let [yy, yt, tt] = [row.cyy, row.cyt, row.ctt];
        let covariance = [[xx, xy, xt], [xy, yy, yt], [xt, yt, tt]];
        Motion {
            stamp: stamp(row),
            odom: self.frames.odom(),
            map_to_odom: self.frames.map_to_odom(),
            covariance: spatial(&self.frames.in_odom(&covariance)),
            v: row.v_s,
            omega: row.v_alpha,
            speed_covariance: self.noise.covariance(row.v_s, row.v_alpha),
        }
    }

    /// Nobody doubts it.
    fn truth(&mut self, row: &Row, speed: (f64, f64)) -> Result<()> {
        let sure = spatial(&[[0.0; 3]; 3]);
        let motion = Motion {
            stamp: stamp(row),
            odom: Pose::new(row.true_x, row.true_y, row.true_theta),
            map_to_odom: Pose::default(),
            covariance: sure,
            v: speed.0,
            omega: speed.1,
            speed_covariance: sure,
        };
        let truth = odometry(&self.names.map, &self.names.base, &motion);
        Ok(self
            .recorder
            .log()
            .write(GROUND_TRUTH, stamp(row), &truth)?)
    }

    fn fast(&mut self, row: &Row, speed: (f64, f64)) -> Result<()> {
        let turned = Turned {
            counts: [row.left_count, row.right_count],
            wheel_speeds: [row.left_speed, row.right_speed],
            omega: row.v_alpha,
            steer: row.steer.unwrap_or(f64::NAN),
        };
        let joints = Report::Joints {
            stamp: stamp(row),
            joints: joints(&self.names, &self.base, &turned),
        };
        let motion = Report::Motion(self.motion(row));
        self.recorder.write(stamp(row), &motion)?;
        self.recorder.write(stamp(row), &joints)?;
        self.truth(row, speed)
    }

    fn battery(&mut self, row: &Row) -> Result<()> {
        // A base that does not measure it says 0.
        let volts = (row.battery > 0.0).then_some(row.battery);
        let stamp = stamp(row);
        Ok(self
            .recorder
            .write(stamp, &Report::Battery { stamp, volts })?)
    }

    fn diagnostics(&mut self, row: &Row) -> Result<()> {
        let is_well = row.fault == "none";
        let status = Status {
            level: if is_well { Level::Ok } else { Level::Error },
            name: "controller".into(),
            message: if is_well {
                "no fault".into()
            } else {
                format!("fault: {}", row.fault)
            },
            values: vec![
                ("fault".into(), row.fault.clone()),
                ("move_state".into(), row.move_state.clone()),
                ("turn_state".into(), row.turn_state.clone()),
            ],
        };
        let stamp = stamp(row);
        let report = Report::Diagnostics {
            stamp,
            hardware: "hil-sim".into(),
            statuses: vec![status],
        };
        Ok(self.recorder.write(stamp, &report)?)
    }

    /// Writes the end.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn finish(mut self) -> Result<()> {
        self.recorder.log().finish().context("message log")
    }
}

impl Watcher for MessageLog {
    fn note(&mut self, base: &dyn Base) -> Result<()> {
        let (fast, slow) = (
            self.ticks.is_multiple_of(FAST),
            self.ticks.is_multiple_of(SLOW),
        );
        self.ticks += 1;
        if !fast {
            return Ok(());
        }
        let row = base.row()?;
        self.fast(&row, base.plant().speed())?;
        if slow {
            self.battery(&row)?;
            self.recorder.log().flush()?;
        }
        if slow || row.fault != self.fault {
            self.diagnostics(&row)?;
        }
        self.fault.clone_from(&row.fault);
        self.last = Some(row);
        Ok(())
    }
}

/// Simulated time, ns: that of a run has no date.
fn stamp(row: &Row) -> i64 {
    (row.t * 1e9).round() as i64
}

/// The estimate has gone another way than the base: somebody has corrected it.
fn is_correction(last: &Row, row: &Row) -> bool {
    let pose = |row: &Row| Pose::new(row.est_x, row.est_y, row.est_theta);
    let step = pose(last).inverse().then(&pose(row));
    let [v, omega] =
        [(last.v_s, row.v_s), (last.v_alpha, row.v_alpha)].map(|(a, b)| f64::midpoint(a, b));
    let led = Pose::after(v, omega, row.t - last.t);
    let off = (step.x - led.x).hypot(step.y - led.y);
    off > STEP.0 + SHARE * led.x.hypot(led.y)
        || wrapped(step.theta - led.theta).abs() > STEP.1 + SHARE * led.theta.abs()
}
