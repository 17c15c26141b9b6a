//! Energy, determinism, independence of the step, stability.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::*;

/// A plant in any state of motion, with unstressed gears.
fn tumbling(physics: &Physics, random: &mut ChaCha8Rng) -> Plant {
    let mut plant = Plant::new(physics, random.random());
    let mut within = |limit: f64| limit * random.random_range(-1.0..1.0);
    plant.body.velocity = super::super::body::Velocity {
        forward: within(2.0),
        lateral: within(1.0),
        yaw: within(15.0),
    };
    for wheel in &mut plant.wheels {
        wheel.motor_speed = within(30.0);
        wheel.speed = within(60.0);
    }
    if !plant.undercarriage.has_second_motor() {
        let absent = &mut plant.wheels[1];
        (absent.motor_speed, absent.speed) = (0.0, 0.0);
    }
    for wheel in plant.undercarriage.free_wheels() {
        wheel.speed = within(60.0);
    }
    if let Some(servo) = plant.undercarriage.servo_mut() {
        servo.step(Some(0.0015 + within(0.0005)), 10.0);
    }
    plant
}

#[test]
fn without_drive_energy_never_grows() {
    let mut random = ChaCha8Rng::seed_from_u64(17);
    for physics in robots::all() {
        for _ in 0..200 {
            let mut plant = tumbling(&physics, &mut random);
            let mut last = plant.energy();
            for n in 0..2000 {
                plant.step(DT, &duty(0.0, 0.0));
                let now = plant.energy();
                // Tolerance: rounding.
                assert!(now <= last * (1.0 + 1e-12), "step {n}: {last} {now}");
                last = now;
            }
        }
    }
}

#[test]
fn at_rest_it_stays_at_rest() {
    for physics in robots::all() {
        for seed in 0..20 {
            let mut plant = Plant::new(&physics, seed);
            plant.run(1.0, &duty(0.0, 0.0));
            assert_eq!((plant.pose(), plant.counts()), ([0.0; 3], [0, 0]));
            assert_eq!((plant.front_counts(), plant.steering_counts()), ([0, 0], 0));
        }
    }
}

#[test]
fn motion_dies_out() {
    let mut random = ChaCha8Rng::seed_from_u64(18);
    for physics in robots::all() {
        for _ in 0..20 {
            let mut plant = tumbling(&physics, &mut random);
            plant.run(5.0, &duty(0.0, 0.0));
            // What is left creeps: fading frictions do not stop it altogether. It is 1 mm/s of the
            // lightest.
            let creep = 1e-6 * (physics.body.mass / 2.0);
            assert!(plant.energy() < creep, "{}", plant.energy());
        }
    }
}

#[test]
fn the_seed_decides() {
    let physics = robots::default();
    let run = |seed| {
        let mut plant = Plant::new(&physics, seed);
        plant.run(1.0, &duty(0.5, 0.4));
        plant.pose().map(f64::to_bits)
    };
    assert_eq!(run(7), run(7));
    assert_ne!(run(7), run(8));
    let twist = |seed| Plant::new(&physics, seed).wheels.map(|w| w.twist);
    assert_ne!(twist(7), twist(8));
    // Phases show in where the first count falls: turn a thousandth of a count at a time with ideal
    // wheels.
    let first = |seed| {
        let mut plant = Plant::new(&physics, seed);
        let count = std::f64::consts::PI * 0.084 / 2796.8;
        let input = Input {
            command: Command::Speed([1e-3 * count; 2]),
            push: NO_PUSH,
            steering: None,
        };
        (0..1001).position(|_| {
            plant.step(1.0, &input);
            plant.counts()[0] != 0
        })
    };
    assert_eq!(first(7), first(7));
    assert_ne!(first(7), first(8));
}

#[test]
fn the_spread_is_as_wide_as_asked() {
    let physics = robots::default();
    let ratios: Vec<f64> = (0..2000)
        .map(|seed| Plant::new(&physics, seed).wheels[0].motor.emf_constant / 0.545 - 1.0)
        .collect();
    let mean = ratios.iter().sum::<f64>() / 2000.0;
    let deviation = (ratios.iter().map(|r| r * r).sum::<f64>() / 2000.0).sqrt();
    // Standard errors: 0.01/√2000 and 0.01/√4000; four of them. The cut at three takes 1.3 % off
    // the deviation.
    assert!(
        mean.abs() < 9e-4 && (deviation - 0.01).abs() < 8e-4,
        "{mean} {deviation}"
    );
}

