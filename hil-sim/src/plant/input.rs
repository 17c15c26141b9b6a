//! What acts on the plant in a step.

/// What drives the wheels: the first and the second motor. Those of a differential drive and of a
/// car turn the left and the right wheel; a synchro drive's drive and steer; a tricycle has only the
/// first one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Command {
    /// What the bridges are told.
    Bridges([BridgeInput; 2]),
    /// Speeds of the rims \[m/s\] which ideal wheels follow at once, without slip: no force acts on
    /// such a base. The second of a synchro drive is the rate of the heading times its lever; a car
    /// takes the mean of the two.
    Speed([f64; 2]),
}

/// What one bridge is told.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BridgeInput {
    /// A duty cycle, −1..1. Zero shorts the motor.
    Duty(f64),
    /// The driver is not enabled: no current can flow, the motor is free.
    Open,
}

impl Command {
    /// Both bridges enabled, with these duty cycles.
    pub fn duty([left, right]: [f64; 2]) -> Self {
        Self::Bridges([BridgeInput::Duty(left), BridgeInput::Duty(right)])
    }
}

/// A force from outside on the body.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Push {
    /// Along the heading, through the reference point \[N\].
    pub force: f64,
    /// About the vertical axis, counterclockwise \[N·m\].
    pub torque: f64,
}

/// What acts on the robot during a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Input {
    /// What drives the wheels.
    pub command: Command,
    /// What pushes the body; without effect under [`Command::Speed`].
    pub push: Push,
    /// Width of the steering servo's pulses \[s\]. None: there are none, and the servo stays where
    /// it is.
    pub steering: Option<f64>,
}
