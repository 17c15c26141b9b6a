//! A rigid body in the plane on any number of wheels, each with its own place, direction and tyre.

use std::array;

use super::super::MAX_TRIALS;
use super::super::balance::Balance;
use super::super::body::Body;
use super::super::input::Push;
use super::super::stance::Stance;
use super::super::wheel::{Guess, Trial, Wheel};

/// A step of `dt` \[s\] with these voltages on the motors behind the wheels \[V\].
///
/// As with two wheels, each wheel becomes a force that is linear in its speed over ground; here the
/// body's three equations couple all of them.
pub(super) fn drive<const N: usize>(
    body: &mut Body,
    mut wheels: [&mut Wheel; N],
    stances: &[Stance; N],
    voltage: [f64; N],
    push: Push,
    dt: f64,
) {
    let start = body.turned(dt);
    let base = Balance::new(body, start, [1.0, 0.0], push, dt);
    let mut guesses: [Guess; N] = array::from_fn(|i| {
        let (along, across) = stances[i].speeds(start);
        wheels[i].guess(along, across, dt)
    });
    let mut remaining = MAX_TRIALS;
    let (trials, velocity) = loop {
        let trials: [Trial; N] = array::from_fn(|i| wheels[i].attempt(&guesses[i], voltage[i], dt));
        let mut balance = base;
        for ((stance, trial), guess) in stances.iter().zip(&trials).zip(&guesses) {
            // A − B·v_c' along the wheel, −D·v' across it
            balance.push(&stance.along, dt * trial.force);
            balance.resist(&stance.along, dt * trial.slope);
            balance.resist(&stance.across, dt * guess.grip);
        }
        let velocity = balance.solve();
        remaining -= 1;
        if remaining == 0 {
            break (trials, velocity);
        }
        let mut wrong = false;
        for (i, guess) in guesses.iter_mut().enumerate() {
            let ground = stances[i].speeds(velocity);
            wrong |= wheels[i].judge(guess, &trials[i], voltage[i], ground, dt);
        }
        if !wrong {
            break (trials, velocity);
        }
    };

    for (i, wheel) in wheels.iter_mut().enumerate() {
        let (along, _) = stances[i].speeds(velocity);
        wheel.settle(&guesses[i], &trials[i], along, dt);
    }
    body.travel(velocity, dt);
}