#[test]
fn ten_times_smaller_steps_agree() {
    for (physics, gain) in [
        (robots::default(), 0.6),
        (robots::robuter(), 0.8),
        (robots::synchro(), 0.5),
        (robots::tricycle(), 0.5),
        (robots::cycab(), 0.3),
        (robots::car(), 0.3),
    ] {
        let run = |steps: u32| {
            let mut plant = Plant::new(&physics, 3);
            for n in 0..8000 * steps {
                // Start, a bend, braking to rest within 2 s.
                let mut input = match n / (1000 * steps) {
                    0..=2 => duty(gain, gain),
                    3..=5 => duty(gain, 0.7 * gain),
                    _ => duty(0.0, 0.0),
                };
                input.steering = Some(0.0018);
                plant.step(DT / f64::from(steps), &input);
            }
            plant.pose()
        };
        let (coarse, fine) = (run(1), run(10));
        let path = fine[0].hypot(fine[1]);
        let apart = (coarse[0] - fine[0]).hypot(coarse[1] - fine[1]);
        // First order: dt/2 = 125 µs late at each of three changes of speed, of 2 s, and
        // slipping wheels at the start.
        assert!(
            apart < 0.01 * path && (coarse[2] / fine[2] - 1.0).abs() < 0.01,
            "{coarse:?} {fine:?}"
        );
    }
}

#[test]
fn a_million_random_steps_stay_bounded() {
    let mut random = ChaCha8Rng::seed_from_u64(19);
    for (physics, fastest) in [(robots::default(), 1.0), (robots::robuter(), 1.6)] {
        let mut plant = Plant::new(&physics, 1);
        let weight = physics.body.mass * 9.8;
        let mut input = duty(0.0, 0.0);
        for n in 0..1_000_000 {
            // Both a new duty each step and one that is held for a while.
            if n % 200_000 < 100_000 || n % 500 == 0 {
                input = duty(
                    random.random_range(-1.0..1.0),
                    random.random_range(-1.0..1.0),
                );
                input.push.force = 0.1 * weight * random.random_range(-1.0..1.0);
            }
            if n % 10_000 == 0 {
                plant.set_blocked(0, random.random_bool(0.2));
                plant.set_strength(1, random.random());
            }
            plant.step(DT, &input);
            let (u, r) = plant.speed();
            // Free speed, with what a push of a tenth of the weight adds.
            let bounded = u.abs() < 2.0 * fastest && r.abs() < 4.0 * fastest / physics.wheels.base;
            assert!(bounded, "step {n}: {u} {r}");
            assert!(plant.bus_voltage().is_finite() && plant.current()[0].is_finite());
        }
        assert!(plant.pose().into_iter().all(f64::is_finite));
    }
}

#[test]
fn other_chassis_stay_bounded_whatever_they_are_told() {
    let mut random = ChaCha8Rng::seed_from_u64(20);
    for (physics, fastest) in [
        (robots::synchro(), 0.8),
        (robots::tricycle(), 0.8),
        (robots::cycab(), 2.9),
        (robots::car(), 2.9),
    ] {
        for dt in [DT, 1e-3] {
            let mut plant = Plant::new(&physics, 1);
            let mut input = duty(0.0, 0.0);
            for n in 0..200_000 {
                if n % 40_000 < 20_000 || n % 500 == 0 {
                    // From one stop to the other.
                    let mut bang = |size: f64| size * f64::from(random.random_range(-1..=1));
                    input = duty(bang(1.0), bang(1.0));
                    input.steering = Some(0.0015 + bang(0.001));
                }
                if n % 10_000 == 0 {
                    plant.set_blocked(0, random.random_bool(0.2));
                }
                plant.step(dt, &input);
                let (u, r) = plant.speed();
                let v = plant.body.velocity.lateral;
                // Free speed; the heading of a synchro drive turns by 7.5 rad/s, a tricycle on the
                // spot by 0.8/0.15.
                assert!(
                    u.abs() < 1.1 * fastest && v.abs() < 1.1 * fastest && r.abs() < 9.0,
                    "{:?}, step {n} of {dt}: {u} {v} {r}",
                    physics.chassis
                );
            }
            assert!(plant.pose().into_iter().all(f64::is_finite));
            assert!(plant.bus_voltage().is_finite() && plant.current()[0].is_finite());
        }
    }
}

#[test]
fn the_seed_decides_for_other_chassis_too() {
    for physics in robots::all() {
        let run = |seed| {
            let mut plant = Plant::new(&physics, seed);
            let mut input = duty(0.5, 0.4);
            input.steering = Some(0.0017);
            plant.run(1.0, &input);
            let turned = (
                plant.counts(),
                plant.front_counts(),
                plant.steering_counts(),
            );
            (plant.pose().map(f64::to_bits), turned)
        };
        assert_eq!(run(7), run(7));
        assert_ne!(run(7), run(8));
    }
}
