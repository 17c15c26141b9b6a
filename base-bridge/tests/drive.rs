//! A bridge and a simulated base, in real time: what is said moves it, and what is not said stops it.
#![cfg(unix)]

mod common;

use base_bridge::network::{FramedPose, Request, UncertainPose};
use base_bridge::params::Params;
use common::cable::Wire;
use common::{Base, Bridge, count, diagonal, pose, sleep, wait_for_base, wall};
use ros_messages::base::Report;
use ros_messages::base::frames::{Pose, wrapped};
use vehicle_controller::params::Id;

/// At rest: what encoders' steps leave, m/s.
const REST: f64 = 5e-3;
/// Two lines of 20 bytes, a telemetry line ahead of them, a tick, and this machine, s.
const LATE: f64 = 0.15;

fn start(robot: &str, params: Params) -> (Base, Bridge) {
    let base = Base::start(robot, 1, &[]);
    let bridge = Bridge::start(Wire(base.clone()), params);
    bridge.wait_until_up(0);
    (base, bridge)
}

fn near(a: Pose, b: Pose, metres: f64, radians: f64) -> bool {
    (a.x - b.x).hypot(a.y - b.y) < metres && wrapped(a.theta - b.theta).abs() < radians
}

#[test]
fn silence_stops_the_base_and_nothing_else_moves_it() {
    let (base, bridge) = start("default", Params::default());
    let mark = base.now().t;
    sleep(0.5);
    bridge.drive_until(0.3, 0.5, || base.speed().0 > 0.27);
    let silent = base.now().t;
    // A quarter of a second, and the ramp of 0.3 m/s at 1 m/s².
    base.wait_until(silent + 0.25 + 0.3 + LATE);
    assert!(base.speed().0 < REST, "{:?}", base.speed());
    let stopped = base.now();
    sleep(0.5);
    assert_eq!(
        base.now().pose.map(|x| (x * 1e3) as i64),
        stopped.pose.map(|x| (x * 1e3) as i64)
    );
    // The base's deadman has had nothing to do: others than the driver still talk to it.
    wait_for_base(&bridge, bridge.mark() - 1, "no fault");
    let before: Vec<_> = base.since(mark).into_iter().take(400).collect();
    assert_eq!(
        before[0].pose, before[399].pose,
        "it moved before it was told to"
    );
    bridge.end();
}

#[test]
fn numbers_that_are_none_move_nothing() {
    let (base, bridge) = start("default", Params::default());
    for _ in 0..10 {
        bridge.speeds(0.3, f64::NAN);
        bridge.speeds(f64::INFINITY, 0.0);
        sleep(0.05);
    }
    assert!(base.speed().0 < REST);
    let counted = bridge.wait_for(bridge.mark() - 1, 3.0, |report| {
        (count(report, "refused cmd_vel not finite")? == 20).then_some(())
    });
    assert!(counted.is_some());
}

