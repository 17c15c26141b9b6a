//! The reference of one axis: a discrete trapezoid that lands exactly (theory section 7).

use crate::math::{Factor, Sum, larger, limit, sign, smaller, sqrt};

/// Where the reference is going.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Target {
    /// To rest, wherever that is.
    Rest,
    /// On and on; true is forward.
    Endless(bool),
    /// This much further. Carried as state and counted down by what was travelled: a difference of two large positions would not do.
    Remaining(Sum),
}

/// What the reference speed did in the last cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// It grew toward the target.
    Accelerating,
    /// It stayed.
    Cruising,
    /// It fell, or was still directed away from the target.
    Decelerating,
}

/// One cycle of the reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// Displacement during the cycle, (v + v') T / 2; m or rad.
    pub displacement: f32,
    /// v' − v, m/s or rad/s; never more than a T, but for what [`Profile::wait`] takes back.
    pub speed_change: f32,
    /// What the speed did.
    pub phase: Phase,
}

/// How the speed toward the target goes on.
enum Next {
    /// To this speed, as far as the acceleration allows.
    To(f32),
    /// By this difference, as far as the acceleration allows.
    By(f32),
}

/// Reference generator of one axis: speed, target, and the limits of the command. Units are m or rad, and seconds.
///
/// Per cycle of nominal length T, with u the speed toward the target, v and a the command's speed and acceleration, r the distance that remains:
///
/// ```text
///     r' = r − u T/2
///     n  = max(1, ⌈(√(1 + 8 r'/(a T²)) − 1) / 2⌉)          cycles of braking that are left
///     v_b = r'/(n T) + (n − 1) a T/2                       from this speed, n cycles at −a land exactly
///     u' = max(u − a T, min(u + a T, v, v_b))
///     r  := r − (u + u') T/2
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Profile {
    target: Target,
    /// A sum too: a T rounded to an ulp of v would change the slope by 6e-5, and a ramp of 600 cycles would end 3 µm off.
    speed: Sum,
    max_speed: f32,
    acceleration: f32,
}

impl Profile {
    /// At rest and going nowhere.
    #[must_use]
    pub const fn at_rest() -> Self {
        Self {
            target: Target::Rest,
            speed: Sum::new(0.0),
            max_speed: 0.0,
            acceleration: 1.0,
        }
    }

    /// Goes `distance` further (signed, finite or infinite) at `speed` > 0 with `acceleration` > 0, from the present speed.
    pub fn go(&mut self, distance: f32, speed: f32, acceleration: f32) {
        self.target = if distance.is_infinite() {
            Target::Endless(distance > 0.0)
        } else {
            Target::Remaining(Sum::new(distance))
        };
        self.max_speed = speed;
        self.acceleration = acceleration;
    }

    /// Comes to rest with `acceleration` > 0.
    pub fn stop(&mut self, acceleration: f32) {
        self.target = Target::Rest;
        self.max_speed = 0.0;
        self.acceleration = acceleration;
    }

    /// Present reference speed, signed.
    #[must_use]
    pub fn speed(&self) -> f32 {
        self.speed.get()
    }

    /// Speed of the command, 0 if it is to stop.
    #[must_use]
    pub fn pace(&self) -> f32 {
        self.max_speed
    }

    /// What is left to go, signed; 0 if there is no end to it.
    #[must_use]
    pub fn remaining(&self) -> f32 {
        match self.target {
            Target::Remaining(remaining) => remaining.get(),
            Target::Rest | Target::Endless(_) => 0.0,
        }
    }

    /// The command's acceleration toward the target, signed; 0 if there is none.
    #[must_use]
    pub fn urge(&self) -> f32 {
        match self.target {
            Target::Rest => 0.0,
            Target::Endless(true) => self.acceleration,
            Target::Endless(false) => -self.acceleration,
            Target::Remaining(_) if self.has_landed() => 0.0,
            Target::Remaining(remaining) => sign(remaining.get()) * self.acceleration,
        }
    }

    /// The speed that will be needed, signed: the command's, or what of it the distance allows to reach, or the present one where that is more.
    #[must_use]
    pub fn wanted_speed(&self) -> f32 {
        let speed = self.speed();
        let wanted = match self.target {
            Target::Rest => 0.0,
            Target::Endless(true) => self.max_speed,
            Target::Endless(false) => -self.max_speed,
            Target::Remaining(remaining) => {
                let distance = remaining.get();
                // Up and down again at a: v² = a r + u²/2. The product may be infinite.
                let square = self.acceleration * distance.abs() + 0.5 * speed * speed;
                let reached = if square < self.max_speed * self.max_speed {
                    sqrt(square)
                } else {
                    self.max_speed
                };
                sign(distance) * reached
            }
        };
        if speed.abs() > wanted.abs() {
            speed
        } else {
            wanted
        }
    }

