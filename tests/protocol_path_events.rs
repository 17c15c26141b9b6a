//! The serial protocol: how paths and chases go and end, what is told of it, and what is left in the queue.

mod common;

use common::Rig;
use common::paths::{assert_at, said, under_way, until_rest};

#[test]
fn a_path_tells_each_posture_and_its_end_and_nothing_of_its_own_moves() {
    let mut rig = Rig::new();
    rig.unsolicited();
    under_way(&mut rig);
    assert_eq!(
        until_rest(&mut rig),
        ["! posture 1", "! posture 2", "! path done"]
    );
    assert_at(&mut rig, 0.0, 1.0, 180.0);
    assert_eq!(rig.ask("GetPath"), "Path 0 idle");
    // Later ones are told again.
    rig.ok("m 0.1");
    rig.ok("t 10");
    rig.run(2.0);
    let events = rig.unsolicited();
    assert_eq!(events.len(), 2, "{events:?}");
    assert!(events.iter().any(|line| line.starts_with("! move done ")));
    assert!(events.iter().any(|line| line.starts_with("! turn done ")));
}

#[test]
fn go_to_goes_there_from_anywhere() {
    let mut rig = Rig::new();
    rig.unsolicited();
    for (line, [x, y, theta]) in [
        ("GoTo 0 0", [0.0, 0.0, 0.0]),
        ("GoTo 0 0 45", [0.0, 0.0, 45.0]),
        ("GoTo -0.5 0 -90", [-0.5, 0.0, -90.0]),
        ("goto -0.5, -0.3, 270", [-0.5, -0.3, -90.0]),
        ("GoTo 0.2 -0.3", [0.2, -0.3, 0.0]),
        ("GoTo 0.2 -0.3 -", [0.2, -0.3, 0.0]),
    ] {
        rig.ok(line);
        assert_eq!(until_rest(&mut rig), ["! path done"], "{line}");
        assert_at(&mut rig, x, y, theta);
    }
}

#[test]
fn go_to_forgets_the_queue_and_brings_a_moving_base_to_rest_first() {
    let mut rig = Rig::new();
    rig.ok("Follow 5 5");
    rig.ok("m inf 0.3");
    rig.run(1.0);
    rig.unsolicited();
    rig.ok("GoTo 0 0 0");
    assert_eq!(rig.ask("GetPath"), "Path 1 path");
    assert_eq!(
        rig.unsolicited(),
        ["~ 1 0.000000 0.000000 0.00000 -"],
        "a move that is replaced is no path that ends"
    );
    assert_eq!(until_rest(&mut rig), ["! path done"]);
    assert_at(&mut rig, 0.0, 0.0, 0.0);
}

#[test]
fn what_ends_a_path_is_answered_first_and_then_told() {
    for (line, reason, after) in [
        ("Stop", "stop", "Path 3 idle"),
        ("m 0.1", "move", "Path 3 idle"),
        ("m 0 0", "move", "Path 3 idle"),
        ("t 10", "turn", "Path 3 idle"),
        ("Disable", "stop", "Path 3 idle"),
        ("Follow clear", "stop", "Path 0 idle"),
        ("GoTo 0 0", "replaced", "Path 1 path"),
        ("Chase 0 0", "replaced", "Path 3 chase"),
    ] {
        let mut rig = Rig::new();
        under_way(&mut rig);
        let lines = said(&mut rig, line);
        assert_eq!(lines, ["OK", &format!("! path end {reason}")], "{line}");
        assert_eq!(rig.ask("GetPath"), after, "{line}");
    }
}

#[test]
fn a_start_while_it_follows_changes_nothing() {
    let mut rig = Rig::new();
    under_way(&mut rig);
    assert_eq!(said(&mut rig, "Follow start"), ["OK"]);
    assert_eq!(rig.ask("GetPath"), "Path 3 path");
}

#[test]
fn a_stop_is_told_once_the_base_rests_and_the_end_at_once() {
    for (line, stop) in [
        ("Stop", "! stop command"),
        ("Disable", "! stop disable"),
        ("Follow clear", "! stop command"),
    ] {
        let mut rig = Rig::new();
        under_way(&mut rig);
        assert_eq!(said(&mut rig, line), ["OK", "! path end stop"], "{line}");
        assert!(rig.snapshot().is_moving());
        assert_eq!(until_rest(&mut rig), [stop], "{line}");
    }
}

