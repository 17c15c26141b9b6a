//! The serial protocol: paths of a base that cannot turn in place. What it cannot drive is refused, and the path under way stays what it is.

mod wheeled;

use vehicle_controller::params::{Id, Params};
use vehicle_controller::vehicle::Kind;
use wheeled::base::Base;
use wheeled::{Car, car, params};

const AHEAD: &str = "ERR range posture 1 does not lie ahead, and the vehicle cannot turn in place";

fn sharp(number: u32) -> String {
    format!("ERR range posture {number} takes too sharp a turn: the vehicle cannot turn in place")
}

fn cycab_params() -> Params {
    params(
        Kind::BiSteerable,
        &[
            (Id::WheelBase, 1.2),
            (Id::Track, 1.2),
            (Id::LeftDiameter, 0.4),
            (Id::RightDiameter, 0.4),
            (Id::SteerMax, 30.0),
            (Id::SteerRate, 60.0),
            (Id::RearSteered, 1.0),
            (Id::CountsPerTurn, 1e6),
            (Id::MoveSpeed, 0.5),
            (Id::MaxAccel, 1.0),
        ],
    )
}

/// A car whose steering follows, and that can drive a corner 1 m off.
fn cycab() -> Base<Car> {
    let params = cycab_params();
    let mut base = Base::new(car(&params), &params);
    base.rate = 2.0;
    base.tick();
    ok(&mut base, "SetParam corner 1");
    base.lines();
    base
}

fn ok(base: &mut Base<Car>, line: &str) {
    assert_eq!(base.ask(line), "OK", "{line}");
}

/// A refusal while it stands changes nothing of what the interpreter keeps.
fn refused(base: &mut Base<Car>, line: &str, reply: &str) {
    let before = base.kept();
    assert_eq!(base.ask(line), reply, "{line}");
    let after = base.kept();
    if before != after {
        let same = before.bytes().zip(after.bytes());
        let from = same.take_while(|(a, b)| a == b).count().saturating_sub(80);
        let part = |s: &str| s.chars().skip(from).take(200).collect::<String>();
        panic!("{line:?} changed\n{}\nto\n{}", part(&before), part(&after));
    }
}

/// What is told in so many seconds, and at which ms.
fn told(base: &mut Base<Car>, seconds: u32) -> Vec<(u32, String)> {
    let mut told = Vec::new();
    for at in 0..seconds * 1000 {
        base.tick();
        let lines = base.lines();
        told.extend(lines.into_iter().map(|line| (at, line)));
    }
    told
}

fn events(base: &mut Base<Car>, seconds: u32) -> Vec<String> {
    told(base, seconds)
        .into_iter()
        .map(|(_, line)| line)
        .filter(|line| line.starts_with("! "))
        .collect()
}

#[test]
fn it_goes_to_what_lies_ahead_only() {
    let mut base = cycab();
    ok(&mut base, "Follow 5 5");
    for line in ["GoTo 0 2", "GoTo -1 0", "GoTo 2 0.1", "GoTo 0 -1 -90"] {
        refused(&mut base, line, AHEAD);
    }
    for line in [
        "GoTo 2 0 90",
        "GoTo 0 0 180",
        "GoTo 0 0 1.1",
        // Ahead, within a degree; so is the heading, and yet they are more than a degree apart.
        "GoTo 10 0.15 -0.9",
    ] {
        refused(&mut base, line, &sharp(1));
    }
    assert_eq!(base.ask("GetPath"), "~ 1 5.000000 5.000000 - -");
    for line in ["GoTo 1 0", "GoTo 2 0 0.5", "GoTo 2 0"] {
        ok(&mut base, line);
        assert_eq!(events(&mut base, 6), ["! path done"], "{line}");
    }
    assert!((base.snapshot().estimator.present().pose.x - 2.0).abs() < 0.01);
}

