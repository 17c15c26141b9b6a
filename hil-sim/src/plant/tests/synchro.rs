//! The synchro drive.

use super::super::params::{Chassis, SynchroParams};
use super::*;

/// The synchro drive with motors that are alike.
fn even() -> Physics {
    let mut physics = robots::synchro();
    physics.motor.spread = 0.0;
    physics
}

/// What is particular to it.
fn particulars(physics: &mut Physics) -> &mut SynchroParams {
    match &mut physics.chassis {
        Chassis::Synchro(synchro) => synchro,
        _ => panic!("it is a synchro drive"),
    }
}

#[test]
fn it_steers_on_the_spot_and_drives_where_it_points() {
    let mut plant = Plant::new(&even(), 1);
    plant.run(0.5, &duty(0.0, 0.3));
    plant.run(0.5, &duty(0.0, 0.0));
    let [x, y, heading] = plant.pose();
    assert!(heading > 0.5, "{heading}");
    // Wheels that turn where they touch make no force.
    assert_eq!((x, y, plant.body.pose[2]), (0.0, 0.0, 0.0));
    // The backlash is 1.7 mrad here.
    let counted = plant.counts()[1] as f64 / 8390.4 * std::f64::consts::TAU;
    assert!((counted - heading).abs() < 2e-3, "{counted} {heading}");
    plant.run(2.0, &duty(0.3, 0.0));
    let [x, y, heading] = plant.pose();
    // Like wheels make no torque; the steering comes to rest within its backlash before it drives.
    assert!(
        x.hypot(y) > 0.2 && (y.atan2(x) - heading).abs() < 1e-6,
        "{x} {y} {heading}"
    );
    let counted = plant.counts()[0] as f64 / 2796.8 * std::f64::consts::PI * 0.065;
    // Slip while it speeds up, m·v over C·N: 3·0.2/(150·29) m/s over 0.2 m/s, of 0.4 m; and the
    // backlash of 5.2 mrad.
    assert!((counted - x.hypot(y)).abs() < 0.5e-3, "{counted}");
}

#[test]
fn a_heading_that_turns_makes_a_circle() {
    let mut plant = Plant::new(&even(), 1);
    let input = duty(0.3, 0.1);
    plant.run(1.0, &input);
    let (speed, rate) = plant.speed();
    let start = plant.pose();
    plant.run(std::f64::consts::PI / rate, &input);
    let end = plant.pose();
    let across = (end[0] - start[0]).hypot(end[1] - start[1]);
    // Half of a circle of the radius v/ω. The centripetal slip v·ω/(C·g) is the same at all wheels:
    // it turns the way, but does not bend it.
    assert!(
        (across * rate / (2.0 * speed) - 1.0).abs() < 2e-4,
        "{across} {speed} {rate}"
    );
    assert!(plant.body.pose[2].abs() < 1e-9);
}

#[test]
fn unlike_wheels_turn_the_body_as_it_drives() {
    let mut physics = even();
    physics.wheels.diameter_left *= 1.0002;
    particulars(&mut physics).misalignment = [1e-4, 0.0, 0.0];
    for direction in [0.0, 0.3] {
        let mut plant = Plant::new(&physics, 1);
        plant.run(0.5, &duty(0.0, direction));
        plant.run(1.0, &duty(0.3, 0.0));
        let (before, from) = (plant.pose(), plant.body.pose[2]);
        plant.run(4.0, &duty(0.3, 0.0));
        let (after, to) = (plant.pose(), plant.body.pose[2]);
        let path = (after[0] - before[0]).hypot(after[1] - before[1]);
        // Where the slips are small the grips are equal, and their torques cancel at the rate
        // r = ω·Σ R_i·(x_i·sin δ_i − y_i·cos δ_i)/Σ(x_i² + y_i²): from the left wheel's 2e-4 at
        // (−ρ/2, ρ·√3/2) and the front wheel's 1e-4 rad at (ρ, 0), with ρ = 0.1 m.
        let (sin, cos) = plant.steering().sin_cos();
        let left = 2e-4 * (-0.5 * sin - 0.75f64.sqrt() * cos);
        let closed = (left + 1e-4 * cos) / 0.3;
        // Slips of 2e-4 lower the grips by C/μ times that, 4 %, the largest at the left wheel.
        assert!(
            ((to - from) / path / closed - 1.0).abs() < 0.05,
            "{} {closed}",
            (to - from) / path
        );
        // The heading turns with the body, and the encoder of the steering does not see it.
        assert!((after[2] - before[2] - (to - from)).abs() < 2e-4);
    }
}

