//! What is taken, and what is not.

use crate::alone::alone;
use crate::common::{Base, sleep};
use crate::peer::{Peer, number};
use crate::stage::{REST, Stage};

/// 0.3 m/s at 1 m/s², a quarter of a second of silence, and this machine, s.
const STOPPED: f64 = 1.0;

fn is_near(base: &Base, x: f64, y: f64, yaw: f64) -> bool {
    let [ex, ey, theta] = base.now().estimate;
    (ex - x).hypot(ey - y) < 0.02 && (theta - yaw).abs() < 0.05
}

fn wait_until_near(base: &Base, x: f64, y: f64, yaw: f64) {
    for _ in 0..1000 {
        if is_near(base, x, y, yaw) {
            return;
        }
        sleep(0.01);
    }
    panic!("{:?} is not {x} {y} {yaw}", base.now());
}

#[test]
fn speeds_are_taken_reliable_or_not() {
    alone("commands::speeds_are_taken_reliable_or_not", || {
        let stage = Stage::set();
        let _bridge = stage.bridge(&[]);
        let mut peer = Peer::start("r1");
        peer.ask("wait 10");
        for kind in ["best_effort", "reliable"] {
            let driven = peer.ask(&format!("drive 0.2 0.5 1.5 {kind}"));
            assert_eq!(driven["matched"], 1, "{kind}");
            let (v, omega) = (
                number(&driven, "/odom/twist/twist/linear/x"),
                number(&driven, "/odom/twist/twist/angular/z"),
            );
            assert!(
                (v - 0.2).abs() < 0.02 && (omega - 0.5).abs() < 0.05,
                "{kind}: {v} {omega}"
            );
            sleep(STOPPED);
            assert!(stage.base.speed().0 < REST, "{kind}");
        }
    });
}

/// One reader of each type on the same name would take bytes of one for the other.
#[test]
fn another_type_never_matches() {
    alone("commands::another_type_never_matches", || {
        let stage = Stage::set();
        for (option, right, wrong) in [
            ("false", "best_effort", "stamped"),
            ("true", "stamped", "best_effort"),
        ] {
            let bridge = stage.bridge(&["-p", &format!("cmd_vel.stamped:={option}")]);
            let mut peer = Peer::start("r1");
            peer.ask("wait 10");
            let before = stage.base.now().pose;
            let driven = peer.ask(&format!("drive 0.2 0 1 {wrong}"));
            assert_eq!(driven["matched"], 0, "{wrong}");
            let after = stage.base.now().pose;
            // 20 cm, if it were taken; it may still settle from the drive before.
            assert!(
                (after[0] - before[0]).hypot(after[1] - before[1]) < 1e-3,
                "{wrong} moved it"
            );
            let driven = peer.ask(&format!("drive 0.2 0 1 {right}"));
            assert_eq!(driven["matched"], 1, "{right}");
            assert!(
                number(&driven, "/odom/twist/twist/linear/x") > 0.15,
                "{driven}"
            );
            assert!(bridge.terminate().success());
        }
    });
}

#[test]
fn numbers_that_are_none_are_refused_and_counted() {
    alone(
        "commands::numbers_that_are_none_are_refused_and_counted",
        || {
            let stage = Stage::set();
            let _bridge = stage.bridge(&[]);
            let mut peer = Peer::start("r1");
            peer.ask("wait 10");
            let before = stage.base.now().pose;
            for (v, omega) in [("nan", "0"), ("0.2", "nan"), ("inf", "0"), ("0", "-inf")] {
                assert_eq!(peer.ask(&format!("drive {v} {omega} 0.5"))["matched"], 1);
            }
            assert_eq!(
                stage.base.now().pose.map(|at| (at * 1e6) as i64),
                before.map(|at| (at * 1e6) as i64)
            );
            sleep(1.1);
            let diagnostics = peer.ask("diagnostics").to_string();
            assert!(diagnostics.contains("cmd_vel not finite"), "{diagnostics}");
            // A number that is one is taken after them.
            let driven = peer.ask("drive 0.2 0 1");
            assert!(number(&driven, "/odom/twist/twist/linear/x") > 0.15);
        },
    );
}

