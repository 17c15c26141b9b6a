//! What happens when the image fails: motors off, a reset, and nothing moves afterwards.

mod image;

use hil_sim::base::Base;
use hil_sim::emulator::{Fault, ImageBase, Outcome, Setup};
use image::{Client, emulated};

/// The slowest, the nominal and the fastest that the watchdog's oscillator may be, Hz.
const LSI_HZ: [u64; 3] = [17_000, 32_000, 47_000];
/// Within this the motors are off and the base has reset itself, whatever hangs, s.
const HANG_DEADLINE: f64 = 0.050;
/// The same with an oscillator of its nominal frequency.
const NOMINAL_DEADLINE: f64 = 0.025;
/// Within this a fault switches the motors off, s.
const FAULT_DEADLINE: f64 = 0.001;

/// A base at speed.
fn driving(lsi_hz: u64) -> Client<ImageBase> {
    driving_for(lsi_hz, 1500)
}

/// The same after some milliseconds.
fn driving_for(lsi_hz: u64, milliseconds: u64) -> Client<ImageBase> {
    let mut client = Client::new(emulated(&Setup {
        lsi_hz,
        ..Setup::default()
    }));
    client.wait_for("! boot power-on", 100);
    // Nobody need repeat himself here.
    assert_eq!(client.ask("SetParam deadman 0"), "OK");
    assert_eq!(client.ask("m inf 0.3"), "OK");
    client.run(milliseconds);
    assert!(client.base.plant().speed().0 > 0.25, "it does not drive");
    client
}

/// Lets something go wrong at speed. When the motors were off and when it reset itself, s after the fault.
fn fail(client: &mut Client<ImageBase>, fault: Fault) -> (f64, f64) {
    client.base.inject(fault).unwrap();
    client.run(60);
    let Outcome {
        injected,
        motors_off,
        resets,
    } = client.base.outcome().unwrap();
    let injected = injected.expect("the core came by no place for the fault");
    let motors_off = motors_off.expect("the motors are on");
    assert_eq!(resets.len(), 1, "{resets:?}");
    let times = (motors_off - injected, resets[0] - injected);
    let (off, reset) = (times.0 * 1e6, times.1 * 1e6);
    println!("{fault:?}: motors off after {off:.2} us, reset after {reset:.2} us");
    times
}

/// After a reset by the watchdog: it says so, a fault is latched, and nothing moves.
fn is_safe(client: &mut Client<ImageBase>) {
    client.run(20);
    assert!(
        client
            .lines
            .iter()
            .any(|(_, line)| line == "! boot watchdog"),
        "{:?}",
        client.lines
    );
    assert_eq!(client.ask("GetStatus"), "Status HOLD HOLD enabled watchdog");
    assert!(client.ask("m 1").starts_with("ERR fault"));
    assert!(
        client
            .base
            .bridges()
            .iter()
            .all(hil_sim::emulator::Bridge::is_off)
    );
    assert_eq!(client.ask("ClearFault"), "OK");
    assert_eq!(client.ask("GetStatus"), "Status HOLD HOLD enabled none");
}

fn hang(fault: Fault) {
    for lsi_hz in LSI_HZ {
        let mut client = driving(lsi_hz);
        let deadline = if lsi_hz == 32_000 {
            NOMINAL_DEADLINE
        } else {
            HANG_DEADLINE
        };
        let (off, reset) = fail(&mut client, fault);
        for time in [off, reset] {
            assert!((0.0..deadline).contains(&time), "{lsi_hz} Hz: {time} s");
        }
        is_safe(&mut client);
    }
}

/// The stack grows downward into nothing: the fault's handler runs on a fresh one.
#[test]
fn a_stack_that_overflows_switches_off_at_once() {
    let mut client = driving(32_000);
    let (off, reset) = fail(&mut client, Fault::IdleOverflows);
    // 16 KiB at 36 bytes a turn of two instructions: some 10 µs.
    assert!((0.0..FAULT_DEADLINE).contains(&off), "off after {off} s");
    assert!(
        (0.0..HANG_DEADLINE).contains(&reset),
        "reset after {reset} s"
    );
    is_safe(&mut client);
}

/// A line takes effect within 2 ms of its last byte, whenever that comes.
#[test]
fn a_command_takes_effect_within_two_ticks() {
    /// Ten bits at 115 200 baud, ms.
    const BYTE: f64 = 10.0 / 115.2;
    for blanks in 0..12 {
        let mut client = Client::new(emulated(&Setup::default()));
        client.wait_for("! boot", 100);
        client.run(50);
        let line = format!("m {:>width$}", 0.5, width = blanks + 3);
        client.send(&line);
        let sent = client.time;
        while client
            .base
            .bridges()
            .iter()
            .all(hil_sim::emulator::Bridge::is_off)
        {
            client.tick();
            assert!(client.time < sent + 20, "it does not drive");
        }
        let arrived = (line.len() + 1) as f64 * BYTE;
        // As of the end of a millisecond: the motors were on up to one earlier.
        let taken = (client.time - sent) as f64 - arrived;
        assert!(taken <= 2.0, "{} bytes: {taken} ms", line.len() + 1);
    }
}

