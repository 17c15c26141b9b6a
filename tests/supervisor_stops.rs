//! What the controller does about a fault: stopping with a deadline, switching off.

#[path = "supervised/battery.rs"]
mod battery;
mod common;

use battery::*;
use common::Rig;
use vehicle_controller::params::Id;
use vehicle_controller::supervisor::Fault;

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
    let disabling: fn() -> Rig = || {
        let mut rig = moving();
        rig.ok("Disable");
        rig
    };
    for begin in [stopping, disabling] {
        let mut rig = begin();
        let stopped = until(&mut rig, 1.0, |rig| !drives(rig));
        assert!((stopped - RAMP).abs() < 0.02, "{stopped}");
        let braked = until(&mut rig, 1.0, |rig| !rig.hand.brakes.get());
        assert!((braked - 0.5).abs() < 0.003, "{braked}");
    }
}
