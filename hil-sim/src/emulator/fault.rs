//! Faults that are put into a running image from outside: an instruction or two are overwritten in the emulated flash, until the next reset.

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
/// `push {r0-r7, lr}` and back to it: the stack grows without end.
const PUSH: u16 = 0xB5FF;
const AGAIN: u16 = 0xE7FD;

/// What goes wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// Idle gets stuck.
    IdleHangs,
    /// The control interrupt gets stuck at its first instruction.
    TickHangs,
    /// Idle pushes on its stack for ever.
    IdleOverflows,
    /// Idle runs into an instruction that is none.
    IdleFaults,
    /// The control interrupt does, at its first instruction.
    TickFaults,
}

/// A fault on its way into the image.
#[derive(Debug)]
pub(super) struct Injection {
    instructions: &'static [u16],
    /// The places of which the first that the core comes by is overwritten.
    places: Vec<u64>,
    /// What was overwritten: where, with what it was.
    done: Vec<(u64, u64)>,
    at: Option<VirtualNanos>,
}

impl Injection {
    /// Prepares a fault for a program.
    pub(super) fn new(program: &Program, fault: Fault) -> Result<Self> {
        let places = match fault {
            Fault::TickHangs | Fault::TickFaults => vec![program.control()?.address],
            Fault::IdleHangs | Fault::IdleFaults | Fault::IdleOverflows => {
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
            instructions: match fault {
                Fault::IdleHangs | Fault::TickHangs => &[HANG],
                Fault::IdleFaults | Fault::TickFaults => &[UNDEFINED],
                // A call, which is what it replaces, has room for two.
                Fault::IdleOverflows => &[PUSH, AGAIN],
            },
            places,
            done: Vec::new(),
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
        for (address, instruction) in (hit.address..).step_by(2).zip(self.instructions) {
            self.done.push((address, host.read(address, Width::W16)?));
            host.program(address, Width::W16, (*instruction).into())?;
        }
        self.at = Some(hit.at);
        Ok(())
    }

    /// A reset: the image is whole again.
    pub(super) fn restore(&mut self, host: &mut dyn Host) -> Result<()> {
        for (address, before) in self.done.drain(..) {
            host.program(address, Width::W16, before)?;
        }
        Ok(())
    }
}