/// A client gone mad, and somebody who stops the base: what cannot be answered any more is obeyed all the same.
#[test]
fn a_flood_of_lines_does_not_hide_an_emergency_stop() {
    for lines in [250, 340, 500] {
        let mut client = driving(32_000);
        for k in 0..lines {
            client.send(&format!("@{k} GetEstPos"));
        }
        client.send("EStop");
        while client.base.backlog() > 0 {
            client.tick();
        }
        client.wait_for("! fault estop", 2000);
        client.run(3000);
        assert!(client.base.plant().speed().0.abs() < 1e-3, "it drives on");
        assert_eq!(client.ask("GetStatus"), "Status HOLD HOLD enabled estop");
    }
}

#[test]
fn idle_hangs() {
    hang(Fault::IdleHangs);
}

#[test]
fn the_tick_hangs() {
    hang(Fault::TickHangs);
}

#[test]
fn a_hard_fault_switches_off_at_once() {
    for fault in [Fault::IdleFaults, Fault::TickFaults] {
        let mut client = driving(32_000);
        let (off, reset) = fail(&mut client, fault);
        assert!(
            (0.0..FAULT_DEADLINE).contains(&off),
            "{fault:?}: off after {off} s"
        );
        assert!(
            (0.0..HANG_DEADLINE).contains(&reset),
            "{fault:?}: reset after {reset} s"
        );
        is_safe(&mut client);
    }
}

#[test]
fn an_open_emergency_stop_never_lets_it_move() {
    let mut client = Client::new(emulated(&Setup::default()));
    client.wait_for("! boot", 100);
    assert_eq!(client.ask("SetParam estop_input 1"), "OK");
    client.base.set_estop(true).unwrap();
    client.run(100);
    for line in [
        "m 1",
        "t 90",
        "ClearFault",
        "m inf 0.1",
        "Enable",
        "ClearFault",
        "m 0.1",
    ] {
        let reply = client.ask(line);
        let moves = line.starts_with(['m', 't']) || line == "ClearFault";
        assert!(!moves || reply.starts_with("ERR fault"), "{line}: {reply}");
    }
    client.run(500);
    assert_eq!(client.base.plant().pose(), [0.0; 3]);
    assert!(client.base.outcome().unwrap().motors_off.is_some());

    // With the circuit closed it can be cleared, and drives.
    client.base.set_estop(false).unwrap();
    client.run(100);
    assert_eq!(client.ask("ClearFault"), "OK");
    assert_eq!(client.ask("m 0.1"), "OK");
    client.wait_for("! move done", 3000);
}

#[test]
fn the_emergency_stop_stops_at_speed() {
    let mut client = driving(32_000);
    assert!(client.ask("SetParam estop_input 1") == "OK");
    client.base.set_estop(true).unwrap();
    client.wait_for("! fault estop", 100);
    client.run(2000);
    assert!(client.base.plant().speed().0.abs() < 1e-3);
    assert!(client.ask("m 1").starts_with("ERR fault"));
}

#[test]
fn the_button_stops() {
    let mut client = driving(32_000);
    client.base.press(true).unwrap();
    client.wait_for("! fault estop", 100);
    // For as long as it is held, the fault cannot be cleared.
    assert!(client.ask("ClearFault").starts_with("ERR fault"));
    client.base.press(false).unwrap();
    client.run(2000);
    assert!(client.base.plant().speed().0.abs() < 1e-3, "it still moves");
    assert_eq!(client.ask("GetStatus"), "Status HOLD HOLD enabled estop");
    assert_eq!(client.ask("ClearFault"), "OK");
}

#[test]
fn the_reset_button_resets() {
    let mut client = driving(32_000);
    client.base.reset().unwrap();
    client.wait_for("! boot", 100);
    client.run(2000);
    assert!(client.base.plant().speed().0.abs() < 1e-3, "it still moves");
    assert_eq!(client.ask("GetStatus"), "Status HOLD HOLD enabled none");
}

/// From power-on to the first tick and on to the first command, no driver is enabled or no PWM is given.
#[test]
fn outputs_are_off_before_the_first_motion() {
    let mut client = Client::new(emulated(&Setup::default()));
    client.run(500);
    let outcome = client.base.outcome().unwrap();
    // As the wires see it from the first access to them on, without a gap: some microseconds after power-on.
    assert!(outcome.motors_off.unwrap() < 0.001, "{outcome:?}");
    let [green, _, red] = client.base.leds().unwrap();
    assert!(!red, "no fault");
    client.run(500);
    assert_ne!(
        client.base.leds().unwrap()[0],
        green,
        "the green light blinks"
    );
}
