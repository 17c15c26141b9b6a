//! The cable pulled in motion, and plugged in again: the base stops within its deadman each time, and does not move by itself after.
#![cfg(unix)]

mod common;

use base_bridge::line::serial::Serial;
use base_bridge::network::Request;
use base_bridge::params::Params;
use common::cable::{Usb, moves};
use common::{Base, Bridge, Truth, count, pose, sleep, status};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::time::Instant;
use vehicle_controller::params::Id;

/// Bases that are driven at the same time, and pulls of each: a hundred in all.
const BASES: u64 = 10;
const PULLS: u32 = 10;
/// What such a base coasts to rest in, at `stop_accel` 1 m/s² and with the tyres' slip, from the greatest speed driven here, s.
const RAMP: f64 = 0.4;
/// The supervisor looks at each tick; a line under way; the load of this machine, s.
const SLACK: f64 = 0.1;
/// At rest: what encoders' steps and gears' play leave, m/s and rad/s.
const REST: (f64, f64) = (5e-3, 0.03);

/// How far it has gone since a simulated time: m along its way, rad.
fn moved(base: &Base, since: f64) -> (f64, f64) {
    let all = base.since(since);
    let first = all[0].pose;
    all.iter().fold((0.0, 0.0), |(way, turn), truth| {
        let [x, y, theta] = truth.pose;
        let here = (x - first[0]).hypot(y - first[1]);
        (here.max(way), (theta - first[2]).abs().max(turn))
    })
}

/// A reference that falls does not rise again; where it was still rising to what was asked for last, it rises to that at most.
fn assert_never_rises(all: &[Truth], reference: impl Fn(&Truth) -> f64, asked: f64, name: &str) {
    let sizes: Vec<_> = all.iter().map(|truth| reference(truth).abs()).collect();
    let most = sizes.iter().copied().fold(0.0, f64::max);
    // An order has four decimals.
    assert!(most < asked.abs() + 1e-3, "{name}: {most} of {asked}");
    let falls = sizes.iter().position(|&size| size == most).unwrap();
    for pair in sizes[falls..].windows(2) {
        assert!(pair[1] <= pair[0] + 1e-6, "{name}: {pair:?}");
    }
}

/// Somebody goes on to say speeds, and where to go, from the pull until just before the line is opened again, which is half a second after; the cable is
/// plugged in between. None of that may ever reach the base.
fn speak_to_nobody(bridge: &Bridge, v: f64, omega: f64, plug: impl FnOnce(), gone: f64) {
    let (begin, mut plug) = (Instant::now(), Some(plug));
    let passed = || begin.elapsed().as_secs_f64();
    while passed() < 0.45 {
        bridge.speeds(v, omega);
        assert!(bridge.inbox.put(Request::Goal(pose("map", 1.0, 1.0, 0.0))));
        sleep(0.02);
        if passed() > gone
            && let Some(plug) = plug.take()
        {
            plug();
        }
    }
    if let Some(plug) = plug {
        plug();
    }
}

/// Pulls the cable of a base so often. Returns what took longest from the pull to rest, s beyond its deadman.
fn pulls(seed: u64) -> f64 {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    // Half of them reconnect while the base still runs on, the others when it has been stopped by its deadman.
    let deadman = if seed.is_multiple_of(2) { 1.0 } else { 0.6 };
    let base = Base::start("default", seed, &[(Id::Deadman, deadman)]);
    let deadman = f64::from(deadman);
    let directory = tempfile::tempdir().unwrap();
    let port = directory.path().join("ttyACM0");
    let mut usb = Usb::new(&base, &port);
    usb.plug();
    let bridge = Bridge::start(Serial::new(port, 115_200), Params::default());
    bridge.wait_until_up(0);
    let mut longest: f64 = 0.0;
    for pull in 0..PULLS {
        let v = random.random_range(0.15..0.35) * if random.random() { 1.0 } else { -1.0 };
        let omega = random.random_range(-1.0..1.0);
        bridge.drive_until(v, omega, || base.speed().0 > 0.9 * v.abs());
        sleep(random.random_range(0.0..0.05));
        let pulled = base.now().t;
        usb.pull();
        let gone = random.random_range(0.0..0.4);
        speak_to_nobody(&bridge, v, omega, || usb.plug(), gone);
        base.wait_until(pulled + deadman + RAMP + SLACK);
        let (rest, mark) = (base.now().t, bridge.mark());
        let (speed, turn) = base.speed();
        let at_rest = speed < REST.0 && turn.abs() < REST.1;
        assert!(at_rest, "seed {seed} pull {pull}: {speed} {turn}");
        let stopped = base.since(pulled);
        let last = stopped[stopped.len() - 1].pose;
        let still = |t: &&Truth| {
            (t.pose[0] - last[0]).hypot(t.pose[1] - last[1]) > 1e-3
                || (t.pose[2] - last[2]).abs() > 0.01
        };
        let moving = stopped.iter().rfind(still);
        longest = longest.max(moving.map_or(0.0, |truth| truth.t) - pulled - deadman);
        bridge.wait_for_motion(mark);
        sleep(0.3);
        // The deadman's fault, if it came to that, waits for somebody who knows.
        // Where a loaded machine has cost the line once more, he asks again.
        let cleared = (0..10).any(|_| {
            let cleared = bridge.call(Request::ClearFault).is_ok();
            sleep(if cleared { 0.0 } else { 0.5 });
            cleared
        });
        assert!(cleared, "seed {seed} pull {pull}");
        sleep(0.3);
        let (way, turn) = moved(&base, rest);
        assert!(way < 1e-3, "seed {seed} pull {pull}: {way} m by itself");
        assert!(turn < 0.01, "seed {seed} pull {pull}: {turn} rad by itself");
        let all = base.since(pulled);
        let name = format!("seed {seed} pull {pull}");
        assert_never_rises(&all, |truth| truth.reference, v, &name);
        assert_never_rises(&all, |truth| truth.turn_reference, omega, &name);
        // The first thing that it hears is a Stop, and nothing after moves it.
        let lines = usb.lines();
        assert_eq!(lines[..2], ["", "Stop"], "{name}");
        let moving = lines.iter().find(|line| moves(line));
        assert_eq!(moving, None, "{name}");
        // Nothing that was said meanwhile is lost without a trace.
        for topic in ["cmd_vel", "goal_pose"] {
            let counted = bridge.wait_for(bridge.mark(), 3.0, |report| {
                let refused = count(report, &format!("refused {topic} no base"))?;
                (refused >= 10 * u64::from(pull + 1)).then_some(())
            });
            assert!(counted.is_some(), "seed {seed} pull {pull}: {topic}");
        }
    }
    longest
}

