//! What the controller does about a fault: latching, clearing, and going on with what the loss of the link leaves.

#[path = "supervised/battery.rs"]
mod battery;
mod common;

use battery::*;
use common::Rig;
use vehicle_controller::controller::{Action, AxisCommand};
use vehicle_controller::params::{Id, Params};
use vehicle_controller::supervisor::Fault;

#[test]
fn a_fault_that_demands_more_replaces_one_that_demands_less_and_not_the_reverse() {
    // Off after stop.
    let mut rig = stopping();
    rig.inputs.battery = TOO_HIGH;
    until(&mut rig, 0.5, |rig| fault(rig) == Some(Fault::Overvoltage));
    assert!(!drives(&rig));
    assert_eq!(rig.unsolicited(), ["! fault overvoltage"]);
    // Stop after off: nothing is told, nothing moves.
    let mut rig = moving();
    rig.inputs.battery = TOO_HIGH;
    until(&mut rig, 0.5, |rig| fault(rig).is_some());
    rig.inputs.battery = TOO_LOW;
    assert_off_and(&mut rig, Fault::Overvoltage);
    // The first of two that demand the same is the one that is known.
    let mut rig = stopping();
    rig.alive = false;
    rig.run(2.0);
    assert_eq!(fault(&rig), Some(Fault::Undervoltage));
    let mut rig = moving();
    rig.broken.set(true);
    until(&mut rig, 0.1, |rig| fault(rig) == Some(Fault::Output));
    rig.broken.set(false);
    rig.inputs.battery = TOO_HIGH;
    assert_off_and(&mut rig, Fault::Output);
}

#[test]
fn an_emergency_stop_is_told_whatever_is_latched() {
    for start in [
        None,
        Some(Fault::Watchdog),
        Some(Fault::Storage),
        Some(Fault::Link),
    ] {
        for button in [false, true] {
            let mut rig = Rig::after(Params::default(), start);
            rig.unsolicited();
            if button {
                rig.inputs.stop_button = true;
                rig.tick();
            } else {
                rig.ok("EStop");
            }
            assert_eq!(fault(&rig), Some(Fault::Estop));
            assert_eq!(rig.unsolicited(), ["! fault estop"], "{start:?}");
            rig.run(0.1);
            // Once.
            assert_eq!(rig.unsolicited().len(), 0);
        }
    }
    let mut rig = stopping();
    rig.ok("EStop");
    assert!(!drives(&rig));
    assert_eq!(rig.unsolicited(), ["! fault estop"]);
    assert_off_and(&mut rig, Fault::Estop);
}

#[test]
fn the_release_of_the_emergency_stop_moves_nothing_nor_does_clearing() {
    for line in ["m inf 0.5", "m 1", "t inf", "t 90"] {
        let mut rig = with(&[]);
        rig.ok(line);
        rig.run(0.5);
        rig.inputs.stop_button = true;
        rig.tick();
        assert!(!drives(&rig));
        rig.refused("ClearFault", "fault");
        rig.inputs.stop_button = false;
        rig.tick();
        assert_off(&mut rig);
        rig.refused("m 1", "fault");
        rig.refused("t 1", "fault");
        rig.ok("ClearFault");
        assert_off(&mut rig);
        let was = rig.estimate().pose;
        rig.ok("m 0.1");
        rig.run(2.0);
        // From where it is, not from where it would have been.
        let now = rig.estimate().pose;
        assert!(((now.x - was.x).hypot(now.y - was.y) - 0.1).abs() < 1e-3);
    }
}

#[test]
fn while_a_cause_lasts_its_fault_is_not_cleared() {
    for (volts, name) in [(TOO_LOW, "undervoltage"), (TOO_HIGH, "overvoltage")] {
        let mut rig = moving();
        rig.inputs.battery = volts;
        rig.run(2.0);
        assert!(rig.refused("ClearFault", "fault").contains(name));
        rig.inputs.battery = GOOD;
        rig.run(0.5);
        assert!(fault(&rig).is_some(), "it latches");
        rig.ok("ClearFault");
        assert_eq!(fault(&rig), None);
        assert_off(&mut rig);
        rig.ok("m inf 0.5");
        rig.run(1.0);
        assert!(speed(&rig) > 0.4);
    }
}

