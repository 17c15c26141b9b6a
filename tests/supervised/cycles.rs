//! Cycles before a supervisor without a motor model, so that nothing but bounds is looked at.
#![allow(dead_code, reason = "each test file uses a part of it")]

use vehicle_controller::supervisor::{
    Config, Cycle, Fault, Following, MotorModel, Place, Supervisor,
};
use vehicle_controller::vehicle::Wheel;

pub(crate) const CLOSELY: [Following; 2] = [Following::Closely; 2];
/// A tick, s.
pub(crate) const DT: f32 = 1e-3;

/// No motor model, so that nothing but the bounds is looked at.
pub(crate) const CONFIG: Config = Config {
    motor: MotorModel {
        static_friction: 0.0,
        speed_gain: 0.0,
        acceleration_gain: 0.0,
        resistance: 0.0,
        tolerance: 0.0,
        floor: 0.0,
        rest_floor: 0.0,
    },
    max_wheel_speed: 1.0,
    max_current: 4.0,
    supply: [9.0, 15.0],
    deadman: 1.0,
};

pub(crate) const STILL: Wheel = Wheel {
    count: 0,
    speed: 0.0,
    duty: 0.0,
};

pub(crate) const FINE: Cycle = Cycle {
    dt: DT,
    steps: 1,
    wheels: [STILL; 2],
    currents: [None; 2],
    supply: 12.0,
    motor_supply: 12.0,
    turns: false,
    estimate_is_finite: true,
};

/// A cycle that is out of bounds in some way, or hardly within them.
pub(crate) type Case = (Cycle, [Following; 2]);

pub(crate) fn speeds(left: f32, right: f32) -> Case {
    let wheels = [left, right].map(|speed| Wheel { speed, ..STILL });
    (Cycle { wheels, ..FINE }, CLOSELY)
}

pub(crate) fn currents(left: Option<f32>, right: Option<f32>) -> Case {
    let currents = [left, right];
    (Cycle { currents, ..FINE }, CLOSELY)
}

pub(crate) fn supply(supply: f32) -> Case {
    (Cycle { supply, ..FINE }, CLOSELY)
}

pub(crate) fn following(translation: Following, rotation: Following) -> Case {
    (FINE, [translation, rotation])
}

/// After how many ticks of a cycle, at most so many, something is found.
pub(crate) fn found(
    supervisor: &mut Supervisor,
    case: &Case,
    most: u32,
) -> Option<(u32, Fault, Place)> {
    (1..=most).find_map(|tick| {
        let (fault, place) = supervisor.watch(&CONFIG, &case.0, || case.1)?;
        Some((tick, fault, place))
    })
}
