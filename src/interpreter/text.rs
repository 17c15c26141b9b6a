//! A line under construction.

use super::crc;
use super::number::{self, Sink};
use heapless::Vec;

/// Longest line, without its end.
pub const MAX_LINE: usize = 255;
/// A line and its end.
const CAPACITY: usize = MAX_LINE + 2;
/// What must stay free for `*hhhh`.
const CHECK: usize = 5;

/// A line of text of bounded length. What does not fit is left out: replies are laid out so that everything fits.
#[derive(Clone, Debug, Default)]
pub struct Text {
    bytes: Vec<u8, CAPACITY>,
}

impl Sink for Text {
    fn byte(&mut self, byte: u8) {
        if self.bytes.len() < MAX_LINE - CHECK {
            let _ = self.bytes.push(byte);
        }
    }
}

impl Text {
    /// The bytes so far.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// The present length, to cut back to.
    pub fn mark(&self) -> usize {
        self.bytes.len()
    }

    /// Takes back what came after a mark.
    pub fn cut(&mut self, mark: usize) {
        self.bytes.truncate(mark);
    }

    /// True if something may have been left out.
    pub fn is_full(&self) -> bool {
        self.bytes.len() >= MAX_LINE - CHECK
    }

    /// Appends text.
    pub fn str(&mut self, s: &str) -> &mut Self {
        for byte in s.bytes() {
            self.byte(byte);
        }
        self
    }

    /// Appends a blank and a word.
    pub fn word(&mut self, s: &str) -> &mut Self {
        self.byte(b' ');
        self.str(s)
    }

    /// Appends a blank and a number with fixed decimals.
    pub fn fixed(&mut self, x: f64, decimals: u8) -> &mut Self {
        self.byte(b' ');
        number::fixed(self, x, decimals);
        self
    }

    /// Appends a blank and a number with 6 significant digits.
    pub fn scientific(&mut self, x: f64) -> &mut Self {
        self.byte(b' ');
        number::scientific(self, x);
        self
    }

    /// Appends a blank and an integer.
    pub fn integer(&mut self, n: i64) -> &mut Self {
        self.byte(b' ');
        number::integer(self, n);
        self
    }

    /// Appends a blank and the shortest decimal form of a number.
    pub fn shortest(&mut self, x: f32) -> &mut Self {
        self.byte(b' ');
        number::shortest(self, x);
        self
    }

    /// Ends the line, with a check if wanted, and gives its bytes.
    pub fn finish(&mut self, check: bool) -> &[u8] {
        if check {
            let crc = crc::of(&self.bytes);
            let _ = self.bytes.push(b'*');
            for digit in crc::hex(crc) {
                let _ = self.bytes.push(digit);
            }
        }
        let _ = self.bytes.extend_from_slice(b"\r\n");
        &self.bytes
    }
}