    /// True if the reference stands where it was sent.
    #[must_use]
    pub fn has_landed(&self) -> bool {
        self.speed.get() == 0.0
            && match self.target {
                Target::Rest => true,
                Target::Endless(_) => false,
                Target::Remaining(remaining) => remaining.get() == 0.0,
            }
    }

    /// Advances by one cycle of `period` seconds; `share` ≤ 1 is how much of the command's speed there is to have.
    #[inline]
    pub fn step(&mut self, period: f32, share: f32) -> Step {
        let max_speed = self.max_speed * share;
        let before = self.speed.get();
        let change = self.acceleration * period;
        let (direction, next) = match self.target {
            Target::Rest => (sign(before), Next::To(0.0)),
            Target::Endless(forward) => {
                let direction = if forward { 1.0 } else { -1.0 };
                (direction, Next::To(max_speed))
            }
            Target::Remaining(remaining) => {
                let distance = remaining.get();
                let direction = if distance == 0.0 {
                    sign(before)
                } else {
                    sign(distance)
                };
                let u = before * direction;
                // r' = r − u T/2
                let rest = distance * direction - 0.5 * u * period;
                if Self::lands(u, rest, change, period) {
                    return self.land(distance);
                }
                (
                    direction,
                    self.approach(remaining, u, rest, period, max_speed),
                )
            }
        };
        let u = before * direction;
        match next {
            Next::To(wanted) if wanted > u + change => self.speed.add(direction * change),
            Next::To(wanted) if wanted < u - change => self.speed.add(-direction * change),
            Next::To(wanted) => self.speed = Sum::new(direction * wanted),
            Next::By(difference) => self.speed.add(direction * limit(difference, change)),
        }
        let after = self.speed.get();
        let displacement = 0.5 * (before + after) * period;
        if let Target::Remaining(remaining) = &mut self.target {
            remaining.add(-displacement);
        }
        let next = after * direction;
        Step {
            displacement,
            speed_change: after - before,
            phase: if next > u && next > 0.0 {
                Phase::Accelerating
            } else if next == u && next == max_speed {
                Phase::Cruising
            } else {
                Phase::Decelerating
            },
        }
    }

    /// The last cycle: what remains is travelled, and the speed ends.
    fn land(&mut self, distance: f32) -> Step {
        let before = self.speed.get();
        self.speed = Sum::default();
        self.target = Target::Remaining(Sum::default());
        Step {
            displacement: distance,
            speed_change: -before,
            phase: Phase::Decelerating,
        }
    }

    /// True if this cycle can end at the target, but for rounding.
    ///
    /// Each displacement is an f32; over some thousand cycles of full braking, which leave no room to make up for it, that comes to nanometres.
    /// A twentieth of a T² (25 nm for 0.5 m/s² at 1 kHz) is more, and less than the last cycle's own displacement.
    fn lands(u: f32, rest: f32, change: f32, period: f32) -> bool {
        rest.abs() <= 0.05 * change * period && u >= 0.0 && u <= change * (1.0 + 1e-3)
    }

    /// What to strive for: v, or v_b where it is less.
    #[inline]
    fn approach(&self, remaining: Sum, u: f32, rest: f32, period: f32, max_speed: f32) -> Next {
        let change = self.acceleration * period;
        let next = smaller(u + change, max_speed);
        // Far from the target nothing brakes. The comparison also holds r too large for a square.
        if rest >= next * (0.5 * next / self.acceleration + period) {
            return Next::To(max_speed);
        }
        if rest <= 0.0 {
            return Next::To(0.0);
        }
        Next::By(self.braking(remaining, u, rest, period, max_speed))
    }

    /// min(v, v_b) − u. Apart from [`Self::approach`], which is all that most cycles need.
    #[inline(never)]
    fn braking(&self, remaining: Sum, u: f32, rest: f32, period: f32, max_speed: f32) -> f32 {
        let change = self.acceleration * period;
        let cycles = 0.5 * (sqrt(1.0 + 8.0 * rest / (change * period)) - 1.0);
        let n = larger(libm::ceilf(cycles), 1.0);
        // Braking uses all of a: a speed that is too high by an f32's rounding stays so to the end, and lands micrometres beyond.
        let speed = if u < 0.0 {
            self.speed.abs().negative()
        } else {
            self.speed.abs()
        };
        let period = Factor::new(period);
        let travelled = speed.times(period).times(Factor::new(0.5));
        let rest = remaining.abs().minus(travelled);
        let left = Sum::new(n).times(period);
        let ramp = Sum::new(change).times(Factor::new(0.5 * (n - 1.0)));
        let braking = rest.over(left).plus(ramp);
        let braking = if braking.get() > max_speed {
            Sum::new(max_speed)
        } else {
            braking
        };
        braking.minus(speed).get()
    }

