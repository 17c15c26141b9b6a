//! Replay: what the estimator makes of recorded counts, real ones and such as have a closed form, and the command around it.

use assert_cmd::assert::Assert;
use hil_sim::replay::{Errors, Log, replay};
use hil_sim::robot::Robot;
use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// Metres per count and wheel base of the robot `default`.
const COUNT: f64 = PI * 0.084 / 2796.8;
const BASE: f64 = 0.2;

/// The folder of real logs, if it is here.
fn real_logs() -> Option<PathBuf> {
    let shared = std::env::var_os("VEHICLE_CONTROLLER_SHARED").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data"),
        PathBuf::from,
    );
    let folder = shared.join("odometry");
    if folder.join("README.md").is_file() {
        return Some(folder);
    }
    println!(
        "LEFT OUT: the test on real logs, as there is no {}",
        folder.display()
    );
    None
}

/// The README's table of nominal odometry: rows and errors (m, °) of each differential log.
fn table(folder: &Path) -> BTreeMap<String, (usize, [f64; 4])> {
    let text = std::fs::read_to_string(folder.join("README.md")).unwrap();
    let mut table = BTreeMap::new();
    for line in text.lines().filter(|line| line.starts_with("| diff-")) {
        let cells: Vec<_> = line.trim_matches('|').split('|').map(str::trim).collect();
        let [name, rows, errors @ ..] = cells.as_slice() else {
            panic!("{line}");
        };
        let errors: Vec<f64> = errors.iter().map(|cell| cell.parse().unwrap()).collect();
        let row = (rows.parse().unwrap(), errors.try_into().unwrap());
        table.insert((*name).to_owned(), row);
    }
    table
}

#[test]
fn the_real_logs_give_the_errors_of_the_table() {
    let Some(folder) = real_logs() else {
        return;
    };
    let robot = Robot::load("default").unwrap();
    let table = table(&folder);
    assert_eq!(table.len(), 16);
    let mut worst = [0.0_f64; 4];
    for (name, (rows, wanted)) in table {
        let log = Log::load(&folder.join(format!("{name}.csv"))).unwrap();
        assert_eq!(log.len(), rows, "{name}");
        let Errors {
            max_position,
            max_heading,
            final_position,
            final_heading,
        } = replay(&log, &robot, &robot.params)
            .unwrap()
            .errors()
            .unwrap();
        let is = [
            max_position,
            max_heading.to_degrees(),
            final_position,
            final_heading.to_degrees(),
        ];
        // 0.5 mm and 0.05°; the table itself is rounded to 0.05 mm and 0.0005°.
        for (i, tolerance) in [5e-4, 0.05, 5e-4, 0.05].into_iter().enumerate() {
            let error = (is[i] - wanted[i]).abs();
            worst[i] = worst[i].max(error);
            assert!(error < tolerance, "{name}: {is:?} instead of {wanted:?}");
        }
    }
    println!("differences from the table: {worst:?}");
}

/// A folder with files of our own.
struct Folder(TempDir);

