//! What a base refuses, or never hears of, does not leave it doing what it did before: nobody would stop it then.
#![cfg(unix)]

mod common;

use base_bridge::client::check;
use base_bridge::network::{Request, UncertainPose};
use base_bridge::params::Params;
use common::cable::Tap;
use common::{Base, Bridge, count, diagonal, pose, sleep, status, wait_for_base};
use std::sync::atomic::Ordering;
use vehicle_controller::params::Id;

/// At rest: what encoders' steps leave, m/s.
const REST: f64 = 5e-3;

fn start(robot: &str, changes: &[(Id, f32)]) -> (Base, Tap, Bridge) {
    let base = Base::start(robot, 1, changes);
    let tap = Tap::new(&base);
    let bridge = Bridge::start(tap.clone(), Params::default());
    bridge.wait_until_up(0);
    (base, tap, bridge)
}

fn lose(tap: &Tap, lines: &'static str) {
    *tap.lost.lock().unwrap() = Some(lines);
}

fn assert_at_rest(base: &Base) {
    assert!(base.speed().0 < REST, "{:?}", base.speed());
}

#[test]
fn a_goal_that_is_refused_ends_what_was_before() {
    // A car cannot go to what is behind it.
    let (base, tap, bridge) = start("cycab", &[]);
    bridge.drive_until(0.8, 0.0, || base.speed().0 > 0.7);
    let [x, y, _] = base.now().estimate;
    tap.lines();
    assert!(
        bridge
            .inbox
            .put(Request::Goal(pose("map", x - 3.0, y, 0.0)))
    );
    // Nobody says anything more. From 0.8 m/s at 1 m/s², and a car's own slowness.
    sleep(2.0);
    let lines = tap.lines();
    assert!(
        lines.iter().any(|line| line.starts_with("GoTo")),
        "{lines:?}"
    );
    assert_at_rest(&base);
    wait_for_base(&bridge, bridge.mark() - 1, "no fault");
    let told = "no way to the goal: range posture 1 does not lie ahead";
    assert!(bridge.said().iter().any(|words| words.starts_with(told)));
}

#[test]
fn a_goal_that_is_lost_ends_what_was_before() {
    let (base, tap, bridge) = start("default", &[]);
    bridge.drive_until(0.3, 0.0, || base.speed().0 > 0.27);
    lose(&tap, "GoTo");
    assert!(bridge.inbox.put(Request::Goal(pose("map", 5.0, 0.0, 0.0))));
    sleep(1.0);
    assert_at_rest(&base);
    // The next one is heard.
    *tap.lost.lock().unwrap() = None;
    assert!(bridge.inbox.put(Request::Goal(pose("map", 5.0, 0.0, 0.0))));
    sleep(1.5);
    assert!(base.speed().0 > 0.1, "{:?}", base.speed());
    assert_eq!(bridge.call(Request::Stop), Ok("OK".into()));
}

#[test]
fn power_off_that_is_lost_stops_the_base_all_the_same() {
    let (base, tap, bridge) = start("default", &[]);
    bridge.drive_until(0.3, 0.0, || base.speed().0 > 0.27);
    lose(&tap, "Disable");
    let off = bridge.call(|reply| Request::Enable(false, reply));
    assert_eq!(off, Err("the base does not answer".into()));
    sleep(0.5);
    assert_at_rest(&base);
}

#[test]
fn a_pose_that_is_not_set_is_told() {
    let (_base, tap, bridge) = start("default", &[]);
    let set = || {
        bridge.call(|reply| {
            let pose = pose("map", 5.0, 5.0, 1.0);
            let covariance = diagonal(0.1, 0.1);
            Request::SetPose(UncertainPose { pose, covariance }, Some(reply))
        })
    };
    lose(&tap, "ResetPos");
    assert_eq!(set(), Err("the base does not answer".into()));
    let told = "the pose is not set: the base does not answer";
    // The caller is answered first.
    sleep(0.3);
    assert!(bridge.said().iter().any(|words| words == told));
    let mark = bridge.mark();
    tap.mute.store(true, Ordering::Relaxed);
    let lost = bridge.wait_for(mark, 3.0, |report| {
        let link = status(report, "link")?;
        (link.message == "lost: tapped wire: no telemetry").then_some(())
    });
    assert!(lost.is_some());
    assert_eq!(set(), Err("no base at the line".into()));
    let counted = bridge.wait_for(bridge.mark(), 3.0, |report| {
        (count(report, "refused initialpose no base")? == 1).then_some(())
    });
    assert!(counted.is_some(), "{:?}", bridge.diagnostics());
}

