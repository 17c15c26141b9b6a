//! Each side ends, by its will and against it, and comes again.

use crate::alone::alone;
use crate::common::sleep;
use crate::peer::{Peer, number};
use crate::stage::{REST, Stage};
use std::time::{Duration, Instant};

/// The base's own deadman, s.
const DEADMAN: f64 = 1.0;
/// From 0.3 m/s at 1 m/s², a tick and this machine, s.
const RAMP: f64 = 0.3 + 0.15;
/// Lines that were under way, s.
const LATE: f64 = 0.05;

#[test]
fn a_bridge_that_is_killed_leaves_a_base_that_stops() {
    alone(
        "endings::a_bridge_that_is_killed_leaves_a_base_that_stops",
        || {
            let stage = Stage::set();
            let mut bridge = stage.bridge(&["-p", "services.mapping:=cyclone"]);
            let mut peer = Peer::start("r1");
            peer.ask("wait 10");
            for _ in 0..2 {
                peer.ask("begin 0.3 0.2");
                stage.wait_for_speed(0.25);
                let killed = stage.base.now().t;
                bridge.kill();
                stage.base.wait_until(killed + DEADMAN + RAMP + LATE);
                assert!(stage.base.speed().0 < REST, "{:?}", stage.base.speed());
                let stopped = stage.base.now().pose;
                // The next one says Stop first, and what is said all the while moves nothing: the deadman's fault waits for somebody who knows.
                bridge = stage.bridge(&["-p", "services.mapping:=cyclone"]);
                peer.ask("wait 10");
                sleep(1.0);
                let still = stage.base.now().pose;
                assert!((still[0] - stopped[0]).hypot(still[1] - stopped[1]) < 1e-3);
                assert_eq!(peer.ask("trigger clear_fault")["success"], true);
                stage.wait_for_speed(0.25);
                peer.ask("end");
                sleep(1.0);
            }
        },
    );
}

#[test]
fn a_driver_who_is_killed_is_missed_and_another_one_is_heard() {
    alone(
        "endings::a_driver_who_is_killed_is_missed_and_another_one_is_heard",
        || {
            let stage = Stage::set();
            let _bridge = stage.bridge(&[]);
            for _ in 0..3 {
                let begin = Instant::now();
                let mut driver = Peer::start("r1");
                driver.ask("wait 10");
                driver.ask("begin 0.3 0.2");
                stage.wait_for_speed(0.25);
                println!("a new driver drives after {:?}", begin.elapsed());
                let killed = stage.base.now().t;
                driver.kill();
                // Its writers stay matched for most of a minute. The silence counts: 0.25 s.
                stage.base.wait_until(killed + 0.25 + RAMP + LATE);
                assert!(stage.base.speed().0 < REST, "{:?}", stage.base.speed());
            }
        },
    );
}

#[test]
fn a_bridge_that_is_told_to_end_stops_the_base_and_says_goodbye() {
    alone(
        "endings::a_bridge_that_is_told_to_end_stops_the_base_and_says_goodbye",
        || {
            let stage = Stage::set();
            let bridge = stage.bridge(&[]);
            let mut peer = Peer::start("r1");
            peer.ask("wait 10");
            peer.ask("begin 0.3 0");
            stage.wait_for_speed(0.25);
            let told = (Instant::now(), stage.base.now().t);
            assert!(bridge.terminate().success());
            let ended = told.0.elapsed();
            assert!(ended < Duration::from_secs(1), "{ended:?}");
            // Not by the deadman.
            stage.base.wait_until(told.1 + RAMP + LATE);
            assert!(stage.base.speed().0 < REST, "{:?}", stage.base.speed());
            let gone = peer.ask("gone 10");
            assert!(
                gone["left"] == true && number(&gone, "/after") < 1.0,
                "{gone}"
            );
            // And the next one is found at once.
            let _bridge = stage.bridge(&[]);
            assert!(number(&peer.ask("wait 10"), "/after") < 5.0);
            stage.wait_for_speed(0.25);
        },
    );
}
