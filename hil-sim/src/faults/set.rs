//! What is wrong with a base at the moment, but for what only one kind of base has.

use super::{Fault, FaultyEncoder, MotorFault};
use crate::plant::{BridgeInput, Command, Plant};
use anyhow::{Result, bail};

/// The faults of encoders, motors and battery, between the plant and the peripherals of a base.
#[derive(Clone, Debug)]
pub struct FaultSet {
    /// Between the true encoders and the counters, left and right.
    pub encoders: [FaultyEncoder; 2],
    motors: [Option<MotorFault>; 2],
}

impl FaultSet {
    /// All is well with this plant. The seed determines which counts get lost, if any ever do.
    pub fn new(plant: &Plant, seed: u64) -> Self {
        let counts = plant.counts();
        Self {
            encoders: [0, 1].map(|wheel| FaultyEncoder::new(counts[wheel], seed, wheel)),
            motors: [None; 2],
        }
    }

    /// A fault begins, in place of what was wrong with the same part.
    ///
    /// # Errors
    /// If it is one of the serial line, of the parameter storage or of a motor controller, which are not here.
    pub fn inject(&mut self, fault: Fault, plant: &mut Plant) -> Result<()> {
        match fault {
            Fault::Encoder(side, fault) => {
                for wheel in side.wheels() {
                    self.encoders[wheel].inject(fault);
                }
            }
            Fault::Motor(side, fault) => {
                for wheel in side.wheels() {
                    self.motors[wheel] = Some(fault);
                    let power = match fault {
                        MotorFault::Weak(factor) => factor,
                        MotorFault::Open | MotorFault::Short => 1.0,
                    };
                    plant.set_power(wheel, power);
                }
            }
            Fault::Battery(volts) => plant.set_battery(Some(volts)),
            Fault::Controller(_) | Fault::LinkCut | Fault::FlashCut(_) => {
                bail!("this base cannot have `{fault}`")
            }
        }
        Ok(())
    }

    /// All is well again.
    pub fn clear(&mut self, plant: &mut Plant) {
        for encoder in &mut self.encoders {
            encoder.clear();
        }
        self.motors = [None; 2];
        for wheel in [0, 1] {
            plant.set_power(wheel, 1.0);
        }
        plant.set_battery(None);
    }

    /// What reaches the motors of what the bridges are told.
    pub fn bridges(&self, told: [BridgeInput; 2]) -> Command {
        let reached = |wheel: usize| match self.motors[wheel] {
            Some(MotorFault::Open) => BridgeInput::Open,
            Some(MotorFault::Short) => BridgeInput::Duty(0.0),
            Some(MotorFault::Weak(_)) | None => told[wheel],
        };
        Command::Bridges([0, 1].map(reached))
    }
}
