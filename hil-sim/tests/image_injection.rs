//! The image sees what the library sees of what is broken around it.

mod image;

use hil_sim::base::Base;
use hil_sim::emulator::Setup;
use hil_sim::faults::Fault;
use image::{Client, emulated, host};

/// Left and right, with faults of the left one: the counts after each of the milliseconds of a push to and fro, while the motors are off.
fn counts<B: Base>(mut client: Client<B>, fault: &str) -> Vec<[i64; 2]> {
    client.send("Disable");
    client.run(300);
    let words: Vec<&str> = fault.split_whitespace().collect();
    let mut seen = Vec::new();
    let mut look = |client: &mut Client<B>, milliseconds: u32| {
        for _ in 0..milliseconds {
            client.tick();
            let row = client.base.row().unwrap();
            seen.push([row.left_count, row.right_count]);
        }
    };
    client.base.push(12.0, 0.1, 0.4);
    look(&mut client, 200);
    Base::inject(&mut client.base, Fault::parse(&words).unwrap()).unwrap();
    look(&mut client, 200);
    client.base.push(-12.0, 0.0, 0.6);
    look(&mut client, 400);
    client.base.clear_faults().unwrap();
    look(&mut client, 200);
    seen
}

fn agree(fault: &str) {
    let ours = counts(Client::new(host()), fault);
    let theirs = counts(Client::new(emulated(&Setup::default())), fault);
    assert_eq!(ours.len(), theirs.len());
    // Idle passes on what the tick knows; when it is busy, the knowledge is that of a tick before.
    let mut stale = 0;
    for millisecond in 1..ours.len() {
        let (now, before, seen) = (
            ours[millisecond],
            ours[millisecond - 1],
            theirs[millisecond],
        );
        stale += u32::from(seen != now);
        assert!(
            seen == now || seen == before,
            "`{fault}` after {millisecond} ms: {now:?} on the host, {seen:?} in the image"
        );
    }
    assert!(stale < 100, "`{fault}`: {stale} times a tick behind");
}

#[test]
fn a_stuck_encoder() {
    agree("left encoder stuck");
}

#[test]
fn an_open_channel_a() {
    agree("left encoder open-a");
}

#[test]
fn an_open_channel_b() {
    agree("both encoder open-b");
}

#[test]
fn exchanged_channels() {
    agree("right encoder swapped");
}

#[test]
fn other_discs() {
    agree("left encoder scale 2");
    agree("both encoder scale -0.3");
}

#[test]
fn lost_counts() {
    agree("both encoder drop 0.5");
}

#[test]
fn jumps() {
    agree("left encoder jump 500");
    agree("both encoder jump -500");
}

/// What the timers' filters could not tell apart waits: 600 edges fit into a millisecond.
#[test]
fn a_jump_beyond_a_millisecond_is_spread_over_some() {
    let mut client = Client::new(emulated(&Setup::default()));
    client.run(300);
    let jump = Fault::parse(&["right", "encoder", "jump", "-20000"]).unwrap();
    Base::inject(&mut client.base, jump).unwrap();
    client.run(10);
    let partly = client.base.row().unwrap().right_count;
    assert!((-6000..=-5400).contains(&partly), "{partly}");
    client.run(30);
    let row = client.base.row().unwrap();
    assert_eq!((row.left_count, row.right_count), (0, -20_000));
}

#[test]
fn a_cut_line_carries_nothing_either_way() {
    let mut client = Client::new(emulated(&Setup::default()));
    client.wait_for("! boot", 100);
    assert!(client.ask("GetTime").starts_with("Time "));
    client.send("Stream 0.01");
    client.run(200);
    Base::inject(&mut client.base, Fault::LinkCut).unwrap();
    client.run(100);
    let (lines, bytes) = (client.lines.len(), client.received);
    client.send("m 0.1");
    client.run(500);
    assert_eq!((client.lines.len(), client.received), (lines, bytes));
    assert_eq!(client.base.backlog(), 0, "nothing waits");
    client.base.clear_faults().unwrap();
    client.run(200);
    assert!(client.lines.len() > lines + 5, "the telemetry is back");
    assert_eq!(
        client.base.plant().counts(),
        [0, 0],
        "what was said is lost"
    );
}

#[test]
fn motors_and_battery_fail_under_the_image_too() {
    let mut client = Client::new(emulated(&Setup::default()));
    client.run(300);
    // What is looked at here are the motors, not what the supervisor says of them.
    client.send("SetParam motor_tolerance 10");
    let inject = |client: &mut Client<_>, words: &[&str]| {
        Base::inject(&mut client.base, Fault::parse(words).unwrap()).unwrap();
    };
    inject(&mut client, &["battery", "10.5"]);
    inject(&mut client, &["left", "motor", "open"]);
    client.run(300);
    let battery = client.base.row().unwrap().battery;
    assert!((battery - 10.5).abs() < 0.02, "{battery}");
    client.send("m inf 0.2");
    client.run(200);
    let [left, right] = client.base.plant().current();
    assert!(left == 0.0 && right.abs() > 0.05, "{left} {right} A");
    client.base.clear_faults().unwrap();
    client.run(50);
    assert!(client.base.plant().current()[0].abs() > 0.05);
    assert!(client.base.plant().bus_voltage() > 11.5);
}
