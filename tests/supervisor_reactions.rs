//! What the controller does about a fault: stopping with a deadline, switching off, latching, clearing.
//!
//! Faults are made of the battery: 11 V are too little for `supply_min` 0.95, and 13 V too much for `supply_max` 1.05; neither is far from what the motors'
//! model expects.

mod common;

use common::Rig;
use vehicle_controller::controller::{Action, AxisCommand};
use vehicle_controller::params::{Id, Params};
use vehicle_controller::supervisor::Fault;

/// Volts at the divider.
const TOO_LOW: Option<f32> = Some(1.0);
const GOOD: Option<f32> = Some(12.0 / 11.0);
const TOO_HIGH: Option<f32> = Some(13.0 / 11.0);
/// m/s, and the default deceleration of a stop.
const SPEED: f32 = 0.5;
const DECELERATION: f32 = 1.0;
const RAMP: f64 = 0.5;
/// What a stop for a fault's sake may take: 1.25 ramps and 0.6 s.
const DEADLINE: f64 = 1.25 * RAMP + 0.6;

fn with(values: &[(Id, f32)]) -> Rig {
    let mut params = Params::default();
    params
        .set_all(&[(Id::SupplyMin, 0.95), (Id::SupplyMax, 1.05)])
        .unwrap();
    params.set_all(values).unwrap();
    let mut rig = Rig::with(params);
    rig.inputs.battery = GOOD;
    rig.unsolicited();
    rig
}

fn moving_with(values: &[(Id, f32)]) -> Rig {
    let mut rig = with(values);
    rig.ok("m inf 0.5 2");
    rig.run(1.0);
    assert!((speed(&rig) - SPEED).abs() < 1e-4);
    rig.unsolicited();
    rig
}

fn moving() -> Rig {
    moving_with(&[])
}

fn speed(rig: &Rig) -> f32 {
    rig.snapshot().translation.speed
}

fn drives(rig: &Rig) -> bool {
    rig.hand.drives.get()
}

fn fault(rig: &Rig) -> Option<Fault> {
    rig.snapshot().fault
}

/// Seconds until something is so.
fn until(rig: &mut Rig, most: f64, so: impl Fn(&Rig) -> bool) -> f64 {
    let ticks = (most * 1e3) as u32;
    let at = (0..ticks).find(|_| {
        let is = so(rig);
        if !is {
            rig.tick();
        }
        is
    });
    f64::from(at.unwrap_or_else(|| panic!("not within {most} s: {:?}", rig.snapshot()))) * 1e-3
}

/// A base that has just begun to stop, for the battery's sake.
fn stopping_with(values: &[(Id, f32)]) -> Rig {
    let mut rig = moving_with(values);
    rig.inputs.battery = TOO_LOW;
    until(&mut rig, 0.3, |rig| fault(rig).is_some());
    assert_eq!(rig.unsolicited(), ["! fault undervoltage"]);
    assert!(drives(&rig));
    rig
}

fn stopping() -> Rig {
    stopping_with(&[])
}

/// A base that somebody carries along, whatever it does: it never comes to rest.
fn carried() -> Rig {
    let rig = stopping_with(&[(Id::MotorSpeedGain, 0.0), (Id::MoveLag, 1.0)]);
    rig.hand.carries.set(Some(SPEED));
    rig
}

/// The motors are off, stay off, and nothing moves.
fn assert_off(rig: &mut Rig) {
    for _ in 0..1000 {
        rig.tick();
        assert!(!drives(rig) && speed(rig) == 0.0);
    }
}

#[test]
fn a_battery_too_low_for_a_tenth_of_a_second_stops_the_base_and_switches_it_off() {
    let mut rig = moving();
    rig.inputs.battery = TOO_LOW;
    // The filter of 50 ms passes 11.4 V on the way from 12 V to 11 V after 50 ms · ln(1/0.4); then 0.1 s.
    let at = until(&mut rig, 1.0, |rig| fault(rig).is_some());
    let expected = 0.05 * (1.0_f64 / 0.4).ln() + 0.1;
    assert!((at - expected).abs() < 0.005, "{at} {expected}");
    assert_eq!(fault(&rig), Some(Fault::Undervoltage));
    // v/a.
    let start = rig.estimate().pose.x;
    let stopped = until(&mut rig, 1.0, |rig| !drives(rig));
    assert!((stopped - RAMP).abs() < 0.01, "{stopped}");
    // v²/2a.
    let way = rig.estimate().pose.x - start;
    assert!((way - 0.125).abs() < 0.002, "{way}");
    assert_eq!(rig.unsolicited(), ["! fault undervoltage", "! stop fault"]);
    assert_off(&mut rig);
}

