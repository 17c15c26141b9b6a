//! Motor, gear, battery and bridge.

use super::*;

/// b + K²/R of the default motor \[N·m·s/rad\].
const DAMPING: f64 = 0.00358 + 0.545 * 0.545 / 2.2;

#[test]
fn free_speed_is_200_rpm() {
    let mut plant = Plant::new(&robots::jacked(), 1);
    plant.run(2.0, &duty(1.0, -1.0));
    // T_c of 0.07 N·m stays, the remainder of the stiction at 21 rad/s is 2e-5 of it; 90 time
    // constants have passed.
    let closed = (0.545 * 12.0 / 2.2 - 0.07) / DAMPING;
    for (speed, sign) in plant.wheel_speed().into_iter().zip([1.0, -1.0]) {
        let omega = sign * speed / 0.042;
        assert!((omega / closed - 1.0).abs() < 1e-6, "{omega}");
        // b is given with three digits, which is 0.01 % of the speed.
        let rpm = omega * 60.0 / std::f64::consts::TAU;
        assert!((rpm - 200.0).abs() < 0.05, "{rpm}");
    }
}

#[test]
fn a_blocked_motor_draws_its_stall_current() {
    let mut plant = Plant::new(&robots::plain(), 1);
    plant.set_blocked(0, true);
    plant.set_blocked(1, true);
    plant.run(0.1, &duty(1.0, -0.5));
    // i = V/R, at once; tolerance: rounding.
    assert!((plant.current()[0] - 12.0 / 2.2).abs() < 1e-12);
    assert!((plant.current()[1] + 6.0 / 2.2).abs() < 1e-12);
    assert_eq!(plant.counts(), [0, 0]);
}

#[test]
fn a_speed_step_is_exponential() {
    let mut physics = robots::jacked();
    (
        physics.motor.coulomb,
        physics.motor.stiction,
        physics.motor.backlash,
    ) = (0.0, 0.0, 0.0);
    let mut plant = Plant::new(&physics, 1);
    let (tau, last) = ((2.9e-3 + 1e-4) / DAMPING, 0.545 * 12.0 / 2.2 / DAMPING);
    for n in 1..400 {
        plant.step(DT, &duty(1.0, 1.0));
        let closed = last * (1.0 - (-f64::from(n) * DT / tau).exp());
        // The implicit step is late by up to dt/(2·τ)/e = 0.21 % of the final speed; the gear's
        // spring takes another 0.05 % at the very start.
        let omega = plant.wheels[0].motor_speed;
        assert!(
            (omega - closed).abs() < 0.003 * last,
            "{n}: {omega} {closed}"
        );
    }
}

#[test]
fn coast_down_on_shorted_motors() {
    let mut physics = robots::plain();
    physics.motor.stiction = physics.motor.coulomb;
    // The brakes are stronger than real tyres.
    (physics.tyre.friction, physics.tyre.creep) = (100.0, 1e4);
    let mut plant = Plant::new(&physics, 1);
    let omega = 10.0;
    plant.rolling(omega * 0.042);
    // The wheels push their motors from the start.
    for wheel in &mut plant.wheels {
        wheel.twist = -wheel.gear.half_gap;
    }
    // J·dω/dt = −T_c − β·ω for each wheel with half of the mass: ω = (ω_0 + T_c/β)·e^(−t/τ) − T_c/β
    let tau = (2.9e-3 + 1e-4 + 0.5 * 2.5 * 0.042 * 0.042) / DAMPING;
    let offset = 0.07 / DAMPING;
    let rest = tau * (1.0 + omega / offset).ln();
    let angle = (omega + offset) * tau * (1.0 - (-rest / tau).exp()) - offset * rest;
    let mut time = 0.0;
    while plant.speed().0 > 1e-4 {
        plant.step(DT, &duty(0.0, 0.0));
        time += DT;
    }
    // The motors stop first; the body then runs on within the backlash, 5.2 mrad or 0.22 mm. The
    // implicit step adds dt/2 at 0.42 m/s, 0.05 mm.
    plant.run(0.5, &duty(0.0, 0.0));
    assert!(
        (plant.pose()[0] - 0.042 * angle).abs() < 0.3e-3,
        "{:?} {angle}",
        plant.pose()
    );
    // As for the time: a few ms to cross the gaps.
    assert!((time - rest).abs() < 0.02, "{time} {rest}");
}

