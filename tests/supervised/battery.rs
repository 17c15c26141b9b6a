//! A base whose faults are made of its battery: 11 V are too little for `supply_min` 0.95, and 13 V too much for `supply_max` 1.05; neither is far from
//! what the model of the motors expects.
#![allow(dead_code, reason = "each test file uses a part of it")]

use crate::common::Rig;
use vehicle_controller::params::{Id, Params};
use vehicle_controller::supervisor::Fault;

/// Volts at the divider.
pub(crate) const TOO_LOW: Option<f32> = Some(1.0);
pub(crate) const GOOD: Option<f32> = Some(12.0 / 11.0);
pub(crate) const TOO_HIGH: Option<f32> = Some(13.0 / 11.0);
/// m/s, and the default deceleration of a stop.
pub(crate) const SPEED: f32 = 0.5;
pub(crate) const DECELERATION: f32 = 1.0;
pub(crate) const RAMP: f64 = 0.5;
/// What a stop for a fault's sake may take: 1.25 ramps and 0.6 s.
pub(crate) const DEADLINE: f64 = 1.25 * RAMP + 0.6;

pub(crate) fn with(values: &[(Id, f32)]) -> Rig {
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

pub(crate) fn moving_with(values: &[(Id, f32)]) -> Rig {
    let mut rig = with(values);
    rig.ok("m inf 0.5 2");
    rig.run(1.0);
    assert!((speed(&rig) - SPEED).abs() < 1e-4);
    rig.unsolicited();
    rig
}

pub(crate) fn moving() -> Rig {
    moving_with(&[])
}

pub(crate) fn speed(rig: &Rig) -> f32 {
    rig.snapshot().translation.speed
}

pub(crate) fn drives(rig: &Rig) -> bool {
    rig.hand.drives.get()
}

pub(crate) fn fault(rig: &Rig) -> Option<Fault> {
    rig.snapshot().fault
}

/// Seconds until something is so.
pub(crate) fn until(rig: &mut Rig, most: f64, so: impl Fn(&Rig) -> bool) -> f64 {
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
pub(crate) fn stopping_with(values: &[(Id, f32)]) -> Rig {
    let mut rig = moving_with(values);
    rig.inputs.battery = TOO_LOW;
    until(&mut rig, 0.3, |rig| fault(rig).is_some());
    assert_eq!(rig.unsolicited(), ["! fault undervoltage"]);
    assert!(drives(&rig));
    rig
}

pub(crate) fn stopping() -> Rig {
    stopping_with(&[])
}

/// A base that somebody carries along, whatever it does: it never comes to rest.
pub(crate) fn carried() -> Rig {
    let rig = stopping_with(&[(Id::MotorSpeedGain, 0.0), (Id::MoveLag, 1.0)]);
    rig.hand.carries.set(Some(SPEED));
    rig
}

/// The motors are off, stay off, and nothing moves.
pub(crate) fn assert_off(rig: &mut Rig) {
    for _ in 0..1000 {
        rig.tick();
        assert!(!drives(rig) && speed(rig) == 0.0);
    }
}

pub(crate) fn assert_off_and(rig: &mut Rig, latched: Fault) {
    rig.tick();
    assert_off(rig);
    assert_eq!(fault(rig), Some(latched));
}
