//! The serial protocol: keywords, parameters, numbers, and the form of data lines.

mod common;

use common::Rig;

const STATUS: &str = "Status HOLD HOLD enabled none";

#[test]
fn keywords_are_case_insensitive() {
    let mut rig = Rig::new();
    for line in [
        "getstatus",
        "GETSTATUS",
        "gEtStAtUs",
        "  GetStatus",
        "GetStatus\t ",
    ] {
        assert_eq!(rig.ask(line), STATUS, "{line:?}");
    }
    for line in ["M 0", "MOVE 0", "move 0", "T 0", "Turn 0", "sTOP"] {
        rig.ok(line);
    }
    assert_eq!(rig.ask("GETPARAM Wheel_Base"), "Param wheel_base 0.2 m");
}

#[test]
fn parameters_are_separated_by_blanks_or_one_comma() {
    for line in [
        "m 0.1 0.2 0.3",
        "m 0.1,0.2,0.3",
        "m 0.1, 0.2 ,0.3",
        "m\t0.1 \t0.2\t,\t0.3",
        "m   0.1 , 0.2   0.3  ",
    ] {
        let mut rig = Rig::new();
        rig.ok(line);
        rig.run(0.4);
        // 0.3 m/s² for 0.4 s; one cycle is 0.0003 m/s.
        let speed = rig.data("GetEstSpeed", "EstSpeed")[0];
        assert!((speed - 0.12).abs() < 4e-4, "{line:?}: {speed}");
    }
}

#[test]
fn an_empty_parameter_is_a_syntax_error() {
    let mut rig = Rig::new();
    for line in [
        "m 1,,2",
        "m ,1",
        "m 1,",
        "m 1 ,, 2",
        "m 1, ,2",
        "m ,",
        "Stop ,",
        "GetParam ,gate",
        "SetParam gate,",
        "Stream 0.1,,x",
        "ResetPos 0,0,0,",
    ] {
        rig.refused(line, "syntax");
    }
}

#[test]
fn malformed_numbers_are_syntax_errors() {
    let mut rig = Rig::new();
    for word in [
        "nan", "NaN", "-nan", "0x10", "1f", "1.2.3", "1e", "1e+", "e5", ".", "-", "+", "--1",
        "+-1", "1_000", "1m", "infinity", "in", "1e5.0", "1/2", "(1)", "'1'",
    ] {
        for line in [
            format!("m {word}"),
            format!("m 1 {word}"),
            format!("t 1 1 {word}"),
            format!("ResetPos 0 0 {word}"),
            format!("GoTo {word} 0"),
            format!("Chase 0 {word}"),
            format!("Follow 0 0 0 {word}"),
            format!("SetParam gate {word}"),
            format!("Stream {word}"),
        ] {
            rig.refused(&line, "syntax");
        }
    }
}

#[test]
fn decimal_numbers_are_taken_with_sign_fraction_and_exponent() {
    let mut rig = Rig::new();
    for (word, printed) in [
        ("1", "1.000000"),
        ("+1", "1.000000"),
        ("-1.5", "-1.500000"),
        (".5", "0.500000"),
        ("5.", "5.000000"),
        ("1e2", "100.000000"),
        ("1E-2", "0.010000"),
        ("+1.25e+1", "12.500000"),
        ("0000.1", "0.100000"),
        ("-0", "0.000000"),
        ("1e-60", "0.000000"),
        ("123456.789012", "123456.789012"),
    ] {
        rig.ok(&format!("ResetPos {word} 0 0"));
        let reply = rig.ask("GetEstPos");
        assert_eq!(reply.split(' ').nth(1), Some(printed), "{word}: {reply}");
    }
}

#[test]
fn what_f32_cannot_hold_is_out_of_range() {
    let mut rig = Rig::new();
    for line in [
        "m 1e39",
        "m -1e39",
        "m 1 1e39",
        "m 1 1 1e99999",
        "t 1e40",
        "ResetPos 1e39 0 0",
        "ResetPos 0 0 0 1e39 0 0 0 0 0",
        "CorrectPos 1e39 0 0 0 0 0 0 0 0 0 0 0",
        "CorrectPos 0 0 0 -1e39 0 0 0 0 0 0 0 0",
        "SetParam gate 1e39",
        "ObservePos 0 0 0 1e39 0 0 1 0 1",
        "ObserveScalar 1e39 1 1 0 0",
        "GoTo 1e39 0",
        "Follow 0 -1e39",
        "Follow 0 0 - 1e39",
        "Chase 0 0 1e39",
        "Stream 1e39",
    ] {
        rig.refused(line, "range");
    }
}

#[test]
fn infinity_is_allowed_for_distances_only() {
    let mut rig = Rig::new();
    for line in [
        "m 1 inf",
        "m 1 1 inf",
        "t 1 -inf",
        "ResetPos inf 0 0",
        "ResetPos 0 0 -inf",
        "ResetPos 0 0 0 inf 0 0 1 0 1",
        "CorrectPos inf 0 0 0 0 0 0 0 0 0 0 0",
        "ObservePos inf 0 0 1 0 0 1 0 1",
        "ObserveScalar 0 inf 1 0 0",
        "GoTo inf 0",
        "Follow 0 0 - inf",
        "Chase 0 0 -inf",
        "SetParam gate inf",
        "Stream inf",
    ] {
        let reply = rig.ask(line);
        assert!(
            reply.starts_with("ERR syntax ") || reply.starts_with("ERR range "),
            "{line}: {reply}"
        );
    }
    for line in ["m inf", "m -inf", "m INF", "t inf", "t -inf"] {
        rig.ok(line);
    }
}

