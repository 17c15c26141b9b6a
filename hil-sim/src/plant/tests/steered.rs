//! The other chassis: circles, slips, and what no tyre can do.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use super::super::BridgeInput;
use super::super::params::Chassis;
use super::super::params::{RearSteering, ServoParams};
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
        // Centripetal forces, below 0.6 % of the weight, and drags of 1 % of it are slip of less
        // than 1e-4 with C = 150. What a car's two like motors oppose to the differing speeds of
        // its rear wheels, β/R² times 0.06 m/s or 40 N each, is more: as a torque over L and half
        // of C·N a slip angle of up to 2e-4, of 0.4 rad at two axles.
        assert!((r / u / closed - 1.0).abs() < 1e-3, "{} {closed}", r / u);
        // The path itself: half a turn later it is a diameter away.
        let start = plant.pose();
        plant.run(PI / r.abs(), &input);
        let end = plant.pose();
        let across = (end[0] - start[0]).hypot(end[1] - start[1]);
        assert!(
            (across * closed.abs() / 2.0 - 1.0).abs() < 1e-3,
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
        assert!(off.abs() < 5e-4, "{way} {heading}");
    }
}

#[test]
fn no_wheel_slides_on_a_slow_circle() {
    for (physics, duty, angle) in [
        (robots::tricycle(), 0.2, 0.5),
        (robots::cycab(), 0.1, 0.4),
        (robots::car(), 0.1, 0.4),
    ] {
        let mut physics = even(physics);
        let input = steered(&mut physics, duty, angle);
        let mut plant = Plant::new(&physics, 1);
        plant.run(6.0, &input);
        let from = counts(&plant);
        plant.run(10.0, &input);
        let to = counts(&plant);
        let (u, r) = plant.speed();
        // Every wheel rolls on its own circle about the common centre.
        let counts_per_metre = |diameter: f64| physics.encoder.counts_per_turn / (PI * diameter);
        let ways: &[(usize, f64)] = match &physics.chassis {
            Chassis::Tricycle(t) => &[(0, u.hypot(r * t.wheel_base))],
            Chassis::Bisteerable(c) => {
                let ahead = match c.rear {
                    RearSteering::Opposite => 0.5 * c.wheel_base,
                    RearSteering::Fixed => 0.0,
                };
                let (front, rear) = (c.wheel_base - ahead, -ahead);
                &[
                    (0, (u - 0.6 * r).hypot(rear * r)),
                    (1, (u + 0.6 * r).hypot(rear * r)),
                    (2, (u - 0.6 * r).hypot(front * r)),
                    (3, (u + 0.6 * r).hypot(front * r)),
                ]
            }
            _ => unreachable!(),
        };
        let diameter = 2.0 * plant.wheels[0].radius;
        for &(wheel, speed) in ways {
            let closed = 10.0 * speed * counts_per_metre(diameter);
            // A count, and the backlash where the inner wheel comes to be pushed, 3.4 counts; slip
            // as above.
            let counted = (to[wheel] - from[wheel]) as f64;
            assert!(
                (counted - closed).abs() < 5.0 + 2e-4 * closed,
                "{:?}: {wheel}: {counted} {closed}",
                physics.chassis
            );
        }
    }
}

/// All counts: both motors, then the front wheels.
fn counts(plant: &Plant) -> [i64; 4] {
    let ([a, b], [c, d]) = (plant.counts(), plant.front_counts());
    [a, b, c, d]
}

#[test]
fn a_tricycle_at_90_degrees_turns_about_its_rear_axle() {
    let mut physics = even(robots::tricycle());
    let input = steered(&mut physics, 0.3, FRAC_PI_2);
    let mut plant = Plant::new(&physics, 1);
    // The wheel gets there before the motor starts.
    let wait = Input {
        command: Command::duty([0.0; 2]),
        ..input
    };
    plant.run(1.0, &wait);
    assert!((plant.steering() - FRAC_PI_2).abs() < 1e-4);
    plant.run(5.0, &input);
    let [x, y, heading] = plant.pose();
    assert!(heading > 5.0, "{heading}");
    // The centre of mass, 75 mm from there, is held on its circle by the front wheel alone:
    // m·c·r²/(C·N) = 2·0.075·1.3²/(150·9.8) is a slip of 2e-4 of 0.19 m/s, which turns with the
    // robot: a circle of 3e-5 m. The start adds as much.
    assert!(x.hypot(y) < 1e-4, "{x} {y}");
    let rolled = plant.counts()[0] as f64 / 1600.0 * PI * 0.065;
    // Drag and start: slip as above; a count is 0.13 mm, the backlash 0.17 mm, of 0.96 m.
    assert!(
        (heading * 0.150 / rolled - 1.0).abs() < 1e-3,
        "{heading} {rolled}"
    );
}

#[test]
fn straight_ahead_is_straight() {
    for physics in [robots::tricycle(), robots::cycab(), robots::car()] {
        let mut physics = even(physics);
        let input = steered(&mut physics, 0.3, 0.0);
        let mut plant = Plant::new(&physics, 1);
        // Both sides of the gears at the same flank.
        for wheel in &mut plant.wheels {
            wheel.twist = 0.0;
        }
        plant.run(4.0, &input);
        let [x, y, heading] = plant.pose();
        // Left and right are alike: tolerance: rounding.
        assert!(
            x > 0.3 && y.abs() < 1e-9 && heading.abs() < 1e-9,
            "{x} {y} {heading}"
        );
    }
}

