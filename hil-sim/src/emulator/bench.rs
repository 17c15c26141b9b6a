//! What can be done to an emulated base on the bench: its buttons, its lights, its flash, and what is counted, broken and measured in it.

use super::base::ImageBase;
use super::count::{Counter, Counts};
use super::fault::{Fault, Injection};
use anyhow::{Result, anyhow};
use rigless::time::VirtualNanos;

/// What has come of a fault; all times in seconds since power-on.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// When it took place.
    pub injected: Option<f64>,
    /// Since when both motors are off, as their drivers see it.
    pub motors_off: Option<f64>,
    /// The resets so far.
    pub resets: Vec<f64>,
}

impl ImageBase {
    /// Presses the blue button, or lets it go.
    ///
    /// # Errors
    /// If the emulator has given up.
    pub fn press(&mut self, pressed: bool) -> Result<()> {
        self.core
            .hold(move |held| held.session.board_mut().press(held.stop.at, pressed))
    }

    /// Presses the reset button; what is on the wires stays there.
    ///
    /// # Errors
    /// If the emulator has given up.
    pub fn reset(&mut self) -> Result<()> {
        self.core.hold(|held| {
            held.observer.expect_reset();
            let (at, count) = (held.stop.at, held.stop.instruction_count);
            held.session.reset_by_pin(at, count, held.host);
        })
    }

    /// Whether the green, the blue and the red light are on.
    ///
    /// # Errors
    /// If the emulator has given up.
    pub fn leds(&self) -> Result<[bool; 3]> {
        self.core.hold(|held| held.session.board().leds())
    }

    /// What is in the flash.
    ///
    /// # Errors
    /// If there is no flash at the address.
    pub fn flash(&self, address: u64, length: usize) -> Result<Vec<u8>> {
        let bytes = self.core.hold(move |held| {
            let flash = &held.session.board().part.flash;
            flash.content(address, length).map(<[u8]>::to_vec)
        })?;
        bytes.ok_or_else(|| anyhow!("there is no flash at {address:#010x}"))
    }

    /// One more reset may happen: without this it ends the run.
    ///
    /// # Errors
    /// If the emulator has given up.
    pub fn expect_reset(&mut self) -> Result<()> {
        self.core.hold(|held| held.observer.expect_reset())
    }

    /// Counts the instructions of the control interrupt from here on; what each of its parts takes too, if `by_part`, which is slow.
    ///
    /// # Errors
    /// If the image has no such interrupt.
    pub fn count(&mut self, by_part: bool) -> Result<()> {
        let counter = Counter::new(&self.program, by_part)?;
        self.core.hold(move |held| {
            for watch in counter.watches() {
                held.session.watch(watch);
            }
            held.observer.counter = Some(counter);
        })
    }

    /// What was counted.
    ///
    /// # Errors
    /// If the emulator has given up.
    pub fn counts(&self) -> Result<Counts> {
        let counts = self.core.hold(|held| {
            let counter = held.observer.counter.as_ref();
            counter.map(|counter| counter.counts().clone())
        })?;
        counts.ok_or_else(|| anyhow!("nothing was counted"))
    }

    /// Lets something go wrong, as soon as the core comes by a place where it can. A reset is expected to follow.
    ///
    /// # Errors
    /// If the image has no such place.
    pub fn inject(&mut self, fault: Fault) -> Result<()> {
        let injection = Injection::new(&self.program, fault)?;
        self.core.hold(move |held| {
            for watch in injection.watches() {
                held.session.watch(watch);
            }
            held.observer.expect_reset();
            held.observer.overflows = fault == Fault::IdleOverflows;
            held.observer.injection = Some(injection);
        })
    }

    /// What has come of it.
    ///
    /// # Errors
    /// If the emulator has given up.
    pub fn outcome(&self) -> Result<Outcome> {
        let seconds = |at: VirtualNanos| at.0 as f64 * 1e-9;
        self.core.hold(move |held| {
            let injection = held.observer.injection.as_ref();
            let resets = held.session.resets().iter();
            Outcome {
                injected: injection.and_then(Injection::at).map(seconds),
                motors_off: held.observer.off_since().map(seconds),
                resets: resets.map(|reset| seconds(reset.at)).collect(),
            }
        })
    }
}
