//! Landmarks in scripts, and pictures of the map.

use hil_sim::map::figures::figures;
use hil_sim::map::sketch::Sketch;
use hil_sim::map::tour::between;
use hil_sim::plot::plot_charts;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn run(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_hil-sim"))
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .args(arguments)
        .output()
        .unwrap()
}

fn temporary(name: &str) -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join(name)
}

#[test]
fn a_lamp_that_is_seen_again_shrinks_circles() {
    let picture = temporary("map_run.svg");
    let trace = temporary("map_run.csv");
    let output = run(&[
        "run",
        "scenarios/map.script",
        "--robot",
        "uncalibrated",
        "--map",
        picture.to_str().unwrap(),
        "--trace",
        trace.to_str().unwrap(),
    ]);
    assert!(output.status.success(), "{output:?}");
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(said.contains("\tConfirmed door 3"), "{said}");
    let lines = said
        .lines()
        .filter_map(|line| Some(line.split_once('\t')?.1));
    let sketches = Sketch::all(lines).unwrap();
    let [before, after] = sketches.as_slice() else {
        panic!("{said}");
    };
    // Where it truly was at each Mark, by the trace; the first place's frame is where it stood then.
    let trace = std::fs::read_to_string(trace).unwrap();
    let mut rows = trace
        .lines()
        .map(|row| row.split(',').collect::<Vec<&str>>());
    let header = rows.next().unwrap();
    let rows: Vec<Vec<&str>> = rows.collect();
    let pose = |time: f64| {
        let cell = |row: &[&str], name: &str| -> f64 {
            let column = header.iter().position(|known| *known == name).unwrap();
            row[column].parse().unwrap()
        };
        let row = rows.iter().find(|row| cell(row, "t") >= time).unwrap();
        ["true_x", "true_y", "true_theta"].map(|name| cell(row, name))
    };
    let truth = [
        ("door", 1.0),
        ("desk", 17.0),
        ("window", 29.0),
        ("shelf", 48.0),
    ];
    let door = pose(1.0);
    for sketch in [before, after] {
        let circles = sketch.circles();
        assert_eq!(circles.len(), 4);
        for (name, disc, _) in circles {
            let (_, time) = truth.iter().find(|(known, _)| *known == name).unwrap();
            let [x, y, _] = between(door, pose(*time));
            let away = (x - disc.x).hypot(y - disc.y);
            // A row has four decimals of a metre and three of a degree.
            assert!(away <= disc.radius + 3e-4, "{name} {disc:?}: {x} {y}");
        }
    }
    let radius = |sketch: &Sketch, name: &str| {
        let circles = sketch.circles();
        circles
            .iter()
            .find(|(known, ..)| known == name)
            .unwrap()
            .1
            .radius
    };
    assert!(radius(after, "shelf") < 0.5 * radius(before, "shelf"));
    let svg = std::fs::read_to_string(picture).unwrap();
    assert!(
        svg.contains("circle of uncertainty") && svg.contains("shelf"),
        "{svg}"
    );
}

#[test]
fn the_same_script_and_seed_see_the_same() {
    let said = |seed: &str| {
        let arguments = [
            "run",
            "scenarios/map.script",
            "--robot",
            "uncalibrated",
            "--seed",
            seed,
        ];
        run(&arguments).stdout
    };
    assert_eq!(said("5"), said("5"));
}

/// What the base says to a script with the robot `uncalibrated`.
fn said(name: &str, script: &str) -> Vec<String> {
    let path = temporary(name);
    std::fs::write(&path, script).unwrap();
    let output = run(&["run", path.to_str().unwrap(), "--robot", "uncalibrated"]);
    assert!(output.status.success(), "{output:?}");
    let said = String::from_utf8(output.stdout).unwrap();
    let lines = said.lines().filter_map(|line| line.split_once('\t'));
    lines.map(|(_, line)| line.to_owned()).collect()
}

#[test]
fn ten_turns_on_the_spot_exclude_nothing_that_is_true() {
    // A client with a compass turns on by the 48° that ten turns fall short, and drives back: 12 mm from the door.
    let said = said(
        "turns.script",
        "1 Mark door 0.3\n1.2 m 4\n20 t 3600\n75 t 47.6\n78 m -4\n95 AmIThere door\n96 Mark door\n97 !end\n",
    );
    let is = |what: &str| said.iter().any(|line| line.starts_with(what));
    assert!(
        is("AmIThere door yes-maybe ") && is("Confirmed door "),
        "{said:?}"
    );
}

#[test]
fn who_cannot_trust_an_encoder_has_lost_where_it_is() {
    let said = said(
        "stuck.script",
        "1 Mark door 0.3\n1.2 m 4\n8 !fault left encoder stuck\n10 !clear\n10.5 AmIThere door\n11 ClearFault\n12 Enable\n13 m 1\n20 AmIThere door\n\
         21 Mark back 0.3\n22 GetMap\n23 !end\n",
    );
    let at = |what: &str| said.iter().position(|line| line.starts_with(what));
    let (fault, lost) = (at("! fault ").unwrap(), at("! map lost").unwrap());
    assert!(fault < lost, "{said:?}");
    let asked: Vec<&String> = said
        .iter()
        .filter(|line| line.starts_with("AmIThere"))
        .collect();
    assert_eq!(asked, ["AmIThere door yes-maybe -"; 2], "{said:?}");
    // The next place is on an island of its own.
    assert!(at("Map 2 0 0 back").is_some(), "{said:?}");
    assert_eq!(said.iter().filter(|line| *line == "! map lost").count(), 1);
}

#[test]
fn mistakes_are_told() {
    let script = temporary("no_lamp.script");
    std::fs::write(&script, "0 Mark a\n1 !sight lamp\n").unwrap();
    let output = run(&["run", script.to_str().unwrap()]);
    let told = String::from_utf8(output.stderr).unwrap();
    assert!(
        !output.status.success() && told.contains("no landmark lamp"),
        "{told}"
    );
    std::fs::write(&script, "0 Mark a\n").unwrap();
    let output = run(&["run", script.to_str().unwrap(), "--map", "/nowhere.svg"]);
    let told = String::from_utf8(output.stderr).unwrap();
    assert!(
        !output.status.success() && told.contains("GetMap"),
        "{told}"
    );
}

#[test]
fn the_paper_s_figures_are_drawn() {
    let charts = figures(1).unwrap();
    assert_eq!(charts.len(), 4);
    let picture = temporary("brooks.svg");
    plot_charts(&charts, "figures", &picture).unwrap();
    let first = std::fs::read(&picture).unwrap();
    plot_charts(&figures(1).unwrap(), "figures", &picture).unwrap();
    assert_eq!(first, std::fs::read(&picture).unwrap());
    assert!(plot_charts(&[], "nothing", &picture).is_err());
}