#[test]
fn what_is_published_is_what_the_base_says_and_when() {
    let (base, bridge) = start("default", Params::default());
    let (begin, host) = (std::time::Instant::now(), wall());
    bridge.drive_until(0.3, 0.8, || base.now().pose[2] > 1.0);
    bridge.call(Request::Stop).unwrap();
    sleep(1.0);
    let motions = bridge.motions(0);
    let truths = base.since(0.0);
    let mut errors: Vec<f64> = Vec::new();
    for motion in &motions {
        assert_eq!(motion.map_to_odom, Pose::default());
        // Which tick was it? That at which the estimate was this one.
        let truth = truths
            .iter()
            .map(|truth| {
                (
                    truth,
                    Pose::new(truth.estimate[0], truth.estimate[1], truth.estimate[2]),
                )
            })
            .find(|(_, pose)| near(*pose, motion.odom, 2e-6, 2e-7));
        if motion.v.abs() > 0.1
            && let Some((truth, _)) = truth
        {
            let at = truth.at.duration_since(begin).as_secs_f64();
            errors.push((motion.stamp - host) as f64 * 1e-9 - at);
        }
    }
    assert!(errors.len() > 20, "{}", errors.len());
    errors.sort_by(f64::total_cmp);
    // The stamp is later by what no clock can tell: the host's own waits. Of a line of 110 bytes, 9.5 ms are not among them.
    let median = errors[errors.len() / 2];
    assert!(median.abs() < 5e-3, "{median}");
    assert!(motions.windows(2).all(|pair| pair[0].stamp < pair[1].stamp));
    let last = motions.last().unwrap();
    let truth = base.now();
    let [x, y, theta] = truth.estimate;
    assert!(near(last.odom, Pose::new(x, y, theta), 1e-6, 1e-6));
    // The covariance is that of GetEstPos, digit for digit.
    let c = &last.covariance;
    base.task(|rig| rig.send(b"GetEstPos\n"));
    assert!(c[0] > 1e-9 && c[35] > 1e-9 && c[1] == c[6] && c[5] == c[30] && c[11] == c[31]);
    let row = base.covariance();
    for (place, value) in [
        (0, row[0][0]),
        (1, row[0][1]),
        (5, row[0][2]),
        (7, row[1][1]),
        (11, row[1][2]),
        (35, row[2][2]),
    ] {
        // Six significant digits.
        assert!(
            (c[place] - value).abs() <= 1e-5 * value.abs(),
            "{place}: {} {value}",
            c[place]
        );
    }
    let joints = bridge
        .reports()
        .into_iter()
        .rev()
        .find_map(|report| match report {
            Report::Joints { joints, .. } => Some(joints),
            _ => None,
        });
    let joints = joints.unwrap();
    // 84 mm wheels: what they have turned is what the base has gone and turned.
    let turned = (joints[1].position - joints[0].position) * 0.042 / 0.2;
    assert!((turned - theta).abs() < 1e-3, "{turned} {theta}");
    let volts = bridge
        .reports()
        .into_iter()
        .find_map(|report| match report {
            Report::Battery { volts, .. } => volts,
            _ => None,
        });
    assert!((11.0..13.0).contains(&volts.unwrap()));
}

#[test]
fn fixes_move_the_map_and_not_odom() {
    let (base, bridge) = start("default", Params::default());
    // A base that is not sure where it is: the first fix makes its estimate leap.
    let set = |reply| {
        let pose = pose("map", 0.0, 0.0, 0.0);
        let covariance = diagonal(0.5, 0.5);
        Request::SetPose(UncertainPose { pose, covariance }, Some(reply))
    };
    bridge.call(set).unwrap();
    sleep(0.2);
    let mark = bridge.mark();
    // What the base believes is 0.3 m and 0.2 rad off what somebody else sees, who is surer than it is.
    let offset = Pose::new(0.3, -0.2, 0.2);
    for round in 0..60 {
        bridge.speeds(0.3, 0.6);
        sleep(0.05);
        if round % 4 == 3 && round > 8 {
            let truth = base.now();
            let [x, y, theta] = truth.pose;
            let seen = offset.then(&Pose::new(x, y, theta));
            let stamp = wall() - truth.at.elapsed().as_nanos() as i64;
            assert!(bridge.inbox.put(Request::Fix(UncertainPose {
                pose: FramedPose {
                    stamp: Some(stamp),
                    ..pose("map", seen.x, seen.y, seen.theta)
                },
                covariance: diagonal(0.02, 0.02),
            })));
        }
    }
    sleep(1.0);
    let motions = bridge.motions(mark);
    let mut largest: f64 = 0.0;
    for pair in motions.windows(2) {
        let moved = pair[0].odom.inverse().then(&pair[1].odom);
        let dt = (pair[1].stamp - pair[0].stamp) as f64 * 1e-9;
        // As far as its speed goes, whatever the fixes say: 0.3 m/s, and a row may have been lost.
        let way = moved.x.hypot(moved.y);
        assert!(way < 0.35 * dt.max(0.02) + 0.01, "{way} in {dt}");
        largest = largest.max(way);
    }
    // And where the base is in the map is what it believes now.
    let [x, y, theta] = base.now().estimate;
    let last = motions.last().unwrap();
    let in_map = last.map_to_odom.then(&last.odom);
    assert!(near(in_map, Pose::new(x, y, theta), 2e-6, 2e-6));
    let shift = last.map_to_odom;
    assert!(near(shift, offset, 0.06, 0.06), "{shift:?}; rows {largest}");
}