    /// Takes back a part of the last step that the vehicle could not follow, and goes on from the speed `u` ≥ 0 that it has (toward where the
    /// step went).
    pub fn wait(&mut self, untravelled: f32, u: f32) {
        if let Target::Remaining(remaining) = &mut self.target {
            remaining.add(untravelled);
        }
        let speed = self.speed.get();
        self.speed = Sum::new(sign(speed) * smaller(speed.abs(), u));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const T: f32 = 1e-3;

    /// a T, the thousandth of it that landing may add, and half an ulp of either speed.
    fn allowed(profile: &Profile) -> f32 {
        profile.acceleration * T * 1.001 + 1.2e-7 * profile.speed().abs()
    }

    /// Runs to landing; returns cycles and the exact sum of displacements, and checks |Δv| ≤ aT on the way.
    fn run(profile: &mut Profile, limit: u32) -> (u32, f64) {
        let mut travelled = 0.0;
        for cycle in 0..limit {
            if profile.has_landed() {
                return (cycle, travelled);
            }
            let allowed = allowed(profile);
            let step = profile.step(T, 1.0);
            assert!(step.speed_change.abs() <= allowed, "{step:?}");
            travelled += f64::from(step.displacement);
        }
        panic!("did not land: {profile:?}");
    }

    #[test]
    fn triangle_and_trapezoid_land() {
        for (d, v, a, seconds) in [
            (1.0, 0.3, 0.5, 3.9333),
            (0.1, 1.0, 0.5, 0.8944),
            (-2.0, 0.5, 1.0, 4.5),
        ] {
            let mut profile = Profile::at_rest();
            profile.go(d, v, a);
            let (cycles, travelled) = run(&mut profile, 100_000);
            assert!(
                (f64::from(cycles) * 1e-3 - seconds).abs() < 1.5e-3,
                "{d}: {cycles}"
            );
            assert!((travelled - f64::from(d)).abs() < 1e-7, "{d}: {travelled}");
        }
    }

    #[test]
    fn far_targets_are_reached_exactly() {
        // 2 km at 1 m/s: an f32 remainder alone would change by multiples of 0.12 mm and land metres off.
        let mut profile = Profile::at_rest();
        profile.go(2000.0, 1.0, 1.0);
        let (cycles, travelled) = run(&mut profile, 3_000_000);
        assert!((travelled - 2000.0).abs() < 1e-5, "{travelled}");
        assert!(cycles.abs_diff(2_001_000) <= 1);
    }

    proptest! {
        #[test]
        fn any_command_from_any_speed_lands(
            commands in proptest::collection::vec((-2.0..2.0f32, 0.01..2.0f32, 0.05..5.0f32, 1..400u32), 1..6),
        ) {
            let mut profile = Profile::at_rest();
            for (d, v, a, cycles) in commands {
                profile.go(d, v, a);
                let mut goes = 0.0;
                for _ in 0..cycles {
                    let allowed = allowed(&profile);
                    let step = profile.step(T, 1.0);
                    prop_assert!(step.speed_change.abs() <= allowed);
                    goes += f64::from(step.displacement);
                }
                let mut copy = profile;
                let (_, rest) = run(&mut copy, 1_000_000);
                prop_assert!((goes + rest - f64::from(d)).abs() < 1e-6, "{} for {}", goes + rest, d);
            }
        }
    }

    #[test]
    fn phases_of_a_reversal() {
        let mut profile = Profile::at_rest();
        profile.go(f32::INFINITY, 0.5, 1.0);
        for _ in 0..600 {
            profile.step(T, 1.0);
        }
        assert_eq!(profile.step(T, 1.0).phase, Phase::Cruising);
        profile.go(f32::NEG_INFINITY, 0.5, 1.0);
        assert_eq!(profile.step(T, 1.0).phase, Phase::Decelerating);
        for _ in 0..600 {
            profile.step(T, 1.0);
        }
        assert_eq!(profile.step(T, 1.0).phase, Phase::Accelerating);
        assert!(profile.speed() < 0.0);
    }
}
