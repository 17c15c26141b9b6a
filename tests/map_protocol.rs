//! The map, as lines.

mod common;

use common::{Rig, is_unsolicited};

/// A base that stands at the first place of a map.
fn at_door() -> Rig {
    let mut rig = Rig::noiseless();
    assert_eq!(rig.ask("Mark door 0.4"), "Marked door");
    rig
}

/// The rows of a list.
fn rows(rig: &mut Rig, line: &str, head: &str) -> Vec<String> {
    rig.unsolicited();
    rig.receive(format!("{line}\n").as_bytes());
    let mut rows = Vec::new();
    for _ in 0..400 {
        rig.tick();
        rows.extend(rig.lines());
    }
    assert_eq!(rows.remove(0), head);
    assert!(rows.iter().all(|row| row.starts_with("~ ")), "{rows:?}");
    rows
}

/// The reply refuses, with this code; what was worked out to find that may be kept.
fn cannot(rig: &mut Rig, line: &str, code: &str) {
    let reply = rig.ask(line);
    assert!(
        reply.starts_with(&format!("ERR {code} ")),
        "{line}: {reply}"
    );
}

fn drive(rig: &mut Rig, turn: f64, distance: f64) {
    rig.ok(&format!("t {turn}"));
    rig.run(2.5);
    rig.ok(&format!("m {distance}"));
    rig.run(2.5 + distance.abs() / 0.3);
    rig.unsolicited();
}

#[test]
fn a_square_leads_back() {
    let mut rig = at_door();
    assert_eq!(rig.ask("AmIThere door"), "AmIThere door yes-maybe 1.000");
    assert_eq!(rig.ask("Sight lamp 0 2 3 0.1"), "Added door");
    for leg in 0..4 {
        drive(&mut rig, 90.0, 1.0);
        let there = rig.ask("AmIThere door");
        let is = there.starts_with("AmIThere door yes-maybe");
        // Figure 4: after one side and after two it is not, after four it is.
        assert!(is == (leg == 3) || leg == 2, "{leg}: {there}");
    }
    // The lamp is where it was. The circles before shrink.
    let confirmed = rig.ask("Sight lamp 0 2 3 0.1");
    assert_eq!(confirmed, "Confirmed door 1");
    let there = rig.ask("AmIThere door");
    // A circle of the meadow's size, as a Gaussian with the same variance: 1 − exp(−2).
    let probability: f64 = there.rsplit(' ').next().unwrap().parse().unwrap();
    assert!(probability > 0.86, "{there}");
}

#[test]
fn what_is_known_is_listed() {
    let mut rig = at_door();
    rig.ok("Label door lamp");
    drive(&mut rig, 0.0, 2.0);
    assert_eq!(rig.ask("Mark desk"), "Marked desk");
    rig.ok("Freeway door desk 0.8");
    let list = rows(&mut rig, "GetMap", "Map 2 1 1 door");
    assert_eq!(list.len(), 4, "{list:?}");
    assert_eq!(list[0], "~ place door 0.400");
    assert_eq!(list[1], "~ landmark lamp door");
    assert_eq!(list[2], "~ place desk 0.500");
    let list = &list[1..];
    // [1.85, 2.15] m, ±(5 + 2 × 0.6)°: d = 2/cos 6.2° cos 1.2° or so.
    assert!(list[2].starts_with("~ arc door desk 2.0"), "{list:?}");
    let numbers: Vec<f64> = list[2]
        .split(' ')
        .skip(4)
        .map(|w| w.parse().unwrap())
        .collect();
    let [d, beta, r, eta, alpha, freeway, x, y, theta, ..] = numbers[..] else {
        panic!("{list:?}");
    };
    assert!(
        (d - 2.01).abs() < 0.01 && (r - 0.27).abs() < 0.01,
        "{list:?}"
    );
    assert!(beta.abs() < 0.01 && eta.abs() < 0.01 && (alpha - 6.2).abs() < 0.01);
    assert!(freeway == 0.8 && (x - 2.0).abs() < 1e-3 && y.abs() < 1e-3 && theta.abs() < 1e-3);
    assert_eq!(
        rows(&mut rig, "Route door desk 0.7", "Route 2"),
        ["~ route door", "~ route desk"]
    );
    rig.refused("Route door desk 0.9", "unknown");
    rig.ok("Freeway desk door -");
    rig.refused("Route door desk 0", "unknown");
    let there = rows(&mut rig, "AmIThere", "AmIThere 2");
    assert!(there[0].starts_with("~ there door no 0.000"), "{there:?}");
    assert!(
        there[1].starts_with("~ there desk yes-maybe 1.000"),
        "{there:?}"
    );
    rig.ok("ForgetMap");
    assert_eq!(
        rows(&mut rig, "GetMap", "Map 0 0 0 -"),
        Vec::<String>::new()
    );
    assert_eq!(
        rows(&mut rig, "AmIThere", "AmIThere 0"),
        Vec::<String>::new()
    );
}

