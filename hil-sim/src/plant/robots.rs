//! The robots that the tests of the plant drive.

use super::{Chassis, Physics, RearSteering};

/// A small base with 84 mm wheels on 43.7:1 gear motors of 37 mm.
pub(super) const DEFAULT: &str = "
[body]
mass = 2.5
yaw_inertia = 0.02
load_share = 0.85
caster_position = -0.09
caster_friction = 0.02

[wheels]
diameter_left = 0.084
diameter_right = 0.084
base = 0.200
inertia = 1.0e-4
rolling_resistance = 0.004

[motor]
resistance = 2.2
torque_constant = 0.545
inertia = 2.9e-3
viscous = 0.00358
coulomb = 0.07
stiction = 0.095
stribeck_speed = 0.1
backlash = 0.005236
gear_stiffness = 1000.0
gear_damping = 0.5
spread = 0.01

[battery]
voltage = 12.4
resistance = 0.15

[bridge]
dead_band = 0.01
current_sensitivity = 0.25

[tyre]
friction = 0.8
creep = 150.0
rest_speed = 0.002

[encoder]
counts_per_turn = 2796.8
";

/// Crowley's Robuter.
pub(super) const ROBUTER: &str = "
[body]
mass = 150.0
yaw_inertia = 26.0
load_share = 0.6
caster_position = 0.75
caster_friction = 0.02

[wheels]
diameter_left = 0.350
diameter_right = 0.350
base = 0.640
inertia = 0.05
rolling_resistance = 0.01

[motor]
resistance = 1.5
torque_constant = 6.0
inertia = 0.5
viscous = 0.3
coulomb = 6.0
stiction = 8.0
stribeck_speed = 0.05
backlash = 0.005236
gear_stiffness = 2.0e4
gear_damping = 40.0
spread = 0.01

[battery]
voltage = 50.0
resistance = 0.05

[bridge]
dead_band = 0.01
current_sensitivity = 0.025

[tyre]
friction = 0.7
creep = 150.0
rest_speed = 0.002

[encoder]
counts_per_turn = 4096.0
";

/// The small base.
pub(super) fn default() -> Physics {
    toml::from_str(DEFAULT).unwrap()
}

/// The small base with a wheel base and wheel diameters that are not what its drawing says.
pub(super) fn uncalibrated() -> Physics {
    let mut physics = default();
    physics.wheels.base = 0.2014;
    physics.wheels.diameter_left = 0.083_524;
    physics.wheels.diameter_right = 0.083_457;
    physics
}

/// The Robuter.
pub(super) fn robuter() -> Physics {
    toml::from_str(ROBUTER).unwrap()
}

/// The small base without what blurs closed forms: no spread, no dead band, an ideal battery of 12
/// V, no rolling loss.
pub(super) fn plain() -> Physics {
    let mut physics = default();
    physics.motor.spread = 0.0;
    physics.bridge.dead_band = 0.0;
    physics.battery.voltage = 12.0;
    physics.battery.resistance = 0.0;
    physics.body.caster_friction = 0.0;
    physics.wheels.rolling_resistance = 0.0;
    physics
}

/// `plain` with its wheels in the air.
pub(super) fn jacked() -> Physics {
    let mut physics = plain();
    physics.body.load_share = 0.0;
    physics
}

/// What is under `[physics]` in a robot's file.
fn physics(text: &str) -> Physics {
    let mut file: toml::Table = text.parse().unwrap();
    file.remove("physics").unwrap().try_into().unwrap()
}

/// The synchro drive.
pub(super) fn synchro() -> Physics {
    physics(include_str!("../../robots/synchro.toml"))
}

/// The tricycle.
pub(super) fn tricycle() -> Physics {
    physics(include_str!("../../robots/tricycle.toml"))
}

/// The bi-steerable car.
pub(super) fn cycab() -> Physics {
    physics(include_str!("../../robots/cycab.toml"))
}

/// The same with a rear axle that is not steered.
pub(super) fn car() -> Physics {
    let mut physics = cycab();
    if let Chassis::Bisteerable(car) = &mut physics.chassis {
        car.rear = RearSteering::Fixed;
    }
    physics
}

/// A robot of each chassis, and of each size.
pub(super) fn all() -> [Physics; 6] {
    [default(), robuter(), synchro(), tricycle(), cycab(), car()]
}
