//! The same inputs give the same bytes, another seed another run, and both fast.

use assert_cmd::cargo::cargo_bin_cmd;
use std::fs;
use std::time::Duration;

const SCRIPT: &str = "0 m 0.4\n0.2 t 90\n1 GetEstPos\n1.5 !push 5 0.1 0.5\n2 Stream 0.1\n2.5 m -0.2\n6 Stream 0\n6 GetWheels\n7 !end\n";

/// What a run prints, writes and draws.
struct Bytes {
    printed: Vec<u8>,
    trace: Vec<u8>,
    pictures: Vec<Vec<u8>>,
}

fn run(robot: &str, seed: &str, pictures: &[&str]) -> Bytes {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("a.script"), SCRIPT).unwrap();
    let hil_sim = |arguments: &[&str]| {
        let mut command = cargo_bin_cmd!("hil-sim");
        command.timeout(Duration::from_secs(60));
        command.current_dir(folder.path()).args(arguments);
        command.assert().success().get_output().stdout.clone()
    };
    let base = ["--robot", robot, "--seed", seed, "--trace", "t.csv"];
    let printed = hil_sim(&[&["run", "a.script"], &base[..]].concat());
    let read = |name: &str| fs::read(folder.path().join(name)).unwrap();
    let pictures = pictures.iter().map(|picture| {
        let again = hil_sim(&[&["run", "a.script", "--plot", picture], &base[..]].concat());
        assert!(again == printed, "a picture changes the run");
        read(picture)
    });
    Bytes {
        pictures: pictures.collect(),
        printed,
        trace: read("t.csv"),
    }
}

fn assert_repeats(robot: &str) {
    let [first, second] = [(); 2].map(|()| run(robot, "7", &["p.svg", "p.png"]));
    assert!(!first.printed.is_empty());
    assert!(first.printed == second.printed, "standard output differs");
    assert!(first.trace == second.trace, "the trace differs");
    assert!(first.pictures[0] == second.pictures[0], "the SVG differs");
    assert!(first.pictures[1] == second.pictures[1], "the PNG differs");
}

fn assert_seed_matters(robot: &str) {
    assert!(run(robot, "7", &[]).trace != run(robot, "8", &[]).trace);
}

#[test]
fn default_repeats() {
    assert_repeats("default");
}

#[test]
fn uncalibrated_repeats() {
    assert_repeats("uncalibrated");
}

#[test]
fn ideal_repeats() {
    assert_repeats("ideal");
}

#[test]
fn robuter_repeats() {
    assert_repeats("robuter");
}

#[test]
fn another_seed_is_another_run_of_default() {
    assert_seed_matters("default");
}

#[test]
fn another_seed_is_another_run_of_uncalibrated() {
    assert_seed_matters("uncalibrated");
}

#[test]
fn another_seed_is_another_run_of_ideal() {
    assert_seed_matters("ideal");
}

#[test]
fn another_seed_is_another_run_of_robuter() {
    assert_seed_matters("robuter");
}

#[test]
fn the_robots_drive_differently() {
    let names = ["default", "uncalibrated", "ideal", "robuter", "increments"];
    let runs = names.map(|name| run(name, "7", &[]));
    for (k, one) in runs.iter().enumerate() {
        assert!(
            runs[..k].iter().all(|other| other.trace != one.trace),
            "{}",
            names[k]
        );
    }
}

#[test]
fn a_trace_does_not_change_the_run() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("a.script"), SCRIPT).unwrap();
    let mut command = cargo_bin_cmd!("hil-sim");
    command.current_dir(folder.path());
    command.args(["run", "a.script", "--seed", "7"]);
    let printed = command.assert().success().get_output().stdout.clone();
    assert!(printed == run("default", "7", &[]).printed);
}

/// CPU time of the simulator on a script, s: the shell's `times` counts what its children used, however busy the machine is.
#[cfg(unix)]
fn cpu_seconds(folder: &std::path::Path) -> f64 {
    let output = std::process::Command::new("sh")
        .args(["-c", r#""$0" run long.script >printed && times"#])
        .arg(assert_cmd::cargo::cargo_bin!("hil-sim"))
        .current_dir(folder)
        .env("LC_ALL", "C")
        .output()
        .unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    // Two lines, the shell's and its children's, each of user and system time: 0m0.080s 0m0.000s.
    let (_, children) = text.trim().split_once('\n').unwrap();
    let seconds = |time: &str| -> f64 {
        let (minutes, seconds) = time.trim_end_matches('s').split_once('m').unwrap();
        60.0 * minutes.parse::<f64>().unwrap() + seconds.parse::<f64>().unwrap()
    };
    children.split_whitespace().map(seconds).sum()
}

#[cfg(unix)]
#[test]
fn driving_is_simulated_500_times_faster_than_it_happens() {
    use std::fmt::Write;
    let mut script = String::new();
    for second in (0..200).step_by(4) {
        writeln!(script, "{second} m 0.5\n{} t 90", second + 2).unwrap();
    }
    script += "200 !end\n";
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("long.script"), script).unwrap();
    let best = (0..3)
        .map(|_| cpu_seconds(folder.path()))
        .fold(f64::INFINITY, f64::min);
    let printed = fs::read_to_string(folder.path().join("printed")).unwrap();
    assert_eq!(printed.matches("OK").count(), 100, "it drove");
    println!("200 s in {best:.3} s: {:.0} times real time", 200.0 / best);
    assert!(best < 200.0 / 500.0, "200 simulated seconds took {best} s");
}
