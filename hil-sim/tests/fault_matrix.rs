//! Each encoder fault at each wheel in each phase of a motion, both ways: it is found in time, and the base does not run away.
//!
//! The tables of `docs/fault-matrix.md` and `docs/safety.md` come from here: `UPDATE_FAULT_MATRIX=1 cargo nextest run -p hil-sim --test fault_matrix` writes them.
//! `FAULT_CASE='left stuck forward MOVE' cargo nextest run -p hil-sim --test fault_matrix a_case --no-capture` shows a case; any words of its name do.

mod matrix;

use hil_sim::base::Base;
use hil_sim::rig::Rig;
use hil_sim::robot::Robot;
use matrix::{Case, Matrix, Phase, SEED, report};
use std::path::Path;

const HEAD: &str = "# The fault matrix

Encoder faults on the simulated robot `default`, for each wheel and for both, forward and backward: each row is the worst of six runs. Written by
`hil-sim/tests/fault_matrix.rs`, which says how; do not edit.

* **detected after** counts from the first moment at which the wheel of a sound base would turn at 30 % of its free speed (0.256 m/s), or from the fault if that
  is later. A negative time: it was latched before that. At most 150 ms are allowed.
* **motors off after** counts from the same moment, until neither motor is driven any more.
* **travel** is the path of the axle's middle from the later of fault and command; at most 0.2 m. Commanded are 0.5 m/s with 1 m/s², or 150 °/s with 300 °/s².
* **wrong way** is the furthest that the base goes against its command, turning: that a rim does; while it is pushed with 5 N: the furthest beyond what the push
  does to a sound base. At most 0.05 m.
* **turned** is the largest change of heading from the same instant; wanted when turning.

";

fn power_up(robot: &Robot) -> Box<dyn Base> {
    Box::new(Rig::new(robot, SEED).unwrap())
}

#[test]
fn every_encoder_fault_is_found_in_time_and_the_table_in_the_docs_says_so() {
    let results = Matrix::new(power_up).try_all(Case::all());
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs");
    let read = |path: &Path| {
        let text = std::fs::read_to_string(path).unwrap_or_default();
        text.replace("\r\n", "\n")
    };
    let (page, safety) = (docs.join("fault-matrix.md"), docs.join("safety.md"));
    let table = format!("{HEAD}{}", report::table(&results));
    let before = read(&safety);
    let start = before.find(report::SUMMARY).unwrap();
    let end = before[start..].find("\n\n").unwrap() + start + 1;
    let summary = report::summary(&results);
    let after = format!("{}{summary}{}", &before[..start], &before[end..]);
    if std::env::var_os("UPDATE_FAULT_MATRIX").is_some() {
        std::fs::write(&page, &table).unwrap();
        std::fs::write(&safety, &after).unwrap();
    }
    for (path, text) in [(page, table), (safety, after)] {
        assert!(
            read(&path) == text,
            "{} is not what comes out: run this test with UPDATE_FAULT_MATRIX=1",
            path.display()
        );
    }
}

/// The checker itself: what it measures on a sound base is what was commanded.
#[test]
fn a_sound_base_is_measured_as_it_was_told_to_move() {
    let mut matrix = Matrix::new(power_up);
    // The threshold, 0.3·(12 V·0.98 − 0.42 V)/13.3 V·s/m, is reached so many ms after a command at 1 m/s², or at 300 °/s²·0.1 m.
    let threshold = 0.3 * (12.0 * 0.98 - 0.42) / 13.3;
    let rim_accel = 300_f64.to_radians() * 0.1;
    assert!(threshold / rim_accel < 0.5, "the turn is fast enough");
    for case in Case::all().into_iter().step_by(3) {
        // 0.5 m/s after 0.5 s and 0.125 m, for the rest of the 2.5 s.
        let (moment, travel, turned) = match case.phase {
            Phase::Standstill | Phase::Hold => (1e3 * threshold, 0.125 + 0.5 * 2.0, 0.0),
            Phase::Accel => (1e3 * threshold - 250.0, 0.09375 + 0.5 * 2.25, 0.0),
            Phase::Move => (0.0, 0.5 * 2.5, 0.0),
            Phase::Deccel => (0.0, 0.5 * 0.4 * 0.4, 0.0),
            Phase::Turn => (0.0, 0.0, 150.0 * 2.5),
        };
        let (verdict, seen) = matrix.try_sound(&case);
        let name = case.name();
        assert_eq!((verdict.detection, &verdict.name), (None, &None), "{name}");
        // The line takes 2 ms, and the base lags by what the motors' time constant makes of 1 m/s².
        assert!(
            (seen - moment).abs() < 40.0,
            "{name}: {seen} ms for {moment}"
        );
        assert!(
            (verdict.travel - travel).abs() < 0.02,
            "{name}: {verdict:?}"
        );
        assert!((verdict.turned - turned).abs() < 5.0, "{name}: {verdict:?}");
        assert!(verdict.wrong_way < 2e-3, "{name}: {verdict:?}");
    }
}

/// Shows the first case whose name has all words of `FAULT_CASE`.
#[test]
fn a_case_can_be_looked_at() {
    let wanted = std::env::var("FAULT_CASE").unwrap_or_else(|_| "left stuck forward MOVE".into());
    let is_wanted = |case: &Case| {
        let name = case.name();
        wanted.split_whitespace().all(|word| name.contains(word))
    };
    let case = Case::all().into_iter().find(is_wanted);
    let case = case.unwrap_or_else(|| panic!("no case `{wanted}`"));
    println!("{}\n{}\n{}", case.name(), case.script(), report::COLUMNS);
    let verdict = Matrix::new(power_up).try_case(&case, true);
    println!("{verdict:#?}\n{:?}", verdict.complaints());
}
