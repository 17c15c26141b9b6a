//! The command line of `hil-sim`: what each command prints and writes, and how it refuses.

mod desk;

use desk::{Desk, hil_sim, text};
use std::fs;
use std::path::Path;

const COLUMNS: &str = "t,true_x,true_y,true_theta,est_x,est_y,est_theta,cxx,cxy,cxt,cyy,cyt,ctt,s,s_ref,v_s,v_s_ref,\
    alpha,alpha_ref,v_alpha,v_alpha_ref,move_state,turn_state,left_count,right_count,left_speed,right_speed,\
    left_duty,right_duty,left_current,right_current,battery,fault";

/// A robot's file that is right.
const ROBOT: &str = include_str!("../robots/default.toml");
/// `1 +` the index of the line that holds `what`.
fn line_of(text: &str, what: &str) -> usize {
    1 + text.lines().position(|line| line.contains(what)).unwrap()
}

#[test]
fn robots_lists_the_robots_with_a_description_each() {
    let listed = text(
        &hil_sim()
            .arg("robots")
            .assert()
            .success()
            .get_output()
            .stdout,
    );
    let mut names = Vec::new();
    for line in listed.lines() {
        let (name, description) = line.split_once(' ').unwrap();
        assert!(description.trim().len() > 20, "{line}");
        names.push(name);
    }
    let presets = [
        "default",
        "uncalibrated",
        "ideal",
        "robuter",
        "increments",
        "synchro",
        "tricycle",
        "cycab",
        "cycab-uncalibrated",
    ];
    assert_eq!(names, presets);
}

#[test]
fn run_prints_seconds_with_three_decimals_a_tab_and_the_line() {
    let desk = Desk::new("0 @7 m 0.1\n0.5 GetTime\n2 nonsense\n");
    let printed = desk.prints("run a.script");
    let mut lines = Vec::new();
    for line in printed.lines() {
        let (seconds, line) = line.split_once('\t').unwrap();
        assert_eq!(seconds.split_once('.').unwrap().1.len(), 3, "{seconds}");
        lines.push((seconds.parse::<f64>().unwrap(), line));
    }
    assert!(lines.is_sorted_by(|a, b| a.0 <= b.0), "{printed}");
    let at = |begin: &str| {
        let found = lines.iter().find(|(_, line)| line.starts_with(begin));
        found
            .unwrap_or_else(|| panic!("no {begin} in\n{printed}"))
            .0
    };
    assert_eq!(lines[0].1, "! boot power-on");
    assert!(at("@7 OK") < 0.02);
    // When the reply's end arrives: 8 bytes up and 14 down take 2 ms at 115 200 baud.
    assert!((0.5..0.51).contains(&at("Time 0.50")));
    // 0.1 m with 0.5 m/s²: 2·√(0.1/0.5) s = 0.89 s.
    assert!((0.85..1.4).contains(&at("! move done ")));
    assert!((2.0..2.01).contains(&at("ERR syntax ")));
}

#[test]
fn run_ends_by_itself_only_when_the_motion_is_over() {
    let printed = Desk::new("0 m 0.5\n").prints("run a.script");
    assert!(
        printed.lines().last().unwrap().contains("! move done"),
        "{printed}"
    );
}

#[test]
fn run_ends_at_end() {
    let desk = Desk::new("0 m inf\n1.5 !end\n");
    desk.prints("run a.script --trace t.csv --trace-period 0.001");
    let rows = desk.trace("t.csv");
    assert_eq!(rows.len(), 1500);
    assert_eq!(rows[1499][0], "1.500000");
}

#[test]
fn a_push_moves_the_base() {
    let off = |script: &str| -> f64 {
        let desk = Desk::new(script);
        desk.prints("run a.script --trace t.csv");
        let rows = desk.trace("t.csv");
        let x = |row: &Vec<String>| row[1].parse::<f64>().unwrap();
        rows.iter().map(x).fold(0.0, f64::max)
    };
    assert!(off("0 GetTime\n0.5 !push 12 0 1\n2 !end\n") > 1e-3);
    assert!(off("0 GetTime\n2 !end\n") < 1e-6);
}