#[test]
fn a_stop_that_is_lost_is_said_again() {
    let (base, tap, bridge) = start("default", &[]);
    bridge.drive_until(0.3, 0.0, || base.speed().0 > 0.27);
    lose(&tap, "Stop");
    let begin = std::time::Instant::now();
    std::thread::scope(|scope| {
        scope.spawn(|| {
            sleep(0.7);
            *tap.lost.lock().unwrap() = None;
        });
        assert_eq!(bridge.call(Request::Stop), Ok("OK".into()));
    });
    assert!(begin.elapsed().as_secs_f64() > 0.7);
    sleep(0.5);
    assert_at_rest(&base);
}

#[test]
fn a_base_that_hears_nothing_and_streams_is_given_up() {
    let (base, tap, bridge) = start("default", &[]);
    bridge.drive_until(0.3, 0.0, || base.speed().0 > 0.27);
    lose(&tap, "");
    // Its deadman stops it, though telemetry goes on.
    for _ in 0..60 {
        bridge.speeds(0.3, 0.0);
        sleep(0.05);
    }
    assert_at_rest(&base);
    let said = bridge.said();
    let given_up = "line lost: tapped wire: no answers";
    assert!(said.iter().any(|said| said == given_up), "{said:?}");
    let stopped = base.now().pose;
    *tap.lost.lock().unwrap() = None;
    wait_for_base(&bridge, bridge.mark() - 1, "fault: link");
    sleep(0.5);
    assert!((base.now().pose[0] - stopped[0]).abs() < 1e-3);
}

#[test]
fn all_that_a_base_can_do_may_be_asked_of_it() {
    // 2 rad/s, and 2/3 m/s: numbers that rounding makes larger.
    let changes = [(Id::MaxTurnSpeed, 114.591_56), (Id::MaxSpeed, 0.666_67)];
    let (base, _tap, bridge) = start("default", &changes);
    bridge.drive_until(3.0, 0.0, || base.speed().0 > 0.63);
    bridge.drive_until(0.0, 9.0, || base.speed().1 > 1.9);
    let last = bridge.diagnostics().unwrap();
    let refused = common::count(&last, "refused by the base: range");
    assert_eq!(refused, Some(0), "{last:?}");
}

#[test]
fn limits_that_somebody_else_has_changed_are_learnt() {
    let (base, tap, bridge) = start("default", &[]);
    bridge.drive_until(0.5, 0.0, || base.speed().0 > 0.47);
    base.task(|rig| {
        for line in ["SetParam max_speed 0.4", "SetParam max_turn_speed 180"] {
            rig.send(format!("{}\n", check::with(line)).as_bytes());
        }
    });
    // It goes on at what it was told until it is told something else. That must not go on: the base refuses it.
    bridge.drive(0.6, 0.0, 1.0);
    let (speed, _) = base.speed();
    assert!((speed - 0.4).abs() < 0.02, "{speed}");
    bridge.drive(0.0, 4.0, 1.5);
    let (_, turn_speed) = base.speed();
    let most = 180_f64.to_radians();
    assert!((turn_speed - most).abs() < 0.1, "{turn_speed}");
    // Once for all: the next wishes are made smaller.
    let asked = tap.lines();
    let asked = asked.iter().filter(|line| line.starts_with("GetParam"));
    let before = asked.count();
    bridge.drive(0.5, 4.0, 0.5);
    let asked = tap.lines();
    assert!(!asked.iter().any(|line| line.starts_with("GetParam")));
    assert!(before >= 3);
    let said = bridge.said();
    let learnt = "the base has changed: max_speed 0.4 m/s";
    assert_eq!(said.iter().filter(|words| *words == learnt).count(), 1);
}
