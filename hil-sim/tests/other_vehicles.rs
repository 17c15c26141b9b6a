//! The tools on vehicles that are no differential drives: what they show of them, and what they are not for.

mod desk;

use desk::{Desk, text};

/// Ahead, and to the left.
const BEND: &str = "0 m 1 0.3\n0.5 t 20\n";

#[test]
fn what_is_for_differential_drives_says_so() {
    let desk = Desk::new(BEND);
    for (robot, vehicle) in [
        ("synchro", "a synchro drive"),
        ("tricycle", "a tricycle"),
        ("cycab", "a car"),
    ] {
        for command in ["umbmark --runs 1", "consistency --runs 2 --seconds 2"] {
            let told = desk.refuses(&format!("{command} --robot {robot}"));
            assert!(
                told.contains("is for differential drives") && told.contains(vehicle),
                "{command}: {told}"
            );
        }
    }
}

#[test]
fn a_trace_has_the_steering_of_a_vehicle_that_steers() {
    let desk = Desk::new(BEND);
    let header = |robot: &str| {
        desk.prints(&format!("run a.script --robot {robot} --trace t.csv"));
        let trace = text(&desk.read("t.csv"));
        trace.lines().next().unwrap().to_owned()
    };
    assert!(header("default").ends_with(",battery,fault"));
    assert!(header("synchro").ends_with(",battery,fault"));
    assert!(
        header("cycab").ends_with(",fault,steer,true_steer,front_left_count,front_right_count")
    );
    assert!(header("tricycle").ends_with(",fault,steer,true_steer"));
    // The wheel turned to the left, and its potentiometer said so, to the 2 % of its spread and a step of the converter.
    let column = |row: &Vec<String>, index: usize| row[index].parse::<f64>().unwrap();
    let rows = desk.trace("t.csv");
    let steers = |index| {
        rows.iter()
            .map(|row| column(row, index))
            .fold(0.0, f64::max)
    };
    let (measured, truth) = (steers(33), steers(34));
    assert!(truth > 0.05, "{truth}");
    assert!(
        (measured - truth).abs() < 0.02 * truth + 0.002,
        "{measured} {truth}"
    );
    // It can be drawn.
    desk.prints("plot t.csv -o t.svg");
}

/// A script's log knows how the vehicle was steered: odometry from it is where the base believed to be.
#[test]
fn journeys_of_scripts_know_the_steering() {
    let desk = Desk::new(BEND);
    for robot in ["synchro", "tricycle", "cycab"] {
        let told = desk.prints(&format!(
            "propagate a.script --robot {robot} --particles 2000"
        ));
        let mean = |name: &str| -> Vec<f64> {
            let line = told.lines().find(|line| line.trim().starts_with(name));
            let words = line.unwrap().split_whitespace();
            words.filter_map(|word| word.parse().ok()).collect()
        };
        let (linear, particles) = (mean("linear"), mean("particles"));
        // It went ahead and turned to the left; the particles, too.
        assert!(linear[0] > 0.9 && linear[2] > 15.0, "{told}");
        assert!((particles[0] - linear[0]).abs() < 0.02, "{told}");
        assert!((particles[1] - linear[1]).abs() < 0.02, "{told}");
        assert!((particles[2] - linear[2]).abs() < 1.0, "{told}");
    }
}

#[test]
fn a_calibration_draws_the_gains_of_the_vehicle() {
    let desk = Desk::new(BEND);
    for (robot, name) in [
        ("synchro", "turn_drift"),
        ("tricycle", "steer_offset"),
        ("cycab", "steer_offset"),
    ] {
        desk.prints(&format!(
            "calibrate a.script --robot {robot} --fix-every 1 --plot p.svg"
        ));
        assert!(text(&desk.read("p.svg")).contains(name), "{robot}");
    }
}
