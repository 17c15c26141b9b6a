//! The DC gear motor: winding, back-EMF and friction, all referred to the wheel's shaft.

use super::params::MotorParams;

/// A motor, without its state of motion. The winding's inductance is neglected: its time constant
/// is far below the mechanical one.
#[derive(Clone, Debug)]
pub(super) struct Motor {
    /// Torque and back-EMF constant \[N·m/A = V·s/rad\].
    pub emf_constant: f64,
    /// 1/R \[S\].
    conductance: f64,
    /// J_m \[kg·m²\].
    pub inertia: f64,
    /// b \[N·m·s/rad\].
    viscous: f64,
    /// Factor of the applied voltage, 0..1.
    pub strength: f64,
    /// What a fault leaves of that, 0..1.
    pub power: f64,
    /// Whether something holds the motor.
    pub blocked: bool,
    /// Whether the circuit is open.
    pub open: bool,
    coulomb: f64,
    /// T_s − T_c \[N·m\].
    rise: f64,
    /// 1/ω_s \[s/rad\].
    inverse_stribeck: f64,
}

impl Motor {
    /// A motor whose torque constant, resistance and dry friction are those of the parameters times
    /// these factors.
    pub(super) fn new(params: &MotorParams, factors: [f64; 3]) -> Self {
        let [constant, resistance, friction] = factors;
        let emf_constant = params.torque_constant * constant;
        let conductance = 1.0 / (params.resistance * resistance);
        Self {
            emf_constant,
            conductance,
            inertia: params.inertia,
            viscous: params.viscous,
            strength: 1.0,
            power: 1.0,
            blocked: false,
            open: false,
            coulomb: params.coulomb * friction,
            rise: (params.stiction - params.coulomb) * friction,
            inverse_stribeck: 1.0 / params.stribeck_speed,
        }
    }

    /// The part of the bridge's voltage that reaches the winding, 0..1.
    #[inline]
    pub(super) fn share(&self) -> f64 {
        self.strength * self.power
    }

    /// 1/R \[S\]; 0 while the circuit is open.
    #[inline]
    pub(super) fn conductance(&self) -> f64 {
        if self.open { 0.0 } else { self.conductance }
    }

    /// b + K²/R: what resists in proportion to the speed, at a given voltage \[N·m·s/rad\].
    #[inline]
    pub(super) fn damping(&self) -> f64 {
        self.viscous + self.emf_constant * self.emf_constant * self.conductance()
    }

    /// Current at a voltage and a speed \[A\].
    #[inline]
    pub(super) fn current(&self, voltage: f64, omega: f64) -> f64 {
        // i = (V − K·ω)/R
        (voltage - self.emf_constant * omega) * self.conductance()
    }

    /// Torque that a voltage makes when the motor stands \[N·m\].
    #[inline]
    pub(super) fn stall_torque(&self, voltage: f64) -> f64 {
        // T = K·V/R
        self.emf_constant * self.conductance() * voltage
    }

    /// Magnitude of the dry friction at a speed; at rest, the torque it can hold \[N·m\].
    #[inline]
    pub(super) fn dry_friction(&self, omega: f64) -> f64 {
        // T_f = T_c + (T_s − T_c)/(1 + (ω/ω_s)²)
        let ratio = omega * self.inverse_stribeck;
        self.coulomb + self.rise / (1.0 + ratio * ratio)
    }
}

#[cfg(test)]
mod tests {
    use super::super::robots;
    use super::*;

    #[test]
    fn stall_current_and_torque() {
        let motor = Motor::new(&robots::plain().motor, [1.0; 3]);
        // 12 V / 2.2 Ω and 0.545 N·m/A times that. Tolerance: rounding.
        assert!((motor.current(12.0, 0.0) - 12.0 / 2.2).abs() < 1e-12);
        assert!((motor.stall_torque(12.0) - 0.545 * 12.0 / 2.2).abs() < 1e-12);
    }

    #[test]
    fn an_open_circuit_neither_drives_nor_brakes() {
        let mut motor = Motor::new(&robots::plain().motor, [1.0; 3]);
        motor.open = true;
        assert_eq!(motor.current(12.0, 5.0), 0.0);
        assert_eq!(motor.stall_torque(12.0), 0.0);
        assert_eq!(motor.damping(), robots::plain().motor.viscous);
    }

    #[test]
    fn friction_falls_from_stiction_to_coulomb() {
        let motor = Motor::new(&robots::plain().motor, [1.0; 3]);
        // By definition at rest and at the Stribeck speed; tolerance: rounding.
        assert!((motor.dry_friction(0.0) - 0.095).abs() < 1e-12);
        assert!((motor.dry_friction(-0.1) - 0.0825).abs() < 1e-12);
        // (ω_s/ω)² = 1e-6 of the rise of 0.025 N·m remains at 100 rad/s.
        assert!((motor.dry_friction(100.0) - 0.07).abs() < 3e-8);
    }
}