#[test]
fn run_does_not_read_standard_input() {
    let desk = Desk::new("0 GetTime\n");
    let mut command = hil_sim();
    command.current_dir(desk.0.path()).write_stdin("Version\n");
    let run = command.args(["run", "a.script"]).assert().success();
    assert!(!text(&run.get_output().stdout).contains("Version"));
}

#[test]
fn a_bad_line_of_a_script_is_told_with_file_and_line() {
    for (script, message) in [
        (
            "# one\n0 m 1\nx m 1\n",
            "a.script:3: a line begins with its time in seconds",
        ),
        ("1 m 1\n0.5 m 1\n", "a.script:2: time 0.5 is before"),
        ("0 m 1\n1 !push 1\n", "a.script:2: !push takes"),
        ("0 m 1\n\n1 !jump 3\n", "a.script:3: no directive !jump"),
        ("0\n", "a.script:1: nothing to send"),
        ("-1 m\n", "a.script:1: time -1 is negative"),
        ("0 !end\n1 m 1\n", "a.script:2: after !end"),
        ("# nothing\n", "a.script: the script is empty"),
    ] {
        let told = Desk::new(script).refuses("run a.script");
        assert!(
            told.starts_with(&format!("error: {message}")),
            "{script:?}: {told}"
        );
    }
}

#[test]
fn a_bad_script_prints_and_writes_nothing() {
    let desk = Desk::new("0 GetTime\n1 !jump\n");
    desk.hil_sim("run a.script --trace t.csv --plot p.svg")
        .code(2)
        .stdout("");
    assert!(!desk.path("t.csv").exists());
    assert!(!desk.path("p.svg").exists());
}

#[test]
fn a_typo_in_a_robot_is_told_with_file_and_line() {
    for (right, wrong, message) in [
        ("mass = 2.5", "mas = 2.5", "unknown field `mas`"),
        (
            "model = \"dynamic\"",
            "model = \"dinamic\"",
            "unknown variant `dinamic`",
        ),
        (
            "counter_bits = 16",
            "counter_bits = 24",
            "counter_bits must be 16 or 32",
        ),
        (
            "wheel_base = 0.2",
            "wheel_bass = 0.2",
            "no parameter `wheel_bass`",
        ),
        (
            "supply = 12.0",
            "supply = 900.0",
            "supply must be 3 to 60 V",
        ),
        ("voltage = 12.4", "voltage = twelve", ""),
        ("[physics.tyre]", "[physics.tire]", "unknown field `tire`"),
    ] {
        let desk = Desk::new("0 m 1\n");
        let robot = ROBOT.replacen(right, wrong, 1);
        desk.put("my.toml", &robot);
        let told = desk.refuses("run a.script --robot my.toml");
        let place = format!("error: my.toml:{}: ", line_of(&robot, wrong));
        assert!(
            told.starts_with(&place) && told.contains(message),
            "{wrong}: {told}"
        );
    }
}

#[test]
fn a_missing_key_of_a_robot_is_told_with_its_file() {
    let desk = Desk::new("0 m 1\n");
    desk.put(
        "my.toml",
        &ROBOT.replacen("torque_constant = 0.545\n", "", 1),
    );
    let told = desk.refuses("run a.script --robot my.toml");
    assert!(told.starts_with("error: my.toml:"), "{told}");
    assert!(told.contains("missing field `torque_constant`"), "{told}");
}

#[test]
fn physics_out_of_range_are_told_with_file_and_line() {
    let desk = Desk::new("0 m 1\n");
    let robot = ROBOT.replacen("mass = 2.5", "mass = -2.5", 1);
    desk.put("my.toml", &robot);
    let told = desk.refuses("run a.script --robot my.toml");
    assert!(told.contains("mass"), "{told}");
    let place = format!("error: my.toml:{}: ", line_of(&robot, "mass = -2.5"));
    assert!(told.starts_with(&place), "{told}");
}