#[test]
fn terminal_speed_with_coulomb_friction() {
    let mut plant = Plant::new(&robots::plain(), 1);
    plant.run(3.0, &duty(0.5, 0.5));
    // K·V/R = T_c + β·ω at half of 12 V; stiction's rest (0.1/20)² of 0.025 N·m. Nothing slips when
    // nothing drags.
    let closed = (0.545 * 6.0 / 2.2 - 0.07) / DAMPING * 0.042;
    assert!(
        (plant.speed().0 / closed - 1.0).abs() < 1e-5,
        "{:?} {closed}",
        plant.speed()
    );
    assert!((plant.wheel_speed()[0] / closed - 1.0).abs() < 1e-5);
}

#[test]
fn nothing_moves_below_the_stiction() {
    let mut plant = Plant::new(&robots::plain(), 3);
    // 0.095 N·m is 0.3835 V, 3.2 % of 12 V. Somewhat more is needed to get away: just above it
    // the shorted motor creeps at an equilibrium of falling friction and rising back-EMF.
    plant.run(1.0, &duty(0.0319, -0.0319));
    assert_eq!((plant.counts(), plant.pose()), ([0, 0], [0.0; 3]));
    plant.run(1.0, &duty(0.0345, 0.0345));
    assert!(plant.pose()[0] > 1e-3, "{:?}", plant.pose());
}

#[test]
fn reversing_leaves_the_wheel_still_for_the_gap() {
    let physics = robots::plain();
    let mut plant = Plant::new(&physics, 1);
    let gap = physics.motor.backlash;
    for wheel in &mut plant.wheels {
        wheel.twist = 0.5 * gap;
    }
    let mut crossed = false;
    for _ in 0..4000 {
        plant.step(DT, &duty(-0.05, -0.05));
        for wheel in &plant.wheels {
            let turned = wheel.angle - wheel.twist + 0.5 * gap;
            if wheel.angle > -gap {
                // No force reaches the wheel; tolerance: rounding of the difference.
                assert!(turned.abs() < 1e-15, "{turned}");
            } else {
                crossed = true;
            }
        }
    }
    assert!(crossed);
    // Once across, the wheel follows, less the gap and the spring's 1e-4 rad per 0.1 N·m.
    let wheel = &plant.wheels[0];
    assert!((wheel.twist + 0.5 * gap).abs() < 2e-4, "{}", wheel.twist);
    assert!(plant.pose()[0] < -1e-3);
}

#[test]
fn the_battery_sags_under_load() {
    let mut physics = robots::default();
    physics.motor.spread = 0.0;
    let mut plant = Plant::new(&physics, 1);
    plant.set_blocked(0, true);
    plant.set_blocked(1, true);
    plant.run(0.01, &duty(1.0, 1.0));
    // 2.2 Ω twice in parallel behind 0.15 Ω. Tolerance: rounding.
    assert!((plant.bus_voltage() - 12.4 * 1.1 / 1.25).abs() < 1e-12);
}

#[test]
fn a_weak_motor_gets_less_voltage() {
    let mut plant = Plant::new(&robots::jacked(), 1);
    plant.set_strength(1, 0.5);
    plant.run(2.0, &duty(1.0, 1.0));
    let closed = (0.545 * 6.0 / 2.2 - 0.07) / DAMPING * 0.042;
    // As for the terminal speed.
    assert!((plant.wheel_speed()[1] / closed - 1.0).abs() < 1e-5);
    assert!(plant.wheel_speed()[0] > 1.9 * plant.wheel_speed()[1]);
}