#[test]
fn a_path_with_a_corner_too_sharp_is_refused_whole() {
    for (lines, number) in [
        (&["Follow 3 0", "Follow 3 0.3", "Follow 9 0.3"][..], 1),
        (&["Follow 4 0", "Follow 8 0", "Follow 4 0"], 2),
        (&["Follow 4 0", "Follow 8 4 -45"], 2),
        (&["Follow 4 0 0", "Follow 8 4"], 1),
    ] {
        let mut base = cycab();
        for line in lines {
            ok(&mut base, line);
        }
        // Planned once, it stays a plan of nothing.
        assert_eq!(base.ask("Follow start"), sharp(number));
        refused(&mut base, "Follow start", &sharp(number));
        assert_eq!(events(&mut base, 1), Vec::<String>::new());
        assert_eq!(base.snapshot().wheels[0].count, 0);
    }
    let mut base = cycab();
    ok(&mut base, "Follow 0 4");
    assert_eq!(base.ask("Follow start"), AHEAD);
    refused(&mut base, "Follow start", AHEAD);
}

/// A right angle that is rounded.
fn under_way() -> Base<Car> {
    let mut base = cycab();
    for line in ["Follow 5 0", "Follow 5 6", "Follow start"] {
        ok(&mut base, line);
    }
    base
}

#[test]
fn a_corner_that_it_can_round_is_driven() {
    let mut base = under_way();
    assert_eq!(events(&mut base, 40), ["! posture 1", "! path done"]);
    let pose = base.snapshot().estimator.present().pose;
    // It does not come once more to a place that it has missed: half a degree over half a leg.
    assert!(
        (pose.x - 5.0).hypot(pose.y - 6.0) < 0.05,
        "it stands at {pose:?}"
    );
}

#[test]
fn what_is_refused_on_the_way_changes_nothing_of_it() {
    let alone = told(&mut under_way(), 40);
    for (at, lines) in [
        (2, &["GoTo 0 0", "Follow 5 0", "Follow 5 12 90 99"][..]),
        (9, &["Follow 5 12 0", "Follow 5 5.9"]),
        (16, &["Follow 5 12 0", "Follow 5 0", "GoTo 9 9"]),
    ] {
        let mut base = under_way();
        let mut heard = told(&mut base, at);
        let before = heard.len();
        for line in lines {
            base.say(line);
        }
        let later = told(&mut base, 40 - at);
        heard.extend(later.into_iter().map(|(ms, line)| (ms + at * 1000, line)));
        let refusals: Vec<_> = heard
            .extract_if(.., |(_, line)| line.starts_with("ERR "))
            .collect();
        assert_eq!(
            refusals.len(),
            lines.len(),
            "{lines:?} at {at} s: {heard:?}"
        );
        // To the millisecond.
        assert_eq!(heard, alone, "{lines:?} at {at} s, after {before}");
    }
}

#[test]
fn a_posture_that_joins_without_a_sharp_turn_is_taken() {
    let mut base = under_way();
    base.run(2.0);
    assert_eq!(base.ask("Follow 11 6"), "OK");
    assert_eq!(
        events(&mut base, 60),
        ["! posture 1", "! posture 2", "! path done"]
    );
}

#[test]
fn what_it_has_rolled_past_while_it_came_to_rest_is_told() {
    let mut base = cycab();
    ok(&mut base, "m 50 1 0.5");
    base.run(3.0);
    let x = base.snapshot().estimator.present().pose.x;
    // From 1 m/s it takes a metre to stop.
    ok(&mut base, &format!("GoTo {} 0", x + 0.5));
    assert_eq!(events(&mut base, 4), ["! path end refused"]);
    assert!(!base.snapshot().is_moving());
    assert!(base.ask("GetPath").starts_with("~ 1 "));
}

#[test]
fn it_chases_what_it_can_turn_to_while_it_moves() {
    let mut base = cycab();
    // Aside, it moves on a curve there; behind, it cannot.
    for n in 0..200 {
        ok(&mut base, "Chase 6 3");
        base.run(0.05);
        assert!(n < 199 || base.snapshot().estimator.present().pose.x > 3.0);
    }
    assert_eq!(events(&mut base, 6), ["! chase end timeout"]);
}
