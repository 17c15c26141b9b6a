//! The serial line of the rig, whole or cut.

use crate::peripherals::FakeSerial;
use embedded_hal_nb::serial::{ErrorType, Read, Write};
use std::convert::Infallible;
use vehicle_controller::time::Duration;

/// A serial port whose line can be cut. Nothing reaches either end then, and no end knows: the port goes on sending into the void at its pace.
#[derive(Debug, Default)]
pub struct FaultyLink {
    port: FakeSerial,
    cut: bool,
}

impl FaultyLink {
    /// Cuts the line, or mends it. What is on its way to the base when it is cut is lost.
    pub fn set_cut(&mut self, cut: bool) {
        self.cut = cut;
        if cut {
            self.port.to_base.clear();
        }
    }

    /// Puts bytes on the line to the base.
    pub fn send(&mut self, bytes: &[u8]) {
        if !self.cut {
            self.port.to_base.extend(bytes);
        }
    }

    /// Takes what has arrived from the base.
    pub fn receive(&mut self) -> Vec<u8> {
        self.port.from_base.drain(..).collect()
    }

    /// Bytes that have not reached the base yet.
    pub fn backlog(&self) -> usize {
        self.port.to_base.len()
    }

    /// Lets time pass.
    pub fn advance(&mut self, elapsed: Duration) {
        self.port.advance(elapsed);
    }
}

impl ErrorType for FaultyLink {
    type Error = Infallible;
}

impl Read<u8> for FaultyLink {
    fn read(&mut self) -> nb::Result<u8, Infallible> {
        self.port.read()
    }
}

impl Write<u8> for FaultyLink {
    fn write(&mut self, byte: u8) -> nb::Result<(), Infallible> {
        self.port.write(byte)?;
        if self.cut {
            self.port.from_base.pop_back();
        }
        Ok(())
    }

    fn flush(&mut self) -> nb::Result<(), Infallible> {
        self.port.flush()
    }
}