#[test]
fn a_hundred_times_in_motion() {
    let bases: Vec<_> = (0..BASES)
        .map(|seed| std::thread::spawn(move || pulls(seed)))
        .collect();
    let mut longest = Vec::new();
    for base in bases {
        longest.push(base.join().unwrap());
    }
    println!("at rest, s beyond the deadman, at most: {longest:.3?}");
}

/// A base at a port of its own, plugged in, on its way to a goal.
fn on_the_way(directory: &tempfile::TempDir) -> (Base, Usb, Bridge) {
    let base = Base::start("default", 1, &[]);
    let port = directory.path().join("ttyACM0");
    let mut usb = Usb::new(&base, &port);
    usb.plug();
    let bridge = Bridge::start(Serial::new(port, 115_200), Params::default());
    bridge.wait_until_up(0);
    assert!(bridge.inbox.put(Request::Goal(pose("map", 2.0, 0.0, 0.0))));
    let begin = Instant::now();
    while base.speed().0 < 0.2 {
        assert!(begin.elapsed().as_secs_f64() < 5.0);
        sleep(0.01);
    }
    (base, usb, bridge)
}

#[test]
fn a_goal_is_gone_on_to_without_a_cable_and_not_again_with_it() {
    let directory = tempfile::tempdir().unwrap();
    let (base, mut usb, bridge) = on_the_way(&directory);
    usb.pull();
    let begin = Instant::now();
    while base.speed().0 > REST.0 {
        assert!(begin.elapsed().as_secs_f64() < 15.0);
        sleep(0.1);
    }
    let [x, y, _] = base.now().pose;
    // Its own odometry, and nothing else, led it there.
    assert!((x - 2.0).hypot(y) < 0.05, "{x} {y}");
    let (rest, mark) = (base.now().t, bridge.mark());
    usb.plug();
    bridge.wait_for_motion(mark);
    sleep(1.0);
    assert!(moved(&base, rest).0 < 1e-3);
    assert!(!usb.lines().iter().any(|line| moves(line)));
}

#[test]
fn a_goal_ends_when_the_cable_is_back() {
    let directory = tempfile::tempdir().unwrap();
    let (base, mut usb, bridge) = on_the_way(&directory);
    let mark = bridge.mark();
    usb.pull();
    // Until it is noticed, what was under way is still told.
    sleep(0.1);
    usb.plug();
    let lost = bridge.wait_for(mark, 1.0, |report| {
        let link = status(report, "link")?;
        link.message.starts_with("lost").then_some(())
    });
    assert!(lost.is_some());
    bridge.wait_until_up(bridge.mark());
    sleep(0.5);
    assert_eq!(usb.lines()[..2], ["", "Stop"]);
    assert!(base.speed().0 < REST.0 && base.now().pose[0] < 1.5);
}

#[test]
fn who_ends_the_bridge_just_after_a_long_time_without_a_cable_stops_the_base() {
    let directory = tempfile::tempdir().unwrap();
    let (base, mut usb, bridge) = on_the_way(&directory);
    usb.pull();
    // By then the bridge looks for it but every few seconds.
    sleep(4.2);
    usb.plug();
    bridge.end();
    sleep(0.6);
    assert!(base.speed().0 < REST.0, "{:?}", base.speed());
    // Not at the goal.
    assert!(base.now().pose[0] < 1.7, "{:?}", base.now());
}

#[test]
fn who_ends_the_bridge_while_the_cable_is_out_for_a_moment_stops_the_base() {
    let directory = tempfile::tempdir().unwrap();
    let (base, mut usb, bridge) = on_the_way(&directory);
    usb.pull();
    // It has noticed that.
    sleep(0.1);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            sleep(0.1);
            usb.plug();
        });
        let begin = Instant::now();
        bridge.end();
        assert!(begin.elapsed().as_secs_f64() < 1.5);
    });
    sleep(0.6);
    assert!(base.speed().0 < REST.0, "{:?}", base.speed());
    assert!(base.now().pose[0] < 1.5, "{:?}", base.now());
}

#[test]
fn a_bridge_whose_cable_stays_out_ends_all_the_same() {
    let directory = tempfile::tempdir().unwrap();
    let (_base, mut usb, bridge) = on_the_way(&directory);
    usb.pull();
    let begin = Instant::now();
    bridge.end();
    assert!(begin.elapsed().as_secs_f64() < 1.5);
}
