//! What happens when the image fails: motors off, a reset, and nothing moves afterwards.

mod image;

use hil_sim::base::Base;
use hil_sim::emulator::{Fault, ImageBase, Outcome, Setup};
use image::{Client, emulated};

/// The slowest, the nominal and the fastest that the watchdog's oscillator may be, Hz.
const LSI_HZ: [u64; 3] = [17_000, 32_000, 47_000];
/// Within this the motors are off and the base has reset itself, whatever hangs, s.
const HANG_DEADLINE: f64 = 0.050;
/// Within this a fault switches the motors off, s.
const FAULT_DEADLINE: f64 = 0.001;

/// A base at speed.
fn driving(lsi_hz: u64) -> Client<ImageBase> {
    let mut client = Client::new(emulated(&Setup {
        lsi_hz,
        ..Setup::default()
    }));
    client.wait_for("! boot power-on", 100);
    assert_eq!(client.ask("m inf 0.3"), "OK");
    client.run(1500);
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
        let (off, reset) = fail(&mut client, fault);
        assert!(
            (0.0..HANG_DEADLINE).contains(&off),
            "{lsi_hz} Hz: off after {off} s"
        );
        assert!(
            (0.0..HANG_DEADLINE).contains(&reset),
            "{lsi_hz} Hz: reset after {reset} s"
        );
        is_safe(&mut client);
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
