//! The interpreter on a serial port, through `embedded_hal_nb`.

use super::Interpreter;
use embedded_hal_nb::serial::{Read, Write};
use nb::Error;

/// What stands for a byte that the port lost or damaged: it makes its line `bad-byte`, so that half a command is never obeyed.
const DAMAGED: u8 = 0;

impl Interpreter {
    /// Takes in what the port has received, all of it: among it may be what stops the base.
    pub fn receive_from(&mut self, port: &mut impl Read<u8>) {
        loop {
            match port.read() {
                Ok(byte) => self.receive(byte),
                Err(Error::WouldBlock) => return,
                Err(Error::Other(_)) => self.receive(DAMAGED),
            }
        }
    }

    /// Gives the port what it can send.
    pub fn transmit_to(&mut self, port: &mut impl Write<u8>) {
        while let Some(byte) = self.output.front() {
            match port.write(*byte) {
                Err(Error::WouldBlock) => return,
                // A byte that the port refuses for good is lost: the line's check will tell.
                Ok(()) | Err(Error::Other(_)) => self.output.pop_front(),
            };
        }
    }
}