#[test]
fn an_offset_of_the_steering_is_not_seen_by_its_sensors() {
    let mut physics = even(robots::cycab());
    servo(&mut physics).steer_offset = 0.02;
    let input = steered(&mut physics, 0.1, 0.0);
    let mut plant = Plant::new(&physics, 1);
    plant.run(6.0, &input);
    assert_eq!(
        (plant.steering_signal(), plant.steering_counts()),
        (1.65, 0)
    );
    assert_eq!(plant.steering(), 0.02);
    let (u, r) = plant.speed();
    // As for the circles.
    assert!((r / u / (2.0 * 0.02f64.tan() / 1.2) - 1.0).abs() < 1e-3);
}

#[test]
fn a_rear_axle_that_cannot_differ_scrubs() {
    for (physics, angle) in [(robots::cycab(), 0.002), (robots::car(), 0.004)] {
        let mut physics = even(physics);
        // Flywheels: both rear wheels keep their speed whatever the floor does.
        physics.motor.inertia = 1e9;
        physics.motor.backlash = 0.0;
        physics.tyre.friction = 1e3;
        let input = steered(&mut physics, 0.0, angle);
        let mut plant = Plant::new(&physics, 1);
        plant.rolling(0.5);
        for wheel in plant.undercarriage.free_wheels() {
            wheel.speed = 0.5 / wheel.radius;
        }
        plant.run(
            5.0,
            &Input {
                command: Command::Bridges([BridgeInput::Open; 2]),
                ..input
            },
        );
        let (u, r) = plant.speed();
        // All four tyres creep alike, D = C·N/v. The rear wheels slip by ±r·B/2 along, a torque of
        // −2·D·(B/2)²·r. Across, the lateral forces can only balance when both axles slip by the
        // same, ±(r − κ·u)·L/2, a torque of −4·D·(L/2)²·(r − κ·u). So r/u = κ·L²/(L² + B²/2): of
        // the circle that the steering asks for, two thirds.
        let closed = curvature(&physics, angle) * 1.2 * 1.2 / (1.2 * 1.2 * 1.5);
        assert!((u - 0.5).abs() < 0.01, "{u}");
        // The rolling resistance of 1 % over C and the centripetal force are slip of less than 1e-4
        // of what the wheels do here.
        assert!((r / u / closed - 1.0).abs() < 1e-3, "{} {closed}", r / u);
    }
}

#[test]
fn coasting_on_a_curve_only_slows_down() {
    for (physics, speed, angle) in [
        (robots::tricycle(), 0.6, 0.9),
        (robots::cycab(), 2.0, 0.4),
        (robots::car(), 2.0, 0.4),
    ] {
        let mut physics = even(physics);
        let input = steered(&mut physics, 0.0, 0.0);
        let mut plant = Plant::new(&physics, 1);
        let open = Input {
            command: Command::Bridges([BridgeInput::Open; 2]),
            ..input
        };
        plant.rolling(speed);
        let turn = steered(&mut physics, 0.0, angle);
        let mut last = f64::INFINITY;
        for _ in 0..20_000 {
            plant.step(
                DT,
                &Input {
                    steering: turn.steering,
                    ..open
                },
            );
            let now = plant.energy();
            // The servo moves while it drives, and takes nothing from there. Tolerance: rounding.
            assert!(now <= last * (1.0 + 1e-12), "{last} {now}");
            last = now;
        }
        assert!(plant.pose()[2].abs() > 0.3, "{:?}", plant.pose());
    }
}

#[test]
fn ideal_wheels_follow_exactly() {
    for (physics, angle) in [
        (robots::tricycle(), 0.7),
        (robots::cycab(), 0.35),
        (robots::car(), -0.4),
    ] {
        let mut physics = even(physics);
        // At once.
        (
            servo(&mut physics).steer_lag,
            servo(&mut physics).steer_rate,
        ) = (0.0, 1e9);
        let input = Input {
            command: Command::Speed([0.2, 0.4]),
            ..steered(&mut physics, 0.0, angle)
        };
        let mut plant = Plant::new(&physics, 9);
        plant.run(2.0, &input);
        let k = curvature(&physics, angle);
        // The wheels' circles about (0, 1/k), from the reference point.
        let (u, front) = match &physics.chassis {
            Chassis::Tricycle(_) => (0.2 * angle.cos(), None),
            Chassis::Bisteerable(c) => {
                let ahead = match c.rear {
                    RearSteering::Opposite => 0.6,
                    RearSteering::Fixed => 0.0,
                };
                let way = |x: f64, y: f64| (1.0 - k * y).hypot(k * x);
                let u = 0.6 / (way(-ahead, 0.6) + way(-ahead, -0.6));
                (
                    u,
                    Some([way(1.2 - ahead, 0.6) * u, way(1.2 - ahead, -0.6) * u]),
                )
            }
            _ => unreachable!(),
        };
        let turned = 2.0 * u * k;
        let closed = [turned.sin() / k, (1.0 - turned.cos()) / k, turned];
        for (is, ought) in plant.pose().into_iter().zip(closed) {
            // Rounding of 8000 additions.
            assert!((is - ought).abs() < 1e-10, "{:?} {closed:?}", plant.pose());
        }
        for (count, speed) in plant
            .front_counts()
            .into_iter()
            .zip(front.unwrap_or([0.0; 2]))
        {
            let closed = 2.0 * speed / (PI * 0.4) * 4096.0;
            // The phase is below one count.
            assert!((count as f64 - closed).abs() <= 1.0, "{count} {closed}");
        }
    }
}