#[test]
fn ones_own_robot_runs() {
    let desk = Desk::new("0 m 0.2\n");
    desk.put("my.toml", ROBOT);
    let own = desk.prints("run a.script --robot my.toml");
    assert_eq!(own, desk.prints("run a.script"));
}

#[test]
fn an_unknown_robot_is_refused_with_the_names_of_the_known() {
    let told = Desk::new("0 m 1\n").refuses("run a.script --robot nobody");
    for name in ["nobody", "default", "robuter", "increments", "cycab"] {
        assert!(told.contains(name), "{told}");
    }
}

#[test]
fn a_missing_file_is_told_with_its_name() {
    let desk = Desk::new("0 m 1\n");
    for (arguments, file) in [
        ("run none.script", "none.script"),
        ("run a.script --robot none.toml", "none.toml"),
        ("run a.script --trace none/t.csv", "none/t.csv"),
        ("run a.script --plot none/p.svg", "none/p.svg"),
        ("run a.script --plot none/p.png", "none/p.png"),
        ("plot none.csv -o p.svg", "none.csv"),
        ("replay none.csv", "none.csv"),
        ("drive --robot none.toml", "none.toml"),
    ] {
        let told = desk.refuses(arguments);
        assert!(told.starts_with("error: "), "{arguments}: {told}");
        assert!(told.contains(&format!("{file}: ")), "{arguments}: {told}");
    }
}

#[test]
fn a_trace_has_exactly_the_columns_that_are_promised() {
    let desk = Desk::new("0 m 0.3\n0 t 45\n");
    desk.prints("run a.script --trace t.csv");
    let text = text(&desk.read("t.csv"));
    let mut lines = text.lines();
    assert_eq!(lines.next().unwrap(), COLUMNS);
    let cells = COLUMNS.split(',').count();
    assert!(lines.all(|line| line.split(',').count() == cells));
}

#[test]
fn a_trace_is_written_every_hundredth_of_a_second() {
    let desk = Desk::new("0 m 0.1\n2 !end\n");
    desk.prints("run a.script --trace t.csv");
    assert_eq!(desk.trace("t.csv").len(), 200);
}

#[test]
fn the_period_of_a_trace_can_be_chosen() {
    let desk = Desk::new("0 m 0.1\n2 !end\n");
    for (period, rows) in [("0.001", 2000), ("0.02", 100), ("0.5", 4)] {
        desk.prints(&format!(
            "run a.script --trace t.csv --trace-period {period}"
        ));
        let trace = desk.trace("t.csv");
        assert_eq!(trace.len(), rows, "{period}");
        let t: Vec<f64> = trace.iter().map(|row| row[0].parse().unwrap()).collect();
        let period: f64 = period.parse().unwrap();
        assert!(
            t.windows(2)
                .all(|two| (two[1] - two[0] - period).abs() < 1e-9)
        );
    }
}

#[test]
fn a_period_that_is_none_is_refused() {
    let desk = Desk::new("0 m 0.1\n");
    for period in ["0", "-1", "inf", "nan", "often"] {
        let told = desk.refuses(&format!(
            "run a.script --trace t.csv --trace-period={period}"
        ));
        assert!(told.contains("--trace-period"), "{told}");
    }
}

#[test]
fn a_run_is_drawn_as_svg_and_as_png() {
    let desk = Desk::new("0 m 0.3\n0 t 45\n");
    desk.prints("run a.script --plot p.svg");
    assert_svg(&desk.path("p.svg"));
    desk.prints("run a.script --plot p.png");
    assert_png(&desk.path("p.png"));
}

#[test]
fn plot_draws_a_trace() {
    let desk = Desk::new("0 m 0.3\n0 t 45\n");
    desk.prints("run a.script --trace t.csv");
    desk.prints("plot t.csv -o p.svg");
    assert_svg(&desk.path("p.svg"));
    desk.prints("plot t.csv --output p.png");
    assert_png(&desk.path("p.png"));
}

