//! The serial protocol: parameters.

mod common;

use common::Rig;
use vehicle_controller::params::{Kind, Params};

/// Names that the protocol fixes, with their units.
const FIXED: &[(&str, &str)] = &[
    ("wheel_base", "m"),
    ("left_diameter", "m"),
    ("right_diameter", "m"),
    ("counts_per_turn", "-"),
    ("move_speed", "m/s"),
    ("move_accel", "m/s2"),
    ("turn_speed", "deg/s"),
    ("turn_accel", "deg/s2"),
    ("stop_accel", "m/s2"),
    ("stop_turn_accel", "deg/s2"),
    ("max_speed", "m/s"),
    ("max_accel", "m/s2"),
    ("max_turn_speed", "deg/s"),
    ("max_turn_accel", "deg/s2"),
    ("noise_s", "m2/m"),
    ("noise_drift", "deg2/m"),
    ("noise_rot", "deg2/deg"),
    ("k_drift", "deg2/m2"),
    ("k_rot", "-"),
    ("gain_right", "-"),
    ("gain_left", "-"),
    ("gain_base", "-"),
    ("gate", "-"),
    ("deadman", "s"),
    ("require_crc", "-"),
];

/// Name, value, min, max, unit.
fn list(rig: &mut Rig) -> Vec<[String; 5]> {
    rig.unsolicited();
    let head = rig.ask("ListParams");
    let count: usize = head.strip_prefix("Params ").unwrap().parse().unwrap();
    rig.run(0.1);
    let rows: Vec<[String; 5]> = rig
        .unsolicited()
        .iter()
        .map(|line| {
            let words: Vec<String> = line
                .strip_prefix("~ ")
                .unwrap()
                .split(' ')
                .map(str::to_owned)
                .collect();
            words.try_into().unwrap_or_else(|_| panic!("{line}"))
        })
        .collect();
    assert_eq!(rows.len(), count);
    rows
}

#[test]
fn the_fixed_names_are_there_with_their_units() {
    let mut rig = Rig::new();
    for (name, unit) in FIXED {
        let reply = rig.ask(&format!("GetParam {name}"));
        let words: Vec<&str> = reply.split(' ').collect();
        assert_eq!(
            [words[0], words[1], words[3]],
            ["Param", name, unit],
            "{reply}"
        );
    }
    assert_eq!(rig.ask("GetParam gate"), "Param gate 25 -");
}

#[test]
fn every_listed_parameter_reads_as_it_is_listed_and_can_be_set_to_it() {
    let mut rig = Rig::new();
    let rows = list(&mut rig);
    assert!(rows.len() >= FIXED.len());
    for [name, value, min, max, unit] in &rows {
        assert_eq!(
            rig.ask(&format!("GetParam {name}")),
            format!("Param {name} {value} {unit}")
        );
        assert_eq!(*name, name.to_ascii_lowercase());
        let [low, v, high] = [min, value, max].map(|w| w.parse::<f32>().unwrap());
        assert!(low <= v && v <= high, "{name}");
        let before = *rig.params();
        rig.ok(&format!("SetParam {name} {value}"));
        assert_eq!(
            *rig.params(),
            before,
            "{name}: what is printed is the value, to the last bit"
        );
    }
}

#[test]
fn every_parameter_is_refused_beyond_its_listed_limits() {
    for [name, _, min, max, _] in list(&mut Rig::new()) {
        for (limit, beyond) in [(&min, -1.0), (&max, 1.0)] {
            let value: f64 = limit.parse().unwrap();
            let outside = value + beyond * (value.abs() * 1e-3).max(1e-3);
            let reply = Rig::new().refused(&format!("SetParam {name} {outside}"), "range");
            for word in [&name, &min, &max] {
                assert!(reply.split(' ').any(|w| w == word), "{reply}");
            }
        }
    }
}

#[test]
fn every_parameter_is_taken_at_its_listed_limits() {
    let mut refusals = Vec::new();
    for [name, _, min, max, _] in list(&mut Rig::new()) {
        for limit in [&min, &max] {
            let mut rig = Rig::new();
            let line = format!("SetParam {name} {limit}");
            let reply = rig.ask(&line);
            rig.tick();
            // Its own limit may be at odds with another parameter, which the text names then.
            if reply.contains("must not exceed") || name == "require_crc" {
                continue;
            }
            let told = rig.ask(&format!("GetParam {name}"));
            if reply != "OK" || !told.starts_with(&format!("Param {name} {limit} ")) {
                refusals.push(format!("{line}: {reply}, {told}"));
            }
        }
    }
    assert!(refusals.is_empty(), "{refusals:#?}");
}