#[test]
fn a_stop_decelerates_at_the_stop_rate_from_the_first_tick() {
    let mut rig = stopping();
    // What is measured is the tick before, and the reference's mean speed in it.
    rig.run(0.002);
    let mut before = speed(&rig);
    for _ in 0..400 {
        rig.tick();
        let now = speed(&rig);
        assert!(
            ((before - now) - DECELERATION * 1e-3).abs() < 1e-4,
            "{before} {now}"
        );
        before = now;
    }
}

#[test]
fn a_battery_too_high_switches_off_at_once() {
    let mut rig = moving();
    rig.inputs.battery = TOO_HIGH;
    // 12.6 V on the way from 12 V to 13 V.
    let at = until(&mut rig, 1.0, |rig| fault(rig).is_some());
    let expected = 0.05 * (1.0_f64 / 0.4).ln() + 0.1;
    assert!((at - expected).abs() < 0.005, "{at} {expected}");
    assert!(!drives(&rig), "in the same tick");
    rig.tick();
    assert_off(&mut rig);
    assert_eq!(rig.unsolicited(), ["! fault overvoltage"]);
}

#[test]
fn a_base_that_does_not_come_to_rest_is_switched_off_by_the_deadline() {
    let pesterings: [&[&str]; 5] = [
        &[],
        &["Stop"],
        &["Disable"],
        &["Disable", "Enable"],
        &["ClearFault"],
    ];
    for lines in pesterings {
        for period in [1, 10, 100] {
            let mut rig = carried();
            let mut ticks = 0;
            while drives(&rig) {
                if ticks % period == 0
                    && let Some(line) = lines.get((ticks / period) as usize % lines.len().max(1))
                {
                    rig.receive(format!("{line}\n").as_bytes());
                    rig.pump();
                }
                rig.tick();
                ticks += 1;
                assert!(
                    f64::from(ticks) * 1e-3 <= DEADLINE + 0.002,
                    "{lines:?} {period}"
                );
            }
        }
    }
}

#[test]
fn an_axis_waits_for_rest_and_the_deadline_for_nothing() {
    // An axis waits for half a second to come to rest, unless it is told to stop again and again: then it has 0.6 s after what is left of its ramp.
    let mut rig = carried();
    let off = until(&mut rig, 3.0, |rig| !drives(rig));
    assert!((off - (RAMP + 0.5)).abs() < 0.005, "{off}");
    let mut rig = carried();
    let mut ticks = 0;
    while drives(&rig) && ticks < 3000 {
        rig.receive(b"Stop\n");
        rig.pump();
        rig.tick();
        ticks += 1;
    }
    let off = f64::from(ticks) * 1e-3;
    assert!((off - (RAMP + 0.6)).abs() < 0.005, "{off}");
}

#[test]
fn turning_has_its_own_ramp_and_the_longer_one_counts() {
    // 360 °/s at 360 °/s² is a second, 0.3 m/s at 1 m/s² a third of that.
    let mut rig = with(&[(Id::MaxWheelSpeed, 5.0), (Id::MotorSpeedGain, 0.0)]);
    rig.ok("m inf 0.3");
    rig.ok("t inf 180");
    rig.run(2.0);
    rig.inputs.battery = TOO_LOW;
    until(&mut rig, 0.3, |rig| fault(rig).is_some());
    let stopped = until(&mut rig, 2.0, |rig| !drives(rig));
    assert!((stopped - 0.5).abs() < 0.01, "{stopped}");
}

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

