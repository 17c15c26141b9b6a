//! What the wheels of the other chassis carry, and what they can therefore do.

use super::super::body::GRAVITY;
use super::super::params::Chassis;
use super::*;

/// Motors that no tyre can hold.
fn strong(mut physics: Physics) -> Physics {
    physics.motor.spread = 0.0;
    physics.motor.resistance *= 0.1;
    physics.battery.voltage *= 4.0;
    physics.wheels.rolling_resistance = 0.0;
    physics
}

#[test]
fn the_load_on_the_driven_wheels_limits_the_acceleration() {
    let tricycle = |ahead: f64| {
        let mut physics = strong(robots::tricycle());
        if let Chassis::Tricycle(tricycle) = &mut physics.chassis {
            tricycle.centre_of_mass = ahead;
        }
        // The driven front wheel has ahead/L of the weight.
        (physics, ahead / 0.150)
    };
    let car = |ahead: f64| {
        let mut physics = strong(robots::cycab());
        if let Chassis::Bisteerable(car) = &mut physics.chassis {
            car.centre_of_mass = ahead;
        }
        (physics, 1.0 - ahead / 1.2)
    };
    for (physics, share) in [
        tricycle(0.03),
        tricycle(0.12),
        car(0.3),
        car(0.9),
        (strong(robots::synchro()), 1.0),
    ] {
        let limit = physics.tyre.friction * share * GRAVITY;
        let free = physics.wheels.inertia
            * match &physics.chassis {
                Chassis::Synchro(_) => 0.0,
                _ => 2.0,
            };
        let radius = 0.5 * physics.wheels.diameter_left;
        // What the free wheels have to be turned with.
        let closed = limit / (1.0 + free / (radius * radius * physics.body.mass));
        let mut plant = Plant::new(&physics, 1);
        let mut input = duty(1.0, 1.0);
        if matches!(physics.chassis, Chassis::Synchro(_)) {
            input = duty(1.0, 0.0);
        }
        plant.run(0.02, &input);
        let from = plant.speed().0;
        plant.run(0.05, &input);
        let acceleration = (plant.speed().0 - from) / 0.05;
        // x/(1 + x) with x = C/μ ≈ 200 of all slip.
        assert!(
            (acceleration / closed - 1.0).abs() < 0.02,
            "{:?}: {acceleration} {closed}",
            physics.chassis
        );
    }
}

#[test]
fn a_tricycle_has_one_motor() {
    let physics = robots::tricycle();
    let mut plant = Plant::new(&physics, 1);
    plant.set_blocked(0, true);
    plant.run(0.5, &duty(0.0, 1.0));
    assert_eq!((plant.current(), plant.counts()), ([0.0; 2], [0; 2]));
    assert_eq!(plant.bus_voltage(), 12.4);
    assert_eq!(plant.wheel_speed(), [0.0; 2]);
}

#[test]
fn a_push_acts_along_the_heading_and_about_the_vertical() {
    for physics in [robots::synchro(), robots::tricycle(), robots::cycab()] {
        let mut physics = physics;
        physics.motor.spread = 0.0;
        // Free motors on jacks: only the mass resists.
        physics.body.load_share = 0.0;
        let mut plant = Plant::new(&physics, 1);
        plant.run(0.5, &duty(0.0, 0.3));
        let (speed, _) = plant.speed();
        let body = plant.body.velocity.yaw;
        plant.step(
            DT,
            &Input {
                push: Push {
                    force: 10.0,
                    torque: 3.0,
                },
                ..duty(0.0, 0.0)
            },
        );
        let (faster, _) = plant.speed();
        let closed = DT * 10.0 / physics.body.mass;
        // Rounding, and the rotation of the frame, dt·r·v < 1e-3 of that.
        assert!(
            ((faster - speed) / closed - 1.0).abs() < 2e-3,
            "{faster} {speed}"
        );
        let closed = DT * 3.0 / physics.body.yaw_inertia;
        assert!(((plant.body.velocity.yaw - body) / closed - 1.0).abs() < 1e-9);
    }
}

#[test]
fn casters_are_where_the_body_has_them() {
    let mut physics = robots::cycab();
    physics.body.load_share = 0.0;
    physics.body.caster_friction = 0.1;
    // At the centre of mass they stop it without turning it.
    physics.body.caster_position = 0.6;
    let mut plant = Plant::new(&physics, 1);
    plant.body.velocity.lateral = 0.5;
    plant.run(0.2, &duty(0.0, 0.0));
    assert!((plant.body.velocity.lateral - (0.5 - 0.1 * GRAVITY * 0.2)).abs() < 0.01);
    assert_eq!(plant.body.velocity.yaw, 0.0);
    // Ahead of it they turn the nose away from where it slides.
    physics.body.caster_position = 1.0;
    let mut plant = Plant::new(&physics, 1);
    plant.body.velocity.lateral = 0.5;
    plant.run(0.2, &duty(0.0, 0.0));
    assert!(plant.body.velocity.yaw < 0.0);
}
