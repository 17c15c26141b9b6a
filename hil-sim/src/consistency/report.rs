//! What all the runs say together.

use super::Plan;
use super::trial::{Check, Outcome, Trial};
use crate::plot::{Cloud, OverTime};
use crate::prior::Prior;
use crate::robot::Robot;
use crate::statistics::{CHI_SQUARE_3_95, NORMAL_95, chi_square_band, mean};
use anyhow::{Context, Result};
use nalgebra::{Matrix3, Vector3};
use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;
use vehicle_controller::vehicle::Calibration;

/// A number, and where it may lie with 95 %.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimated {
    /// It.
    pub value: f64,
    /// From, to.
    pub band: [f64; 2],
}

/// The estimates of all runs at one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moment {
    /// s.
    pub time: f64,
    /// Mean NEES/3 in exponential coordinates; the band is about 1.
    pub nees: Estimated,
    /// The same in differences of x, y and θ.
    pub cartesian: f64,
    /// Share of the runs whose truth lies in the 95 % region; the band is about 0.95.
    pub coverage: Estimated,
}

/// The estimates of one gain at the end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gain {
    /// Its name.
    pub name: &'static str,
    /// Standard deviation before anything is known of the base.
    pub prior: f64,
    /// Root mean square of its errors.
    pub error: f64,
    /// Root mean square of the standard deviations that the filter gives.
    pub claimed: f64,
    /// Mean squared error in units of the variance that the filter gives; the band is about 1.
    pub normalised: Estimated,
}

/// All of it.
#[derive(Clone, Debug)]
pub struct Report {
    /// What was tried.
    pub plan: Plan,
    /// Before each fix, or every second.
    pub before: Vec<Moment>,
    /// After each fix, of the runs that took it.
    pub after: Vec<Moment>,
    /// Mean over all that is before a fix, and after: NEES/3 in exponential coordinates with the band of the mean, by the spread of the runs that have any.
    /// None where fewer than two have.
    pub mean_before: Option<Estimated>,
    /// After those that were taken.
    pub mean_after: Option<Estimated>,
    /// Mean d²/3 of the innovations, of fixes that were refused, too; the band is about 1. None without fixes.
    pub innovation: Option<Estimated>,
    /// How the innovation of a fix that was taken goes along with the next one; the band is about 0. None where no run has two fixes.
    pub autocorrelation: Option<Estimated>,
    /// Fixes beyond the gate.
    pub refused: usize,
    /// Fixes that would have led to gains beyond what any vehicle can have.
    pub unreasonable: usize,
    /// Fixes, taken or not.
    pub fixes: usize,
    /// The gains whose prior leaves anything to know.
    pub gains: Vec<Gain>,
    /// Each run's true pose at the end as seen from its estimate, m, m, rad.
    pub misses: Vec<[f64; 3]>,
    /// The mean of the covariances at the end, in the directions of the estimate.
    pub covariance: Matrix3<f64>,
}

fn around(center: f64, half: f64) -> [f64; 2] {
    [center - half, center + half]
}

impl Report {
    pub(super) fn new(plan: &Plan, robot: &Robot, trials: Vec<Trial>) -> Self {
        let by_time = |checks: fn(&Trial) -> &Vec<Check>| -> Vec<Moment> {
            let mut moments: BTreeMap<u64, Vec<Check>> = BTreeMap::new();
            for check in trials.iter().flat_map(checks) {
                moments.entry(check.tick).or_default().push(*check);
            }
            moments.values().filter_map(|same| moment(same)).collect()
        };
        let over_all = |checks: fn(&Trial) -> &Vec<Check>| {
            let some = trials.iter().map(checks).filter(|all| !all.is_empty());
            let runs = some.clone().count();
            let each = some.map(|all| {
                let nees = all.iter().map(|check| check.nees / 3.0);
                nees.sum::<f64>() / all.len() as f64
            });
            let (value, deviation) = mean(each);
            (runs >= 2).then(|| Estimated {
                value,
                band: around(value, NORMAL_95 * deviation),
            })
        };
        let (before, after) = (
            by_time(|trial| &trial.before),
            by_time(|trial| &trial.after),
        );
        let (mean_before, mean_after) = (
            over_all(|trial| &trial.before),
            over_all(|trial| &trial.after),
        );
        let (innovation, autocorrelation) = whiteness(&trials);
        let count = |which: fn(&Outcome) -> bool| {
            let fixes = trials.iter().flat_map(|trial| &trial.fixes);
            fixes.filter(|fix| which(&fix.outcome)).count()
        };
        Self {
            plan: plan.clone(),
            before,
            after,
            mean_before,
            mean_after,
            innovation,
            autocorrelation,
            refused: count(|outcome| *outcome == Outcome::Gate),
            unreasonable: count(|outcome| *outcome == Outcome::Gains),
            fixes: count(|_| true),
            gains: gains(&trials, &Prior::of(&robot.params)),
            covariance: trials
                .iter()
                .map(|trial| trial.covariance / trials.len() as f64)
                .sum(),
            misses: trials.into_iter().map(|trial| trial.miss).collect(),
        }
    }

