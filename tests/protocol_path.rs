//! The serial protocol: paths and chases. What is refused, and how; what GetPath lists. How they go and end: `protocol_path_events`; among many lines: `protocol_path_load`.

mod common;

use common::{Rig, checked, unchecked};

/// What GetPath says, and its rows.
fn listed(rig: &mut Rig) -> (String, Vec<String>) {
    rig.unsolicited();
    let head = rig.ask("GetPath");
    let count: usize = head.split(' ').nth(1).unwrap().parse().unwrap();
    let mut rows = Vec::new();
    // A list that is longer than the output has room for takes some ticks.
    for _ in 0..4 {
        rows.extend(rig.unsolicited());
        rows.retain(|line| line.starts_with("~ "));
        if rows.len() < count {
            rig.tick();
        }
    }
    assert_eq!(rows.len(), count, "{head}");
    (head, rows)
}

/// All of GetPath in one text.
fn path(rig: &mut Rig) -> String {
    let (head, rows) = listed(rig);
    format!("{head}\n{}", rows.join("\n"))
}

/// A path of three postures.
fn zigzag(rig: &mut Rig) {
    for line in ["Follow 2 0", "Follow 2 1 - 0.2", "Follow 0 1 180"] {
        rig.ok(line);
    }
}

#[test]
fn what_was_appended_is_listed() {
    let mut rig = Rig::new();
    assert_eq!(path(&mut rig), "Path 0 idle\n");
    for (line, row) in [
        ("Follow 1 2", "~ 1 1.000000 2.000000 - -"),
        ("follow -1.5, 2.25, -, 0.2", "~ 2 -1.500000 2.250000 - 0.2"),
        (
            "FOLLOW 1e3 -0.0000004 270",
            "~ 3 1000.000000 0.000000 -90.00000 -",
        ),
        (
            "Follow 0 0 -180 0.125",
            "~ 4 0.000000 0.000000 180.00000 0.125",
        ),
        ("Follow\t.5 ,+1e1 720.5", "~ 5 0.500000 10.000000 0.50000 -"),
    ] {
        rig.ok(line);
        let (_, rows) = listed(&mut rig);
        assert_eq!(rows.last().map(String::as_str), Some(row), "{line}");
    }
    let (head, rows) = listed(&mut rig);
    assert_eq!((head.as_str(), rows.len()), ("Path 5 idle", 5));
    rig.ok("Follow CLEAR");
    assert_eq!(path(&mut rig), "Path 0 idle\n");
}

#[test]
fn headings_are_listed_wrapped() {
    let mut rig = Rig::new();
    for degrees in (-540..=540).step_by(15).chain([-181, -179, 179, 181]) {
        rig.ok(&format!("Follow 0 0 {degrees}"));
        let (_, rows) = listed(&mut rig);
        let told: f64 = rows[0].split(' ').nth(4).unwrap().parse().unwrap();
        assert!(told > -180.0 && told <= 180.0, "{degrees}: {told}");
        let turns = (told - f64::from(degrees)) / 360.0;
        // Kept as f32, which is good for 0.7e-5° there: one of the last digits that are printed.
        assert!(
            (turns - turns.round()).abs() * 360.0 < 1.1e-5,
            "{degrees}: {told}"
        );
        rig.ok("Follow clear");
    }
}

#[test]
fn what_is_no_posture_is_a_syntax_error() {
    let mut rig = Rig::new();
    zigzag(&mut rig);
    for line in [
        "GoTo",
        "GoTo 1",
        "GoTo x 1",
        "GoTo - 1",
        "GoTo 1 -",
        "GoTo 1 2 x",
        "GoTo 1 2 - -",
        "GoTo 1 2 3 4",
        "GoTo inf 0",
        "GoTo 0 -inf",
        "GoTo 0 0 inf",
        "GoTo 0 0 nan",
        "GoTo 1,,2",
        "GoTo 1,2,",
        "GoTo start",
        "Go 1 2",
        "Follow",
        "Follow 1",
        "Follow begin",
        "Follow - -",
        "Follow 1 2 x",
        "Follow 1 2 --",
        "Follow 1 2 - -",
        "Follow 1 2 - x",
        "Follow 1 2 - inf",
        "Follow 1 2 - 0.1 0.1",
        "Follow 1 2 3 0.1 0.1",
        "Follow 1,2,-,",
        "Follow start 1",
        "Follow clear 1",
        "Follow start clear",
        "Follow start,",
        "GetPath 1",
        "Chase",
        "Chase 1",
        "Chase 1 x",
        "Chase 1 2 3 4",
        "Chase 1 2 - -",
        "Chase 1 2 inf",
        "Chase stop",
        "Chase clear",
    ] {
        rig.refused(line, "syntax");
    }
}