#[test]
fn what_does_not_exist_is_unknown() {
    let mut rig = at_door();
    for (line, what) in [
        ("AmIThere desk", "no such place"),
        ("Label desk lamp", "no such place"),
        ("Freeway door desk 1", "no such place"),
        ("Freeway door door 1", "no arc between the two"),
        ("Route door desk 0", "no such place"),
        ("Crosses door door door desk", "no such place"),
    ] {
        assert_eq!(rig.ask(line), format!("ERR unknown {what}"), "{line}");
    }
    // In the meadow, any landmark is a new one of this place: first out of it.
    drive(&mut rig, 0.0, 1.0);
    let reply = rig.ask("Sight lamp");
    assert_eq!(reply, "ERR unknown no place with that landmark is possible");
    assert_eq!(rig.ask("Mark desk"), "Marked desk");
    let reply = rig.ask("Route door desk 0");
    assert_eq!(reply, "ERR unknown no way that is wide enough");
}

#[test]
fn what_is_not_understood_is_refused() {
    let mut rig = at_door();
    for line in [
        "Mark",
        "Mark a-name-of-16-bytes",
        "Mark d+r",
        "Mark desk 1 2",
        "Mark desk x",
        "AmIThere a b",
        "Sight",
        "Sight lamp 10",
        "Sight lamp 10 1 2 3 4",
        "Label door",
        "Freeway door desk",
        "Route door desk",
        "Crosses door door door",
        "GetMap 1",
        "ForgetMap 1",
    ] {
        rig.refused(line, "syntax");
    }
    for line in [
        "Mark desk -1",
        "Mark desk 1001",
        "Sight lamp 361 1",
        "Sight lamp 10 181",
        "Sight lamp 10 1 -1",
        "Sight lamp 10 1 1 -1",
        "Freeway door door -1",
        "Route door door 1e4",
    ] {
        rig.refused(line, "range");
    }
    assert_eq!(
        rows(&mut rig, "GetMap", "Map 1 0 0 door"),
        ["~ place door 0.400"]
    );
}

#[test]
fn a_contradiction_is_told_and_changes_nothing() {
    let mut rig = at_door();
    drive(&mut rig, 0.0, 2.0);
    assert_eq!(rig.ask("Mark desk"), "Marked desk");
    let before = rows(&mut rig, "GetMap", "Map 2 0 1 door");
    // 2 m away it is not at the door.
    cannot(&mut rig, "Mark door", "contradiction");
    cannot(&mut rig, "Mark door 1", "contradiction");
    assert_eq!(rows(&mut rig, "GetMap", "Map 2 0 1 door"), before);
    // It still knows where it is.
    assert!(rig.ask("AmIThere door").starts_with("AmIThere door no"));
    // A meadow that reaches here is another matter.
    assert!(rig.ask("Mark door 2").starts_with("Confirmed door"));
}

#[test]
fn a_landmark_of_two_places_is_one_of_both() {
    let mut rig = at_door();
    rig.ok("Label door lamp");
    drive(&mut rig, 0.0, 1.0);
    assert_eq!(rig.ask("Mark desk 0.55"), "Marked desk");
    rig.ok("Label desk lamp");
    // Half way: it may be in either meadow.
    drive(&mut rig, 180.0, 0.5);
    assert_eq!(rig.ask("Sight lamp"), "Unsure 2");
    // Beyond both.
    drive(&mut rig, 0.0, 0.6);
    assert!(rig.ask("Sight lamp").starts_with("Confirmed door"));
}

#[test]
fn a_map_is_full_at_32_places() {
    let mut rig = Rig::noiseless();
    for place in 0..32 {
        assert_eq!(
            rig.ask(&format!("Mark p{place}")),
            format!("Marked p{place}")
        );
    }
    cannot(&mut rig, "Mark p32", "full");
    for label in 0..4 {
        rig.ok(&format!("Label p3 l{label}"));
    }
    rig.refused("Label p3 l4", "full");
    assert_eq!(rows(&mut rig, "GetMap", "Map 32 4 31 p0").len(), 67);
}

#[test]
fn a_stop_waits_for_no_question() {
    let mut rig = Rig::noiseless();
    for place in 0..32 {
        assert_eq!(
            rig.ask(&format!("Mark p{place}")),
            format!("Marked p{place}")
        );
    }
    rig.ok("m inf 0.3");
    rig.run(1.0);
    rig.lines();
    rig.receive(b"Crosses p0 p9 p20 p31\nStop\n");
    rig.run(0.01);
    // Nothing has been said yet, and the base stops.
    assert_eq!(rig.lines(), Vec::<String>::new());
    assert_eq!(rig.snapshot().translation.state.name(), "DECCEL");
    rig.run(1.0);
    let lines = rig.lines();
    let replies: Vec<&String> = lines.iter().filter(|line| !is_unsolicited(line)).collect();
    assert_eq!(replies, ["Crosses may", "OK"]);
}