    /// What the plot wants to know.
    #[must_use]
    pub fn cloud(&self) -> Cloud {
        let of = |value: fn(&Moment) -> f64| self.before.iter().map(value).collect();
        Cloud {
            points: self.misses.iter().map(|[x, y, _]| [*x, *y]).collect(),
            points_name: "true positions at the end".into(),
            covariance: self.covariance,
            other: None,
            over_time: Some(OverTime {
                times: of(|moment| moment.time),
                nees: of(|moment| moment.nees.value),
                cartesian: of(|moment| moment.cartesian),
                band: chi_square_band(3.0 * self.misses.len() as f64, NORMAL_95),
            }),
        }
    }

    /// Writes a row per moment.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn write(&self, path: &Path) -> Result<()> {
        let shown = || path.display().to_string();
        let mut writer = csv::Writer::from_path(path).with_context(shown)?;
        writer.write_record([
            "t",
            "when",
            "nees",
            "nees_low",
            "nees_high",
            "nees_cartesian",
            "coverage",
            "coverage_low",
            "coverage_high",
        ])?;
        let labels = if self.plan.fix_every.is_some() {
            ["before", "after"]
        } else {
            ["free", "after"]
        };
        for (moments, label) in [&self.before, &self.after].into_iter().zip(labels) {
            for moment in moments {
                let numbers = [
                    moment.nees.value,
                    moment.nees.band[0],
                    moment.nees.band[1],
                    moment.cartesian,
                    moment.coverage.value,
                    moment.coverage.band[0],
                    moment.coverage.band[1],
                ];
                let mut record = vec![format!("{:.3}", moment.time), label.to_owned()];
                record.extend(numbers.map(|number| format!("{number:.6}")));
                writer.write_record(record)?;
            }
        }
        writer.flush().with_context(shown)
    }
}

fn moment(checks: &[Check]) -> Option<Moment> {
    let first = checks.first()?;
    let count = checks.len() as f64;
    let over = |value: fn(&Check) -> f64| checks.iter().map(value).sum::<f64>() / count;
    let inside = |check: &Check| f64::from(u8::from(check.nees <= CHI_SQUARE_3_95));
    Some(Moment {
        time: first.time,
        nees: Estimated {
            value: over(|check| check.nees) / 3.0,
            band: chi_square_band(3.0 * count, NORMAL_95),
        },
        cartesian: over(|check| check.cartesian) / 3.0,
        coverage: Estimated {
            value: over(inside),
            // Of a few runs, the band would go beyond all of them.
            band: around(0.95, NORMAL_95 * (0.95 * 0.05 / count).sqrt())
                .map(|share| share.clamp(0.0, 1.0)),
        },
    })
}

/// Mean d²/3 and the autocorrelation of successive innovations, each with the band that it should be in. The innovation after a fix that was refused has
/// the same error in it once more, and need not be white.
fn whiteness(trials: &[Trial]) -> (Option<Estimated>, Option<Estimated>) {
    let all = || trials.iter().flat_map(|trial| &trial.fixes);
    let count = all().count() as f64;
    let squares: f64 = all().map(|fix| fix.innovation.norm_squared()).sum();
    let (mut pairs, mut products, mut of_pairs) = (0.0, 0.0, 0.0);
    for two in trials.iter().flat_map(|trial| trial.fixes.windows(2)) {
        if matches!(two[0].outcome, Outcome::Taken(_)) {
            pairs += 1.0;
            products += two[0].innovation.dot(&two[1].innovation);
            of_pairs += 0.5 * (two[0].innovation.norm_squared() + two[1].innovation.norm_squared());
        }
    }
    (
        (count > 0.0).then(|| Estimated {
            value: squares / (3.0 * count),
            band: chi_square_band(3.0 * count, NORMAL_95),
        }),
        (pairs > 0.0).then(|| Estimated {
            value: products / of_pairs,
            band: around(0.0, NORMAL_95 / (3.0_f64 * pairs).sqrt()),
        }),
    )
}