#[test]
fn unknown_commands_and_wrong_counts_are_syntax_errors() {
    let mut rig = Rig::new();
    for line in [
        "Hello",
        "mm 1",
        "mo 1",
        "m1",
        "GetEstPo",
        "GetEstPosX",
        "?",
        "!",
        "~",
        "# comment",
        "m 1 0.1 0.1 0.1",
        "t 1 1 1 1",
        "Stop 1",
        "GoTo",
        "GoTo 1",
        "GoTo 1 2 3 4",
        "Follow",
        "Follow 1",
        "Follow 1 2 3 0.1 4",
        "Follow start 1",
        "Follow clear 1",
        "Follow stop",
        "GetPath 1",
        "Chase",
        "Chase 1",
        "Chase 1 2 3 4",
        "GetEstPos 1",
        "GetEstSpeed x",
        "GetStatus 1",
        "GetState 1",
        "GetTime 1",
        "GetBattery 1",
        "GetSteering 1",
        "GetWheels 1",
        "Version 1",
        "EStop now",
        "ClearFault 1",
        "Enable 1",
        "Disable 1",
        "ListParams 1",
        "SaveParams 1",
        "LoadParams 1",
        "ResetParams 1",
        "Help m t",
        "Help nothing",
        "Stream",
        "GetParam",
        "GetParam gate gate",
        "SetParam",
        "SetParam gate",
        "SetParam gate 1 2",
        "ResetPos",
        "ResetPos 1",
        "ResetPos 1 2",
        "ResetPos 1 2 3 1",
        "ResetPos 1 2 3 1 0 0 1 0",
        "ResetPos 1 2 3 1 0 0 1 0 1 1",
        "CorrectPos 0 0 0",
        "CorrectPos 0 0 0 0 0 0 0 0 0 0 0",
        "CorrectPos 0 0 0 0 0 0 0 0 0 0 0 0 0",
        "ObservePos 0 0 0",
        "ObservePos 0 0 0 1 0 0 1 0",
        "ObservePos 0 0 0 1 0 0 1 0 1 0 0",
        "ObserveScalar 0 1 1 0",
        "ObserveScalar 0 1 1 0 0 0 0",
        "Stream 0.1 nothing",
    ] {
        rig.refused(line, "syntax");
    }
}

#[test]
fn data_lines_have_their_form() {
    let mut rig = Rig::new();
    rig.inputs.battery = Some(11.5 / 11.0);
    rig.run(1.0);
    for (line, reply) in [
        ("GetStatus", STATUS),
        ("GetTime", "Time 1.000000"),
        ("GetBattery", "Battery 11.500"),
        ("GetSteering", "Steering 0.0000"),
        ("GetEstSpeed", "EstSpeed 0.000000 0.00000"),
        (
            "GetState",
            "State 1.000000 0.000000 0.000000 0.000000 0.00000 0.00000 0.00000",
        ),
        ("GetWheels", "Wheels 0 0 0.000000 0.000000 0.0000 0.0000"),
        (
            "GetEstPos",
            "EstPos 0.000000 0.000000 0.00000 0.00000e0 0.00000e0 0.00000e0 0.00000e0 0.00000e0 0.00000e0",
        ),
    ] {
        assert_eq!(rig.ask(line), reply);
    }
    let version = format!(
        "Version vehicle-controller {} test 1",
        env!("CARGO_PKG_VERSION")
    );
    assert_eq!(rig.ask("Version"), version);
}

#[test]
fn every_command_has_help_of_one_line() {
    let mut rig = Rig::new();
    let topics = rig.ask("Help");
    let all: Vec<String> = [
        "motion",
        "path",
        "position",
        "map",
        "calibration",
        "state",
        "safety",
        "parameters",
    ]
    .into_iter()
    .flat_map(|topic| {
        assert!(
            topics
                .split(' ')
                .any(|word| word.trim_end_matches(';') == topic),
            "{topics}"
        );
        let listed = rig.ask(&format!("Help {topic}"));
        listed
            .split(' ')
            .skip(1)
            .map(str::to_owned)
            .collect::<Vec<_>>()
    })
    .collect();
    assert_eq!(all.len(), 43);
    for name in [
        "move",
        "turn",
        "Stop",
        "GoTo",
        "Follow",
        "GetPath",
        "Chase",
        "Calibrate",
        "GetGains",
        "GetEstPos",
        "GetEstSpeed",
        "CorrectPos",
        "ResetPos",
        "ObservePos",
        "ObserveScalar",
        "GetStatus",
        "GetState",
        "GetTime",
        "GetBattery",
        "GetSteering",
        "GetWheels",
        "Stream",
        "Version",
        "Help",
        "EStop",
        "ClearFault",
        "Enable",
        "Disable",
        "GetParam",
        "SetParam",
        "ListParams",
        "SaveParams",
        "LoadParams",
        "ResetParams",
    ] {
        assert!(all.iter().any(|word| word == name), "{name}: {all:?}");
        let help = rig.ask(&format!("Help {name}"));
        assert!(help.starts_with("Help ") && help.contains(name), "{help}");
        assert!(help.len() > name.len() + 10, "{help}");
        let line = format!("@65535 Help {name}");
        let whole = rig.ask(&common::checked(&line));
        assert_eq!(common::unchecked(&whole), format!("@65535 {help}"));
    }
}

#[test]
fn help_is_whole_with_a_tag_and_a_check_too() {
    let mut rig = Rig::new();
    let all = rig.ask("Help");
    let tagged = rig.ask(&common::checked("@65535 Help"));
    assert_eq!(common::unchecked(&tagged), format!("@65535 {all}"));
}