#[test]
fn a_refusal_tells_which_number_and_its_range() {
    let mut rig = Rig::new();
    zigzag(&mut rig);
    for keyword in ["GoTo", "Follow", "Chase"] {
        for (numbers, name, unit) in [
            ("1.1e7 0", "x", "m"),
            ("0 -1.1e7", "y", "m"),
            ("1e39 0", "x", "m"),
            ("0 0 1.1e7", "theta", "deg"),
            ("0 0 -1e99", "theta", "deg"),
        ] {
            let reply = rig.refused(&format!("{keyword} {numbers}"), "range");
            assert_eq!(
                reply,
                format!("ERR range {name} -10000000 to 10000000 {unit}"),
                "{keyword} {numbers}"
            );
        }
    }
    for v in ["0", "-0.1", "0.0009", "1e10"] {
        let reply = rig.refused(&format!("Follow 1 0 - {v}"), "range");
        assert!(
            reply.starts_with("ERR range v 0.001 to ") && reply.ends_with(" m/s"),
            "{v}: {reply}"
        );
    }
    rig.ok("SetParam max_speed 0.5");
    let reply = rig.refused("Follow 1 0 - 0.51", "range");
    assert_eq!(reply, "ERR range v 0.001 to 0.5 m/s");
    rig.ok("Follow 1 0 - 0.5");
    // A path that is far, and yet within the range.
    rig.ok("Follow clear");
    rig.ok("Follow -1e7 1e7 1e7 0.001");
}

#[test]
fn the_queue_has_room_for_32() {
    let mut rig = Rig::new();
    for n in 1..=32 {
        rig.ok(&format!("Follow {n} 0"));
    }
    let before = path(&mut rig);
    assert!(
        before.starts_with("Path 32 idle\n") && before.ends_with("\n~ 32 32.000000 0.000000 - -")
    );
    for line in ["Follow 33 0", "Follow 33 0 90 0.2"] {
        let reply = rig.refused(line, "full");
        assert_eq!(reply, "ERR full there is no room for another posture");
    }
    assert_eq!(path(&mut rig), before);
    // On the way there is room as soon as one is passed.
    rig.ok("Follow start");
    rig.run(1.0);
    rig.refused("Follow 33 0", "full");
    rig.run(4.0);
    let (head, rows) = listed(&mut rig);
    assert_eq!((head.as_str(), rows.len()), ("Path 31 path", 31));
    assert_eq!(rows[0], "~ 2 2.000000 0.000000 - -");
    rig.ok("Follow 33 0");
    // The move goes on farther now.
    rig.run(0.01);
    rig.refused("Follow 34 0", "full");
    let (_, rows) = listed(&mut rig);
    assert_eq!(rows[31], "~ 33 33.000000 0.000000 - -");
}

#[test]
fn nothing_to_follow_is_out_of_range() {
    let mut rig = Rig::new();
    let reply = rig.refused("Follow start", "range");
    assert_eq!(reply, "ERR range posture 1 is none, or too far");
    zigzag(&mut rig);
    rig.ok("Follow clear");
    rig.refused("Follow start", "range");
    // Nor is there anything left of a path that is done.
    rig.ok("GoTo 0 0");
    rig.run(2.0);
    rig.refused("Follow start", "range");
}

const MOTIONS: [&str; 5] = [
    "GoTo 1 1",
    "GoTo 0 0 90",
    "Follow start",
    "Chase 1 1",
    "Chase 1 0 -90",
];

#[test]
fn with_a_fault_nothing_is_followed() {
    let mut rig = Rig::new();
    zigzag(&mut rig);
    rig.ok("EStop");
    let before = path(&mut rig);
    for line in MOTIONS {
        assert_eq!(rig.refused(line, "fault"), "ERR fault estop");
    }
    assert_eq!(path(&mut rig), before);
    // The queue is no motion.
    rig.ok("Follow 5 5");
    assert!(path(&mut rig).starts_with("Path 4 idle"));
    rig.ok("Follow clear");
    assert_eq!(path(&mut rig), "Path 0 idle\n");
    rig.ok("ClearFault");
    rig.ok("GoTo 1 1");
}

