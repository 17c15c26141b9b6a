//! The serial protocol, section "Lines": ends, separators, numbers, tags, length, and how many may wait.

mod common;

use common::Rig;

const STATUS: &str = "Status HOLD HOLD enabled none";

#[test]
fn the_boot_event_comes_first() {
    let mut rig = Rig::new();
    assert_eq!(rig.ask("GetStatus"), STATUS);
    assert_eq!(rig.unsolicited(), ["! boot power-on"]);
}

#[test]
fn a_line_ends_with_lf_cr_or_cr_lf() {
    let mut rig = Rig::new();
    let replies = rig.ask_all(b"@1 GetStatus\n@2 GetStatus\r@3 GetStatus\r\n", 3);
    let expected: Vec<String> = (1..=3).map(|n| format!("@{n} {STATUS}")).collect();
    assert_eq!(replies, expected);
}

#[test]
fn empty_and_blank_lines_are_ignored() {
    let mut rig = Rig::new();
    rig.receive(b"\n\r\r\n\n  \n\t\r\n \t \r");
    rig.run(0.01);
    assert_eq!(rig.unsolicited(), ["! boot power-on"]);
    assert_eq!(rig.ask("GetStatus"), STATUS);
}

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
        "GetEstPos 1",
        "GetEstSpeed x",
        "GetStatus 1",
        "GetState 1",
        "GetTime 1",
        "GetBattery 1",
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
fn a_tag_comes_back_before_the_reply() {
    let mut rig = Rig::new();
    for (line, reply) in [
        ("@17 m 1", "@17 OK".to_owned()),
        ("@0 Stop", "@0 OK".to_owned()),
        ("@65535 GetStatus", format!("@65535 {STATUS}")),
        (" @5\tGetParam gate", "@5 Param gate 25 -".to_owned()),
    ] {
        let mut rig = Rig::new();
        assert_eq!(rig.ask(line), reply, "{line}");
    }
    for line in ["@17", "@17 ", "@17 Hello", "@17 m nan", "@17 m 1 1 1 1"] {
        let reply = rig.ask(line);
        assert!(reply.starts_with("@17 ERR syntax "), "{line:?}: {reply}");
    }
    for line in [
        "@",
        "@ m 1",
        "@65536 m 1",
        "@-1 m 1",
        "@x m 1",
        "@1.0 m 1",
        "@@1 m 1",
    ] {
        rig.refused(line, "syntax");
    }
}

#[test]
fn a_line_of_255_bytes_is_taken_and_one_of_256_is_not() {
    for end in ["\n", "\r", "\r\n"] {
        let mut rig = Rig::new();
        let line = format!("{:<255}{end}", "@9 GetStatus");
        assert_eq!(rig.ask_bytes(line.as_bytes()), format!("@9 {STATUS}"));
        let line = format!("{:<256}{end}", "@9 GetStatus");
        let reply = rig.ask_bytes(line.as_bytes());
        assert!(reply.starts_with("@9 ERR too-long "), "{reply}");
    }
    let number = format!("m {}1", "0".repeat(252));
    assert_eq!(number.len(), 255);
    Rig::new().ok(&number);
}

#[test]
fn a_line_too_long_is_answered_once_when_its_end_arrives() {
    let mut rig = Rig::new();
    let before = rig.ask("GetParam gate");
    rig.receive("m 1 ".repeat(1000).as_bytes());
    rig.run(0.1);
    assert_eq!(rig.replies(), Vec::<String>::new());
    let reply = rig.ask_bytes(b"\r\n");
    assert!(reply.starts_with("ERR too-long "), "{reply}");
    assert_eq!(rig.ask("GetParam gate"), before);
    assert_eq!(rig.ask("GetStatus"), STATUS);
}