#[test]
fn what_a_network_has_held_back_is_not_obeyed() {
    alone(
        "commands::what_a_network_has_held_back_is_not_obeyed",
        || {
            let stage = Stage::set();
            let _bridge = stage.bridge(&[]);
            let mut peer = Peer::start("r1");
            peer.ask("wait 10");
            let begin = stage.base.now().t;
            assert_eq!(peer.ask("late 0.3 0 0.8")["matched"], 1);
            sleep(1.1);
            let driven = |since: f64| {
                let all = stage.base.since(since);
                all.iter().map(|truth| truth.reference).fold(0.0, f64::max)
            };
            assert_eq!(driven(begin), 0.0);
            let diagnostics = peer.ask("diagnostics").to_string();
            assert!(diagnostics.contains("cmd_vel stale"), "{diagnostics}");
            // What is held back for no longer than a network may is.
            let begin = stage.base.now().t;
            peer.ask("late 0.3 0 0.25");
            sleep(0.3);
            assert!(driven(begin) > 0.02, "{}", driven(begin));
        },
    );
}

#[test]
fn poses_are_gone_to_set_and_corrected() {
    alone("commands::poses_are_gone_to_set_and_corrected", || {
        let stage = Stage::set();
        let _bridge = stage.bridge(&[]);
        let mut peer = Peer::start("r1");
        peer.ask("wait 10");
        assert_eq!(peer.ask("goal 0.4 0.2 0.5")["matched"], 1);
        wait_until_near(&stage.base, 0.4, 0.2, 0.5);
        // It has come to its end: a goal is a place of the map, and would be gone to from wherever the base is set.
        sleep(1.0);
        assert_eq!(peer.ask("initial 2 1 0")["matched"], 1);
        wait_until_near(&stage.base, 2.0, 1.0, 0.0);
        // The estimate is as sure as the fix: it goes half the way there.
        assert_eq!(peer.ask("fix 2.02 1 0")["matched"], 1);
        let half_way = || (stage.base.now().estimate[0] - 2.01).abs() < 0.003;
        for _ in 0..200 {
            if half_way() {
                break;
            }
            sleep(0.01);
        }
        assert!(half_way(), "{:?}", stage.base.now());
    });
}

#[test]
fn services_are_answered_as_cyclone_has_them() {
    alone(
        "commands::services_are_answered_as_cyclone_has_them",
        || {
            let stage = Stage::set();
            let _bridge = stage.bridge(&["-p", "services.mapping:=cyclone"]);
            let mut peer = Peer::start("r1");
            peer.ask("wait 10");
            peer.ask("set_pose 1 2 0.5");
            assert!(
                is_near(&stage.base, 1.0, 2.0, 0.5),
                "{:?}",
                stage.base.now()
            );
            peer.ask("begin 0.3 0");
            stage.wait_for_speed(0.25);
            let off = peer.ask("enable 0");
            assert_eq!(
                (off["success"].as_bool(), off["message"].as_str()),
                (Some(true), Some("OK"))
            );
            sleep(STOPPED);
            assert!(stage.base.speed().0 < REST);
            assert_eq!(peer.ask("enable 1")["success"], true);
            stage.wait_for_speed(0.25);
            peer.ask("end");
            let stopped = peer.ask("trigger stop");
            assert_eq!(stopped["success"], true, "{stopped}");
            stage.base.task(|rig| rig.send(b"SetParam estop_input 1\n"));
            stage.base.task(|rig| rig.set_estop(true));
            sleep(0.5);
            let refused = peer.ask("trigger clear_fault");
            assert_eq!(refused["success"], false);
            assert!(
                refused["message"].as_str().unwrap().starts_with("fault"),
                "{refused}"
            );
            stage.base.task(|rig| rig.set_estop(false));
            sleep(0.2);
            assert_eq!(peer.ask("trigger clear_fault")["success"], true);
        },
    );
}
