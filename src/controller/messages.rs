//! What goes in and out of the control loop besides snapshots: configuration, actions, inputs, events.

use super::estimator::Correction;
use super::{AxisCommand, AxisConfig, Noise, Sensing};
use crate::supervisor::{self, Fault, Place};
use crate::time::Duration;
use crate::vehicle::Calibration;
use heapless::Vec;

/// How many requests can wait for a tick.
pub const REQUESTS: usize = 4;

/// As many requests as there is room for wait already. Nothing has changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct NoRoom;

impl core::fmt::Display for NoRoom {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("four requests wait for a tick already")
    }
}
impl core::error::Error for NoRoom {}

/// Everything that parameters decide, in SI units and ready to use: the control loop converts nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Config<C> {
    /// Nominal period of the tick.
    pub period: Duration,
    /// The translation axis, m.
    pub translation: AxisConfig,
    /// The rotation axis, rad.
    pub rotation: AxisConfig,
    /// Deceleration of Stop, m/s².
    pub stop_acceleration: f32,
    /// Angular deceleration of Stop, rad/s².
    pub stop_turn_acceleration: f32,
    /// Random odometric error.
    pub noise: Noise,
    /// What is known of the vehicle's gains.
    pub calibration: Calibration,
    /// An encoder count means something else from here on: what the gains have done so far, others have done.
    pub anew: bool,
    /// What the board's inputs mean.
    pub sensing: Sensing,
    /// What the supervisor holds the base to.
    pub supervision: supervisor::Config,
    /// The vehicle's own.
    pub vehicle: C,
}

/// What the controller is asked to do. The next tick does it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Action<C> {
    /// Replace the translation's command.
    Move(AxisCommand),
    /// Replace the rotation's command.
    Turn(AxisCommand),
    /// Decelerate both axes and hold.
    Stop,
    /// Nothing but a sign of life; every other action is one, too.
    Live,
    /// Motors off at once, fault `estop` latched.
    EStop,
    /// Clear the latched fault.
    ClearFault,
    /// Motor power on.
    Enable,
    /// Stop, then motor power off.
    Disable,
    /// Correct the estimate.
    Correct(Correction),
    /// Take new parameters over.
    Configure(Config<C>),
}

impl<C> Action<C> {
    /// True if it may move the base, or let it.
    pub(super) const fn may_move(&self) -> bool {
        matches!(
            self,
            Self::Move(_) | Self::Turn(_) | Self::ClearFault | Self::Enable
        )
    }
}

/// An action on its way to the controller: from an [`Interface`](super::Interface), which wants to know when it is done, or from anybody (`Action::into`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Request<C> {
    pub(super) action: Action<C>,
    pub(super) ticket: Option<u32>,
}

impl<C> Request<C> {
    /// What is to be done.
    #[must_use]
    pub const fn action(&self) -> &Action<C> {
        &self.action
    }
}

impl<C> From<Action<C>> for Request<C> {
    fn from(action: Action<C>) -> Self {
        Self {
            action,
            ticket: None,
        }
    }
}

/// Why the vehicle was stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum StopReason {
    /// The Stop command.
    Command,
    /// The Disable command.
    Disable,
    /// A fault; the motors are off now.
    Fault,
}

impl StopReason {
    /// The name that the protocol uses.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Command => "command",
            Self::Disable => "disable",
            Self::Fault => "fault",
        }
    }
}

/// Something that happened in a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Event {
    /// A move reached its target; the residual in m.
    MoveDone(f32),
    /// A turn reached its target; the residual in rad.
    TurnDone(f32),
    /// The vehicle rests after a stop.
    Stopped(StopReason),
    /// A fault was latched, and where.
    Fault(Fault, Place),
}

/// The events of one tick.
pub type Events = Vec<Event, { REQUESTS + 6 }>;
