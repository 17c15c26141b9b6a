//! Ten bases, each with a driver of its own.

use crate::alone::{alone, left_out};
use crate::peer::{Peer, number, numbers};
use crate::stage::Running;
use assert_cmd::cargo::cargo_bin;
use std::process::Command;

const BASES: usize = 10;

#[test]
fn each_of_ten_drives_its_own_square() {
    alone("fleet::each_of_ten_drives_its_own_square", || {
        // One more, that nobody tells anything.
        let mut script = Command::new(concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/examples/ten_bases.sh"
        ));
        script.arg("--localhost-only");
        script.env("BASES", (BASES + 1).to_string());
        script.env("BRIDGE", cargo_bin!("base-bridge"));
        let fleet = Running(script.spawn().unwrap());
        let mut driver = Peer::script("fleet.py", &[&BASES.to_string()]);
        let answer = driver.ask("drive");
        assert!(fleet.terminate().success());
        let idle = numbers(&answer, &format!("/bases/{BASES}/at"));
        // Its loop holds it where it is, and its encoders' steps are a tenth of a millimetre.
        assert!(idle.iter().all(|at| at.abs() < 1e-3), "{idle:?}");
        for base in 1..=BASES {
            let of = |what: &str| format!("/bases/{}/{what}", base - 1);
            assert_eq!(number(&answer, &of("readers")), 1.0, "r{base}");
            let side = 0.2 + 0.04 * base as f64;
            let aside = if base % 2 == 0 { side } else { -side };
            let square = [[side, 0.0], [side, aside], [0.0, aside], [0.0, 0.0]];
            for (corner, expected) in square.into_iter().enumerate() {
                let reached = numbers(&answer, &of(&format!("corners/{corner}")));
                // It turns and stops by what comes at 50 Hz over a network.
                let off = (reached[0] - expected[0]).hypot(reached[1] - expected[1]);
                assert!(off < 0.03, "r{base} at {reached:?}, not {expected:?}");
            }
        }
    });
}

/// Says what a launch file would start, to whom ROS is not at hand: what it takes from `launch` is two names.
const LAUNCHED: &str = r#"
import json, runpy, sys, types
launch, actions = types.ModuleType("launch"), types.ModuleType("launch.actions")
launch.LaunchDescription = list
actions.ExecuteProcess = lambda cmd, **others: cmd
sys.modules.update({"launch": launch, "launch.actions": actions})
print(json.dumps(runpy.run_path(sys.argv[1])["generate_launch_description"]()))
"#;

#[test]
fn a_launch_file_starts_the_same() {
    let Some(python) = std::env::var_os("ROS_PYTHON") else {
        return left_out("no Python in ROS_PYTHON (`cargo xtask test` makes one)");
    };
    let examples = concat!(env!("CARGO_MANIFEST_DIR"), "/examples");
    let launch = Command::new(python)
        .args(["-B", "-c", LAUNCHED])
        .arg(format!("{examples}/ten_bases.launch.py"))
        .env("BRIDGE", "echo")
        .output()
        .unwrap();
    let launched: Vec<Vec<String>> = serde_json::from_slice(&launch.stdout).unwrap();
    assert_eq!(launched.len(), BASES);
    let script = Command::new(format!("{examples}/ten_bases.sh"))
        .env("BRIDGE", "echo")
        .output()
        .unwrap();
    let script = String::from_utf8(script.stdout).unwrap();
    for command in launched {
        let said = command[1..]
            .join(" ")
            .replace(examples, "base-bridge/examples");
        assert!(
            script.lines().any(|line| line.trim() == said),
            "{said}: {script}"
        );
        let accepted = Command::new(cargo_bin!("base-bridge"))
            .args(&command[1..])
            .arg("--list-params")
            .output()
            .unwrap();
        assert!(accepted.status.success(), "{accepted:?}");
    }
}
