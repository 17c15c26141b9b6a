//! The serial protocol: the check at a line's end, and `require_crc`.

mod common;

use common::{Rig, checked, crc, unchecked};

#[test]
fn the_check_is_that_of_the_catalogue() {
    assert_eq!(crc(b"123456789"), 0x29B1);
}

#[test]
fn a_line_with_a_check_is_answered_with_one() {
    let mut rig = Rig::new();
    for line in [
        "GetStatus",
        "@17 GetStatus",
        "m 1",
        "Hello",
        "@17",
        "@3 GetParam none",
        "Help",
    ] {
        let plain = Rig::new().ask(line);
        assert_eq!(unchecked(&rig.ask(&checked(line))), plain, "{line}");
        rig = Rig::new();
        let (content, check) = checked(line)
            .rsplit_once('*')
            .map(|(a, b)| (a.to_owned(), b.to_lowercase()))
            .unwrap();
        assert_eq!(
            unchecked(&rig.ask(&format!("{content}*{check}"))),
            plain,
            "{line}"
        );
    }
}

#[test]
fn a_line_without_a_check_is_answered_without_one() {
    let mut rig = Rig::new();
    unchecked(&rig.ask(&checked("GetStatus")));
    assert_eq!(rig.ask("GetStatus"), "Status HOLD HOLD enabled none");
}

#[test]
fn a_wrong_check_is_refused() {
    let mut rig = Rig::new();
    rig.ask("GetStatus");
    let right = checked("m 1");
    for line in [
        "m 1*0000".to_owned(),
        "m 1*".to_owned(),
        "m 1*1".to_owned(),
        "m 1*xxxx".to_owned(),
        format!("{right}0"),
        right.replace("m 1", "m 2"),
        right.replace("m 1", "M 1"),
        right.replace("m 1", "m  1"),
        "Stop*0000".to_owned(),
        "EStop*0000".to_owned(),
        "*0000".to_owned(),
    ] {
        let before = rig.state();
        let reply = rig.ask(&line);
        assert!(
            unchecked(&reply).starts_with("ERR checksum "),
            "{line}: {reply}"
        );
        rig.assert_unchanged(&before, &line);
    }
    let reply = rig.ask("@17 m 1*0000");
    assert!(
        unchecked(&reply).starts_with("@17 ERR checksum "),
        "{reply}"
    );
}

#[test]
fn every_flip_of_a_bit_in_a_checked_line_is_noticed() {
    let line = checked("m 1.5 0.2").into_bytes();
    for bit in 0..line.len() * 8 {
        let mut rig = Rig::new();
        let mut damaged = line.clone();
        damaged[bit / 8] ^= 1 << (bit % 8);
        // Case does not matter in the hex digits; a flip into a line end makes two lines.
        if damaged.eq_ignore_ascii_case(&line) && bit / 8 > 9
            || damaged.contains(&b'\n')
            || damaged.contains(&b'\r')
        {
            continue;
        }
        damaged.push(b'\n');
        let reply = rig.ask_bytes(&damaged);
        assert!(reply.contains("ERR "), "bit {bit}: {reply}");
    }
}

#[test]
fn a_required_check_must_be_there() {
    let mut rig = Rig::new();
    rig.ok("SetParam require_crc 1");
    for line in [
        "GetStatus",
        "@17 GetStatus",
        "m 1",
        "Hello",
        "Stop 1",
        "SetParam require_crc 0",
        "ClearFault",
    ] {
        let before = rig.state();
        let reply = rig.ask(line);
        assert!(
            unchecked(&reply).contains("ERR checksum "),
            "{line}: {reply}"
        );
        rig.assert_unchanged(&before, line);
    }
    assert_eq!(
        unchecked(&rig.ask(&checked("GetStatus"))),
        "Status HOLD HOLD enabled none"
    );
}

