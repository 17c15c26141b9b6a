//! How a motion depends on what it was measured by.

use super::Twist;

/// Derivatives of (ΔS, Δα) with respect to N wheels' displacements and to the steering angle that was measured.
///
/// Where the reference point moves along θ + α with α ≠ 0, a steering error also turns the path itself: the column [−Δy, Δx, 0]ᵀ of theory section 5,
/// which is the estimator's.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Jacobian<const N: usize> {
    /// ∂ΔS/∂S and ∂Δα/∂S (1/m) for each wheel, left before right.
    pub by_wheel: [Twist; N],
    /// ∂ΔS/∂φ (m/rad) and ∂Δα/∂φ.
    pub by_steering: Twist,
}
