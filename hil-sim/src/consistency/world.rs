//! A base as it truly is: gains that its controller does not know, random errors, and encoders that count whole counts (theory sections 3 and 6).
//!
//! Written from the physics, in f64: it shares no kinematics with the controller.

use crate::random::Random;
use crate::se2::Pose;
use std::f64::consts::{PI, TAU};
use vehicle_controller::params::{Id, Params};

/// The random part: variances per way and per angle.
#[derive(Clone, Copy, Debug)]
struct Noise {
    /// κ_S, m²/m.
    translation: f64,
    /// κ_drift, rad²/m.
    drift: f64,
    /// κ_rot, rad²/rad.
    rotation: f64,
}

/// What the drawings of the base say.
#[derive(Clone, Copy, Debug)]
pub struct Drawing {
    /// m.
    wheel_base: f64,
    /// Right, left: m per count.
    per_count: [f64; 2],
    noise: Noise,
    /// The gains that the controller begins with: right, left, base.
    believed: [f64; 3],
}

impl Drawing {
    /// As the parameters have it.
    #[must_use]
    pub fn of(params: &Params) -> Self {
        let get = |id| f64::from(params.get(id));
        let per_count = |diameter| PI * get(diameter) / get(Id::CountsPerTurn);
        Self {
            wheel_base: get(Id::WheelBase),
            per_count: [Id::RightDiameter, Id::LeftDiameter].map(per_count),
            noise: Noise {
                translation: get(Id::NoiseS),
                drift: get(Id::NoiseDrift) * (TAU / 360.0).powi(2),
                rotation: get(Id::NoiseRot) * (TAU / 360.0),
            },
            believed: [Id::GainRight, Id::GainLeft, Id::GainBase].map(get),
        }
    }
}

/// A base under way.
#[derive(Clone, Debug)]
pub struct World {
    drawing: Drawing,
    /// What the gains truly are: right, left, base.
    gains: [f64; 3],
    /// The wheels' turning, in counts: right, left.
    turned: [f64; 2],
    pose: Pose,
    random: Random,
}

impl World {
    /// A base with these gains at the origin; its encoders stand anywhere between two counts.
    #[must_use]
    pub fn new(drawing: Drawing, gains: [f64; 3], mut random: Random) -> Self {
        let turned = [random.fraction(), random.fraction()];
        Self {
            drawing,
            gains,
            turned,
            pose: [0.0; 3],
            random,
        }
    }

    /// Turns the wheels for `dt` seconds as a controller does that believes in its gains and wants these speeds (m/s, rad/s).
    pub fn drive(&mut self, speed: f64, turn_speed: f64, dt: f64) {
        let Drawing {
            wheel_base,
            per_count,
            noise,
            believed,
        } = self.drawing;
        let aside = 0.5 * turn_speed * wheel_base * believed[2];
        let wanted = [speed + aside, speed - aside];
        let rolled = [0, 1].map(|wheel| {
            let counts = wanted[wheel] * dt / (per_count[wheel] * believed[wheel]);
            self.turned[wheel] += counts;
            self.gains[wheel] * per_count[wheel] * counts
        });
        let ahead = 0.5 * (rolled[0] + rolled[1]);
        let angle = (rolled[0] - rolled[1]) / (self.gains[2] * wheel_base);
        let ahead_variance = noise.translation * ahead.abs();
        let angle_variance = noise.drift * ahead.abs() + noise.rotation * angle.abs();
        let [slip, skid] = [self.random.normal(), self.random.normal()];
        self.roll(
            ahead + ahead_variance.sqrt() * slip,
            angle + angle_variance.sqrt() * skid,
        );
    }

    /// Along a circle of radius ρ = ΔS/Δθ about the point ρ to the left.
    fn roll(&mut self, ahead: f64, angle: f64) {
        let [x, y, theta] = &mut self.pose;
        let after = *theta + angle;
        if angle.abs() < 1e-7 {
            *x += ahead * theta.cos();
            *y += ahead * theta.sin();
        } else {
            let radius = ahead / angle;
            *x += radius * (after.sin() - theta.sin());
            *y -= radius * (after.cos() - theta.cos());
        }
        *theta = after;
    }

    /// What the encoders show: left, right.
    #[must_use]
    pub fn counts(&self) -> [i64; 2] {
        let [right, left] = self.turned.map(|turned| turned.floor() as i64);
        [left, right]
    }

    /// Where it truly is: m, m, rad, unwrapped.
    #[must_use]
    pub fn pose(&self) -> Pose {
        self.pose
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noiseless() -> Drawing {
        let mut drawing = Drawing::of(&Params::default());
        drawing.noise = Noise {
            translation: 0.0,
            drift: 0.0,
            rotation: 0.0,
        };
        drawing
    }

    #[test]
    fn gains_bend_a_straight_way_and_stretch_a_turn() {
        // k_r − k_l = 0.002 over a base of 0.2 m: 0.01 rad/m.
        let mut world = World::new(noiseless(), [1.001, 0.999, 1.0], Random::new(1, 0));
        for _ in 0..2000 {
            world.drive(0.5, 0.0, 1e-3);
        }
        let [x, y, theta] = world.pose();
        // The base of 0.2 m is an f32.
        assert!((theta - 0.01).abs() < 1e-9);
        assert!((x - 0.01_f64.sin() / 0.01).abs() < 1e-9, "{x}");
        assert!((y - (1.0 - 0.01_f64.cos()) / 0.01).abs() < 1e-9, "{y}");
        let mut world = World::new(noiseless(), [1.0, 1.0, 1.02], Random::new(1, 0));
        for _ in 0..1000 {
            world.drive(0.0, 1.0, 1e-3);
        }
        assert!((world.pose()[2] - 1.0 / 1.02).abs() < 1e-12);
        assert!(world.pose()[0].abs() < 1e-12);
    }

    #[test]
    fn encoders_count_whole_counts() {
        let mut world = World::new(noiseless(), [1.0; 3], Random::new(3, 0));
        let start = world.counts();
        let drawing = noiseless();
        for _ in 0..1000 {
            world.drive(0.3, 0.5, 1e-3);
        }
        for (wheel, speed) in [(0, 0.25), (1, 0.35)] {
            let counts = (world.counts()[wheel] - start[wheel]) as f64;
            assert!((counts - speed / drawing.per_count[0]).abs() <= 1.0);
        }
    }

    #[test]
    fn random_errors_grow_with_the_way_and_not_with_the_rate() {
        let drawing = Drawing::of(&Params::default());
        let kappa = drawing.noise.drift;
        for steps in [10, 100] {
            let turned = (0..2000).map(|stream| {
                let mut world = World::new(drawing, [1.0; 3], Random::new(5, stream));
                for _ in 0..steps {
                    world.drive(1.0, 0.0, 2.0 / f64::from(steps));
                }
                world.pose()[2].powi(2) / (2.0 * kappa)
            });
            let mean: f64 = turned.sum::<f64>() / 2000.0;
            // χ² with 2000 degrees: 3.2 % is one standard error.
            assert!((mean - 1.0).abs() < 0.13, "{steps}: {mean}");
        }
    }
}
