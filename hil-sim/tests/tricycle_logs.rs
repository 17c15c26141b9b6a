//! The logs of a real tricycle (issue 6, 2): its nominal odometry, and what calibration makes of it.

mod desk;

use desk::{hil_sim, text};
use hil_sim::replay::{Log, replay};
use hil_sim::robot::Robot;
use hil_sim::statistics::CHI_SQUARE_3_99;
use std::path::{Path, PathBuf};

/// Both of these are calibrated on.
const CIRCULAR: [&str; 2] = [
    "tricyc-circular-140120211415-1",
    "tricyc-circular-140120211415-2",
];
const FREE: &str = "tricyc-free-140120211508-1";
const SQUARE: [&str; 2] = [
    "tricyc-square-140120211430-1",
    "tricyc-square-140120211430-2",
];

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

/// The README's table of nominal odometry: rows and errors (m, °) of each of the tricycle's logs.
fn table(folder: &Path) -> Vec<(String, usize, Vec<f64>)> {
    let text = std::fs::read_to_string(folder.join("README.md")).unwrap();
    let row = |line: &str| {
        let cells: Vec<_> = line.trim_matches('|').split('|').map(str::trim).collect();
        let errors = cells[2..].iter().map(|cell| cell.parse().unwrap());
        (
            cells[0].to_owned(),
            cells[1].parse().unwrap(),
            errors.collect(),
        )
    };
    let lines = text.lines().filter(|line| line.starts_with("| tricyc-"));
    lines.map(row).collect()
}

#[test]
fn the_real_logs_give_the_errors_of_the_table() {
    let Some(folder) = real_logs() else {
        return;
    };
    let robot = Robot::load("tricycle").unwrap();
    let table = table(&folder);
    assert_eq!(table.len(), 5);
    let mut worst = [0.0_f64; 4];
    for (name, rows, wanted) in table {
        let log = Log::load(&folder.join(format!("{name}.csv"))).unwrap();
        assert_eq!(log.len(), rows, "{name}");
        let replayed = replay(&log, &robot, &robot.params).unwrap();
        let errors = replayed.errors().unwrap();
        let is = [
            errors.max_position,
            errors.max_heading.to_degrees(),
            errors.final_position,
            errors.final_heading.to_degrees(),
        ];
        // Issue 6 asks for 1 mm and 0.1°; a heading of a hundred degrees in f32 increments is off by far less.
        for (i, tolerance) in [1e-3, 0.1, 1e-3, 0.1].into_iter().enumerate() {
            let error = (is[i] - wanted[i]).abs();
            worst[i] = worst[i].max(error);
            assert!(error < tolerance, "{name}: {is:?} instead of {wanted:?}");
        }
    }
    println!("differences from the table: {worst:?}");
}

/// A log that `calibrate` was told to test on.
#[derive(Debug)]
struct Tested {
    name: String,
    /// Its largest position error before and after, m.
    errors: [f64; 2],
    /// d² of its final pose.
    distance: f64,
}

/// Calibrated on both circular runs with a fix each second and these options: what becomes of the other logs.
fn tested(folder: &Path, changes: &[&str]) -> Vec<Tested> {
    let path = |name: &&str| folder.join(format!("{name}.csv"));
    let mut command = hil_sim();
    command.arg("calibrate").args(CIRCULAR.iter().map(path));
    command.args(["--robot", "tricycle", "--fix-every", "1"]);
    command.args(changes);
    command.arg("--test").arg(path(&FREE));
    command.args(SQUARE.iter().map(path));
    let printed = text(&command.assert().success().get_output().stdout);
    let (_, table) = printed.split_once("\ntested on").unwrap();
    let lines = table.lines().filter(|line| line.starts_with("tricyc-"));
    let tested: Vec<_> = lines
        .map(|line| {
            let words: Vec<_> = line.split_whitespace().collect();
            let number = |index: usize| words[index].parse().unwrap();
            Tested {
                name: words[0].to_owned(),
                errors: [number(1), number(2)],
                distance: number(9),
            }
        })
        .collect();
    println!("{changes:?}: {tested:.4?}");
    assert_eq!(tested.len(), 3);
    tested
}

#[test]
fn calibrated_on_circles_the_other_paths_are_as_good_as_by_a_batch_optimum() {
    let Some(folder) = real_logs() else {
        return;
    };
    let tested = tested(&folder, &[]);
    let [free, squares @ ..] = tested.as_slice() else {
        panic!("{tested:?}");
    };
    assert_eq!(free.name, FREE);
    // Nominal 0.608 m; the published batch optimum that was fitted to this very log has 0.070 m.
    assert!(free.errors[1] < 0.070, "{free:?}");
    // Of the set: its largest error falls to a quarter at most.
    let largest = |which: usize| {
        let errors = squares.iter().map(|tested| tested.errors[which]);
        errors.fold(0.0_f64, f64::max)
    };
    assert!(largest(1) < 0.25 * largest(0), "{squares:?}");
    // Of the first run alone, whose nominal error is small, it cannot: a batch optimum fitted to both squares leaves 0.137 m of its 0.453 m. By the circles
    // it falls to less than half, that of the second run to an eighth.
    for (square, part) in squares.iter().zip([0.5, 0.13]) {
        assert!(square.errors[1] < part * square.errors[0], "{square:?}");
    }
    // And it knows how wrong it is.
    for one in &tested {
        assert!(one.distance < CHI_SQUARE_3_99, "{one:?}");
    }
}

/// The preset's numbers come from these logs: no value of theirs may be a lucky one.
#[test]
fn half_and_twice_of_each_setting_are_nearly_as_good() {
    let Some(folder) = real_logs() else {
        return;
    };
    let params = Robot::load("tricycle").unwrap().params;
    let mut options = vec![
        ("--fix-position", String::new(), 0.01),
        ("--fix-heading", String::new(), 0.5),
    ];
    for name in [
        "noise_s",
        "noise_rot",
        "noise_drift",
        "noise_steer",
        "k_scale",
        "k_rot",
        "k_steer",
    ] {
        let id = vehicle_controller::params::Id::find(name.as_bytes()).unwrap();
        options.push(("--set", format!("{name}="), f64::from(params.get(id))));
    }
    for (option, name, value) in &options {
        for factor in [0.5, 2.0] {
            let change = format!("{name}{}", value * factor);
            let tested = tested(&folder, &[option, &change]);
            // The nearest of 18 neighbours has 0.0656 m, the farthest 0.0750 m.
            assert!(tested[0].errors[1] < 0.08, "{change}: {tested:?}");
            let largest = |which: usize| tested[1].errors[which].max(tested[2].errors[which]);
            assert!(largest(1) < 0.25 * largest(0), "{change}: {tested:?}");
            assert!(
                tested.iter().all(|one| one.distance < CHI_SQUARE_3_99),
                "{change}: {tested:?}"
            );
        }
    }
}