fn gains(trials: &[Trial], prior: &Prior) -> Vec<Gain> {
    let count = trials.len() as f64;
    let over = |value: fn(&Trial) -> Vector3<f64>| -> Vector3<f64> {
        trials.iter().map(value).sum::<Vector3<f64>>() / count
    };
    let errors = over(|trial| trial.gain_errors.map(|e| e * e));
    let claimed = over(|trial| trial.gain_deviations.map(|d| d * d));
    let normalised = over(|trial| {
        trial
            .gain_errors
            .component_div(&trial.gain_deviations)
            .map(|e| e * e)
    });
    let priors = prior.deviations();
    ["k_r", "k_l", "k_b"]
        .into_iter()
        .enumerate()
        .filter(|(index, _)| priors[*index] > 0.0)
        .map(|(index, name)| Gain {
            name,
            prior: priors[index],
            error: errors[index].sqrt(),
            claimed: claimed[index].sqrt(),
            normalised: Estimated {
                value: normalised[index],
                band: chi_square_band(count, NORMAL_95),
            },
        })
        .collect()
}

impl fmt::Display for Estimated {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{:7.3}   ({:.3} to {:.3})",
            self.value, self.band[0], self.band[1]
        )
    }
}

/// What there is, or a dash.
fn or_dash(estimated: Option<&Estimated>) -> String {
    estimated.map_or_else(|| format!("{:>7}", "-"), Estimated::to_string)
}

impl fmt::Display for Report {
    /// For people.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let plan = &self.plan;
        write!(
            f,
            "{} runs of {} s, seed {}: ",
            plan.runs, plan.seconds, plan.seed
        )?;
        match plan.fix_every {
            None => writeln!(f, "no fixes")?,
            Some(every) => writeln!(
                f,
                "a fix of {:.1} cm and {:.2} deg every {every} s, gains {}",
                100.0 * plan.fix_deviations[0],
                plan.fix_deviations[1].to_degrees(),
                if plan.learns { "learned" } else { "considered" }
            )?,
        }
        let when = if plan.fix_every.is_some() {
            "before the fix"
        } else {
            ""
        };
        writeln!(
            f,
            "  NEES/3 {when:<14} (95 % band if right)   Cartesian   in the 95 % region"
        )?;
        for moment in few(&self.before) {
            writeln!(
                f,
                "  at {:6.1} s {}   {:11.3}   {:6.1} % ({:.1} to {:.1})",
                moment.time,
                moment.nees,
                moment.cartesian,
                100.0 * moment.coverage.value,
                100.0 * moment.coverage.band[0],
                100.0 * moment.coverage.band[1],
            )?;
        }
        if self.fixes > 0 {
            writeln!(f, "  over all fixes (95 % band of the mean)")?;
            for (name, estimated) in [("before", &self.mean_before), ("after", &self.mean_after)] {
                writeln!(f, "  {name:11}{}", or_dash(estimated.as_ref()))?;
            }
            writeln!(f, "  innovations (95 % band if white)")?;
            for (name, estimated) in [("d2/3", &self.innovation), ("lag 1", &self.autocorrelation)]
            {
                writeln!(f, "  {name:11}{}", or_dash(estimated.as_ref()))?;
            }
            write!(f, "  refused    {} of {}", self.refused, self.fixes)?;
            if self.unreasonable > 0 {
                let [min, max] = Calibration::RANGE;
                write!(
                    f,
                    " beyond the gate, {} as a gain would be beyond {min} to {max}",
                    self.unreasonable
                )?;
            }
            writeln!(f)?;
        }
        if plan.learns {
            writeln!(
                f,
                "  gain   prior sd    error rms   of prior   claimed sd   (error/claimed)2 (95 % band if right)"
            )?;
            for gain in &self.gains {
                writeln!(
                    f,
                    "  {}    {:.3e}   {:.3e}   {:5.1} %    {:.3e}   {}",
                    gain.name,
                    gain.prior,
                    gain.error,
                    100.0 * gain.error / gain.prior,
                    gain.claimed,
                    gain.normalised
                )?;
            }
        }
        Ok(())
    }
}

/// Six at even distances, the last one among them; all, if there are no more.
fn few(moments: &[Moment]) -> impl Iterator<Item = &Moment> {
    const SHOWN: usize = 6;
    let count = moments.len();
    (0..SHOWN.min(count)).map(move |index| &moments[(index + 1) * count / SHOWN.min(count) - 1])
}