#[test]
fn ideal_wheels_follow_exactly() {
    let mut plant = Plant::new(&even(), 9);
    let input = Input {
        command: Command::Speed([0.2, 0.1 * 0.8]),
        push: NO_PUSH,
        steering: None,
    };
    plant.run(2.0, &input);
    let closed = [0.25 * 1.6f64.sin(), 0.25 * (1.0 - 1.6f64.cos()), 1.6];
    for (is, ought) in plant.pose().into_iter().zip(closed) {
        // Chords for arcs of 0.2 mrad: (2e-4)²/24 of the way.
        assert!((is - ought).abs() < 1e-8, "{:?} {closed:?}", plant.pose());
    }
    let turns = [
        0.4 / (std::f64::consts::PI * 0.065),
        1.6 / std::f64::consts::TAU,
    ];
    for (count, closed) in plant
        .counts()
        .into_iter()
        .zip([turns[0] * 2796.8, turns[1] * 8390.4])
    {
        // The phase is below one count.
        assert!((count as f64 - closed).abs() <= 1.0, "{count} {closed}");
    }
}

#[test]
fn the_drive_is_as_heavy_as_all_of_it() {
    let mut physics = even();
    physics.battery.resistance = 0.0;
    (physics.motor.coulomb, physics.motor.stiction) = (0.0, 0.0);
    physics.wheels.rolling_resistance = 0.0;
    physics.motor.backlash = 0.0;
    physics.wheels.inertia = 1e-3;
    let mut plant = Plant::new(&physics, 1);
    // J = J_m + 3·J_w + m·R², β = b + K²/R at half of 12.4 V less the dead band.
    let inertia = 2.9e-3 + 3e-3 + 3.0 * 0.0325 * 0.0325;
    let damping = 0.00358 + 0.545 * 0.545 / 2.2;
    let voltage = 12.4 * 0.2 / 0.99;
    let last = 0.545 * voltage / 2.2 / damping * 0.0325;
    for n in 1..400 {
        plant.step(DT, &duty(0.21, 0.0));
        let closed = last * (1.0 - (-f64::from(n) * DT * damping / inertia).exp());
        // Late by dt/2 of τ = 65 ms, 0.2 %. Gear and tyres pass the torque on through a spring and
        // a creep, a quarter of a period, ½·π·√(J/k) = 2 ms, later: below 2 % at the start.
        assert!(
            (plant.speed().0 - closed).abs() < 0.02 * last,
            "{n}: {} {closed}",
            plant.speed().0
        );
    }
}

#[test]
fn the_steering_turns_as_its_motor_behind_its_gear() {
    let mut physics = even();
    (physics.motor.backlash, physics.battery.resistance) = (0.0, 0.0);
    physics.motor.stiction = physics.motor.coulomb;
    let mut plant = Plant::new(&physics, 1);
    // At the heading: K, T_c three times, b, J_m nine times those of the motor.
    let damping = 9.0 * (0.00358 + 0.545 * 0.545 / 2.2);
    let inertia = 9.0 * 2.9e-3 + 1e-3;
    let torque = 3.0 * (0.545 * 12.4 * 0.3 / 0.99 / 2.2 - 0.07) - 0.05;
    for n in 1..800 {
        plant.step(DT, &duty(0.0, 0.31));
        let (_, rate) = plant.speed();
        let closed = torque / damping * (1.0 - (-f64::from(n) * DT * damping / inertia).exp());
        // Late by dt/2 of τ = 22 ms, 0.6 %, and by the gear's spring, √(J_s/(9·k)) = 0.3 ms; the
        // friction of the wheels fades below 0.02 rad/s, of 1.8 rad/s.
        assert!(
            (rate - closed).abs() < 0.02 * torque / damping,
            "{n}: {rate} {closed}"
        );
    }
    let (_, rate) = plant.speed();
    assert!((rate / (torque / damping) - 1.0).abs() < 1e-3, "{rate}");
    // Its second rim's speed is at the lever.
    assert!((plant.wheel_speed()[1] - 0.1 * rate).abs() < 1e-12);
}

#[test]
fn the_rate_of_the_heading_has_the_body_s_in_it() {
    let mut physics = even();
    physics.wheels.diameter_left *= 1.01;
    let mut plant = Plant::new(&physics, 1);
    plant.run(1.0, &duty(0.3, 0.1));
    let before = plant.pose()[2];
    plant.step(DT, &duty(0.3, 0.1));
    let rate = (plant.pose()[2] - before) / DT;
    assert!(plant.body.velocity.yaw.abs() > 1e-3);
    // Rounding of the difference.
    assert!((plant.speed().1 - rate).abs() < 1e-9, "{rate}");
}