fn assert_svg(path: &Path) {
    let picture = text(&fs::read(path).unwrap());
    assert!(picture.starts_with("<svg "), "{}", &picture[..80]);
    assert!(picture.trim_end().ends_with("</svg>"));
    assert!(picture.len() > 5000);
}

fn assert_png(path: &Path) {
    let picture = fs::read(path).unwrap();
    assert!(picture.starts_with(b"\x89PNG\r\n\x1a\n"));
    assert!(picture.len() > 5000);
}

#[test]
fn a_picture_of_an_unknown_kind_is_refused() {
    let desk = Desk::new("0 m 0.1\n");
    desk.prints("run a.script --trace t.csv");
    for picture in ["p.pdf", "p", "p.svg.txt"] {
        for command in ["run a.script --plot", "plot t.csv -o"] {
            let told = desk.refuses(&format!("{command} {picture}"));
            assert!(told.starts_with(&format!("error: {picture}: ")), "{told}");
            assert!(told.contains(".svg") && told.contains(".png"), "{told}");
            assert!(!desk.path(picture).exists());
        }
    }
}

#[test]
fn a_bad_trace_is_told_with_file_and_line() {
    let desk = Desk::new("0 m 0.1\n");
    desk.prints("run a.script --trace t.csv");
    let good = text(&desk.read("t.csv"));
    let fourth = good.lines().nth(3).unwrap();
    for (right, wrong, message) in [
        (
            "true_theta",
            "theta",
            "bad.csv:1: column `true_theta` is missing",
        ),
        (
            fourth,
            &fourth.replacen("ACCEL", "HALT", 1),
            "bad.csv:4: column `move_state`: `HALT`",
        ),
        (
            fourth,
            &fourth.replacen("0.0", "O.O", 1),
            "bad.csv:4: column `t`: `O.O",
        ),
        (fourth, "1,2,3", "bad.csv:4: 3 cells instead of 33"),
        (&*good, "", "bad.csv: the trace is empty"),
    ] {
        desk.put("bad.csv", &good.replacen(right, wrong, 1));
        let told = desk.refuses("plot bad.csv -o p.svg");
        assert!(told.starts_with(&format!("error: {message}")), "{told}");
    }
}

#[test]
fn replay_reports_on_a_log_and_tells_mistakes_with_file_and_line() {
    let desk = Desk::new("");
    desk.put("log.csv", "t,left,right\n0,0,0\n0.1,100,100\n0.2,100,100\n");
    assert!(!desk.prints("replay log.csv --out out.csv").is_empty());
    assert_eq!(desk.trace("out.csv").len(), 3);
    desk.put("bad.csv", "t,left,right\n0,0,0\n0.1,many,100\n");
    let told = desk.refuses("replay bad.csv");
    assert!(told.starts_with("error: bad.csv:3: "), "{told}");
    assert!(
        desk.refuses("replay log.csv --set wheel_bass=1")
            .contains("wheel_bass")
    );
    assert!(
        desk.refuses("replay log.csv --set wheel_base=99")
            .contains("0.02 to 5")
    );
}

#[test]
fn drive_refuses_a_port_that_others_can_reach() {
    let desk = Desk::new("");
    for address in ["0.0.0.0:0", "192.0.2.1:4000", "[::]:0", "8.8.8.8:80"] {
        let told = desk.refuses(&format!("drive --tcp {address}"));
        assert!(told.contains("not a loopback address"), "{told}");
    }
}

#[test]
fn drive_refuses_a_speed_that_is_none() {
    let desk = Desk::new("");
    for speed in ["0", "-1", "1001", "nan", "fast"] {
        desk.refuses(&format!("drive --speed={speed}"));
    }
}

#[test]
fn drive_has_one_far_end() {
    Desk::new("").refuses("drive --pty --tcp 127.0.0.1:0");
}
