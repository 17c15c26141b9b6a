//! The encoder: counts of the motor's side of the gear.

use super::params::EncoderParams;

/// An encoder with an unknown position of its disc at the start.
#[derive(Clone, Debug)]
pub(super) struct Encoder {
    /// Counts per radian of the wheel \[1/rad\].
    scale: f64,
    /// Part of a count, 0..1, at angle 0.
    phase: f64,
}

impl Encoder {
    /// An encoder with these parameters and this phase in 0..1.
    pub(super) fn new(params: &EncoderParams, phase: f64) -> Self {
        Self {
            scale: params.counts_per_turn / std::f64::consts::TAU,
            phase,
        }
    }

    /// Counts at an angle of the motor referred to the wheel \[rad\].
    #[inline]
    pub(super) fn counts(&self, angle: f64) -> i64 {
        // n = ⌊φ_m·N/2π + phase⌋
        (angle * self.scale + self.phase).floor() as i64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_of_turns_both_ways() {
        let encoder = Encoder::new(
            &EncoderParams {
                counts_per_turn: 2796.8,
            },
            0.25,
        );
        let turn = std::f64::consts::TAU;
        assert_eq!(encoder.counts(0.0), 0);
        // 10 turns are 27968 counts, and the phase of a quarter keeps both away from an edge.
        assert_eq!(encoder.counts(10.0 * turn), 27968);
        assert_eq!(encoder.counts(-10.0 * turn), -27968);
        assert_eq!(encoder.counts(-0.3 / 2796.8 * turn), -1);
    }
}
