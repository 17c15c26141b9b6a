//! The square path experiment: on bases whose gains are known, through the command line.

mod desk;

use desk::{Desk, hil_sim};

/// The numbers of a line of the report that starts with `name`.
fn numbers(report: &str, name: &str) -> Vec<f64> {
    let line = report
        .lines()
        .find_map(|line| line.strip_prefix(name))
        .unwrap();
    line.split_whitespace()
        .filter_map(|word| word.parse().ok())
        .collect()
}

#[test]
fn an_ideal_base_has_the_gains_that_its_parameters_are_off_by() {
    let desk = Desk::new("");
    // The base is 0.5 % wider than it thinks, its left wheel 0.05 % smaller and its right one as much larger.
    let report = desk.prints(
        "umbmark --robot ideal --side 2 --runs 1 --set wheel_base=0.19900498 --set left_diameter=0.08404202 --set right_diameter=0.08395802 --set noise_s=1e-8 --set noise_drift=1e-4 --set noise_rot=1e-4",
    );
    let [right, left, base] = [1.0005, 0.9995, 1.005];
    let truth = numbers(&report, "true");
    for (is, wanted) in truth.iter().zip([right, left, base]) {
        assert!((is - wanted).abs() < 2e-6, "{report}");
    }
    for method in ["closed form ", "filter "] {
        let line = report
            .lines()
            .rfind(|line| line.starts_with(method))
            .unwrap();
        let found = numbers(line, method);
        // The closed form is of first order, and the filter's equations are until its first fix: of each of the angles, up to 8 times 0.5°, something like the
        // square is left out.
        assert!((found[3] - right / left).abs() < 1e-4, "{report}");
        let common = f64::midpoint(right, left);
        assert!((found[4] - base / common).abs() < 3e-4, "{report}");
    }
}

#[test]
fn on_a_base_with_motors_and_tyres_both_ways_find_most_of_what_is_wrong() {
    let desk = Desk::new("");
    let report = desk.prints("umbmark --robot uncalibrated --side 4 --runs 2 --seed 3");
    let line = |name: &str| {
        let line = report.lines().rfind(|line| line.starts_with(name)).unwrap();
        numbers(line, name)
    };
    let before = line("before ");
    for method in ["closed form ", "filter "] {
        let after = line(method);
        // What is left is slip, the tyres' creep.
        assert!(after[5] < 0.2 * before[5], "{report}");
        assert!(after[6] < 0.5 * before[6], "{report}");
    }
    assert_eq!(
        report,
        desk.prints("umbmark --robot uncalibrated --side 4 --runs 2 --seed 3")
    );
}

#[test]
fn what_is_to_be_set_makes_the_squares_close_whatever_gains_are_in_force() {
    let desk = Desk::new("");
    for before in [
        "",
        " --set gain_base=1.0131",
        " --set gain_right=1.004 --set gain_left=1.006 --set gain_base=1.03",
    ] {
        let command = "umbmark --robot uncalibrated --runs 1";
        let report = desk.prints(&format!("{command}{before}"));
        let lines = report
            .lines()
            .filter_map(|line| line.strip_prefix("SetParam "));
        let set: Vec<_> = lines
            .map(|line| format!(" --set {}", line.replace(' ', "=")))
            .collect();
        let set = set.concat();
        assert_eq!(set.matches("--set gain_").count(), 3, "{report}");
        assert_eq!(set.matches("--set").count(), 3, "{report}");
        // On the same base, behind whatever it was told before.
        let after = desk.prints(&format!("{command}{before}{set}"));
        let off = |report: &str| numbers(report, "before ")[5];
        assert!(
            off(&after) < 0.03 && off(&after) < 0.2 * off(&report),
            "{report}{after}"
        );
    }
}

#[test]
fn gains_that_no_base_takes_are_no_lines_to_set() {
    let desk = Desk::new("");
    // Truly 0.2014 m.
    let report = desk.prints("umbmark --runs 1 --side 2 --set wheel_base=0.15");
    assert!(!report.contains("SetParam"), "{report}");
    let told = "no base takes the closed form's gain_base 1.3";
    assert!(
        report.contains(told) && report.contains("beyond 0.8 to 1.25"),
        "{report}"
    );
    // Nor does the filter, which says why.
    assert!(
        report.contains("of 2 fixes, 2 lay beyond the gate"),
        "{report}"
    );
}

#[test]
fn return_errors_are_written_and_drawn() {
    let desk = Desk::new("");
    let command = "umbmark --side 1 --runs 2 --out r.csv --plot r.svg";
    let printed = desk.prints(command);
    assert!(
        printed.starts_with("on uncalibrated, 2 squares of 1 m each way, seed 1: "),
        "{printed}"
    );
    let rows = desk.trace("r.csv");
    // Before, closed form, filter; two directions; two squares.
    assert_eq!(rows.len(), 12);
    let mean = |which: &str, direction: &str, column: usize| {
        let same = rows.iter().filter(|row| row[..2] == [which, direction]);
        same.map(|row| row[column].parse::<f64>().unwrap())
            .sum::<f64>()
            / 2.0
    };
    let told = numbers(&printed, "clockwise ");
    assert!((mean("before", "clockwise", 3) - told[0]).abs() < 1e-4);
    assert!((mean("before", "clockwise", 4) - told[1]).abs() < 1e-4);
    let picture = desk::text(&desk.read("r.svg"));
    assert!(picture.starts_with("<svg ") && picture.contains("closed form"));
}

#[test]
fn squares_that_cannot_be_driven_are_refused() {
    let desk = Desk::new("");
    for (arguments, why) in [
        ("--side 0", "as long as the wheel base, 0.2 m"),
        ("--side nan", "as long as the wheel base, 0.2 m"),
        ("--side 0.4", "0.5 m to 1 km"),
        ("--side 2000", "0.5 m to 1 km"),
        (
            "--robot robuter --side 0.6",
            "as long as the wheel base, 0.64 m",
        ),
        ("--runs 0", "at least one"),
        ("--robot nobody", "no robot `nobody`"),
        ("--fix-position 0", "deviations above 0"),
        ("--plot p.gif", "p.gif"),
        ("--set k_drift=-1", "k_drift must be"),
    ] {
        let message = desk.refuses(&format!("umbmark {arguments}"));
        assert!(message.contains(why), "{arguments}: {message}");
    }
    hil_sim().args(["umbmark", "4"]).assert().code(2);
}
