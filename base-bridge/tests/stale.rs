//! Nothing that was said at another time moves the base: to one that cannot answer, through a bridge that was held up, or with an old stamp.
#![cfg(unix)]

mod common;

use base_bridge::network::{FramedPose, Request, UncertainPose};
use base_bridge::params::Params;
use common::cable::Tap;
use common::{Base, Bridge, count, diagonal, pose, sleep, status, wait_for_base, wall};
use ros_messages::base::Level;
use std::sync::atomic::Ordering;

fn start() -> (Base, Tap, Bridge) {
    let base = Base::start("default", 1, &[]);
    let tap = Tap::new(&base);
    let bridge = Bridge::start(tap.clone(), Params::default());
    bridge.wait_until_up(0);
    (base, tap, bridge)
}

fn goal(stamp: Option<i64>) -> Request {
    Request::Goal(FramedPose {
        stamp,
        ..pose("map", 1.0, 0.0, 0.0)
    })
}

fn initial(stamp: Option<i64>) -> Request {
    let pose = FramedPose {
        stamp,
        ..pose("map", 5.0, 5.0, 1.0)
    };
    let covariance = diagonal(0.1, 0.1);
    Request::SetPose(UncertainPose { pose, covariance }, None)
}

/// Waits until so many of such have been counted.
fn wait_for_count(bridge: &Bridge, name: &str, at_least: u64) {
    let counted = bridge.wait_for(bridge.mark().saturating_sub(1), 3.0, |report| {
        (count(report, name)? >= at_least).then_some(())
    });
    let last = bridge.diagnostics();
    assert!(counted.is_some(), "{name} {at_least}: {last:?}");
}

/// How far it has come since a simulated time, m.
fn moved(base: &Base, since: f64) -> f64 {
    let all = base.since(since);
    let far = |at: &common::Truth| {
        let [x, y, _] = all[0].pose;
        (at.pose[0] - x).hypot(at.pose[1] - y)
    };
    all.iter().map(far).fold(0.0, f64::max)
}

#[test]
fn a_base_that_cannot_answer_is_told_to_stop_and_nothing_else() {
    let (base, tap, bridge) = start();
    bridge.drive_until(0.3, 0.0, || base.speed().0 > 0.27);
    tap.mute.store(true, Ordering::Relaxed);
    let mark = bridge.mark();
    tap.lines();
    // Until it is noticed, the base is driven: it hears, though it is not heard.
    let mut lines = Vec::new();
    while !lines.iter().any(|line| line == "Stop") {
        bridge.speeds(0.3, 0.0);
        sleep(0.01);
        lines.extend(tap.lines());
    }
    let stopped = base.now().t;
    let anew = lines.iter().any(String::is_empty);
    assert!(!anew, "it is stopped before the line is opened anew");
    let lost = bridge.wait_for(mark, 1.0, |report| {
        let link = status(report, "link")?;
        (link.message == "lost: tapped wire: no telemetry").then_some(())
    });
    assert!(lost.is_some(), "{:?}", bridge.diagnostics());
    tap.lines();
    // Two handshakes that nobody answers, and what somebody says meanwhile.
    for _ in 0..300 {
        bridge.speeds(0.3, 0.5);
        assert!(bridge.inbox.put(goal(None)) && bridge.inbox.put(initial(None)));
        sleep(0.02);
    }
    let lines = tap.lines();
    let stops = lines.iter().filter(|line| *line == "Stop").count();
    assert!(stops > 5, "{lines:?}");
    let others: Vec<_> = lines
        .iter()
        .filter(|line| !line.is_empty() && *line != "Stop")
        .collect();
    assert!(others.is_empty(), "{others:?}");
    for topic in ["cmd_vel", "goal_pose", "initialpose"] {
        wait_for_count(&bridge, &format!("refused {topic} no base"), 300);
    }
    let refused = bridge.call(Request::ClearFault);
    assert_eq!(refused, Err("no base at the line".into()));
    let mark = bridge.mark();
    tap.mute.store(false, Ordering::Relaxed);
    bridge.wait_for_motion(mark);
    sleep(1.0);
    // From 0.3 m/s with 1 m/s²: 45 mm, and what tyres slip. Then nothing, for seven seconds.
    assert!(moved(&base, stopped) < 0.06, "{}", moved(&base, stopped));
    assert!(moved(&base, stopped + 0.5) < 1e-3);
    let [x, y, _] = base.now().estimate;
    assert!(x.hypot(y) < 3.0, "the pose of then is set: {x} {y}");
    // It has stopped by being told, not by a fault: who speaks now, is obeyed.
    bridge.drive(0.3, 0.0, 0.5);
    assert!(base.speed().0 > 0.2);
}

#[test]
fn what_waited_while_the_bridge_was_held_up_is_not_obeyed() {
    let (base, tap, bridge) = start();
    tap.lines();
    let (mark, begin) = (bridge.mark(), base.now().t);
    tap.held.store(true, Ordering::Relaxed);
    // It asks for something within this, and is held.
    sleep(0.7);
    assert!(bridge.inbox.put(goal(None)) && bridge.inbox.put(initial(None)));
    bridge.speeds(0.3, 0.0);
    let (sender, answers) = std::sync::mpsc::channel();
    for what in [Request::ClearFault, |reply| Request::Enable(true, reply)] {
        let sender = sender.clone();
        let reply = Box::new(move |answer| sender.send(answer).unwrap());
        assert!(bridge.inbox.put(what(reply)));
    }
    sleep(2.2);
    tap.held.store(false, Ordering::Relaxed);
    for _ in 0..2 {
        let answer = answers.recv_timeout(std::time::Duration::from_secs(1));
        assert_eq!(answer, Ok(Err("stale".into())));
    }
    for topic in ["goal_pose", "initialpose"] {
        wait_for_count(&bridge, &format!("refused {topic} stale"), 1);
    }
    bridge.wait_for_motion(mark);
    sleep(1.0);
    let moving = ["m", "t", "GoTo", "ResetPos", "ClearFault", "Enable"];
    let lines = tap.lines();
    assert!(lines.len() > 1, "{lines:?}");
    let moves = |line: &&String| moving.contains(&line.split(' ').next().unwrap());
    assert_eq!(lines.iter().find(moves), None, "{lines:?}");
    assert!(moved(&base, begin) < 1e-3);
}