#[test]
fn with_motors_disabled_nothing_is_followed() {
    let mut rig = Rig::new();
    zigzag(&mut rig);
    rig.ok("Disable");
    let before = path(&mut rig);
    for line in MOTIONS {
        rig.refused(line, "disabled");
    }
    assert_eq!(path(&mut rig), before);
    rig.ok("Follow 5 5");
    rig.ok("Enable");
    rig.ok("Follow start");
}

#[test]
fn without_speed_nothing_is_followed() {
    for name in ["move_speed", "turn_speed"] {
        let mut rig = Rig::new();
        zigzag(&mut rig);
        rig.ok(&format!("SetParam {name} 0"));
        let before = path(&mut rig);
        for line in MOTIONS {
            let reply = rig.refused(line, "range");
            assert_eq!(
                reply, "ERR range move_speed or turn_speed is 0",
                "{name} 0: {line}"
            );
        }
        assert_eq!(path(&mut rig), before, "{name}");
    }
}

#[test]
fn what_is_refused_on_the_way_changes_nothing() {
    let mut rig = Rig::new();
    zigzag(&mut rig);
    rig.ok("Follow start");
    rig.run(2.0);
    for (line, code) in [
        ("GoTo 1", "syntax"),
        ("GoTo 1e8 0", "range"),
        ("Follow 1 2 3 4 5", "syntax"),
        ("Follow 0 0 - 0", "range"),
        ("Follow 0 0 - 5", "range"),
        ("Chase 0 0 1e8", "range"),
        ("GetPath all", "syntax"),
        ("m 1 100", "range"),
        ("t 1 1 0", "range"),
    ] {
        rig.refused(line, code);
    }
    let (head, rows) = listed(&mut rig);
    assert_eq!((head.as_str(), rows.len()), ("Path 3 path", 3));
    rig.run(30.0);
    let events = rig.unsolicited();
    assert_eq!(events, ["! posture 1", "! posture 2", "! path done"]);
}

#[test]
fn the_motors_speed_on_the_way_can_be_taken_away() {
    let mut rig = Rig::new();
    zigzag(&mut rig);
    rig.ok("Follow start");
    rig.run(1.0);
    rig.ok("SetParam move_speed 0");
    let before = path(&mut rig);
    for line in MOTIONS {
        if line == "Follow start" {
            // There is nothing to start.
            rig.ok(line);
        } else {
            rig.refused(line, "range");
        }
    }
    assert_eq!(path(&mut rig), before);
    // It is the next path that these parameters are for.
    rig.run(30.0);
    assert_eq!(
        rig.unsolicited().last().map(String::as_str),
        Some("! path done")
    );
}

#[test]
fn tags_and_checks_go_with_these_lines_too() {
    let mut rig = Rig::new();
    assert_eq!(rig.ask("@1 Follow 1 0"), "@1 OK");
    assert_eq!(rig.ask("@2 GetPath"), "@2 Path 1 idle");
    assert!(rig.ask("@3 Follow").starts_with("@3 ERR syntax "));
    let reply = rig.ask(&checked("@65535 GetPath"));
    assert_eq!(unchecked(&reply), "@65535 Path 1 idle");
    // Rows are telemetry: they have a check when all lines have.
    assert_eq!(
        rig.unsolicited().last().unwrap(),
        "~ 1 1.000000 0.000000 - -"
    );
    rig.ok("SetParam require_crc 1");
    assert!(unchecked(&rig.ask("GoTo 1 0")).starts_with("ERR checksum "));
    rig.unsolicited();
    let reply = rig.ask(&checked("GetPath"));
    assert_eq!(unchecked(&reply), "Path 1 idle");
    assert_eq!(
        unchecked(&rig.unsolicited()[0]),
        "~ 1 1.000000 0.000000 - -"
    );
    let reply = rig.ask(&checked("@9 GoTo 0 0 1"));
    assert_eq!(unchecked(&reply), "@9 OK");
    rig.run(2.0);
    assert_eq!(unchecked(&rig.unsolicited()[0]), "! path done");
}
