//! Names of places and landmarks.

use core::ops::Deref;

/// The longest name, bytes.
const LONGEST: usize = 15;

/// The name of a place or of a landmark: up to 15 bytes.
#[derive(Clone, Copy, Default, PartialEq, Eq)]
pub struct Name {
    bytes: [u8; LONGEST],
    length: u8,
}

/// Longer than 15 bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct TooLong;

impl core::fmt::Display for TooLong {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("a name has at most 15 bytes")
    }
}
impl core::error::Error for TooLong {}

impl TryFrom<&str> for Name {
    type Error = TooLong;

    fn try_from(text: &str) -> Result<Self, TooLong> {
        let mut name = Self {
            bytes: [0; LONGEST],
            length: text.len() as u8,
        };
        let room = name.bytes.get_mut(..text.len()).ok_or(TooLong)?;
        for (byte, letter) in room.iter_mut().zip(text.bytes()) {
            *byte = letter;
        }
        Ok(name)
    }
}

impl Deref for Name {
    type Target = str;

    fn deref(&self) -> &str {
        let bytes = self.bytes.get(..usize::from(self.length));
        // It was made of text.
        core::str::from_utf8(bytes.unwrap_or_default()).unwrap_or_default()
    }
}

impl core::fmt::Debug for Name {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        core::fmt::Debug::fmt(&**self, f)
    }
}

#[cfg(feature = "defmt")]
impl defmt::Format for Name {
    fn format(&self, f: defmt::Formatter<'_>) {
        defmt::write!(f, "{=str}", self);
    }
}
