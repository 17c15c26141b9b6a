//! What a calibration is worth: the errors of plain odometry before and after it.

use super::Fixes;
use crate::replay::{Errors, Log, Replay, replay, replay_from};
use crate::robot::Robot;
use crate::se2;
use anyhow::{Result, anyhow};
use vehicle_controller::params::Params;

/// A log replayed without fixes, with the gains from before and from after a calibration.
#[derive(Clone, Debug)]
pub struct Verdict {
    /// From the first row's truth, with the gains from before …
    pub before: Replay,
    /// … and with those that were learned.
    pub after: Replay,
    /// Errors of the first …
    pub errors_before: Errors,
    /// … and of the second.
    pub errors_after: Errors,
    /// The squared Mahalanobis distance of the last row's truth, in exponential coordinates, when the first row's is known as well as a fix and the gains as
    /// well as they were learned. It exceeds [`CHI_SQUARE_3_99`](crate::statistics::CHI_SQUARE_3_99) once in a hundred times.
    pub distance: f64,
}

/// Replays a log.
///
/// # Errors
/// If the truth is not known.
pub fn verdict(
    log: &Log,
    robot: &Robot,
    before: &Params,
    after: &Params,
    fixes: &Fixes,
) -> Result<Verdict> {
    let unknown = || anyhow!("{}: the truth is not known", log.name);
    let truth = log.rows()[log.len() - 1].truth.ok_or_else(unknown)?;
    let honest = replay_from(log, robot, after, fixes.covariance())?;
    let distance = se2::nees(honest.last(), truth)
        .ok_or_else(|| anyhow!("{}: the final covariance is singular", log.name))?;
    let (before, after) = (replay(log, robot, before)?, replay(log, robot, after)?);
    Ok(Verdict {
        errors_before: before.errors().ok_or_else(unknown)?,
        errors_after: after.errors().ok_or_else(unknown)?,
        before,
        after,
        distance,
    })
}