#[test]
fn what_is_left_of_a_path_can_be_gone_on_with() {
    for line in ["Stop", "m 0 0.1", "EStop", "Disable"] {
        let mut rig = Rig::new();
        under_way(&mut rig);
        rig.run(4.0);
        assert_eq!(rig.unsolicited(), ["! posture 1"]);
        rig.ok(line);
        rig.run(2.0);
        rig.unsolicited();
        assert_eq!(rig.ask("GetPath"), "Path 2 idle", "{line}");
        // What is left is counted from 1 again.
        assert_eq!(
            rig.unsolicited(),
            [
                "~ 1 1.000000 1.000000 - -",
                "~ 2 0.000000 1.000000 180.00000 -"
            ]
        );
        match line {
            "EStop" => rig.ok("ClearFault"),
            "Disable" => rig.ok("Enable"),
            _ => {}
        }
        rig.run(1.0);
        assert!(!rig.snapshot().is_moving(), "{line}");
        rig.ok("Follow start");
        assert_eq!(
            until_rest(&mut rig),
            ["! posture 1", "! path done"],
            "{line}"
        );
        assert_at(&mut rig, 0.0, 1.0, 180.0);
    }
}

#[test]
fn a_fault_ends_a_path_and_a_chase() {
    for chases in [false, true] {
        let mut rig = Rig::new();
        let errand = if chases { "chase" } else { "path" };
        if chases {
            rig.ok("Chase 2 0");
            rig.run(0.5);
            rig.unsolicited();
        } else {
            under_way(&mut rig);
        }
        rig.broken.set(true);
        rig.run(0.1);
        let lines = rig.lines();
        assert_eq!(lines.len(), 2, "{lines:?}");
        assert!(lines[0].starts_with("! fault "), "{lines:?}");
        assert_eq!(lines[1], format!("! {errand} end fault"));
        rig.broken.set(false);
        rig.run(0.1);
        rig.ok("ClearFault");
        rig.run(1.0);
        assert!(!rig.snapshot().is_moving());
        assert!(rig.unsolicited().is_empty());
    }
}

#[test]
fn an_emergency_stop_ends_a_path_at_once() {
    let mut rig = Rig::new();
    under_way(&mut rig);
    let lines = said(&mut rig, "EStop");
    // The motors are off in the next tick, before anything is said.
    assert_eq!(lines, ["! path end fault", "! fault estop", "OK"]);
    assert_eq!(rig.ask("GetPath"), "Path 3 idle");
}

#[test]
fn the_move_that_ends_a_path_is_told_when_it_is_done() {
    for end in ["m 0.1", "m 0"] {
        let mut rig = Rig::new();
        under_way(&mut rig);
        rig.ok(end);
        rig.run(3.0);
        let events = rig.unsolicited();
        assert_eq!(events[0], "! path end move", "{end}");
        let done = events
            .iter()
            .filter(|line| line.starts_with("! move done "))
            .count();
        assert_eq!((events.len(), done), (2, 1), "{end}: {events:?}");
    }
}

#[test]
fn a_move_right_behind_a_go_to_is_told_when_it_is_done() {
    let mut rig = Rig::new();
    under_way(&mut rig);
    rig.ok("m 0 0");
    rig.run(2.0);
    rig.unsolicited();
    // All are read at once; where it stands, the move is over in the next tick.
    let replies = rig.ask_all(b"GoTo 3 0\nGoTo 2 0\nm 0 0.1\n", 3);
    assert_eq!(replies, ["OK"; 3]);
    rig.run(1.0);
    let events = rig.unsolicited();
    assert_eq!(events.len(), 3, "{events:?}");
    assert_eq!(events[..2], ["! path end replaced", "! path end move"]);
    assert!(events[2].starts_with("! move done "), "{events:?}");
}

#[test]
fn each_path_that_is_replaced_is_told() {
    let mut rig = Rig::new();
    under_way(&mut rig);
    let replies = rig.ask_all(b"GoTo 1 0\nChase 2 0\nGoTo 3 0\nm 0 0\n", 4);
    assert_eq!(replies, ["OK"; 4]);
    rig.run(0.1);
    assert_eq!(
        rig.unsolicited(),
        [
            "! path end replaced",
            "! path end replaced",
            "! chase end replaced",
            "! path end move"
        ]
    );
}

#[test]
fn what_has_happened_is_told_before_the_replies_of_later_lines() {
    let arrival = |wait: u32, line: &str| {
        let mut rig = Rig::new();
        rig.unsolicited();
        rig.ok("GoTo 0.05 0");
        for _ in 0..wait {
            rig.tick();
        }
        assert!(rig.unsolicited().is_empty());
        // It comes in the middle of a period, and is read after the next tick.
        rig.receive(format!("{line}\n").as_bytes());
        rig.run(0.01);
        rig.lines()
    };
    // It takes so many ms.
    let mut rig = Rig::new();
    rig.ok("GoTo 0.05 0");
    rig.unsolicited();
    let mut takes = 0;
    while rig.unsolicited().is_empty() {
        rig.tick();
        takes += 1;
    }
    for wait in takes - 5..takes {
        let lines = arrival(wait, "GoTo 1 0");
        assert!(
            lines == ["OK", "! path end replaced"] || lines == ["! path done", "OK"],
            "{wait} of {takes} ms: {lines:?}"
        );
    }
}

