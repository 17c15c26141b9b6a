//! Two driven wheels on one axle: the differential drive.

use super::super::MAX_TRIALS;
use super::super::body::{Body, Velocity};
use super::super::input::Push;
use super::super::wheel::Wheel;

/// A step of `dt` \[s\] with these voltages on the motors \[V\].
#[inline]
pub(super) fn drive(
    body: &mut Body,
    wheels: &mut [Wheel; 2],
    voltage: [f64; 2],
    push: Push,
    dt: f64,
) {
    let [left, right] = &*wheels;
    let start = body.turned(dt);
    let damping = body.caster_damping(start);
    let ground = body.ground(start);
    let mut guesses = [
        left.guess(ground[0], start.lateral, dt),
        right.guess(ground[1], start.lateral, dt),
    ];
    let mut remaining = MAX_TRIALS;
    let (trials, velocity, ground) = loop {
        let trials = [
            left.attempt(&guesses[0], voltage[0], dt),
            right.attempt(&guesses[1], voltage[1], dt),
        ];
        let grip = guesses[0].grip + guesses[1].grip;
        let velocity = body.solve(start, &trials, grip, damping, push, dt);
        let ground = body.ground(velocity);
        remaining -= 1;
        if remaining == 0 {
            break (trials, velocity, ground);
        }
        let lateral = velocity.lateral;
        let wrong = [
            left.judge(
                &mut guesses[0],
                &trials[0],
                voltage[0],
                (ground[0], lateral),
                dt,
            ),
            right.judge(
                &mut guesses[1],
                &trials[1],
                voltage[1],
                (ground[1], lateral),
                dt,
            ),
        ];
        if wrong == [false; 2] {
            break (trials, velocity, ground);
        }
    };

    for (side, wheel) in wheels.iter_mut().enumerate() {
        wheel.settle(&guesses[side], &trials[side], ground[side], dt);
    }
    body.travel(velocity, dt);
}

/// A step of ideal wheels at these speeds of their rims \[m/s\].
pub(super) fn roll(body: &mut Body, wheels: &mut [Wheel; 2], rims: [f64; 2], dt: f64) {
    for (wheel, rim) in wheels.iter_mut().zip(rims) {
        wheel.follow(rim, dt);
    }
    // u = (v_l + v_r)/2, r = (v_r − v_l)/b
    let forward = 0.5 * (rims[0] + rims[1]);
    let yaw = 0.5 * (rims[1] - rims[0]) / body.half_base;
    body.travel(
        Velocity {
            forward,
            lateral: 0.0,
            yaw,
        },
        dt,
    );
}
