//! The far end of the serial line: what waits to be sent, and what has come. The port itself paces the bytes.

use rigless::chip::Timeline;
use rigless::chip::uart::Peer;
use rigless::snapshot::Store;
use rigless::time::VirtualNanos;
use std::collections::VecDeque;

/// A serial line.
#[derive(Debug, Default)]
pub struct Line {
    /// The base has said something, so it listens.
    up: bool,
    /// Nothing reaches either end.
    cut: bool,
    to_base: VecDeque<u8>,
    from_base: Vec<u8>,
}

impl Line {
    /// Puts bytes on the line; they follow each other without a gap. At power-on nothing is sent before the base has said that it is there, as nobody
    /// can be quick enough to.
    pub fn send(&mut self, bytes: &[u8]) {
        if !self.cut {
            self.to_base.extend(bytes);
        }
    }

    /// Cuts the line, or mends it. What is on its way to the base when it is cut is lost.
    pub fn set_cut(&mut self, cut: bool) {
        self.cut = cut;
        if cut {
            self.to_base.clear();
        }
    }

    /// Takes the bytes that have come.
    pub fn receive(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.from_base)
    }

    /// Bytes that have not begun their way yet.
    #[must_use]
    pub fn backlog(&self) -> usize {
        self.to_base.len()
    }
}

/// A run starts from power-on; it is not saved.
impl Store for Line {}

impl Peer for Line {
    fn receive(&mut self, word: u16, _context: &mut Timeline<'_, '_>) {
        self.up = true;
        if !self.cut {
            self.from_base.push(word as u8);
        }
    }

    fn transmit(&mut self, _now: VirtualNanos) -> Option<u16> {
        let word = self.up.then(|| self.to_base.pop_front()).flatten();
        word.map(u16::from)
    }
}
