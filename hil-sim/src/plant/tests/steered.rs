//! The other chassis: circles, slips, and what no tyre can do.

use std::f64::consts::{PI, TAU};

use super::super::params::Chassis;
use super::super::{ServoParams, params::RearSteering};
use super::*;

/// The parameters of a robot's servo.
fn servo(physics: &mut Physics) -> &mut ServoParams {
    match &mut physics.chassis {
        Chassis::Tricycle(tricycle) => &mut tricycle.servo,
        Chassis::Bisteerable(car) => &mut car.servo,
        Chassis::Differential | Chassis::Synchro(_) => panic!("it has no servo"),
    }
}

/// Both motors at this duty, and the steering straight to this angle.
fn steered(physics: &mut Physics, duty: f64, angle: f64) -> Input {
    let servo = servo(physics);
    Input {
        command: Command::duty([duty; 2]),
        push: NO_PUSH,
        steering: Some(servo.pulse_centre + servo.pulse_per_radian * angle),
    }
}

/// Without what differs from motor to motor.
fn even(mut physics: Physics) -> Physics {
    physics.motor.spread = 0.0;
    physics
}

/// How far the reference point's way is bent when the steering is at an angle \[1/m\].
fn curvature(physics: &Physics, angle: f64) -> f64 {
    match &physics.chassis {
        Chassis::Tricycle(tricycle) => angle.tan() / tricycle.wheel_base,
        Chassis::Bisteerable(car) => match car.rear {
            RearSteering::Opposite => 2.0 * angle.tan() / car.wheel_base,
            RearSteering::Fixed => angle.tan() / car.wheel_base,
        },
        Chassis::Differential | Chassis::Synchro(_) => panic!("it has no servo"),
    }
}

#[test]
fn slow_circles_are_those_of_the_steering_angle() {
    for (physics, duty, angle) in [
        (robots::tricycle(), 0.2, 0.5),
        (robots::tricycle(), -0.2, -1.2),
        (robots::cycab(), 0.1, 0.3),
        (robots::cycab(), -0.1, -0.4),
        (robots::car(), 0.1, 0.4),
    ] {
        let mut physics = even(physics);
        let input = steered(&mut physics, duty, angle);
        let mut plant = Plant::new(&physics, 1);
        plant.run(6.0, &input);
        let closed = curvature(&physics, angle);
        let (u, r) = plant.speed();
        assert!(u * duty > 0.0 && u.abs() > 0.04, "{u}");
        // Centripetal forces of m·u²·κ, at most 0.04 of the weight, and drags of 0.01 of it, over
        // C = 150 are slip angles of 3e-4; the differing speeds of a car's rear wheels, which its
        // two like motors do not make, are torques on it. They take the most.
        assert!((r / u / closed - 1.0).abs() < 0.01, "{} {closed}", r / u);
        // The path itself: half a turn later it is a diameter away.
        let start = plant.pose();
        plant.run(PI / r.abs(), &input);
        let end = plant.pose();
        let across = (end[0] - start[0]).hypot(end[1] - start[1]);
        assert!(
            (across * closed.abs() / 2.0 - 1.0).abs() < 0.01,
            "{across} {closed}"
        );
    }
}

#[test]
fn the_reference_point_moves_along_the_heading() {
    for (physics, duty, angle) in [
        (robots::tricycle(), 0.2, 0.8),
        (robots::cycab(), 0.1, 0.4),
        (robots::car(), 0.1, 0.4),
    ] {
        let mut physics = even(physics);
        let input = steered(&mut physics, duty, angle);
        let mut plant = Plant::new(&physics, 1);
        plant.run(6.0, &input);
        let before = plant.pose();
        plant.run(2.0 * DT, &input);
        let after = plant.pose();
        let way = (after[1] - before[1]).atan2(after[0] - before[0]);
        let heading = 0.5 * (before[2] + after[2]);
        // Slip angles as above.
        let off = (way - heading + PI).rem_euclid(TAU) - PI;
        assert!(off.abs() < 3e-3, "{way} {heading}");
    }
}