#[test]
fn a_lost_link_ends_what_has_no_end_and_nothing_else() {
    // No end: deadman, then v/a.
    let mut rig = moving();
    rig.alive = false;
    let at = until(&mut rig, 2.0, |rig| fault(rig).is_some());
    assert!((at - 1.0).abs() < 0.005, "{at}");
    assert_eq!(fault(&rig), Some(Fault::Link));
    let stopped = until(&mut rig, 1.0, |rig| !drives(rig));
    assert!((stopped - RAMP).abs() < 0.01, "{stopped}");
    assert_off(&mut rig);
    assert_eq!(rig.unsolicited(), ["! fault link", "! stop fault"]);
    // An end: it is reached, however long nobody speaks.
    let mut rig = with(&[]);
    rig.ok("m 1 0.5 2");
    rig.alive = false;
    rig.run(5.0);
    assert_eq!(fault(&rig), None);
    assert!((rig.estimate().pose.x - 1.0).abs() < 1e-3);
    // At rest there is nothing to end.
    let mut rig = with(&[]);
    rig.alive = false;
    rig.run(5.0);
    assert_eq!(fault(&rig), None);
    // No deadman.
    let mut rig = moving_with(&[(Id::Deadman, 0.0)]);
    rig.alive = false;
    rig.run(20.0);
    assert_eq!(fault(&rig), None);
    assert!(drives(&rig));
}

/// A turn without an end and a move with one, and nobody there: the move goes on under the latched fault.
fn half_ended() -> Rig {
    let mut rig = with(&[(Id::StopAccel, 0.5)]);
    rig.ok("m 1.2 0.3 2");
    rig.ok("t inf 30");
    rig.alive = false;
    until(&mut rig, 1.5, |rig| fault(rig) == Some(Fault::Link));
    rig.run(0.3);
    assert!(rig.snapshot().rotation.speed.abs() < 1e-3);
    assert!((speed(&rig) - 0.3).abs() < 1e-3);
    rig.unsolicited();
    rig
}

#[test]
fn an_axis_with_a_target_goes_on_to_it_when_the_other_has_lost_the_link() {
    let mut rig = half_ended();
    rig.run(5.0);
    assert!((rig.snapshot().translation.displacement.to_f64()).abs() < 1e-3);
    assert_eq!(fault(&rig), Some(Fault::Link));
    assert_off(&mut rig);
    let events = rig.unsolicited();
    assert_eq!(events.len(), 2, "{events:?}");
    assert!(events[0].starts_with("! move done "));
    assert_eq!(events[1], "! stop fault");
}

#[test]
fn another_fault_stops_what_the_lost_link_let_go_on() {
    let mut rig = half_ended();
    rig.inputs.battery = TOO_LOW;
    let stopped = until(&mut rig, 1.2, |rig| !drives(rig));
    // 147 ms until it is seen, 0.3 m/s at 0.5 m/s².
    assert!((stopped - 0.747).abs() < 0.02, "{stopped}");
    assert_off(&mut rig);
}

