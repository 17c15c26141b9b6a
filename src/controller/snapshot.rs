//! What is known after a tick.

use super::{Estimator, State};
use crate::math::Sum;
use crate::supervisor::Fault;
use crate::time::Instant;
use crate::vehicle::Wheel;
use crate::vehicle::gains::OFFSETS;

/// One axis in a snapshot; m or rad, and seconds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AxisSnapshot {
    /// State of the axis machine.
    pub state: State,
    /// Displacement since the last command, S or α.
    pub displacement: Sum,
    /// Reference minus displacement.
    pub error: f32,
    /// Measured speed.
    pub speed: f32,
    /// Reference speed.
    pub reference_speed: f32,
    /// Measured acceleration.
    pub acceleration: f32,
}

/// All that is known after a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Snapshot {
    /// The tick's instant.
    pub time: Instant,
    /// The interface's last request that was carried out.
    pub(super) ticket: u32,
    /// The interface's last emergency stop that was carried out.
    pub(super) emergency_ticket: u32,
    /// Odometry.
    pub estimator: Estimator,
    /// Translation.
    pub translation: AxisSnapshot,
    /// Rotation.
    pub rotation: AxisSnapshot,
    /// Wheels, left first.
    pub wheels: [Wheel; 2],
    /// The steering angle, where a vehicle can have one.
    pub(super) steering: [f32; OFFSETS],
    /// Battery voltage, filtered, V.
    pub supply: f32,
    /// Motor currents, left first, A, where they are measured.
    pub currents: [Option<f32>; 2],
    /// Motor power is on.
    pub enabled: bool,
    /// The latched fault.
    pub fault: Option<Fault>,
    /// The fault's cause persists.
    pub fault_persists: bool,
}

impl AxisSnapshot {
    /// s_ref or α_ref, counted as the displacement is.
    #[must_use]
    pub fn reference(&self) -> f64 {
        self.displacement.to_f64() + f64::from(self.error)
    }
}

impl Snapshot {
    /// Nothing is known but the estimate.
    pub(super) fn new(estimator: &Estimator) -> Self {
        Self {
            time: Instant::from_ticks(0),
            ticket: 0,
            emergency_ticket: 0,
            estimator: *estimator,
            translation: AxisSnapshot::default(),
            rotation: AxisSnapshot::default(),
            wheels: [Wheel::default(); 2],
            steering: [0.0; OFFSETS],
            supply: 0.0,
            currents: [None; 2],
            enabled: false,
            fault: None,
            fault_persists: false,
        }
    }

    /// The steering angle as measured, rad; 0 for a vehicle that does not steer.
    #[must_use]
    pub fn steering(&self) -> f32 {
        self.steering.first().copied().unwrap_or_default()
    }

    /// True unless both axes hold and the wheels stand (below 1 mm/s).
    #[must_use]
    pub fn is_moving(&self) -> bool {
        const STANDSTILL: f32 = 1e-3;
        self.translation.state != State::Hold
            || self.rotation.state != State::Hold
            || self.wheels.iter().any(|w| w.speed.abs() > STANDSTILL)
    }
}