#[test]
fn ways_cross_or_not() {
    let mut rig = at_door();
    for line in [
        "SetParam bound_turn 1",
        "SetParam bound_turn_per_m 0.1",
        "SetParam bound_dist 0.02",
        "SetParam bound_dist_rel 0.01",
    ] {
        rig.ok(line);
    }
    for name in ["a", "b", "c"] {
        drive(&mut rig, 90.0, 2.0);
        assert_eq!(rig.ask(&format!("Mark {name}")), format!("Marked {name}"));
    }
    // A square: its diagonals cross, its sides do not.
    assert_eq!(rig.ask("Crosses door b a c"), "Crosses must");
    assert_eq!(rig.ask("Crosses door a b c"), "Crosses cannot");
    assert_eq!(rig.ask("Crosses door a a b"), "Crosses may");
}

/// Around a rectangle of 4 m by 2 m, with a lamp at its first corner and a plant at its third; the plant is sighted so often.
fn around(sightings: u32) -> (Rig, String) {
    let mut rig = Rig::noiseless();
    for line in [
        "SetParam bound_turn 3",
        "SetParam bound_turn_per_m 0.4",
        "SetParam bound_dist_rel 0.02",
    ] {
        rig.ok(line);
    }
    assert_eq!(rig.ask("Mark door 0.3"), "Marked door");
    assert_eq!(rig.ask("Sight lamp 0 1 3 0.05"), "Added door");
    drive(&mut rig, 0.0, 4.0);
    assert_eq!(rig.ask("Mark desk 0.3"), "Marked desk");
    drive(&mut rig, 90.0, 2.0);
    assert_eq!(rig.ask("Mark window 0.3"), "Marked window");
    assert_eq!(rig.ask("Sight plant 80 0.3 30 0.05"), "Added window");
    // Still there, but it has turned: now a sighting tells something.
    rig.ok("t 90");
    rig.run(2.5);
    rig.unsolicited();
    let mut told = 0;
    for _ in 1..sightings {
        let reply = rig.ask("Sight plant -10 0.3 30 0.05");
        told += u32::from(reply == "Confirmed window 1");
        rig.run(0.1);
    }
    assert_eq!(told > 0, sightings > 1);
    drive(&mut rig, 0.0, 4.0);
    assert_eq!(rig.ask("Mark shelf 0.3"), "Marked shelf");
    drive(&mut rig, 90.0, 2.0);
    let reply = rig.ask("Sight lamp 90 1 3 0.05");
    (rig, reply)
}

#[test]
fn seeing_a_landmark_again_and_again_does_not_end_the_journey() {
    // The shelf as seen from the door: backward reasoning has put it there, and its circle is no larger than with one sighting.
    let radius = |sightings: u32| -> f64 {
        let (mut rig, reply) = around(sightings);
        assert_eq!(reply, "Confirmed door 2");
        let rows = rows(&mut rig, "GetMap", "Map 4 2 5 door");
        let row = rows.iter().find(|row| row.contains(" door shelf "));
        let row = row.unwrap_or_else(|| panic!("{sightings}: {rows:?}"));
        row.split(' ').nth(6).unwrap().parse().unwrap()
    };
    let (once, often) = (radius(1), radius(20));
    assert!(often <= once + 1e-3, "{once} {often}");
}

#[test]
fn a_landmark_that_was_labelled_first_makes_a_freeway_when_it_is_sighted() {
    let mut rig = at_door();
    drive(&mut rig, 0.0, 2.0);
    assert_eq!(rig.ask("Mark desk"), "Marked desk");
    rig.ok("Label desk door");
    rig.refused("Route desk door 0", "unknown");
    assert_eq!(rig.ask("Sight door 180 1 2 0.1"), "Confirmed desk 0");
    assert_eq!(rig.ask("Route desk door 0"), "Route 2");
}

#[test]
fn who_knows_better_says_so() {
    // The base believes that it is 2 m from the door; somebody has carried it back.
    let mut rig = at_door();
    drive(&mut rig, 0.0, 2.0);
    assert_eq!(rig.ask("Mark desk"), "Marked desk");
    cannot(&mut rig, "Mark door", "contradiction");
    rig.ok("ForgetMap here");
    assert_eq!(rig.ask("AmIThere desk"), "AmIThere desk yes-maybe -");
    assert_eq!(rig.ask("Mark door"), "Confirmed door 0");
    assert_eq!(rig.ask("AmIThere desk"), "AmIThere desk no 0.000");
    assert_eq!(rows(&mut rig, "GetMap", "Map 2 0 1 door").len(), 3);
    rig.refused("ForgetMap there", "syntax");
    rig.refused("ForgetMap here now", "syntax");
}

