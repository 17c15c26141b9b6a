//! The tyre: force by creep, saturating at the friction limit, longitudinal and lateral together.

use super::params::TyreParams;

/// How far a step may overshoot the tyre's friction limit before it is made again \[1\].
const LIMIT_SLACK: f64 = 1.005;

/// A tyre under its load.
#[derive(Clone, Debug)]
pub(super) struct Tyre {
    /// C·N \[N\].
    stiffness: f64,
    /// C/μ \[1\].
    steepness: f64,
    /// v_0 \[m/s\].
    rest_speed: f64,
    /// μ·N \[N\].
    pub limit: f64,
}

impl Tyre {
    /// A tyre with these parameters under a load \[N\].
    pub(super) fn new(params: &TyreParams, load: f64) -> Self {
        Self {
            stiffness: params.creep * load,
            steepness: params.creep / params.friction,
            rest_speed: params.rest_speed,
            limit: params.friction * load,
        }
    }

    /// The grip \[N·s/m\]: the force, which opposes the slip, over the slip speed.
    ///
    /// `rim` is the wheel's R·ω, `ground` the forward speed over ground where it touches, `lateral`
    /// the sideways speed there \[m/s\].
    #[inline]
    pub(super) fn grip(&self, rim: f64, ground: f64, lateral: f64) -> f64 {
        let longitudinal = rim - ground;
        // v_ref = max(|v_c|, |R·ω|) + v_0
        let reference = rim.abs().max(ground.abs()) + self.rest_speed;
        // v_s = √(v_x² + v_y²): one slip, so that both forces share one friction circle
        let slip = (longitudinal * longitudinal + lateral * lateral).sqrt();
        // With x = (C/μ)·v_s/v_ref the force is F = μ·N·x/(1 + x), and F/v_s = C·N/(v_ref +
        // (C/μ)·v_s).
        self.stiffness / (reference + self.steepness * slip)
    }

    /// Lowers a grip with which a step ended beyond the friction limit; whether it did.
    ///
    /// The speeds are those at the step's end; `compliance`, dt·R²/J, is by how much a force that is
    /// missing speeds the rim up in the step \[m/s/N\].
    #[inline]
    pub(super) fn judge(
        &self,
        grip: &mut f64,
        rim: f64,
        (ground, lateral): (f64, f64),
        compliance: f64,
    ) -> bool {
        let slip = rim - ground;
        let limit = LIMIT_SLACK * self.limit;
        // F_x² + F_y² ≤ (μ·N)²
        let square = slip * slip + lateral * lateral;
        if *grip * *grip * square <= limit * limit {
            return false;
        }
        // What the tyre cannot hold turns the wheel further: R·Δω = (dt·R²/J)·ΔF. A grip for the
        // slip without that would take many trials to come down.
        let surplus = slip * (*grip - self.limit / square.sqrt());
        let freed = rim + compliance * surplus;
        *grip = grip.min(self.grip(freed, ground, lateral));
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tyre() -> Tyre {
        Tyre::new(
            &TyreParams {
                friction: 0.8,
                creep: 150.0,
                rest_speed: 0.002,
            },
            10.0,
        )
    }

    #[test]
    fn small_slip_is_proportional() {
        // Slip ratio 1e-5: x = 1.9e-3, and 1/(1 + x) and v_0 = 2e-3 of 1 m/s each take 0.2 % off
        // C·N·s.
        let force = tyre().grip(1.0 + 1e-5, 1.0, 0.0) * 1e-5;
        assert!(
            (force / (150.0 * 10.0 * 1e-5) - 1.0).abs() < 5e-3,
            "{force}"
        );
    }

    #[test]
    fn large_slip_saturates_in_every_direction() {
        let tyre = tyre();
        for angle in 0..12 {
            let (y, x) = (f64::from(angle) * 0.5).sin_cos();
            let force = tyre.grip(2.0 * x, 0.0, 2.0 * y) * 2.0;
            // x/(1 + x) with x = 187 (all slip) or more (the reference falls when the slip is
            // sideways).
            assert!(force < tyre.limit && force > 0.99 * tyre.limit, "{force}");
        }
    }
}