#[test]
fn postures_can_be_appended_on_the_way() {
    let mut rig = Rig::new();
    rig.ok("Follow 1 0");
    rig.ok("Follow start");
    rig.run(1.0);
    rig.ok("Follow 1 1");
    rig.ok("Follow 2 1 - 0.1");
    rig.unsolicited();
    assert_eq!(rig.ask("GetPath"), "Path 3 path");
    rig.run(4.0);
    let lines = rig.unsolicited();
    assert_eq!(lines.last().map(String::as_str), Some("! posture 1"));
    rig.ok("Follow 2 0 0");
    assert_eq!(rig.ask("GetPath"), "Path 3 path");
    // They keep their numbers.
    assert_eq!(
        rig.unsolicited(),
        [
            "~ 2 1.000000 1.000000 - -",
            "~ 3 2.000000 1.000000 - 0.1",
            "~ 4 2.000000 0.000000 0.00000 -"
        ]
    );
    assert_eq!(
        until_rest(&mut rig),
        ["! posture 2", "! posture 3", "! path done"]
    );
    assert_at(&mut rig, 2.0, 0.0, 0.0);
}

#[test]
fn what_is_appended_after_the_end_waits_for_a_start() {
    let mut rig = Rig::new();
    rig.ok("GoTo 0.2 0");
    assert_eq!(until_rest(&mut rig), ["! boot power-on", "! path done"]);
    rig.ok("Follow 1 0");
    rig.run(1.0);
    assert_eq!(rig.ask("GetPath"), "Path 1 idle");
    rig.unsolicited();
    assert!(!rig.snapshot().is_moving());
    // So it does while a target is chased.
    rig.ok("Chase 0.5 0");
    rig.ok("Follow 2 0");
    assert_eq!(rig.ask("GetPath"), "Path 2 chase");
    assert_eq!(rig.unsolicited().len(), 2);
    assert_eq!(until_rest(&mut rig), ["! chase end timeout"]);
    assert_eq!(rig.ask("GetPath"), "Path 2 idle");
}

#[test]
fn a_chase_ends_when_no_target_comes() {
    let mut rig = Rig::new();
    rig.unsolicited();
    // At 20 Hz a target goes along at 0.2 m/s.
    for n in 0..60 {
        let x = 0.5 + 0.01 * f64::from(n);
        assert_eq!(rig.ask(&format!("Chase {x} 0.2")), "OK");
        rig.run(0.05);
    }
    assert_eq!(rig.unsolicited(), Vec::<String>::new());
    assert_eq!(rig.ask("GetPath"), "Path 0 chase");
    rig.run(1.4);
    assert_eq!(rig.unsolicited(), Vec::<String>::new());
    // 1.5 s are the default, and it may have to brake from 0.3 m/s at 0.5 m/s².
    rig.run(0.8);
    assert_eq!(rig.unsolicited(), ["! chase end timeout"]);
    assert!(!rig.snapshot().is_moving());
    // The end is no `move`, and a new one may begin.
    rig.ok("Chase 1 0 90");
    assert_eq!(until_rest(&mut rig), ["! chase end timeout"]);
}

#[test]
fn a_target_that_comes_while_it_brakes_is_chased_on() {
    let mut rig = Rig::new();
    rig.ok("SetParam chase_timeout 0.2");
    rig.ok("Chase 3 0");
    rig.run(0.15);
    rig.ok("Chase 3 0");
    // It is over after 0.2 s, and has to brake from 0.17 m/s at 0.5 m/s² or faster.
    rig.run(0.25);
    assert_eq!(rig.ask("GetPath"), "Path 0 chase");
    let speed = rig.snapshot().translation.reference_speed;
    rig.ok("Chase 3 0");
    rig.run(0.1);
    assert!(rig.snapshot().translation.reference_speed > speed);
    assert_eq!(rig.unsolicited(), ["! boot power-on"]);
    assert_eq!(until_rest(&mut rig), ["! chase end timeout"]);
}

