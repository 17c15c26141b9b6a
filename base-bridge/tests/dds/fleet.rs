//! Ten bases, each with a driver of its own.

use crate::alone::alone;
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
