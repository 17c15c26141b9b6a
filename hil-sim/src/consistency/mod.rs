//! Monte Carlo: many bases, each with gains of its own from the prior and errors on its way, and whether what the controller says of its errors is true of
//! them all (theory sections 3, 4 and 6).

mod report;
mod trial;
pub(crate) mod world;

pub use report::{Estimated, Gain, Moment, Report};
pub use trial::{Check, Fix, Outcome, Trial};

use crate::robot::Robot;
use anyhow::{Result, ensure};
use rayon::prelude::*;
use vehicle_controller::time::Duration;

/// What to try.
#[derive(Clone, Debug)]
pub struct Plan {
    /// How many bases.
    pub runs: u64,
    /// How long each drives, s.
    pub seconds: f64,
    /// A fix comes this often, s.
    pub fix_every: Option<f64>,
    /// Standard deviations of a fix: of x and of y (m), of θ (rad).
    pub fix_deviations: [f64; 2],
    /// Fixes correct the gains, too; otherwise these are considered.
    pub learns: bool,
    /// Period of the control loop.
    pub period: Duration,
    /// Where the random numbers begin.
    pub seed: u64,
}

impl Default for Plan {
    /// Theory section 6: fixes of 1 cm and 0.5°. At 100 Hz, which gives what 1 kHz does, in a tenth of the time.
    fn default() -> Self {
        Self {
            runs: 400,
            seconds: 60.0,
            fix_every: None,
            fix_deviations: [0.01, 0.5_f64.to_radians()],
            learns: false,
            period: Duration::millis(10),
            seed: 1,
        }
    }
}

impl Plan {
    fn check(&self) -> Result<()> {
        let dt = self.period.ticks() as f64 * 1e-6;
        let every = self.fix_every.unwrap_or(1.0);
        ensure!(self.runs >= 2, "one run is no statistics: --runs 2 or more");
        ensure!(
            self.runs <= 1_000_000,
            "more than a million runs would not fit into memory"
        );
        ensure!(
            self.seconds.is_finite() && self.seconds <= 1e5,
            "a run ends within 100 000 s"
        );
        ensure!(
            every >= 2.0 * dt && every.is_finite(),
            "there are at least {} s from fix to fix",
            2.0 * dt
        );
        ensure!(
            self.seconds >= every,
            "nothing is compared before {every} s: drive for longer"
        );
        let good = |deviation: &f64| *deviation > 0.0 && deviation.is_finite();
        ensure!(
            self.fix_deviations.iter().all(good),
            "the deviations of a fix are above 0"
        );
        Ok(())
    }
}

/// Carries a plan out on bases like this robot, whose parameters hold the priors; tells `progress` of each run that is done. The same plan gives the same report,
/// however many run at once.
///
/// # Errors
/// If the plan makes no sense, the robot is no differential drive, or an estimate claims to be exact.
pub fn consistency(plan: &Plan, robot: &Robot, progress: &(dyn Fn() + Sync)) -> Result<Report> {
    consistency_of(plan, robot, robot, progress)
}

/// The same where the bases are not what their controllers believe: gains and errors are drawn from the parameters of `bases`.
///
/// # Errors
/// As for [`consistency`].
pub fn consistency_of(
    plan: &Plan,
    robot: &Robot,
    bases: &Robot,
    progress: &(dyn Fn() + Sync),
) -> Result<Report> {
    plan.check()?;
    robot.ensure_differential("the trial of the estimator on many bases")?;
    let trials = (0..plan.runs)
        .into_par_iter()
        .map(|index| {
            let trial = trial::run(plan, robot, bases, index);
            progress();
            trial
        })
        .collect::<Result<Vec<_>>>()?;
    Ok(Report::new(plan, bases, trials))
}
