//! The serial protocol, section "Lines": ends, tags, length, garbage, and how many may wait.

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
            rig.assert_unchanged(&before, "a bad byte");
        }
    }
    let reply = rig.ask_bytes(b"@17 m \x001\n");
    assert!(reply.starts_with("@17 ERR bad-byte "), "{reply}");
    assert_eq!(rig.ask("GetStatus"), STATUS);
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
