//! What is seen of a base after a tick, whatever its controller runs on.

use crate::base::Base;
use crate::plant::BridgeInput;
use crate::rig::Rig;
use anyhow::Result;
use vehicle_controller::controller::{AxisSnapshot, Snapshot, State};
use vehicle_controller::supervisor::Fault;

/// An axis.
#[derive(Clone, Copy, Debug, Default)]
pub struct AxisSight {
    /// m/s or rad/s.
    pub speed: f64,
    /// m/s or rad/s.
    pub reference: f64,
    /// s_ref − S, m or rad.
    pub error: f64,
    /// It is in HOLD.
    pub holds: bool,
}

/// What is seen after a tick.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sight {
    /// The controller's clock, µs.
    pub clock: u64,
    /// What is seen may be of an instant that is later than the clock by so much, s.
    pub blur: f64,
    /// Every number that the controller knows is one.
    pub is_finite: bool,
    /// Translation and rotation.
    pub axes: [AxisSight; 2],
    /// Speeds of the wheels as the controller has them, m/s.
    pub wheels: [f64; 2],
    /// x, y (m), θ (rad).
    pub pose: [f64; 3],
    /// xx, xy, xθ, yy, yθ, θθ; m and rad.
    pub covariance: [f64; 6],
    /// The battery as the controller has it, V.
    pub supply: f64,
    /// What is latched.
    pub fault: Option<Fault>,
    /// Duties on the wires, −1 to 1; 0 if a bridge is disabled.
    pub duties: [f64; 2],
}

impl Sight {
    /// A motor gets voltage.
    pub fn is_driven(&self) -> bool {
        self.duties != [0.0; 2]
    }
}

/// A base that can be looked into.
pub trait Watched: Base {
    /// What is seen now.
    ///
    /// # Errors
    /// If what the controller knows cannot be read.
    fn sight(&self) -> Result<Sight>;
}

impl Watched for Rig {
    fn sight(&self) -> Result<Sight> {
        let snapshot = self.snapshot();
        let estimate = snapshot.estimator.present();
        let c = &estimate.covariance;
        let axis = |axis: &AxisSnapshot| AxisSight {
            speed: f64::from(axis.speed),
            reference: f64::from(axis.reference_speed),
            error: f64::from(axis.error),
            holds: axis.state == State::Hold,
        };
        let pose = [estimate.pose.x, estimate.pose.y, estimate.pose.theta];
        let covariance = [c.m11, c.m12, c.m13, c.m22, c.m23, c.m33];
        Ok(Sight {
            blur: 0.0,
            clock: snapshot.time.ticks(),
            is_finite: are_finite(&pose) && are_finite(&covariance) && is_finite(snapshot),
            axes: [axis(&snapshot.translation), axis(&snapshot.rotation)],
            wheels: snapshot.wheels.map(|wheel| f64::from(wheel.speed)),
            pose,
            covariance,
            supply: f64::from(snapshot.supply),
            fault: snapshot.fault,
            duties: self.bridges().map(|bridge| match bridge {
                BridgeInput::Duty(duty) => duty,
                BridgeInput::Open => 0.0,
            }),
        })
    }
}

fn are_finite(numbers: &[f64]) -> bool {
    numbers.iter().all(|number| number.is_finite())
}

/// Everything in a snapshot but the estimate.
fn is_finite(snapshot: &Snapshot) -> bool {
    let axis = |axis: &AxisSnapshot| {
        axis.displacement.to_f64().is_finite()
            && [
                axis.error,
                axis.speed,
                axis.reference_speed,
                axis.acceleration,
            ]
            .iter()
            .all(|number| number.is_finite())
    };
    let wheels = &snapshot.wheels;
    axis(&snapshot.translation)
        && axis(&snapshot.rotation)
        && wheels
            .iter()
            .all(|wheel| wheel.speed.is_finite() && wheel.duty.is_finite())
        && snapshot.supply.is_finite()
        && snapshot
            .currents
            .iter()
            .flatten()
            .all(|current| current.is_finite())
}

#[cfg(feature = "emulator")]
impl Watched for crate::emulator::ImageBase {
    fn sight(&self) -> Result<Sight> {
        let row = self.known()?;
        let hold = State::Hold.name();
        let pose = [row.est_x, row.est_y, row.est_theta];
        let covariance = [row.cxx, row.cxy, row.cxt, row.cyy, row.cyt, row.ctt];
        let numbers = [
            row.s,
            row.s_ref,
            row.v_s,
            row.v_s_ref,
            row.alpha,
            row.alpha_ref,
            row.v_alpha,
            row.v_alpha_ref,
            row.left_speed,
            row.right_speed,
            row.left_duty,
            row.right_duty,
            row.battery,
        ];
        Ok(Sight {
            // Idle may be in the midst of copying a snapshot: then some numbers are of the tick after the clock's.
            blur: 1e-3,
            clock: (row.t * 1e6).round() as u64,
            is_finite: are_finite(&pose) && are_finite(&covariance) && are_finite(&numbers),
            axes: [
                AxisSight {
                    speed: row.v_s,
                    reference: row.v_s_ref,
                    error: row.s_ref - row.s,
                    holds: row.move_state == hold,
                },
                AxisSight {
                    speed: row.v_alpha,
                    reference: row.v_alpha_ref,
                    error: row.alpha_ref - row.alpha,
                    holds: row.turn_state == hold,
                },
            ],
            wheels: [row.left_speed, row.right_speed],
            pose,
            covariance,
            supply: row.battery,
            fault: Fault::ALL
                .iter()
                .copied()
                .find(|fault| fault.name() == row.fault),
            duties: self
                .bridges()
                .map(|bridge| if bridge.is_off() { 0.0 } else { bridge.duty }),
        })
    }
}
