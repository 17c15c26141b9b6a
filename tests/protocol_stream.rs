//! The serial protocol: telemetry.

mod common;

use common::{Rig, is_unsolicited};

fn numbers(line: &str) -> Vec<f64> {
    line.strip_prefix("~ ")
        .unwrap()
        .split(' ')
        .map(|w| w.parse().unwrap())
        .collect()
}

#[test]
fn the_default_fields_are_time_pose_and_speeds() {
    let mut rig = Rig::new();
    rig.ok("ResetPos 1 2 90");
    rig.ok("m inf 0.2 1");
    rig.run(1.0);
    rig.unsolicited();
    rig.ok("Stream 0.1");
    rig.run(1.0);
    let lines: Vec<Vec<f64>> = rig.unsolicited().iter().map(|line| numbers(line)).collect();
    // At once, and every 0.1 s.
    assert!((10..=11).contains(&lines.len()), "{}", lines.len());
    for pair in lines.windows(2) {
        assert!((pair[1][0] - pair[0][0] - 0.1).abs() < 1e-9, "{pair:?}");
        assert!((pair[1][2] - pair[0][2] - 0.02).abs() < 2e-6, "{pair:?}");
    }
    let last = lines.last().unwrap();
    assert_eq!(last.len(), 6);
    assert!(
        (last[1] - 1.0).abs() < 1e-6 && (last[3] - 90.0).abs() < 1e-5,
        "{last:?}"
    );
    assert!(
        (last[4] - 0.2).abs() < 1e-5 && last[5].abs() < 1e-5,
        "{last:?}"
    );
}

#[test]
fn named_fields_come_in_their_order() {
    let mut rig = Rig::new();
    rig.ok("ResetPos 1 2 90 0.25 0 0 1 0 4");
    rig.unsolicited();
    rig.ok("Stream 0.1 theta, y X cxx fault");
    rig.run(0.05);
    assert_eq!(
        rig.unsolicited(),
        ["~ 90.00000 2.000000 1.000000 2.50000e-1 none"]
    );
}

#[test]
fn period_zero_turns_it_off() {
    let mut rig = Rig::new();
    rig.ok("Stream 0.01");
    rig.run(0.1);
    rig.ok("Stream 0");
    rig.unsolicited();
    rig.run(1.0);
    assert_eq!(rig.unsolicited(), Vec::<String>::new());
}

#[test]
fn a_refused_stream_leaves_the_old_one() {
    let mut rig = Rig::new();
    rig.ok("Stream 0.1 x");
    rig.refused("Stream -1", "range");
    rig.refused("Stream 0.01 bogus", "syntax");
    rig.unsolicited();
    rig.run(1.0);
    assert_eq!(rig.unsolicited(), vec!["~ 0.000000"; 10]);
}

#[test]
fn of_the_widest_fields_a_line_has_as_many_as_fit_whole() {
    let mut rig = Rig::new();
    rig.ok("SetParam require_crc 1");
    rig.ask(&common::checked(
        "ResetPos -1e7 -1e7 -179 1e-12 -1e-20 -1e-20 1e-12 -1e-20 1e-12",
    ));
    rig.tick();
    let fields = "x y theta cxx cxy cxt cyy cyt ctt s s_ref alpha alpha_ref v_s v_alpha t";
    let line = common::checked(&format!("Stream 0.1 {fields}"));
    assert_eq!(common::unchecked(&rig.ask(&line)), "OK");
    rig.unsolicited();
    rig.run(0.25);
    for line in rig.unsolicited() {
        let numbers: Vec<&str> = common::unchecked(&line).split(' ').skip(1).collect();
        assert!(numbers.len() >= 13, "{line}");
        assert_eq!(numbers[0], "-10000000.000000");
        assert!(numbers.iter().all(|n| n.parse::<f64>().is_ok()), "{line}");
    }
}

#[test]
fn a_field_is_not_given_twice() {
    let mut rig = Rig::new();
    rig.refused("Stream 0.1 x y x", "syntax");
}

#[test]
fn telemetry_never_splits_a_reply() {
    let mut rig = Rig::new();
    rig.ok("Stream 0.001");
    rig.unsolicited();
    for n in 0..200 {
        rig.receive(format!("@{n} GetEstPos\n").as_bytes());
        rig.tick();
    }
    // `lines` looks at each one: printable, and no longer than 255.
    let lines = rig.lines();
    let (telemetry, replies): (Vec<&String>, Vec<&String>) =
        lines.iter().partition(|line| is_unsolicited(line));
    assert!(telemetry.iter().all(|line| line.split(' ').count() == 7));
    assert_eq!(replies.len(), 200);
    for (n, reply) in replies.iter().enumerate() {
        assert!(
            reply.starts_with(&format!("@{n} EstPos ")) && reply.split(' ').count() == 11,
            "{reply}"
        );
    }
}

#[test]
fn the_tick_load_is_the_largest_since_the_last_line() {
    let mut rig = Rig::new();
    rig.ok("Stream 0.01 t tick_load");
    rig.unsolicited();
    let mut heard = Vec::new();
    // In each period of the stream: what the ticks took.
    for shares in [&[][..], &[0.05, 0.5, 0.1], &[f32::NAN, 0.25], &[1.5, 0.0]] {
        for share in shares {
            rig.note_tick_load(*share);
        }
        rig.run(0.01);
        let lines = rig.unsolicited();
        assert_eq!(lines.len(), 1, "{lines:?}");
        heard.push(lines[0].split(' ').next_back().unwrap().to_owned());
    }
    // Not measured, or not at all since: no number, and never an old one.
    assert_eq!(heard, ["-", "0.500", "0.250", "1.500"]);
    rig.run(0.01);
    assert!(rig.unsolicited()[0].ends_with(" -"));
}

#[test]
fn telemetry_is_dropped_when_nobody_listens_but_replies_and_events_are_not() {
    let mut rig = Rig::new();
    rig.ok("Stream 0.01 t dropped");
    rig.unsolicited();
    rig.listening = false;
    rig.ok_unheard("@1 m 0.05 0.2 1");
    rig.run(5.0);
    rig.receive(b"@2 GetStatus\n@3 EStop\n@4 GetStatus\n");
    rig.run(1.0);
    rig.listening = true;
    rig.run(0.5);
    let lines = rig.lines();
    let replies: Vec<&String> = lines.iter().filter(|line| !is_unsolicited(line)).collect();
    assert_eq!(replies.len(), 4, "{replies:?}");
    for (reply, expected) in replies
        .iter()
        .zip(["@1 OK", "@2 Status", "@3 OK", "@4 Status"])
    {
        assert!(reply.starts_with(expected), "{reply}");
    }
    for event in ["! move done ", "! fault estop"] {
        assert_eq!(
            lines.iter().filter(|line| line.starts_with(event)).count(),
            1,
            "{event}"
        );
    }
    let last = lines.iter().rfind(|line| line.starts_with("~ ")).unwrap();
    assert!(numbers(last)[1] > 500.0, "about 600 lines were due: {last}");
}
