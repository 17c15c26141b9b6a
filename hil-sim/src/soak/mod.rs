//! A soak: hours of random driving, with pushes and a motor that is weaker than the other, and with faults; and what must hold in every tick.
//!
//! It is cut into shards, each with its own seed, robot and base, so that what comes of it does not depend on how many run at once.

mod book;
mod driver;
mod line;
mod mishaps;
mod shard;
mod sight;
mod tally;
mod watch;

pub use sight::{Sight, Watched};
pub use tally::{Finding, Tally};

use crate::rig::Rig;
use crate::robot::{Model, Robot};
use anyhow::{Result, anyhow, bail, ensure};
use std::path::PathBuf;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;

/// Robots with motors.
const ROBOTS: [&str; 3] = ["default", "uncalibrated", "robuter"];
/// A shard's length, ticks: on this computer, and on an emulated board.
const SHARD_TICKS: u64 = 600_000;
const EMULATED_SHARD_TICKS: u64 = 75_000;

/// What is done to a base besides driving and pushing it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// Nothing.
    Healthy,
    /// Things break, and are mended.
    Faults,
}

/// What to soak.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Simulated ticks, of all shards.
    pub ticks: u64,
    /// Where the random numbers begin.
    pub seed: u64,
    /// These; healthy driving and driving with faults take turns.
    pub modes: Vec<Mode>,
    /// This robot; all of them take turns otherwise.
    pub robot: Option<String>,
    /// The image that controls the base; the library on this computer otherwise.
    pub image: Option<PathBuf>,
    /// Pushes are so many times as strong as they are meant to be.
    pub push: f64,
    /// This shard only.
    pub shard: Option<u64>,
    /// So many run at once.
    pub threads: usize,
}

/// A shard.
#[derive(Clone, Copy, Debug)]
struct Part {
    index: u64,
    ticks: u64,
    mode: Mode,
    robot: &'static str,
    seed: u64,
    push: f64,
}

impl Plan {
    fn parts(&self) -> Result<Vec<Part>> {
        ensure!(self.ticks > 0, "a soak takes some time");
        ensure!(!self.modes.is_empty(), "a soak has a mode");
        let robots: Vec<&'static str> = match &self.robot {
            None => ROBOTS.into(),
            Some(name) => {
                let known = ROBOTS.iter().find(|robot| *robot == name);
                vec![known.ok_or_else(|| {
                    anyhow!("a soak is of one of {}, not of {name}", ROBOTS.join(", "))
                })?]
            }
        };
        let longest = if self.image.is_some() {
            EMULATED_SHARD_TICKS
        } else {
            SHARD_TICKS
        };
        // Each robot in each mode has the same share.
        let turns = (self.modes.len() * robots.len()) as u64;
        let shards = self.ticks.div_ceil(longest).next_multiple_of(turns);
        let parts = (0..shards).map(|index| Part {
            index,
            ticks: self.ticks / shards + u64::from(index < self.ticks % shards),
            mode: self.modes[index as usize % self.modes.len()],
            robot: robots[index as usize / self.modes.len() % robots.len()],
            push: self.push,
            // Any odd factor: shards of neighbouring seeds have nothing in common.
            seed: self
                .seed
                .wrapping_mul(0x9E37_79B9_7F4A_7C15)
                .wrapping_add(index),
        });
        Ok(parts
            .filter(|part| self.shard.is_none_or(|only| only == part.index))
            .collect())
    }

    /// Simulated ticks of what will run.
    ///
    /// # Errors
    /// If the plan makes no sense.
    pub fn total(&self) -> Result<u64> {
        Ok(self.parts()?.iter().map(|part| part.ticks).sum())
    }
}

/// Carries a plan out; tells `progress` of simulated ticks. The same plan gives the same tally, however many run at once.
///
/// # Errors
/// If the plan makes no sense, or a simulation cannot go on.
pub fn soak(plan: &Plan, progress: &(dyn Fn(u64) + Sync)) -> Result<Tally> {
    let parts = plan.parts()?;
    let next = AtomicU64::new(0);
    let failed = AtomicBool::new(false);
    let done = Mutex::new(Vec::new());
    thread::scope(|scope| {
        for _ in 0..plan.threads.max(1) {
            scope.spawn(|| {
                while let Some(part) = parts.get(next.fetch_add(1, Ordering::Relaxed) as usize) {
                    let result = run(plan, part, progress);
                    failed.fetch_or(result.is_err(), Ordering::Relaxed);
                    if let Ok(mut done) = done.lock() {
                        done.push((part.index, result));
                    }
                    if failed.load(Ordering::Relaxed) {
                        break;
                    }
                }
            });
        }
    });
    let Ok(mut done) = done.into_inner() else {
        bail!("a part of the soak panicked");
    };
    done.sort_by_key(|(index, _)| *index);
    let mut tally = Tally::default();
    for (index, result) in done {
        tally.add(result.map_err(|error| error.context(format!("shard {index}")))?);
    }
    Ok(tally)
}

fn run(plan: &Plan, part: &Part, progress: &(dyn Fn(u64) + Sync)) -> Result<Tally> {
    let robot = Robot::load(part.robot)?;
    ensure!(
        robot.model == Model::Dynamic,
        "an ideal robot has nothing to soak"
    );
    match &plan.image {
        None => shard::run(part, &robot, Rig::new(&robot, part.seed)?, progress),
        Some(image) => emulated(image, part, &robot, progress),
    }
}

#[cfg(feature = "emulator")]
fn emulated(
    image: &std::path::Path,
    part: &Part,
    robot: &Robot,
    progress: &(dyn Fn(u64) + Sync),
) -> Result<Tally> {
    let base = crate::emulator::ImageBase::new(image, robot, part.seed)?;
    shard::run(part, robot, base, progress)
}

#[cfg(not(feature = "emulator"))]
fn emulated(_: &std::path::Path, _: &Part, _: &Robot, _: &(dyn Fn(u64) + Sync)) -> Result<Tally> {
    bail!("an image needs the emulator, which this hil-sim was built without")
}
