//! What the matrix says: a table, a list of complaints, the trace of a case.

use super::{Case, FAULTS, MEANINGS, Phase, Verdict};
use hil_sim::plant::Plant;
use hil_sim::trace::Row;
use std::cmp::Reverse;
use std::collections::BTreeMap;
use std::fmt::Write;

/// The largest value of some verdicts.
fn worst<'a>(
    verdicts: impl IntoIterator<Item = &'a Verdict>,
    value: impl Fn(&Verdict) -> f64,
) -> f64 {
    let values = verdicts.into_iter().map(value);
    values.fold(f64::NEG_INFINITY, f64::max)
}

/// What a fault was called, more often first.
fn names<'a>(verdicts: impl IntoIterator<Item = &'a Verdict>) -> Vec<String> {
    let mut counts = BTreeMap::new();
    for verdict in verdicts {
        *counts
            .entry(verdict.name.as_deref().unwrap_or("none"))
            .or_insert(0) += 1;
    }
    let mut names: Vec<_> = counts.into_iter().collect();
    names.sort_by_key(|(_, count)| Reverse(*count));
    names.iter().map(|(name, _)| format!("`{name}`")).collect()
}

/// The first line of [`summary`].
pub const SUMMARY: &str =
    "| fault | told as | found after | travel | wrong way | turned, unless that was asked |\n";

/// One row per fault: the worst over phases, wheels and directions.
pub fn summary(results: &[(Case, Verdict)]) -> String {
    let mut text = format!("{SUMMARY}|---|---|--:|--:|--:|--:|\n");
    for (fault, meaning) in FAULTS.into_iter().zip(MEANINGS) {
        let of_row = |(case, _): &&(Case, Verdict)| case.fault == fault;
        let cases: Vec<_> = results.iter().filter(of_row).collect();
        let verdicts = || cases.iter().map(|(_, verdict)| verdict);
        let straight = cases.iter().filter(|(case, _)| case.phase != Phase::Turn);
        let _ = writeln!(
            text,
            "| {meaning} (`{fault}`) | {} | {:.0} ms | {:.3} m | {:.3} m | {:.1}° |",
            names(verdicts()).first().map_or("", String::as_str),
            worst(verdicts(), |v| v.detection.unwrap_or(f64::INFINITY)),
            worst(verdicts(), |v| v.travel),
            worst(verdicts(), |v| v.wrong_way),
            worst(straight.map(|(_, verdict)| verdict), |v| v.turned),
        );
    }
    text
}

/// One row per fault and phase: the worst over wheels and directions.
pub fn table(results: &[(Case, Verdict)]) -> String {
    let mut text = String::from(
        "| fault | phase | detected after, ms | as | motors off after, ms | travel, m | wrong way, m | turned, ° |\n\
         |---|---|--:|---|--:|--:|--:|--:|\n",
    );
    for fault in FAULTS {
        for phase in Phase::ALL {
            let of_row = |(case, _): &&(Case, Verdict)| case.fault == fault && case.phase == phase;
            let verdicts: Vec<&Verdict> = results.iter().filter(of_row).map(|(_, v)| v).collect();
            if verdicts.is_empty() {
                continue;
            }
            let worst = |value: fn(&Verdict) -> f64| worst(verdicts.iter().copied(), value);
            let missed = verdicts.iter().any(|verdict| verdict.detection.is_none());
            let detection = if missed {
                "never".to_owned()
            } else {
                format!("{:.0}", worst(|v| v.detection.unwrap_or(f64::NAN)))
            };
            let _ = writeln!(
                text,
                "| {fault} | {} | {detection} | {} | {:.0} | {:.3} | {:.3} | {:.1} |",
                phase.name(),
                names(verdicts.iter().copied()).join(", "),
                worst(|v| v.off),
                worst(|v| v.travel),
                worst(|v| v.wrong_way),
                worst(|v| v.turned),
            );
        }
    }
    text
}

/// Every case that breaks a requirement, and how.
pub fn complaints(results: &[(Case, Verdict)]) -> Vec<String> {
    let complaint = |(case, verdict): &(Case, Verdict)| {
        let complaints = verdict.complaints();
        let name = verdict.name.as_deref().unwrap_or("none");
        (!complaints.is_empty())
            .then(|| format!("{}: {} (`{name}`)", case.name(), complaints.join(", ")))
    };
    results.iter().filter_map(complaint).collect()
}

/// The heading of the columns of [`trace`].
pub const COLUMNS: &str = "   ms  state        v true  left true   seen  duty current | right true   seen  duty current | ref v     w  count l       r  fault";

/// A line about the base now.
pub fn trace(ms: u64, row: &Row, plant: &Plant) {
    let rim = plant.wheel_speed();
    println!(
        "{ms:5}  {:<6} {:<6} {:6.3}  {:9.3} {:6.3} {:5.2} {:7.2} | {:10.3} {:6.3} {:5.2} {:7.2} | {:5.2} {:5.2} {:8} {:7}  {}",
        row.move_state,
        row.turn_state,
        plant.speed().0,
        rim[0],
        row.left_speed,
        row.left_duty,
        row.left_current,
        rim[1],
        row.right_speed,
        row.right_duty,
        row.right_current,
        row.v_s_ref,
        row.v_alpha_ref,
        row.left_count,
        row.right_count,
        row.fault,
    );
}