#[test]
fn the_speed_of_the_commands_does_not_exceed_the_largest_one() {
    for (small, large, value, limit) in [
        ("move_speed", "max_speed", "0.71", "0.29"),
        ("move_accel", "max_accel", "2.1", "0.4"),
        ("turn_speed", "max_turn_speed", "361", "89"),
        ("turn_accel", "max_turn_accel", "1441", "179"),
        ("stop_accel", "max_accel", "2.1", "0.9"),
        ("stop_turn_accel", "max_turn_accel", "1441", "359"),
    ] {
        let mut rig = Rig::new();
        rig.ask("GetStatus");
        let reply = rig.refused(&format!("SetParam {small} {value}"), "range");
        assert!(reply.contains(small) && reply.contains(large), "{reply}");
        rig.refused(&format!("SetParam {large} {limit}"), "range");
    }
}

#[test]
fn switches_are_0_or_1() {
    let mut rig = Rig::new();
    rig.ask("GetStatus");
    for id in Params::default().ids() {
        if matches!(id.spec().kind, Kind::Switch | Kind::Wiring) {
            rig.refused(&format!("SetParam {} 0.5", id.spec().name), "range");
        }
    }
}

#[test]
fn there_is_no_such_parameter() {
    let mut rig = Rig::new();
    rig.ask("GetStatus");
    for line in [
        "GetParam bogus",
        "SetParam bogus 1",
        "GetParam wheel_bas",
        "GetParam 1",
    ] {
        rig.refused(line, "unknown");
    }
}

#[test]
fn geometry_is_refused_while_the_vehicle_moves_and_the_rest_is_not() {
    for id in Params::default().ids() {
        let spec = id.spec();
        let line = format!("SetParam {} {}", spec.name, spec.default);
        let mut rig = Rig::new();
        rig.ok("m inf 0.2 1");
        rig.run(0.5);
        if matches!(spec.kind, Kind::Geometry | Kind::Wiring) {
            rig.refused(&line, "moving");
        } else {
            rig.ok(&line);
        }
        rig.ok("Stop");
        rig.run(1.0);
        rig.ok(&line);
    }
}

#[test]
fn the_fixed_geometry_is_geometry() {
    let mut rig = Rig::new();
    rig.ok("t inf 20 100");
    rig.run(0.5);
    for line in [
        "SetParam wheel_base 0.3",
        "SetParam left_diameter 0.09",
        "SetParam right_diameter 0.09",
        "SetParam counts_per_turn 1000",
        "SetParam gain_left 1.01",
        "SetParam gain_right 1.01",
        "SetParam gain_base 1.01",
    ] {
        rig.refused(line, "moving");
    }
    rig.refused("SaveParams", "moving");
}

#[test]
fn a_parameter_is_effective_at_once() {
    let mut rig = Rig::new();
    for line in ["SetParam move_speed 0.1", "SetParam move_accel 2", "m inf"] {
        rig.ok(line);
    }
    rig.run(0.5);
    assert!((rig.data("GetEstSpeed", "EstSpeed")[0] - 0.1).abs() < 1e-5);
    rig.ok("SetParam max_speed 0.15");
    rig.refused("m inf 0.2", "range");
    rig.ok("SetParam stop_accel 0.2");
    rig.ok("Stop");
    rig.run(0.25);
    // 0.2 m/s² for 0.25 s; two cycles more or less.
    assert!((rig.data("GetEstSpeed", "EstSpeed")[0] - 0.05).abs() < 5e-4);
}

#[test]
fn reset_params_returns_to_what_the_base_began_with() {
    let mut rig = Rig::new();
    for line in [
        "SetParam gate 9",
        "SetParam wheel_base 0.5",
        "SetParam move_speed 0.1",
        "ResetParams",
    ] {
        rig.ok(line);
    }
    assert_eq!(*rig.params(), Params::default());
    rig.ok("m inf");
    rig.run(1.5);
    assert!((rig.data("GetEstSpeed", "EstSpeed")[0] - 0.3).abs() < 1e-5);
    rig.refused("ResetParams", "moving");
}

#[test]
fn a_base_without_storage_says_so() {
    let mut rig = Rig::new();
    rig.ask("GetStatus");
    rig.refused("SaveParams", "storage");
    rig.refused("LoadParams", "storage");
}

#[test]
fn a_list_is_not_mixed_with_the_replies_behind_it() {
    let mut rig = Rig::new();
    rig.pump();
    rig.bytes();
    rig.receive(b"@1 ListParams\n@2 GetStatus\n");
    rig.run(0.1);
    let lines = rig.lines();
    assert_eq!(lines.len(), Params::default().count() + 2);
    assert_eq!(lines[0], format!("@1 Params {}", Params::default().count()));
    assert!(
        lines[1..=Params::default().count()]
            .iter()
            .all(|line| line.starts_with("~ "))
    );
    assert!(lines[Params::default().count() + 1].starts_with("@2 Status "));
}