#[test]
fn an_estimate_that_is_no_number_stops_the_base_until_it_is_told_where_it_is() {
    for error in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let mut rig = moving();
        rig.hand.error.set(error);
        rig.tick();
        rig.tick();
        rig.tick();
        assert_eq!(fault(&rig), Some(Fault::Estimator));
        let stopped = until(&mut rig, DEADLINE + 0.01, |rig| !drives(rig));
        assert!(stopped > 0.0);
        assert_off(&mut rig);
        assert!(rig.refused("ClearFault", "fault").contains("estimator"));
        rig.ok("ResetPos 1 2 90");
        rig.ok("ClearFault");
        assert_off(&mut rig);
        rig.ok("m 0.1");
        rig.run(2.0);
        let pose = rig.estimate().pose;
        assert!((pose.x - 1.0).hypot(pose.y - 2.1) < 1e-3, "{pose:?}");
        assert_eq!(fault(&rig), None);
        let status = rig.ask("GetState");
        assert!(
            !status.contains("nan") && !status.contains("inf"),
            "{status}"
        );
    }
}

#[test]
fn what_comes_between_a_command_and_its_tick_comes_first() {
    let command = AxisCommand {
        distance: 1.0,
        speed: 0.5,
        acceleration: 1.0,
    };
    for motion in [Action::Move(command), Action::Turn(command)] {
        let mut button = with(&[]);
        button.act(&motion);
        button.inputs.stop_button = true;
        button.tick();
        button.inputs.stop_button = false;
        assert_off_and(&mut button, Fault::Estop);
        let mut estop = with(&[]);
        estop.act(&motion);
        estop.act(&Action::EStop);
        estop.tick();
        assert_off_and(&mut estop, Fault::Estop);
        let mut disabled = with(&[]);
        disabled.act(&Action::Disable);
        disabled.act(&motion);
        disabled.tick();
        assert_off(&mut disabled);
        let mut latched = Rig::after(Params::default(), Some(Fault::Watchdog));
        latched.act(&motion);
        latched.tick();
        assert_off_and(&mut latched, Fault::Watchdog);
        // Past the desk a fault does not clear, either, while its cause lasts.
        button.inputs.stop_button = true;
        button.tick();
        button.act(&Action::ClearFault);
        button.act(&motion);
        button.tick();
        button.inputs.stop_button = false;
        assert_off_and(&mut button, Fault::Estop);
        // Cleared and told to go in one tick, it goes.
        button.act(&Action::ClearFault);
        button.act(&motion);
        button.tick();
        assert!(drives(&button));
    }
}

#[test]
fn a_motion_after_switching_off_starts_with_a_clean_slate() {
    // 80 ms of the 100 that a low battery may last, four times over: what was before counts for nothing.
    let mut rig = with(&[]);
    rig.inputs.battery = TOO_LOW;
    rig.run(0.5);
    for _ in 0..4 {
        rig.ok("m inf 0.5 2");
        rig.run(0.08);
        assert_eq!(fault(&rig), None);
        rig.ok("EStop");
        rig.ok("ClearFault");
    }
    rig.ok("m inf 0.5 2");
    let at = until(&mut rig, 0.2, |rig| fault(rig).is_some());
    assert!((at - 0.1).abs() < 0.005, "{at}");
}

#[test]
fn a_stop_command_stops_what_the_lost_link_let_go_on() {
    let mut rig = half_ended();
    rig.ok("Stop");
    let stopped = until(&mut rig, 1.0, |rig| !drives(rig));
    assert!((stopped - 0.6).abs() < 0.02, "{stopped}");
    assert_off(&mut rig);
}

#[test]
fn a_base_that_is_blocked_is_told_from_one_whose_wheels_fight() {
    // Turning, its motors push in opposite directions as they should.
    for (line, is_turn) in [
        ("m inf 0.5 2", false),
        ("t inf 90", true),
        ("t inf 200 1000", true),
    ] {
        let mut rig = with(&[(Id::TurnLag, 90.0), (Id::MoveLag, 1.0)]);
        rig.ok(line);
        rig.run(0.3);
        assert_eq!(is_turn, rig.snapshot().rotation.speed != 0.0);
        rig.hand.carries.set(Some(0.0));
        until(&mut rig, 0.5, |rig| fault(rig).is_some());
        assert_eq!(rig.unsolicited(), ["! fault no-motion both"], "{line}");
        assert!(!drives(&rig));
    }
}
