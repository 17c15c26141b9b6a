//! Commands through a pipe, and the scenarios that users start from.

mod desk;

use desk::{Desk, hil_sim, text};
use std::fs;

#[test]
fn lines_piped_in_are_carried_out_and_the_end_of_input_ends_it() {
    let expected = ["! boot power-on", "OK", "! move done "];
    for arguments in ["--speed max", "drive --speed max"] {
        let piped = hil_sim()
            .args(arguments.split_whitespace())
            .write_stdin("m 0.1\n")
            .assert()
            .success();
        let printed = text(&piped.get_output().stdout);
        let lines: Vec<_> = printed.lines().collect();
        assert_eq!(lines.len(), expected.len(), "{printed}");
        for (line, begin) in lines.iter().zip(expected) {
            assert!(line.starts_with(begin), "{printed}");
        }
    }
}

/// The replies to a command that is sent so often, without waiting for them; tagged from 0.
fn replies_to_a_flood(command: &str, count: usize) -> Vec<String> {
    use std::fmt::Write;
    let mut lines = String::new();
    for tag in 0..count {
        writeln!(lines, "@{tag} {command}").unwrap();
    }
    let piped = hil_sim()
        .args(["--speed", "max"])
        .write_stdin(lines)
        .assert()
        .success();
    let printed = text(&piped.get_output().stdout);
    let replies = printed.lines().filter(|line| line.starts_with('@'));
    replies.map(str::to_owned).collect()
}

#[test]
fn every_line_of_a_long_pipe_is_carried_out_in_order() {
    let replies = replies_to_a_flood("SetParam gate 25", 1000);
    let expected: Vec<_> = (0..1000).map(|tag| format!("@{tag} OK")).collect();
    assert_eq!(replies, expected);
}

#[test]
fn a_pipe_faster_than_its_replies_gets_one_reply_to_a_line_all_the_same() {
    let replies = replies_to_a_flood("GetEstPos", 1000);
    assert_eq!(replies.len(), 1000);
    for (tag, reply) in replies.iter().enumerate() {
        let (found, reply) = reply.split_once(' ').unwrap();
        assert_eq!(found, format!("@{tag}"));
        assert!(
            reply.starts_with("EstPos ") || reply.starts_with("ERR busy "),
            "{reply}"
        );
    }
    assert!(replies[0].starts_with("@0 EstPos "));
}

#[test]
fn an_empty_pipe_ends_it_at_once() {
    let piped = hil_sim()
        .args(["--speed", "max"])
        .write_stdin("")
        .assert()
        .success();
    assert_eq!(text(&piped.get_output().stdout), "! boot power-on\n");
}

#[test]
fn a_drive_by_pipe_is_traced_to_its_end() {
    let desk = Desk::new("");
    let mut command = hil_sim();
    command.current_dir(desk.0.path()).write_stdin("m 0.1\n");
    command
        .args(["--speed", "max", "--trace", "t.csv"])
        .assert()
        .success();
    let rows = desk.trace("t.csv");
    let last = &rows[rows.len() - 1];
    assert!((last[4].parse::<f64>().unwrap() - 0.1).abs() < 1e-3);
    desk.prints("plot t.csv -o p.svg");
}

#[test]
fn every_scenario_runs_without_an_error() {
    let mut names = Vec::new();
    for entry in fs::read_dir("scenarios").unwrap() {
        let path = entry.unwrap().path();
        // These are there to be stopped.
        let is_stopped = [
            "every_state.script",
            "faults.script",
            "loose_encoder.script",
        ]
        .iter()
        .any(|name| path.ends_with(name));
        // Those of a car; one of them shows what a car refuses.
        let robot = if path.ends_with("car.script") || path.ends_with("hermosillo.script") {
            "cycab"
        } else {
            "default"
        };
        let arguments = ["--robot", robot];
        let run = hil_sim()
            .arg("run")
            .arg(&path)
            .args(arguments)
            .assert()
            .success();
        let printed = text(&run.get_output().stdout).replace("ERR standing", "");
        assert!(!printed.contains("ERR"), "{}\n{printed}", path.display());
        assert!(
            is_stopped || !printed.contains("! fault"),
            "{}\n{printed}",
            path.display()
        );
        names.push(path.file_name().unwrap().to_str().unwrap().to_owned());
    }
    for name in [
        "chase",
        "correction",
        "figure_eight",
        "keep_going",
        "push",
        "square",
        "velocity",
    ] {
        assert!(names.contains(&format!("{name}.script")), "{names:?}");
    }
}

/// The pose of the last EstPos line that a scenario prints.
fn last_pose(scenario: &str) -> [f64; 3] {
    let run = hil_sim()
        .arg("run")
        .arg(format!("scenarios/{scenario}.script"))
        .assert()
        .success();
    let printed = text(&run.get_output().stdout);
    let (_, numbers) = printed.rsplit_once("\tEstPos ").unwrap();
    let mut numbers = numbers.split_whitespace().map(|n| n.parse().unwrap());
    [(); 3].map(|()| numbers.next().unwrap())
}

#[test]
fn the_square_comes_back_to_where_it_began() {
    let [x, y, theta] = last_pose("square");
    assert!(x.hypot(y) < 0.003 && theta.abs() < 0.5, "{x} {y} {theta}");
}

#[test]
fn the_pushed_base_arrives_on_its_line() {
    let [x, y, theta] = last_pose("push");
    assert!(
        (x - 1.0).abs() < 0.002 && y.abs() < 0.02 && theta.abs() < 0.5,
        "{x} {y} {theta}"
    );
}