#[test]
fn stop_and_estop_need_no_check() {
    let mut rig = Rig::new();
    rig.ok("SetParam require_crc 1");
    for (line, reply) in [
        ("Stop", "OK"),
        ("@3 STOP", "@3 OK"),
        ("EStop", "OK"),
        ("@4 estop", "@4 OK"),
    ] {
        assert_eq!(unchecked(&rig.ask(line)), reply, "{line}");
    }
    rig.run(0.01);
    let status = rig.ask(&checked("GetStatus"));
    assert_eq!(unchecked(&status), "Status HOLD HOLD enabled estop");
}

#[test]
fn replies_events_telemetry_and_lists_carry_a_check_when_one_is_required() {
    let mut rig = Rig::new();
    rig.ok("SetParam require_crc 1");
    rig.unsolicited();
    for line in ["Stream 0.05", "m 0.1", "ListParams", "EStop"] {
        rig.ask(&checked(line));
        rig.run(0.2);
    }
    let lines = rig.unsolicited();
    assert!(lines.len() > 50);
    for line in &lines {
        unchecked(line);
    }
    assert!(lines.iter().any(|line| line.starts_with("! fault estop*")));
}

#[test]
fn a_requirement_holds_for_the_very_next_line() {
    let mut rig = Rig::new();
    let replies = rig.ask_all(b"SetParam require_crc 1\n@2 GetStatus\n", 2);
    assert!(
        unchecked(&replies[1]).starts_with("@2 ERR checksum "),
        "{replies:?}"
    );
}

#[test]
fn damaged_lines_are_answered_with_a_check_when_one_is_required() {
    let mut rig = Rig::new();
    rig.ok("SetParam require_crc 1");
    let reply = rig.ask_bytes(b"m \x01\n");
    assert!(unchecked(&reply).starts_with("ERR bad-byte "), "{reply}");
    let reply = rig.ask(&"m 1 ".repeat(100));
    assert!(unchecked(&reply).starts_with("ERR too-long "), "{reply}");
    rig.receive("@1 Stop\n".repeat(5).as_bytes());
    for reply in rig.ask_all(b"", 5) {
        unchecked(&reply);
    }
}

/// A line with its check in lower case.
fn lower(line: &str) -> String {
    let (content, check) = line.rsplit_once('*').unwrap();
    format!("{content}*{}", check.to_lowercase())
}

/// Lines whose checks have three letters, one and none.
const LETTERS: &str = "@0 GetTime";
const LETTER: &str = "@1 GetTime";
const DIGITS: &str = "@3 GetTime";

fn is_right(rig: &mut Rig, line: &str) -> bool {
    let before = rig.state();
    let reply = rig.ask(line);
    let refused = unchecked(&reply).contains("ERR checksum ");
    if refused {
        rig.assert_unchanged(&before, line);
    }
    !refused
}

#[test]
fn lines_have_the_letters_that_they_are_to_have() {
    for (line, letters) in [(LETTERS, 3), (LETTER, 1), (DIGITS, 0)] {
        let check = checked(line).split_off(line.len() + 1);
        let found = check.bytes().filter(u8::is_ascii_alphabetic).count();
        assert_eq!(found, letters, "{check}");
    }
}

#[test]
fn the_line_that_requires_checks_says_in_which_case() {
    let set = checked("SetParam require_crc 1");
    let upper: fn(&str) -> String = str::to_owned;
    for [its, other] in [[upper, lower], [lower, upper]] {
        let mut rig = Rig::new();
        assert_eq!(unchecked(&rig.ask(&its(&set))), "OK");
        rig.tick();
        for _ in 0..2 {
            for line in [LETTERS, LETTER, DIGITS].map(checked) {
                assert!(is_right(&mut rig, &its(&line)), "{line}");
            }
            for line in [LETTERS, LETTER].map(checked) {
                assert!(!is_right(&mut rig, &other(&line)), "{line}");
            }
            assert!(is_right(&mut rig, &other(&checked(DIGITS))));
        }
        // Set once more, it is still the same.
        assert!(!is_right(&mut rig, &other(&set)));
        assert!(is_right(&mut rig, &its(&set)));
        rig.tick();
        assert!(!is_right(&mut rig, &other(&checked(LETTER))));
    }
}

