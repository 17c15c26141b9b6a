//! The serial protocol: paths while many lines come, and while nobody listens.

mod common;

use common::paths::{assert_at, under_way};
use common::{PERIOD, Rig};
use vehicle_controller::time;

#[test]
fn rows_under_way_tell_what_has_been_passed_meanwhile() {
    let mut rig = Rig::new();
    for n in 1..=32 {
        rig.ok(&format!("Follow {}.5 0", n - 1));
    }
    rig.ok("Follow start");
    rig.run(1.0);
    rig.unsolicited();
    rig.listening = false;
    rig.ok_unheard("GetPath");
    // At 0.3 m/s, ten of them; what has been said waits to be heard.
    rig.run(32.0);
    rig.listening = true;
    rig.run(0.1);
    let lines = rig.lines();
    let rows: Vec<&String> = lines.iter().filter(|l| l.starts_with("~ ")).collect();
    assert_eq!(rows.len(), 32, "{lines:?}");
    for (number, row) in (1..).zip(rows) {
        let whole = format!("~ {number} {}.500000 0.000000 - -", number - 1);
        let passed = format!("~ {number} passed");
        assert!(*row == whole || *row == passed, "{row}");
        assert!(number < 30 || *row == whole, "{row}");
    }
}

#[test]
fn rows_under_way_keep_their_numbers_when_the_path_ends() {
    let mut rig = Rig::new();
    for n in 1..=32 {
        rig.ok(&format!("Follow {}.5 0", n - 1));
    }
    rig.ok("Follow start");
    rig.run(10.0);
    rig.unsolicited();
    rig.listening = false;
    rig.ok_unheard("GetPath");
    // It is obeyed at once, though the list is not through.
    rig.ok_unheard("Stop");
    rig.run(3.0);
    rig.listening = true;
    rig.run(0.1);
    let lines = rig.lines();
    let rows: Vec<&String> = lines.iter().filter(|l| l.starts_with("~ ")).collect();
    let first = 32 - rows.len() + 1;
    assert!(first > 2, "{lines:?}");
    for (number, row) in (first..).zip(rows) {
        let whole = format!("~ {number} {}.500000 0.000000 - -", number - 1);
        assert_eq!(*row, whole);
    }
    assert!(lines.contains(&"! path end stop".to_owned()), "{lines:?}");
}

/// How long a path takes while this is sent in every tick, s; every line is answered.
fn time_among(lines: &str) -> f64 {
    let mut rig = Rig::new();
    under_way(&mut rig);
    let (mut sent, mut ticks) = (0, 0);
    let mut heard = Vec::new();
    while !heard.contains(&"! path done".to_owned()) {
        rig.receive(lines.as_bytes());
        sent += lines.lines().count();
        rig.tick();
        heard.extend(rig.lines());
        ticks += 1;
        assert!(ticks < 60_000, "the path is not driven");
    }
    for _ in 0..1000 {
        rig.tick();
        heard.extend(rig.lines());
    }
    let postures = heard.iter().filter(|l| l.starts_with("! posture ")).count();
    assert_eq!(postures, 2, "{lines:?}");
    let replies = heard.iter().filter(|line| !line.starts_with("! "));
    assert_eq!(replies.count(), sent, "{lines:?}");
    assert!(
        lines.is_empty()
            || heard
                .iter()
                .any(|line| !line.starts_with("ERR busy") && !line.starts_with('!')),
        "{lines:?}"
    );
    assert_at(&mut rig, 0.0, 1.0, 180.0);
    ticks as f64 * f64::from(time::seconds(PERIOD))
}

#[test]
fn a_flood_of_lines_keeps_no_path_from_being_driven() {
    let alone = time_among("");
    for lines in [
        "GetTime\n",
        "GetEstPos\nGetEstPos\nGetEstPos\nGetEstPos\n",
        "Hello\nm 1 -1\nt 1 1 -1\nGoTo\n",
        "SetParam gate 25\n",
        "SetParam gate 25\nSetParam gate 25\nSetParam gate 25\nSetParam gate 25\n",
        "Stream 0\nSetParam deadman 1\nGetPath 1\nSetParam corner 0.1\n",
    ] {
        let time = time_among(lines);
        // Each of some ten orders may be a few ticks late, and a corner or an approach a little different.
        assert!(time < alone + 0.5, "{lines:?}: {time} s, not {alone} s");
    }
}

#[test]
fn fixes_in_every_tick_keep_no_path_from_being_driven() {
    let mut rig = Rig::noiseless();
    under_way(&mut rig);
    let mut heard = Vec::new();
    for _ in 0..30_000 {
        let pose = rig.estimate().pose;
        let (x, y, theta) = (pose.x, pose.y, pose.theta.to_degrees());
        rig.receive(format!("ObservePos {x:.6} {y:.6} {theta:.5} 1 0 0 1 0 100\n").as_bytes());
        rig.tick();
        heard.extend(rig.lines());
        if heard.last().is_some_and(|line| line == "! path done") {
            break;
        }
    }
    heard.retain(|line| line.starts_with("! "));
    assert_eq!(heard, ["! posture 1", "! posture 2", "! path done"]);
    let replies = rig.ask_all(b"", 0);
    assert!(replies.is_empty());
}