#[test]
fn what_ends_a_chase_is_told() {
    for (line, reason, after) in [
        ("Stop", "stop", "Path 1 idle"),
        ("m 0.1", "move", "Path 1 idle"),
        ("t 10", "turn", "Path 1 idle"),
        ("Disable", "stop", "Path 1 idle"),
        ("GoTo 1 0", "replaced", "Path 1 path"),
        ("Follow start", "replaced", "Path 1 path"),
    ] {
        let mut rig = Rig::new();
        rig.ok("Follow 3 0");
        rig.ok("Chase 2 0.5");
        rig.run(0.5);
        rig.unsolicited();
        // A target that is replaced is no chase that ends.
        rig.ok("Chase 2 0.6 45");
        let lines = said(&mut rig, line);
        assert_eq!(lines, ["OK", &format!("! chase end {reason}")], "{line}");
        assert_eq!(rig.ask("GetPath"), after, "{line}");
    }
}

#[test]
fn an_emergency_stop_overtakes_go_to_lines() {
    let mut rig = Rig::new();
    rig.unsolicited();
    let replies = rig.ask_all(b"GoTo 1 0\nFollow 2 0\nChase 2 0\nEStop\n", 4);
    assert_eq!(replies, ["ERR fault estop", "OK", "ERR fault estop", "OK"]);
    rig.run(1.0);
    assert_eq!(rig.unsolicited(), ["! fault estop"]);
    assert_eq!(rig.ask("GetPath"), "Path 1 idle");
    assert_eq!(rig.data("GetEstPos", "EstPos")[..3], [0.0; 3]);
    // And those behind it come too late as well.
    rig.ok("ClearFault");
    rig.unsolicited();
    let replies = rig.ask_all(b"EStop\nGoTo 1 0\n", 2);
    assert_eq!(replies, ["OK", "ERR fault estop"]);
}

#[test]
fn a_path_behind_a_stop_begins_when_the_base_rests() {
    let mut rig = Rig::new();
    under_way(&mut rig);
    let replies = rig.ask_all(b"Stop\nGoTo 0 1\n", 2);
    assert_eq!(replies, ["OK", "OK"]);
    let lines = until_rest(&mut rig);
    assert_eq!(lines, ["! path end stop", "! path done"]);
    let [x, y] = [0, 1].map(|i| rig.data("GetEstPos", "EstPos")[i]);
    assert!(x.hypot(y - 1.0) <= 0.003, "{x} {y}");
}

#[test]
fn a_turn_leaves_nothing_of_the_paths_way_and_a_move_nothing_of_its_turn() {
    // The whole first leg is left.
    let mut rig = Rig::new();
    under_way(&mut rig);
    let at = rig.data("GetEstPos", "EstPos")[0];
    let speed = rig.data("GetEstSpeed", "EstSpeed")[0];
    assert_eq!(said(&mut rig, "t 90"), ["OK", "! path end turn"]);
    let lines = until_rest(&mut rig);
    // Its own end is told, and no other.
    assert_eq!(lines.len(), 1, "{lines:?}");
    assert!(lines[0].starts_with("! turn done "));
    let pose = rig.data("GetEstPos", "EstPos");
    // Braking at move_accel, 0.5 m/s², and a centimetre of ticks and lines.
    let braking = speed * speed;
    assert!(speed > 0.2 && pose[0] - at < braking + 0.01, "{pose:?}");
    assert!((pose[2] - 90.0).abs() < 0.2, "{pose:?}");

    // In its first corner.
    let mut rig = Rig::new();
    under_way(&mut rig);
    while rig.data("GetEstSpeed", "EstSpeed")[1] < 30.0 {
        rig.run(0.01);
    }
    rig.unsolicited();
    assert_eq!(said(&mut rig, "m 0.2"), ["OK", "! path end move"]);
    let [_, _, turning] = rig.data("GetEstPos", "EstPos")[..3] else {
        panic!()
    };
    let lines = until_rest(&mut rig);
    assert_eq!(lines.len(), 1, "{lines:?}");
    assert!(lines[0].starts_with("! move done "));
    let turned = rig.data("GetEstPos", "EstPos")[2];
    // From up to 90 °/s at 180 °/s² it takes 22.5° to stop; the corner had 90° to go.
    assert!(turned - turning < 23.0 && turned < 80.0, "{turned}");
    assert_eq!(rig.data("GetEstSpeed", "EstSpeed")[1], 0.0);
}

#[test]
fn what_is_asked_after_the_end_of_a_path_is_not_taken_back() {
    let mut rig = Rig::new();
    under_way(&mut rig);
    assert_eq!(rig.ask_all(b"t 30\nm 0.3\n", 2), ["OK"; 2]);
    let lines = until_rest(&mut rig);
    assert!(lines.contains(&"! path end turn".into()), "{lines:?}");
    assert!(lines.iter().any(|line| line.starts_with("! move done ")));
    assert!(lines.iter().any(|line| line.starts_with("! turn done ")));
    assert_eq!(lines.len(), 3, "{lines:?}");
}