#[test]
fn poses_are_set_and_gone_to() {
    let (base, bridge) = start("default", Params::default());
    let set = |reply| {
        let pose = pose("map", 1.0, 2.0, 0.0);
        let covariance = diagonal(0.01, 0.01);
        Request::SetPose(UncertainPose { pose, covariance }, Some(reply))
    };
    assert_eq!(bridge.call(set), Ok("OK".into()));
    sleep(0.3);
    // map → odom has taken it: odom goes on where it was.
    let mark = bridge.mark();
    bridge.wait_for_motion(mark);
    let last = bridge.motions(mark).pop().unwrap();
    assert!(near(last.map_to_odom, Pose::new(1.0, 2.0, 0.0), 1e-6, 1e-6));
    assert!(near(last.odom, Pose::default(), 1e-6, 1e-6));
    for frame in ["elsewhere", "odom"] {
        assert!(bridge.inbox.put(Request::Goal(pose(frame, 0.3, 0.0, 0.0))));
    }
    let there = || {
        let [x, y, _] = base.now().estimate;
        (x - 1.3).hypot(y - 2.0) < 0.01
    };
    for _ in 0..100 {
        if there() {
            break;
        }
        sleep(0.1);
    }
    assert!(there(), "{:?}", base.now());
    // Who is unsure of nothing has filled in nothing.
    let unsaid = bridge.call(|reply| {
        let pose = pose("map", 0.0, 0.0, 0.0);
        let covariance = [0.0; 36];
        Request::SetPose(UncertainPose { pose, covariance }, Some(reply))
    });
    assert_eq!(unsaid, Err("covariance".into()));
}

/// The base is put elsewhere in the map, and sent to a place of `odom`: what stands behind each other in the inbox.
fn put_elsewhere_and_send(bridge: &Bridge) {
    let covariance = diagonal(0.1, 0.1);
    let pose_in_map = pose("map", 5.0, 5.0, 1.5);
    let pose_in_map = UncertainPose {
        pose: pose_in_map,
        covariance,
    };
    assert!(bridge.inbox.put(Request::SetPose(pose_in_map, None)));
    let goal = pose("odom", 0.5, 0.0, 0.0);
    assert!(bridge.inbox.put(Request::Goal(goal)));
}

#[test]
fn a_place_in_odom_stays_where_it_is_while_the_map_is_moved() {
    let (base, bridge) = start("default", Params::default());
    // Speeds of before do not end the way to it.
    bridge.drive_until(0.2, 0.0, || base.speed().0 > 0.1);
    put_elsewhere_and_send(&bridge);
    let begin = base.now().t;
    base.wait_until(begin + 4.0);
    let [x, y, _] = base.now().pose;
    assert!((x - 0.5).hypot(y) < 0.03, "{x} {y}");
    assert!(base.speed().0 < REST);
}

#[test]
fn a_place_in_odom_that_waits_is_not_gone_to_after_a_stop() {
    let commands: [fn(&Bridge); 3] = [
        |bridge| assert_eq!(bridge.call(Request::Stop), Ok("OK".into())),
        |bridge| bridge.speeds(0.0, 0.0),
        |bridge| {
            let off = bridge.call(|reply| Request::Enable(false, reply));
            assert_eq!(off, Ok("OK".into()));
        },
    ];
    for command in commands {
        let (base, bridge) = start("default", Params::default());
        put_elsewhere_and_send(&bridge);
        command(&bridge);
        sleep(1.0);
        let [x, y, _] = base.now().pose;
        assert!(x.hypot(y) < 2e-3, "{x} {y}");
    }
}

