//! Random numbers of known distributions from a seed.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;

/// A source of random numbers. Sources of one seed and different streams have nothing in common.
#[derive(Clone, Debug)]
pub struct Random {
    bits: ChaCha8Rng,
    /// Normal variates come in pairs.
    spare: Option<f64>,
}

impl Random {
    /// The source of a seed and a stream.
    #[must_use]
    pub fn new(seed: u64, stream: u64) -> Self {
        let mut bits = ChaCha8Rng::seed_from_u64(seed);
        bits.set_stream(stream);
        Self { bits, spare: None }
    }

    /// Evenly in 0 to 1.
    pub fn fraction(&mut self) -> f64 {
        self.bits.random()
    }

    /// Evenly about 0, with standard deviation 1: half the width is √3.
    pub fn uniform(&mut self) -> f64 {
        3.0_f64.sqrt() * (2.0 * self.fraction() - 1.0)
    }

    /// Normally about 0, with standard deviation 1.
    pub fn normal(&mut self) -> f64 {
        if let Some(spare) = self.spare.take() {
            return spare;
        }
        // Box and Muller's transform; 1 − a is never 0.
        let (a, b) = (self.fraction(), self.fraction());
        let radius = (-2.0 * (1.0 - a).ln()).sqrt();
        let (sin, cos) = (TAU * b).sin_cos();
        self.spare = Some(radius * sin);
        radius * cos
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn variates_have_their_moments_and_are_independent() {
        const N: u32 = 200_000;
        let draws: [fn(&mut Random) -> f64; 2] = [Random::normal, Random::uniform];
        // Kurtosis: 3 and 9/5.
        for (draw, kurtosis) in draws.into_iter().zip([3.0, 1.8]) {
            let mut random = Random::new(7, 0);
            let (mut sums, mut last, mut product) = ([0.0; 4], 0.0, 0.0);
            for _ in 0..N {
                let x = draw(&mut random);
                for (power, sum) in (1..).zip(&mut sums) {
                    *sum += x.powi(power) / f64::from(N);
                }
                product += x * last / f64::from(N);
                last = x;
            }
            // Four standard errors of each: 1/√N, √2/√N, √15/√N, √96/√N at most.
            let error = 4.0 / f64::from(N).sqrt();
            assert!(sums[0].abs() < error, "{sums:?}");
            assert!((sums[1] - 1.0).abs() < 1.5 * error, "{sums:?}");
            assert!(sums[2].abs() < 4.0 * error, "{sums:?}");
            assert!((sums[3] - kurtosis).abs() < 10.0 * error, "{sums:?}");
            assert!(product.abs() < error, "{product}");
        }
    }

    #[test]
    fn a_stream_repeats_and_no_two_are_alike() {
        let draw = |seed, stream| Random::new(seed, stream).normal();
        assert_eq!(draw(1, 2), draw(1, 2));
        assert_ne!(draw(1, 2), draw(1, 3));
        assert_ne!(draw(1, 2), draw(2, 2));
    }
}
