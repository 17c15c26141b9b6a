//! The steering servo: pulses in, an angle of the wheels out, and its two sensors.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::encoder::Encoder;
use super::normal;
use super::params::{EncoderParams, ServoParams};

/// A steering servo whose gear no force on the wheels can turn.
#[derive(Clone, Debug)]
pub(super) struct Servo {
    params: ServoParams,
    encoder: Encoder,
    /// What the servo and its sensors take for the steering angle \[rad\].
    angle: f64,
    /// What is on the potentiometer's voltage besides \[V\].
    noise: f64,
    random: ChaCha8Rng,
}

impl Servo {
    /// A servo that stands straight ahead, with unknowns from a source of random numbers.
    pub(super) fn new(params: &ServoParams, random: &mut ChaCha8Rng) -> Self {
        let encoder = EncoderParams {
            counts_per_turn: params.steer_counts_per_turn,
        };
        Self {
            encoder: Encoder::new(&encoder, random.random()),
            params: params.clone(),
            angle: 0.0,
            noise: 0.0,
            random: ChaCha8Rng::seed_from_u64(random.random()),
        }
    }

    /// Moves on by `dt` \[s\] under pulses of this width \[s\]. Without pulses, or with what is no
    /// width, it stays where it is.
    pub(super) fn step(&mut self, pulse: Option<f64>, dt: f64) {
        let p = &self.params;
        if let Some(pulse) = pulse.filter(|width| width.is_finite()) {
            let target =
                ((pulse - p.pulse_centre) / p.pulse_per_radian).clamp(-p.steer_max, p.steer_max);
            // φ' = φ + (φ_c − φ)·(1 − e^(−dt/T)), not faster than the rate
            let approach = -(-dt / p.steer_lag).exp_m1();
            let fastest = p.steer_rate * dt;
            self.angle += ((target - self.angle) * approach).clamp(-fastest, fastest);
        }
        if p.pot_noise > 0.0 {
            self.noise = p.pot_noise * normal(&mut self.random);
        }
    }

    /// Where the wheels truly point \[rad\].
    #[inline]
    pub(super) fn truth(&self) -> f64 {
        self.angle + self.params.steer_offset
    }

    /// Voltage of the potentiometer \[V\].
    pub(super) fn signal(&self) -> f64 {
        self.params.pot_centre + self.params.pot_per_radian * self.angle + self.noise
    }

    /// Counts of the encoder.
    pub(super) fn counts(&self) -> i64 {
        self.encoder.counts(self.angle)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT: f64 = 250e-6;

    fn params() -> ServoParams {
        ServoParams {
            steer_max: 1.2,
            steer_rate: 5.0,
            steer_lag: 0.05,
            pulse_centre: 0.0015,
            pulse_per_radian: 0.0005,
            pot_centre: 1.65,
            pot_per_radian: 0.9,
            pot_noise: 0.0,
            steer_counts_per_turn: 4096.0,
            steer_offset: 0.02,
        }
    }

    fn servo(params: &ServoParams) -> Servo {
        Servo::new(params, &mut ChaCha8Rng::seed_from_u64(3))
    }

    #[test]
    fn a_small_step_is_exponential_and_a_large_one_is_limited() {
        let mut small = servo(&params());
        for n in 1..1000 {
            small.step(Some(0.0015 + 0.0005 * 0.2), DT);
            // 0.2 rad over 0.05 s is 4 rad/s, less than the limit. Tolerance: rounding.
            let closed = 0.2 * (1.0 - (-f64::from(n) * DT / 0.05).exp());
            assert!((small.angle - closed).abs() < 1e-13);
        }
        let mut large = servo(&params());
        for n in 1..=600 {
            large.step(Some(0.0015 + 0.0005 * 1.0), DT);
            assert!((large.angle - 5.0 * DT * f64::from(n)).abs() < 1e-12);
        }
        // At 0.75 rad the rest over the lag is the rate; from there on it is exponential.
        for _ in 0..4000 {
            large.step(Some(0.0015 + 0.0005 * 1.0), DT);
        }
        assert!((large.angle - 1.0).abs() < 1e-8);
    }

    #[test]
    fn it_ends_at_its_stop_and_stays_without_pulses() {
        let mut servo = servo(&params());
        for _ in 0..8000 {
            servo.step(Some(0.001), DT);
        }
        assert!((servo.angle + 1.0).abs() < 1e-12);
        for _ in 0..8000 {
            servo.step(Some(0.0001), DT);
        }
        assert!((servo.angle + 1.2).abs() < 1e-12);
        servo.step(None, 10.0);
        assert!((servo.angle + 1.2).abs() < 1e-12);
        // The sensors show the servo; the wheels are off by the offset.
        assert!((servo.truth() + 1.18).abs() < 1e-12);
        assert!((servo.signal() - (1.65 - 0.9 * 1.2)).abs() < 1e-12);
        let closed = -1.2 * 4096.0 / std::f64::consts::TAU;
        // The phase is below one count.
        assert!((servo.counts() as f64 - closed).abs() <= 1.0);
    }

    #[test]
    fn without_lag_it_is_there_as_soon_as_the_rate_allows() {
        let mut params = params();
        params.steer_lag = 0.0;
        let mut servo = servo(&params);
        servo.step(Some(0.0020), 0.1);
        assert!((servo.angle - 0.5).abs() < 1e-15);
        servo.step(Some(0.0020), 0.2);
        assert!((servo.angle - 1.0).abs() < 1e-15);
    }

    #[test]
    fn the_noise_is_as_wide_as_asked() {
        let mut params = params();
        params.pot_noise = 0.01;
        let mut servo = servo(&params);
        let squares: f64 = (0..4000)
            .map(|_| {
                servo.step(None, DT);
                (servo.signal() - 1.65).powi(2)
            })
            .sum();
        // Four standard errors, 1/√8000 each, and the cut at three takes 1.3 % off.
        assert!(((squares / 4000.0).sqrt() / 0.01 - 1.0).abs() < 0.06);
    }
}