#[test]
fn faults_are_told_and_cleared_by_service() {
    let (base, bridge) = start("default", Params::default());
    base.task(|rig| rig.set_estop(true));
    base.task(|rig| rig.send(b"SetParam estop_input 1\n"));
    wait_for_base(&bridge, 0, "fault: estop");
    let refused = bridge.call(Request::ClearFault).unwrap_err();
    assert!(refused.starts_with("fault"), "{refused}");
    base.task(|rig| rig.set_estop(false));
    sleep(0.2);
    let mark = bridge.mark();
    assert_eq!(bridge.call(Request::ClearFault), Ok("OK".into()));
    wait_for_base(&bridge, mark, "no fault");
    assert_eq!(
        bridge.call(|reply| Request::Enable(false, reply)),
        Ok("OK".into())
    );
    bridge.drive(0.3, 0.0, 0.5);
    assert!(base.speed().0 < REST);
    assert_eq!(
        bridge.call(|reply| Request::Enable(true, reply)),
        Ok("OK".into())
    );
    bridge.drive_until(0.3, 0.0, || base.speed().0 > 0.2);
}

#[test]
fn a_base_that_starts_anew_is_known_again_and_stays() {
    let (base, bridge) = start("default", Params::default());
    bridge.drive_until(0.3, 0.0, || base.speed().0 > 0.25);
    base.task(|rig| rig.power_cycle().unwrap());
    sleep(0.5);
    let mark = bridge.mark();
    bridge.wait_for_motion(mark);
    let odom = bridge.motions(mark)[0].odom;
    assert!(odom.x > 0.05, "odom goes on: {odom:?}");
    let still = base.now();
    sleep(0.5);
    let now = base.now();
    assert!((now.pose[0] - still.pose[0]).abs() < 1e-3);
    bridge.drive_until(-0.3, 0.0, || base.speed().0 > 0.2);
}

#[test]
fn who_ends_it_stops_the_base() {
    let (base, bridge) = start("default", Params::default());
    bridge.drive_until(0.3, 0.0, || base.speed().0 > 0.27);
    bridge.end();
    let ended = base.now().t;
    base.wait_until(ended + 0.3 + LATE);
    assert!(base.speed().0 < REST, "{:?}", base.speed());
}

#[test]
fn stamped_speeds_that_are_old_move_nothing() {
    let params = Params {
        cmd_vel_stamped: true,
        ..Params::default()
    };
    let base = Base::start("default", 1, &[(Id::Deadman, 1.0)]);
    let bridge = Bridge::start(Wire(base.clone()), params);
    bridge.wait_until_up(0);
    let say = |age: i64| {
        assert!(bridge.inbox.put(Request::Speeds {
            linear: [0.3, 0.0, 0.0],
            angular: [0.0; 3],
            stamp: Some(wall() - age),
        }));
        sleep(0.05);
    };
    for _ in 0..10 {
        say(400_000_000);
        say(-400_000_000);
    }
    assert!(base.speed().0 < REST);
    for _ in 0..40 {
        say(1_000_000);
    }
    assert!(base.speed().0 > 0.2);
}

#[test]
fn a_base_that_would_run_on_is_told_of() {
    for (deadman, loose) in [(0.0, true), (60.0, true), (1.0, false)] {
        let base = Base::start("default", 1, &[(Id::Deadman, deadman)]);
        let bridge = Bridge::start(Wire(base.clone()), Params::default());
        bridge.wait_until_up(0);
        let words = format!("deadman is {deadman} s");
        sleep(0.2);
        let told = bridge.said().iter().any(|said| said.starts_with(&words));
        assert_eq!(told, loose, "{:?}", bridge.said());
        let message = if loose {
            "no deadman to speak of"
        } else {
            "no fault"
        };
        wait_for_base(&bridge, 0, message);
    }
}

#[test]
fn a_car_turns_while_it_moves() {
    let (base, bridge) = start("cycab", Params::default());
    bridge.drive(0.0, 0.3, 0.5);
    assert!(base.speed().0 < REST);
    for _ in 0..60 {
        bridge.speeds(0.8, 0.2);
        sleep(0.1);
    }
    let (v, omega) = base.speed();
    assert!(
        (v - 0.8).abs() < 0.1 && (omega - 0.2).abs() < 0.05,
        "{v} {omega}"
    );
    let joints = bridge
        .reports()
        .into_iter()
        .rev()
        .find_map(|report| match report {
            Report::Joints { joints, .. } => Some(joints),
            _ => None,
        });
    let joints = joints.unwrap();
    assert_eq!(joints.len(), 3);
    assert!(joints[2].position > 0.05, "{joints:?}");
}