#[test]
fn what_is_left_of_a_torn_line_is_no_command() {
    let (base, tap, bridge) = start();
    let mark = bridge.mark();
    // Without its covariance and its check it is a line that a base would obey.
    *tap.torn.lock().unwrap() = Some("ResetPos 5 5 57");
    assert!(bridge.inbox.put(initial(None)));
    let lost = bridge.wait_for(mark, 1.0, |report| {
        (status(report, "link")?.level != Level::Ok).then_some(())
    });
    assert!(lost.is_some() && tap.torn.lock().unwrap().is_none());
    bridge.wait_for_motion(bridge.mark());
    let [x, y, _] = base.now().estimate;
    assert!(x.hypot(y) < 1e-3, "{x} {y}");
}

#[test]
fn who_comes_back_to_a_base_that_has_stopped_itself_is_told_what_to_do() {
    let (base, tap, bridge) = start();
    bridge.drive_until(0.3, 0.0, || base.speed().0 > 0.27);
    tap.held.store(true, Ordering::Relaxed);
    sleep(1.6);
    let mark = bridge.mark();
    tap.held.store(false, Ordering::Relaxed);
    wait_for_base(&bridge, mark, "fault: link");
    let said = bridge.said();
    let told = said.iter().filter(|words| words.contains("clear_fault"));
    assert_eq!(told.count(), 1, "{said:?}");
}

#[test]
fn goals_and_poses_with_old_stamps_are_refused() {
    let (base, tap, bridge) = start();
    let begin = base.now().t;
    tap.lines();
    for _ in 0..3 {
        let stamp = Some(wall() - 3_000_000_000);
        assert!(bridge.inbox.put(goal(stamp)) && bridge.inbox.put(initial(stamp)));
    }
    for topic in ["goal_pose", "initialpose"] {
        wait_for_count(&bridge, &format!("refused {topic} stale"), 3);
    }
    assert!(moved(&base, begin) < 1e-3);
    let told = |words: &str| bridge.said().iter().filter(|said| *said == words).count();
    assert_eq!(told("goal_pose refused: stale"), 1);
    // A laptop's clock that is half a second behind is no reason.
    assert!(bridge.inbox.put(goal(Some(wall() - 500_000_000))));
    sleep(1.0);
    assert!(moved(&base, begin) > 0.01);
    let lines = tap.lines();
    let goals: Vec<_> = lines
        .iter()
        .filter(|line| line.starts_with("GoTo"))
        .collect();
    assert_eq!(goals, ["GoTo 1 0 0"]);
}

#[test]
fn what_was_said_before_a_stop_is_not_obeyed_after_it() {
    let base = Base::start("default", 1, &[]);
    let params = Params {
        cmd_vel_stamped: true,
        ..Params::default()
    };
    let bridge = Bridge::start(Tap::new(&base), params);
    bridge.wait_until_up(0);
    sleep(0.2);
    let speeds = |stamp| {
        assert!(bridge.inbox.put(Request::Speeds {
            linear: [0.3, 0.0, 0.0],
            angular: [0.0; 3],
            stamp: Some(stamp),
        }));
    };
    let (begin, before) = (base.now().t, wall());
    sleep(0.05);
    assert_eq!(bridge.call(Request::Stop), Ok("OK".into()));
    speeds(before);
    assert!(bridge.inbox.put(goal(Some(before))));
    for topic in ["cmd_vel", "goal_pose"] {
        wait_for_count(&bridge, &format!("refused {topic} stale"), 1);
    }
    assert!(moved(&base, begin) < 1e-3);
    // After a goal, too.
    assert!(bridge.inbox.put(goal(None)));
    sleep(0.05);
    speeds(wall() - 100_000_000);
    sleep(4.0);
    assert!((base.now().pose[0] - 1.0).abs() < 0.03, "{:?}", base.now());
    speeds(wall());
    sleep(0.2);
    assert!(base.speed().0 > 0.05, "{:?}", base.speed());
}

#[test]
fn speeds_that_were_on_their_way_for_long_are_not_obeyed() {
    let (base, _tap, bridge) = start();
    sleep(0.6);
    let begin = base.now().t;
    let speeds = |stamp| Request::Speeds {
        linear: [0.3, 0.0, 0.0],
        angular: [0.0; 3],
        stamp,
    };
    for ago in [0.5, 0.4, 0.3] {
        let said = bridge.inbox.now() - ago;
        assert!(bridge.inbox.put_said(speeds(None), said));
        // Its writer's clock is ahead.
        let stamp = Some(wall() + 50_000_000);
        assert!(bridge.inbox.put_said(speeds(stamp), said));
    }
    wait_for_count(&bridge, "refused cmd_vel stale", 6);
    assert!(moved(&base, begin) < 1e-3);
    let said = bridge.inbox.now() - 0.15;
    assert!(bridge.inbox.put_said(speeds(None), said));
    sleep(0.4);
    assert!(moved(&base, begin) > 1e-3);
    // 0.1 s at 1 m/s², and to rest again: not a quarter of a second.
    assert!(moved(&base, begin) < 0.03, "{}", moved(&base, begin));
}
