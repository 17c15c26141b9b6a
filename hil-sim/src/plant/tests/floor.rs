//! Tyres, body and what pushes it.

use super::super::body::GRAVITY;
use super::*;

#[test]
fn a_push_of_5_n_moves_the_robot_and_3_n_does_not() {
    for seed in 0..10 {
        // Stiction: 2·0.095 N·m/0.042 m = 4.52 N, and up to 0.17 N of drag. Whatever the motors do,
        // the wheels can move within the backlash, 5.2 mrad·42 mm = 0.22 mm.
        let mut plant = Plant::new(&robots::default(), seed);
        plant.run(2.0, &force(3.0));
        assert!(
            plant.pose()[0].abs() < 0.5e-3,
            "seed {seed}: {:?}",
            plant.pose()
        );
        let mut plant = Plant::new(&robots::default(), seed);
        plant.run(2.0, &force(5.0));
        assert!(plant.pose()[0] > 3e-3, "seed {seed}: {:?}", plant.pose());
    }
}

#[test]
fn the_circle_of_two_wheel_speeds() {
    let physics = robots::uncalibrated();
    let mut plant = Plant::new(&physics, 5);
    let input = duty(0.35, 0.6);
    plant.run(2.0, &input);
    let [left, right] = plant.wheel_speed();
    let closed = 0.5 * 0.2014 * (right + left) / (right - left);
    let (u, r) = plant.speed();
    // Wheel losses of 0.1 N over C·N = 1500 N are slip of 1e-4, amplified by (v_r + v_l)/(v_r −
    // v_l) < 4.
    assert!((u / r / closed - 1.0).abs() < 1e-3, "{} {closed}", u / r);
    // The path itself: half a turn later it is a diameter away. The sideways creep m·u·r/(C·N) of
    // the axle adds as little.
    let start = plant.pose();
    plant.run(std::f64::consts::PI / r, &input);
    let end = plant.pose();
    let across = (end[0] - start[0]).hypot(end[1] - start[1]);
    assert!(
        (across / (2.0 * closed) - 1.0).abs() < 1e-3,
        "{across} {closed}"
    );
}

#[test]
fn slip_limits_the_acceleration() {
    let mut physics = robots::plain();
    physics.battery.voltage = 100.0;
    physics.motor.resistance = 0.5;
    let limit = physics.tyre.friction * physics.body.load_share * GRAVITY;
    let mut plant = Plant::new(&physics, 1);
    for _ in 0..400 {
        let before = plant.speed().0;
        plant.step(DT, &duty(1.0, 1.0));
        let acceleration = (plant.speed().0 - before) / DT;
        // The tyre's limit is exceeded by at most 0.5 %, where a step is not made again.
        assert!(acceleration < 1.005 * limit, "{acceleration} {limit}");
    }
    // At large slip x/(1 + x) with x = 187; the first ms are lost to the backlash.
    let speed = plant.speed().0;
    assert!(speed > 0.95 * limit * 0.1, "{speed} {limit}");
    assert!(plant.wheel_speed()[0] > 2.0 * speed);
}

#[test]
fn a_sideways_slide_ends_by_friction() {
    let mut plant = Plant::new(&robots::plain(), 1);
    plant.body.velocity.lateral = 1.0;
    for _ in 0..1000 {
        plant.step(DT, &duty(0.0, 0.0));
    }
    // v²/(2·a) with a = 0.85·μ·g. The casters roll sideways here; x/(1 + x) is near 1 (187 and
    // more), until the slide ends.
    let closed = 0.5 / (0.85 * 0.8 * GRAVITY);
    assert!(
        (plant.pose()[1] / closed - 1.0).abs() < 0.02,
        "{:?} {closed}",
        plant.pose()
    );
}

#[test]
fn odometric_error_of_straight_driving_is_small() {
    let mut physics = robots::default();
    physics.motor.spread = 0.0;
    let mut plant = Plant::new(&physics, 1);
    // A step of the duty spins the wheels; what counts is what comes after.
    plant.run(1.0, &duty(0.5, 0.5));
    let (start, angle) = (plant.pose(), plant.wheels[0].angle);
    plant.run(4.0, &duty(0.5, 0.5));
    let rolled = 0.042 * (plant.wheels[0].angle - angle);
    let path = (plant.pose()[0] - start[0]).hypot(plant.pose()[1] - start[1]);
    // Drag of 0.16 N over C·N = 3126 N is 5e-5; the backlash adds up to 0.22 mm of 2 m.
    assert!(
        (path / rolled - 1.0).abs() < 1e-4,
        "{:?} {rolled}",
        plant.pose()
    );
}

#[test]
fn a_torque_turns_the_robot() {
    let mut plant = Plant::new(&robots::plain(), 1);
    let input = Input {
        command: Command::duty([0.0; 2]),
        push: Push {
            force: 0.0,
            torque: 0.6,
        },
        steering: None,
    };
    plant.run(3.0, &input);
    // Per wheel: 0.6/0.2 N·0.042 m = 0.126 N·m against T_c and β·ω, at steady speed; the stiction
    // that is left at 0.4 rad/s is 1/17 of 0.025 N·m, 3 % of the rest.
    let omega = (0.126 - 0.07 - 0.025 / 17.0) / (0.00358 + 0.545 * 0.545 / 2.2);
    let closed = omega * 0.042 / 0.1;
    assert!(
        (plant.speed().1 / closed - 1.0).abs() < 0.01,
        "{:?} {closed}",
        plant.speed()
    );
}

#[test]
fn the_robuter_does_what_crowleys_did() {
    let mut plant = Plant::new(&robots::robuter(), 1);
    // Half of the bridges' range makes 0.5 m/s² from rest: 1 m/s is reached with reserve.
    let mut time = 0.0;
    while plant.speed().0 < 0.5 {
        plant.step(DT, &duty(0.7, 0.7));
        time += DT;
        assert!(time < 1.0, "{:?}", plant.speed());
    }
    plant.run(3.0, &duty(0.95, 0.95));
    assert!(
        plant.speed().0 > 1.1 && plant.speed().0 < 1.5,
        "{:?}",
        plant.speed()
    );
}

#[test]
fn ideal_wheels_follow_exactly() {
    let physics = robots::uncalibrated();
    let mut plant = Plant::new(&physics, 9);
    let input = Input {
        command: Command::Speed([0.1, 0.3]),
        push: Push {
            force: 100.0,
            torque: 100.0,
        },
        steering: None,
    };
    plant.run(2.0, &input);
    // Arc of 0.4 m with r = 0.2/0.2014 rad/s; tolerance: rounding of 8000 additions.
    let (r, u): (f64, f64) = (0.2 / 0.2014, 0.2);
    let closed = [
        u / r * (2.0 * r).sin(),
        u / r * (1.0 - (2.0 * r).cos()),
        2.0 * r,
    ];
    for (is, ought) in plant.pose().into_iter().zip(closed) {
        assert!((is - ought).abs() < 1e-10, "{:?} {closed:?}", plant.pose());
    }
    for (count, (speed, diameter)) in plant
        .counts()
        .into_iter()
        .zip([(0.1, 0.083_524), (0.3, 0.083_457)])
    {
        let closed = speed * 2.0 / (std::f64::consts::PI * diameter) * 2796.8;
        // The phase is below one count.
        assert!((count as f64 - closed).abs() <= 1.0, "{count} {closed}");
    }
}