#[test]
fn a_byte_that_is_not_printable_is_refused_with_its_line() {
    let mut rig = Rig::new();
    for byte in (0..=255_u8).filter(|b| !matches!(b, b'\t' | b'\r' | b'\n' | b' '..=b'~')) {
        for line in [
            &[b'm', b' ', byte, b'1', b'\n'][..],
            &[byte, b'\n'],
            &[b' ', byte, b'\r'],
        ] {
            let before = rig.state();
            let reply = rig.ask_bytes(line);
            assert!(reply.starts_with("ERR bad-byte "), "{byte:#x}: {reply}");
            if byte != 0 {
                assert_eq!(rig.ask("GetStatus"), STATUS);
            }
            assert_eq!(rig.state(), before_or(&rig, before), "{byte:#x}");
        }
    }
}

/// The first comparison would see the boot event being told.
fn before_or(rig: &Rig, before: String) -> String {
    if before.contains("boot_told: false") {
        rig.state()
    } else {
        before
    }
}

#[test]
fn four_lines_may_wait_and_the_fifth_is_busy_in_its_turn() {
    let mut rig = Rig::new();
    let replies = rig.ask_all(
        b"@1 SetParam gate 1\n@2 SetParam gate 2\n@3 SetParam gate 3\n@4 GetParam gate\n@5 SetParam gate 5\n@6 Hello\n",
        6,
    );
    assert_eq!(
        replies[..4],
        ["@1 OK", "@2 OK", "@3 OK", "@4 Param gate 3 -"]
    );
    for (reply, tag) in replies[4..].iter().zip(["@5", "@6"]) {
        assert!(reply.starts_with(&format!("{tag} ERR busy ")), "{reply}");
    }
    assert_eq!(rig.ask("GetParam gate"), "Param gate 3 -");
}

#[test]
fn a_flood_is_answered_line_by_line_in_order() {
    let mut rig = Rig::new();
    let mut sent = 0;
    while rig.can_receive() {
        rig.receive(format!("@{sent} t 0\n").as_bytes());
        sent += 1;
    }
    let replies = rig.ask_all(b"", sent);
    assert_eq!(replies.len(), sent);
    for (n, reply) in replies.iter().enumerate() {
        let expected = if n < 4 { "OK" } else { "ERR busy " };
        assert!(reply.starts_with(&format!("@{n} {expected}")), "{reply}");
    }
    assert_eq!(rig.ask("@1 Stop"), "@1 OK");
}

#[test]
fn the_next_line_after_garbage_is_answered_normally() {
    for garbage in [
        &b"\x00\xff\xfe"[..],
        b"@",
        b"*",
        b"@*",
        b"m 1*12",
        b"\t\t@1",
        b"m ,,,",
        b"\x1b[A",
        b"~ 1 2",
        b"OK",
        b"@99999999999",
        b"*****",
        b"ERR",
    ] {
        let mut rig = Rig::new();
        let mut bytes = garbage.to_vec();
        bytes.extend(b"\n@7 GetStatus\n");
        let replies = rig.ask_all(&bytes, 2);
        assert!(replies[0].contains("ERR "), "{garbage:?}: {replies:?}");
        assert_eq!(replies[1], format!("@7 {STATUS}"), "{garbage:?}");
    }
}

#[test]
fn data_lines_have_their_form() {
    let mut rig = Rig::new();
    rig.inputs.supply = Some(11.5);
    rig.run(1.0);
    for (line, reply) in [
        ("GetStatus", STATUS),
        ("GetTime", "Time 1.000000"),
        ("GetBattery", "Battery 11.500"),
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
    let all = rig.ask("Help");
    for name in [
        "move",
        "turn",
        "Stop",
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
        assert!(all.split(' ').any(|word| word == name), "{name}: {all}");
        let help = rig.ask(&format!("Help {name}"));
        assert!(help.starts_with("Help ") && help.contains(name), "{help}");
        assert!(help.len() > name.len() + 10, "{help}");
        // A tag and a check must find room in the line too.
        assert!(
            help.len() + "@65535 ".len() + "*FFFF".len() <= 255,
            "{help}"
        );
    }
    assert!(all.len() + "@65535 ".len() + "*FFFF".len() <= 255, "{all}");
}
