//! Faults that are put into a running image from outside: one instruction of it is overwritten in the emulated flash, until the next reset.

use super::program::{Flow, Program};
use anyhow::{Result, anyhow};
use rigless::emulator::{Hit, Host, Watch};
use rigless::session::Session;
use rigless::soc::Width;
use rigless::time::VirtualNanos;

/// `b .`: the processor goes nowhere any more.
const HANG: u16 = 0xE7FE;
/// `udf #0`: an instruction that is none, which ends in a HardFault.
const UNDEFINED: u16 = 0xDE00;

/// What goes wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// Idle gets stuck.
    IdleHangs,
    /// The control interrupt gets stuck at its first instruction.
    TickHangs,
    /// Idle runs into an instruction that is none.
    IdleFaults,
    /// The control interrupt does, at its first instruction.
    TickFaults,
}

/// A fault on its way into the image.
#[derive(Debug)]
pub(super) struct Injection {
    instruction: u16,
    /// The places of which the first that the core comes by is overwritten.
    places: Vec<u64>,
    /// What was overwritten: where, with what it was.
    done: Option<(u64, u64)>,
    at: Option<VirtualNanos>,
}

impl Injection {
    /// Prepares a fault for a program.
    pub(super) fn new(program: &Program, fault: Fault) -> Result<Self> {
        let places = match fault {
            Fault::TickHangs | Fault::TickFaults => vec![program.control()?.address],
            Fault::IdleHangs | Fault::IdleFaults => {
                let flow = program.flow(program.idle()?);
                let is_call = |(_, flow): &(u64, Flow)| matches!(flow, Flow::Call { .. });
                flow.iter()
                    .filter(|site| is_call(site))
                    .map(|(at, _)| *at)
                    .collect()
            }
        };
        if places.is_empty() {
            return Err(anyhow!("idle calls nothing: there is no place for a fault"));
        }
        Ok(Self {
            instruction: match fault {
                Fault::IdleHangs | Fault::TickHangs => HANG,
                Fault::IdleFaults | Fault::TickFaults => UNDEFINED,
            },
            places,
            done: None,
            at: None,
        })
    }

    /// What it must be told of.
    pub(super) fn watches(&self) -> impl Iterator<Item = Watch> {
        self.places.iter().copied().map(Watch::Instruction)
    }

    /// When the fault took place.
    pub(super) fn at(&self) -> Option<VirtualNanos> {
        self.at
    }

    /// The core is about to run a watched instruction: it shall find another one.
    pub(super) fn hit<B: rigless::machine::Board + ?Sized>(
        &mut self,
        session: &mut Session<B>,
        host: &mut dyn Host,
        hit: &Hit,
    ) -> Result<()> {
        if self.at.is_some() || !self.places.contains(&hit.address) {
            return Ok(());
        }
        for watch in self.watches() {
            session.unwatch(watch);
        }
        let before = host.read(hit.address, Width::W16)?;
        host.program(hit.address, Width::W16, self.instruction.into())?;
        self.done = Some((hit.address, before));
        self.at = Some(hit.at);
        Ok(())
    }

    /// A reset: the image is whole again.
    pub(super) fn restore(&mut self, host: &mut dyn Host) -> Result<()> {
        if let Some((address, before)) = self.done.take() {
            host.program(address, Width::W16, before)?;
        }
        Ok(())
    }
}