fn assert_off_and(rig: &mut Rig, latched: Fault) {
    rig.tick();
    assert_off(rig);
    assert_eq!(fault(rig), Some(latched));
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
fn a_stop_in_the_midst_of_a_fault_s_changes_nothing() {
    let mut plain = stopping();
    let mut stopped = stopping();
    stopped.run(0.1);
    plain.run(0.1);
    stopped.ok("Stop");
    plain.tick();
    while drives(&plain) {
        assert!((speed(&plain) - speed(&stopped)).abs() < 2e-3);
        plain.tick();
        stopped.tick();
    }
    stopped.run(0.01);
    assert!(!drives(&stopped));
    assert_eq!(stopped.unsolicited(), ["! stop fault"]);
}

#[test]
fn a_disable_in_the_midst_of_a_fault_s_stop_disables() {
    for enable in [false, true] {
        let mut rig = stopping();
        rig.ok("Disable");
        if enable {
            rig.ok("Enable");
        }
        assert!(drives(&rig));
        let stopped = until(&mut rig, 1.0, |rig| !drives(rig));
        assert!((stopped - RAMP).abs() < 0.02, "{stopped}");
        assert_off(&mut rig);
        assert_eq!(rig.unsolicited(), ["! stop fault"]);
        let status = if enable { "enabled" } else { "disabled" };
        assert_eq!(
            rig.ask("GetStatus"),
            format!("Status HOLD HOLD {status} undervoltage")
        );
    }
}

#[test]
fn a_disable_is_not_taken_back_by_a_fault_that_stops_or_switches_off() {
    for volts in [TOO_LOW, TOO_HIGH] {
        // So slow a stop that the fault comes in its midst.
        let mut rig = moving_with(&[(Id::StopAccel, 0.5)]);
        rig.inputs.battery = volts;
        rig.run(0.1);
        rig.ok("Disable");
        rig.run(2.0);
        assert!(fault(&rig).is_some());
        assert!(
            rig.ask("GetStatus")
                .starts_with("Status HOLD HOLD disabled ")
        );
        assert_off(&mut rig);
    }
}

#[test]
fn a_clearing_in_the_midst_of_a_stop_does_not_end_it() {
    let mut rig = stopping();
    rig.inputs.battery = GOOD;
    until(&mut rig, 0.2, |rig| !rig.snapshot().fault_persists);
    rig.ok("ClearFault");
    assert_eq!(fault(&rig), None);
    let mut before = speed(&rig);
    assert!(before > 0.1);
    while drives(&rig) {
        rig.tick();
        assert!(speed(&rig) < before);
        before = speed(&rig);
    }
    assert_off(&mut rig);
    assert_eq!(rig.unsolicited(), ["! stop fault"]);
    // A motion does: it is told to go.
    let mut rig = stopping();
    rig.refused("m inf 0.5", "fault");
    rig.inputs.battery = GOOD;
    until(&mut rig, 0.2, |rig| !rig.snapshot().fault_persists);
    rig.ok("ClearFault");
    rig.ok("m inf 0.5");
    rig.run(2.0);
    assert!((speed(&rig) - SPEED).abs() < 1e-3);
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
fn a_stop_command_stops_what_the_lost_link_let_go_on() {
    let mut rig = half_ended();
    rig.ok("Stop");
    let stopped = until(&mut rig, 1.0, |rig| !drives(rig));
    assert!((stopped - 0.6).abs() < 0.02, "{stopped}");
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
fn motors_that_are_switched_off_brake_for_half_a_second() {
    let mut rig = moving();
    rig.ok("EStop");
    let braked = until(&mut rig, 1.0, |rig| !rig.hand.brakes.get());
    assert!((braked - 0.5).abs() < 0.003, "{braked}");
    assert_off(&mut rig);
    // Again only after a motion: another stop finds them off.
    rig.ok("EStop");
    rig.ok("Stop");
    rig.ok("Disable");
    rig.run(0.1);
    assert!(!rig.hand.brakes.get());
    // A stop for a fault's sake ends in the same way, and so does a disable.
    let disabling = {
        let mut rig = moving();
        rig.ok("Disable");
        rig
    };
    for mut rig in [stopping(), disabling] {
        let stopped = until(&mut rig, 1.0, |rig| !drives(rig));
        assert!((stopped - RAMP).abs() < 0.02, "{stopped}");
        let braked = until(&mut rig, 1.0, |rig| !rig.hand.brakes.get());
        assert!((braked - 0.5).abs() < 0.003, "{braked}");
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
        button.act(motion.clone());
        button.inputs.stop_button = true;
        button.tick();
        button.inputs.stop_button = false;
        assert_off_and(&mut button, Fault::Estop);
        let mut estop = with(&[]);
        estop.act(motion.clone());
        estop.act(Action::EStop);
        estop.tick();
        assert_off_and(&mut estop, Fault::Estop);
        let mut disabled = with(&[]);
        disabled.act(Action::Disable);
        disabled.act(motion.clone());
        disabled.tick();
        assert_off(&mut disabled);
        let mut latched = Rig::after(Params::default(), Some(Fault::Watchdog));
        latched.act(motion.clone());
        latched.tick();
        assert_off_and(&mut latched, Fault::Watchdog);
        // Past the desk a fault does not clear, either, while its cause lasts.
        button.inputs.stop_button = true;
        button.tick();
        button.act(Action::ClearFault);
        button.act(motion.clone());
        button.tick();
        button.inputs.stop_button = false;
        assert_off_and(&mut button, Fault::Estop);
        // Cleared and told to go in one tick, it goes.
        button.act(Action::ClearFault);
        button.act(motion);
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