#[test]
fn what_is_seen_where_the_base_has_stayed_is_not_forgotten() {
    // After turning about for a while it does not know its heading any more; the plant tells, and the next arc is as good as from a standing start.
    let alpha = |looks: bool| -> f64 {
        let mut rig = at_door();
        drive(&mut rig, 0.0, 1.0);
        assert_eq!(rig.ask("Mark desk"), "Marked desk");
        assert_eq!(rig.ask("Sight plant 10 1 30 0.1"), "Added desk");
        for turn in [170, 170, 20] {
            rig.ok(&format!("t {turn}"));
            rig.run(4.0);
        }
        if looks {
            let reply = rig.ask("Sight plant 10 1 30 0.1");
            assert!(reply.starts_with("Confirmed desk "), "{reply}");
        }
        drive(&mut rig, 0.0, 1.0);
        assert_eq!(rig.ask("Mark shelf"), "Marked shelf");
        let arcs = rows(&mut rig, "GetMap", "Map 3 1 2 door");
        let row = arcs
            .iter()
            .find(|row| row.contains(" desk shelf "))
            .unwrap();
        row.split(' ').nth(8).unwrap().parse().unwrap()
    };
    let (blind, seeing) = (alpha(false), alpha(true));
    // 360° take two bounds of 5°, and the run 0.6°; or 2° of two sightings, the play of the meadow, and one bound more for the run.
    assert!(blind > 10.0 && seeing < 8.5, "{blind} {seeing}");
}

#[test]
fn a_freeway_that_was_taken_back_stays_so() {
    let mut rig = at_door();
    drive(&mut rig, 0.0, 2.0);
    assert_eq!(rig.ask("Mark desk"), "Marked desk");
    assert_eq!(rig.ask("Sight door 180 1 2 0.1"), "Added desk");
    assert_eq!(rig.ask("Route desk door 0"), "Route 2");
    rig.run(0.1);
    rig.lines();
    rig.ok("Freeway desk door -");
    let reply = rig.ask("Sight door 180 1 2 0.1");
    assert!(reply.starts_with("Confirmed desk "), "{reply}");
    rig.refused("Route desk door 0", "unknown");
}

#[test]
fn bounds_hold_for_what_they_were_set_for() {
    // A motion under way when bounds shrink has the wider ones; the next one has not.
    let mut rig = at_door();
    rig.ok("m 1");
    rig.run(2.0);
    rig.ok("SetParam bound_turn 0.1");
    rig.run(5.0);
    assert_eq!(rig.ask("Mark desk"), "Marked desk");
    drive(&mut rig, 0.0, 1.0);
    assert_eq!(rig.ask("Mark window"), "Marked window");
    let arcs = rows(&mut rig, "GetMap", "Map 3 0 2 door");
    let alpha = |row: &str| -> f64 { row.split(' ').nth(8).unwrap().parse().unwrap() };
    // ±5° or ±0.1°, and 0.6 °/m.
    assert!((alpha(&arcs[3]) - 5.6).abs() < 0.01, "{arcs:?}");
    assert!((alpha(&arcs[4]) - 0.7).abs() < 0.01, "{arcs:?}");
}

#[test]
fn corrections_do_not_move_the_map() {
    // Figure 4's drive, while corrections throw the estimate about.
    let mut rig = Rig::new();
    assert_eq!(rig.ask("Mark door 0.4"), "Marked door");
    rig.ok("SetParam gate 0");
    for _ in 0..4 {
        drive(&mut rig, 90.0, 1.0);
        let reply = rig.ask("ObservePos 3 -2 50 1e-4 0 0 1e-4 0 1");
        assert!(reply.starts_with("Observed"), "{reply}");
        rig.run(0.2);
    }
    let there = rig.ask("AmIThere door");
    assert!(there.starts_with("AmIThere door yes-maybe"), "{there}");
    let probability: f64 = there.rsplit(' ').next().unwrap().parse().unwrap();
    // By odometry it is back within some centimetres, and the meadow is 0.4 m.
    assert!(probability > 0.99, "{there}");
}

#[test]
fn a_reply_comes_in_order_with_its_tag_and_check() {
    let mut rig = at_door();
    let replies = rig.ask_all(b"@1 AmIThere door\n@2 GetTime\n@3 Mark desk\n", 3);
    assert!(
        replies[0].starts_with("@1 AmIThere door yes-maybe"),
        "{replies:?}"
    );
    assert!(replies[1].starts_with("@2 Time"), "{replies:?}");
    assert_eq!(replies[2], "@3 Marked desk");
    assert!(!is_unsolicited(&replies[0]));
}
