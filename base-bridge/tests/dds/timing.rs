//! How long a speed takes from another process to the wheels' reference, and how evenly odometry comes. Whoever measures times needs a machine for himself:
//! `cargo test --release -p base-bridge --features dds --test dds -- --ignored --nocapture`.

use crate::alone::alone;
use crate::common::{assert_prompt, wall};
use crate::peer::{Peer, number, numbers};
use crate::stage::Stage;
use std::time::Instant;

/// Speeds that are said.
const SPEEDS: usize = 1000;
/// Odometry is listened to for so long, s.
const LONG: f64 = 600.0;

#[test]
#[ignore = "timed: on a quiet machine, 4 minutes"]
fn a_speed_reaches_the_wheels_in_3_ms() {
    alone("timing::a_speed_reaches_the_wheels_in_3_ms", || {
        let stage = Stage::set();
        let _bridge = stage.bridge(&[]);
        let mut peer = Peer::start("r1");
        peer.ask("wait 10");
        let (origin, host) = (Instant::now(), wall());
        let said = numbers(&peer.ask(&format!("steps {SPEEDS}")), "/said");
        let truths = stage.base.since(0.0);
        let mut times: Vec<f64> = Vec::new();
        for said in said {
            let seconds = said - host as f64 * 1e-9;
            let at = |truth: &crate::common::Truth| truth.at.duration_since(origin).as_secs_f64();
            let next = truths.partition_point(|truth| at(truth) <= seconds);
            let before = truths[next - 1].reference;
            let changed = truths[next..]
                .iter()
                .find(|truth| truth.reference != before);
            times.push((at(changed.unwrap()) - seconds) * 1e3);
        }
        assert_prompt(times);
    });
}

#[test]
#[ignore = "timed: on a quiet machine, 10 minutes"]
fn odometry_comes_50_times_a_second_for_10_minutes() {
    alone(
        "timing::odometry_comes_50_times_a_second_for_10_minutes",
        || {
            let stage = Stage::set();
            let _bridge = stage.bridge(&[]);
            let mut peer = Peer::start("r1");
            peer.ask("wait 10");
            peer.ask("begin 0.2 0.5");
            let gaps = peer.ask(&format!("gaps {LONG}"));
            let truths = stage.base.since(0.0);
            let ticks = truths.windows(2).map(|two| two[1].at - two[0].at);
            println!(
                "{gaps}, and between two ticks of the base {:?}",
                ticks.max()
            );
            assert!(number(&gaps, "/count") > 0.999 * LONG * 50.0);
            assert!(number(&gaps, "/arrival") <= 0.06 && number(&gaps, "/stamp") <= 0.06);
        },
    );
}
