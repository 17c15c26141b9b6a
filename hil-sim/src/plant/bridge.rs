//! The H-bridge: from a duty cycle to a part of the bus voltage.

use super::params::BridgeParams;

/// An H-bridge, averaged over its PWM period. At zero duty it shorts the motor.
#[derive(Clone, Debug)]
pub(super) struct Bridge {
    dead_band: f64,
    /// 1/(1 − dead band).
    gain: f64,
}

impl Bridge {
    /// A bridge with these parameters.
    pub(super) fn new(params: &BridgeParams) -> Self {
        Self {
            dead_band: params.dead_band,
            gain: 1.0 / (1.0 - params.dead_band),
        }
    }

    /// The part of the bus voltage, −1..1, that a duty cycle of −1..1 puts on the motor. Larger
    /// duties are cut.
    #[inline]
    pub(super) fn drive(&self, duty: f64) -> f64 {
        // d' = sign(d)·max(0, |d| − d_0)/(1 − d_0)
        let beyond = (duty.abs().min(1.0) - self.dead_band).max(0.0);
        (beyond * self.gain).copysign(duty)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_dead_band_is_cut_out_of_the_middle() {
        let bridge = Bridge::new(&BridgeParams {
            dead_band: 0.2,
            current_sensitivity: 0.25,
        });
        assert_eq!(bridge.drive(0.0), 0.0);
        assert_eq!(bridge.drive(0.2), 0.0);
        assert_eq!(bridge.drive(-0.15), 0.0);
        // Tolerance: rounding.
        assert!((bridge.drive(0.6) - 0.5).abs() < 1e-12);
        assert!((bridge.drive(-0.6) + 0.5).abs() < 1e-12);
        assert!((bridge.drive(1.0) - 1.0).abs() < 1e-12);
        assert!((bridge.drive(-3.0) + 1.0).abs() < 1e-12);
    }
}