#[test]
fn without_a_line_that_says_it_the_first_letters_decide_the_case() {
    for by_hand in [false, true] {
        for is_lower in [false, true] {
            let mut params = vehicle_controller::params::Params::default();
            if !by_hand {
                params
                    .set(vehicle_controller::params::Id::RequireCrc, 1.0)
                    .unwrap();
            }
            let mut rig = Rig::with(params);
            if by_hand {
                rig.ok("SetParam require_crc 1");
            }
            let cased = |line, is_lower| {
                let line = checked(line);
                if is_lower { self::lower(&line) } else { line }
            };
            // Neither digits, nor what is refused, nor a mixture of cases.
            assert!(is_right(&mut rig, &cased(DIGITS, !is_lower)));
            for line in [
                "@0 GetTime*Ab3d",
                "@0 GetTime*ab3e",
                "@0 GetTime*AB3E",
                "@0 GetTime",
            ] {
                assert!(!is_right(&mut rig, line), "{line}");
            }
            let reply = rig.ask(&cased("SetParam nothing 7", !is_lower));
            assert!(unchecked(&reply).starts_with("ERR unknown "), "{reply}");
            assert!(is_right(&mut rig, &cased(LETTER, is_lower)));
            assert!(!is_right(&mut rig, &cased(LETTER, !is_lower)));
            assert!(!is_right(&mut rig, &cased(LETTERS, !is_lower)));
            assert!(!is_right(&mut rig, "@0 GetTime*Ab3d"));
        }
    }
}

#[test]
fn a_requirement_that_is_taken_back_takes_the_case_with_it() {
    let [on, off] = ["1", "0"].map(|value| checked(&format!("SetParam require_crc {value}")));
    let mut rig = Rig::new();
    for off in [off, checked("@0 ResetParams")] {
        assert_eq!(unchecked(&rig.ask(&on)), "OK");
        rig.tick();
        assert!(!is_right(&mut rig, &lower(&checked(LETTER))));
        assert!(is_right(&mut rig, &off));
        rig.tick();
        // Now any mixture goes.
        for check in ["Ab3D", "aB3d", "AB3D"] {
            assert!(is_right(&mut rig, &format!("{LETTERS}*{check}")));
        }
        assert_eq!(unchecked(&rig.ask(&lower(&on))), "OK");
        rig.tick();
        assert!(is_right(&mut rig, &lower(&checked(LETTER))));
        assert!(!is_right(&mut rig, &checked(LETTER)));
        assert!(is_right(&mut rig, &lower(&off)));
        rig.tick();
    }
    // A mixture requires checks, and decides nothing.
    assert_eq!(unchecked(&rig.ask("SetParam require_crc 1*F52a")), "OK");
    rig.tick();
    assert!(is_right(&mut rig, &lower(&checked(LETTER))));
    assert!(!is_right(&mut rig, &checked(LETTER)));
}

#[test]
fn what_stops_the_base_is_right_in_either_case() {
    let mut rig = Rig::new();
    assert_eq!(
        unchecked(&rig.ask(&checked("SetParam require_crc 1"))),
        "OK"
    );
    rig.tick();
    for line in ["@5 Stop", "@7 EStop"] {
        let line = checked(line);
        let (_, check) = line.rsplit_once('*').unwrap();
        assert!(check.bytes().any(|b| b.is_ascii_alphabetic()), "{line}");
        assert!(
            unchecked(&rig.ask(&lower(&line))).ends_with(" OK"),
            "{line}"
        );
        rig.tick();
        // It has decided nothing.
        assert!(is_right(&mut rig, &checked(LETTER)));
    }
    assert!(unchecked(&rig.ask(&checked("GetStatus"))).ends_with(" estop"));
}