impl Folder {
    fn new() -> Self {
        Self(TempDir::new().unwrap())
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn file(&self, name: &str, text: &str) -> PathBuf {
        let path = self.path(name);
        std::fs::write(&path, text).unwrap();
        path
    }
}

fn hil_sim(arguments: &[&str]) -> Assert {
    assert_cmd::Command::new(env!("CARGO_BIN_EXE_hil-sim"))
        .arg("replay")
        .args(arguments)
        .assert()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

/// A log at 20 Hz of wheels that roll these metres in `rows` rows after the first, with the true pose of each by `truth` (0 to 1).
fn log(rows: u32, rolled: [f64; 2], truth: Option<&dyn Fn(f64) -> [f64; 3]>) -> String {
    let mut text = String::from(if truth.is_some() {
        "t,left,right,x,y,theta\n"
    } else {
        "t,left,right\n"
    });
    let mut last = [0_i64; 2];
    for row in 0..=rows {
        let part = f64::from(row) / f64::from(rows);
        let counts = rolled.map(|metres| (metres * part / COUNT).round() as i64);
        write!(
            text,
            "{:.2},{},{}",
            f64::from(row) * 0.05,
            counts[0] - last[0],
            counts[1] - last[1]
        )
        .unwrap();
        last = counts;
        if let Some(truth) = truth {
            let [x, y, theta] = truth(part);
            write!(text, ",{x:.9},{y:.9},{theta:.9}").unwrap();
        }
        text.push('\n');
    }
    text
}

/// The last row of a CSV file that `replay --out` wrote, by column, and how many rows there are.
fn last_row(path: &Path) -> (usize, BTreeMap<String, f64>) {
    let mut reader = csv::Reader::from_path(path).unwrap();
    let names: Vec<_> = reader
        .headers()
        .unwrap()
        .iter()
        .map(str::to_owned)
        .collect();
    let rows: Vec<_> = reader.records().map(Result::unwrap).collect();
    let values = rows[rows.len() - 1]
        .iter()
        .map(|word| word.parse().unwrap());
    (rows.len(), names.into_iter().zip(values).collect())
}

/// What `replay --out` writes of this log.
fn replayed(log: &str, more: &[&str]) -> (usize, BTreeMap<String, f64>) {
    let folder = Folder::new();
    let (log, out) = (folder.file("log.csv", log), folder.path("out.csv"));
    let mut arguments = vec![log.to_str().unwrap(), "--out", out.to_str().unwrap()];
    arguments.extend(more);
    hil_sim(&arguments).success();
    last_row(&out)
}

#[test]
fn a_straight_log_ends_on_the_axis_with_the_closed_forms_covariance() {
    let (rows, last) = replayed(&log(100, [2.0, 2.0], None), &[]);
    assert_eq!(rows, 101);
    // Half a count of rounding.
    assert!((last["x"] - 2.0).abs() < COUNT, "{last:?}");
    assert_eq!([last["y"], last["theta"]], [0.0, 0.0]);
    // κ L + K L² and κ L³/3 + K L⁴/4 with the default κ of (0.1°)²/m and K of (0.2°/m)²; the play takes a count of it.
    let degree = 1_f64.to_radians();
    let (kappa, k) = (0.01 * degree * degree, 0.04 * degree * degree);
    let ctt = kappa * 2.0 + k * 4.0;
    assert!((last["ctt"] / ctt - 1.0).abs() < 1e-3, "{last:?}");
    let cyy = kappa * 8.0 / 3.0 + k * 16.0 / 4.0;
    assert!((last["cyy"] / cyy - 1.0).abs() < 1e-3, "{last:?}");
    assert!((last["t"] - 5.0).abs() < 1e-9);
}

/// Wheels of a quarter circle of 1 m to the left.
const QUARTER: [f64; 2] = [0.5 * PI * (1.0 - 0.5 * BASE), 0.5 * PI * (1.0 + 0.5 * BASE)];

#[test]
fn a_quarter_circle_ends_beside_its_centre() {
    let (_, last) = replayed(&log(100, QUARTER, None), &[]);
    // Half a count of either wheel: K/w is 0.0005 rad.
    assert!((last["theta"] - 0.5 * PI).abs() < COUNT / BASE, "{last:?}");
    assert!(
        (last["x"] - 1.0).abs() < 1e-3 && (last["y"] - 1.0).abs() < 1e-3,
        "{last:?}"
    );
}

#[test]
fn the_errors_are_those_against_the_truth_of_the_log() {
    // The truth begins elsewhere, at another heading, and goes half the quarter circle further than its counts say.
    let (x0, y0, heading) = (3.0, -2.0, 0.5 * PI);
    let arc = |part: f64| {
        let angle = 0.5 * PI * part;
        // Turned by 90°: ahead is +y, aside is −x.
        [
            x0 - (1.0 - angle.cos()),
            y0 + angle.sin(),
            heading + angle + 0.1 * part,
        ]
    };
    let folder = Folder::new();
    let path = folder.file("arc.csv", &log(100, QUARTER, Some(&arc)));
    let out = folder.path("out.csv");
    let done = hil_sim(&[path.to_str().unwrap(), "--out", out.to_str().unwrap()]).success();
    let (rows, last) = last_row(&out);
    assert_eq!(rows, 101);
    assert!(last["position_error"] < 1e-3, "{last:?}");
    assert!(
        (last["heading_error"] - 0.1).abs() < COUNT / BASE,
        "{last:?}"
    );
    // 0.1 rad is 5.73°.
    let report = text(&done.get_output().stdout);
    assert!(report.contains("arc: 101 rows, 5.00 s"), "{report}");
    assert!(
        report.contains("deg   final 0.000") && report.contains(" 5.7"),
        "{report}"
    );
}

#[test]
fn columns_may_come_in_any_order_and_among_others() {
    let plain = "t,left,right\n0,0,0\n0.05,100,90\n0.1,120,140\n";
    let shuffled = "right,note,t , left\n0,a,0,0\n90,b,0.05,100\n 140 ,c,0.1,120\n";
    assert_eq!(replayed(plain, &[]), replayed(shuffled, &[]));
}

#[test]
fn set_changes_a_parameter_for_this_replay() {
    let (_, wide) = replayed(&log(50, QUARTER, None), &["--set", "wheel_base=0.4"]);
    assert!((wide["theta"] - 0.25 * PI).abs() < COUNT / BASE, "{wide:?}");
    let set = [
        "--set",
        "left_diameter=0.042",
        "--set",
        "RIGHT_DIAMETER = 0.042",
    ];
    let (_, small) = replayed(&log(50, [2.0, 2.0], None), &set);
    assert!((small["x"] - 1.0).abs() < COUNT, "{small:?}");
}

#[test]
fn a_wrong_setting_is_told_with_its_text() {
    let folder = Folder::new();
    let path = folder.file("log.csv", &log(5, [0.1, 0.1], None));
    for (setting, why) in [
        ("wheel_bass=0.2", "wheel_bass"),
        ("wheel_base", "name=value"),
        ("wheel_base=wide", "`wide` is not a number"),
        ("wheel_base=-1", "0.02 to 5"),
        ("wheel_base=NaN", "0.02 to 5"),
    ] {
        let done = hil_sim(&[path.to_str().unwrap(), "--set", setting]).code(2);
        let message = text(&done.get_output().stderr);
        assert!(
            message.contains(setting) && message.contains(why),
            "{message}"
        );
    }
}

#[test]
fn a_wrong_log_ends_with_status_2_and_says_where() {
    let folder = Folder::new();
    let mut failures = Vec::new();
    for (content, line, why) in [
        ("time,left,right\n0,0,0\n", 1, "`t`"),
        ("t,left\n0,0\n", 1, "`right`"),
        ("t,left,right,x\n0,0,0,0\n", 1, "all or none"),
        (
            "t,left,right\n0,0,0\n0.05,1,one\n",
            3,
            "`one` is not a number",
        ),
        ("t,left,right\n0,0,0\n0.05,1,\n", 3, "not a number"),
        ("t,left,right\n0,0,0\n0.05,1,1.5\n", 3, "not a count"),
        ("t,left,right\n0,0,0\n0.05,1,1e12\n", 3, "not a count"),
        ("t,left,right\n0,0,0\ninf,1,1\n", 3, "not a number"),
        ("t,left,right\n0,0,0\n\n0.1,1,1\n0.05,1,1\n", 5, "backwards"),
        ("t,left,right\n0,0,0\n0.05,1\n", 3, ""),
        ("t,left,right\n0,0,0\n0.05,1,2,3\n", 3, ""),
        ("", 1, ""),
    ] {
        let path = folder.file("wrong.csv", content);
        let done = hil_sim(&[path.to_str().unwrap()]).code(2);
        let message = text(&done.get_output().stderr);
        let place = format!("{}:{line}: ", path.display());
        if !(message.contains(&place) && message.contains(why)) {
            failures.push((content, line, message));
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
}

#[test]
fn a_log_without_rows_ends_with_status_2_and_its_name() {
    let folder = Folder::new();
    let path = folder.file("empty.csv", "t,left,right\n");
    let done = hil_sim(&[path.to_str().unwrap()]).code(2);
    assert!(text(&done.get_output().stderr).contains("empty.csv: "));
}

#[test]
fn a_log_that_is_not_there_ends_with_status_2_and_its_name() {
    let done = hil_sim(&["no/such/log.csv"]).code(2);
    assert!(text(&done.get_output().stderr).contains("no/such/log.csv"));
}

#[test]
fn counts_of_more_than_a_16_bit_counter_can_show_are_not_silently_lost() {
    // A row of 40 000 counts is 3.77 m: the log is coarse, not wrong.
    let folder = Folder::new();
    let path = folder.file("coarse.csv", "t,left,right\n0,0,0\n5,40000,40000\n");
    let out = folder.path("out.csv");
    let done = hil_sim(&[path.to_str().unwrap(), "--out", out.to_str().unwrap()]);
    if done.get_output().status.success() {
        let (_, last) = last_row(&out);
        assert!((last["x"] - 40_000.0 * COUNT).abs() < 1e-4, "{last:?}");
    } else {
        let message = text(&done.get_output().stderr);
        assert!(message.contains("coarse.csv:3: "), "{message}");
    }
}

#[test]
fn plot_writes_svg_and_png() {
    let folder = Folder::new();
    let arc = |part: f64| [part, part, 0.5 * PI * part];
    let with = folder.file("with.csv", &log(100, QUARTER, Some(&arc)));
    let without = folder.file("without.csv", &log(100, [1.0, 1.0], None));
    for (name, start) in [
        ("p.svg", &b"<svg"[..]),
        ("p.png", &b"\x89PNG\r\n\x1a\n"[..]),
    ] {
        let picture = folder.path(name);
        hil_sim(&[
            with.to_str().unwrap(),
            without.to_str().unwrap(),
            "--plot",
            picture.to_str().unwrap(),
        ])
        .success();
        let bytes = std::fs::read(&picture).unwrap();
        assert!(
            bytes.starts_with(start) && bytes.len() > 1000,
            "{name}: {} bytes",
            bytes.len()
        );
    }
}

#[test]
fn out_is_for_one_log_and_a_picture_of_another_kind_is_refused() {
    let folder = Folder::new();
    let path = folder.file("log.csv", &log(5, [0.1, 0.1], None));
    let path = path.to_str().unwrap();
    let (out, picture) = (folder.path("o.csv"), folder.path("p.gif"));
    hil_sim(&[path, path, "--out", out.to_str().unwrap()]).code(2);
    assert!(!out.exists());
    hil_sim(&[path, "--plot", picture.to_str().unwrap()]).code(2);
    assert!(!picture.exists());
}
