//! A NOR flash of two small sectors whose power fails in the midst of a write or an erase.

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};
use vehicle_controller::params::store::Flash;

/// Bytes of a sector: two sets find room.
const SECTOR: usize = 2048;
const WORDS: usize = 2 * SECTOR / 4;
const BLANK: u32 = u32::MAX;
/// An erase takes so many polls.
const ERASE_POLLS: u32 = 3;

/// Power is off.
#[derive(Clone, Copy, Debug)]
pub struct Off;

impl NorFlashError for Off {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

/// The flash.
#[derive(Clone, Debug)]
pub struct FuzzFlash {
    words: [u32; WORDS],
    /// Written, or begun to be, since the erase.
    begun: [bool; WORDS],
    /// Bits that read either way, anew at each start.
    unfirm: [u32; WORDS],
    any_unfirm: bool,
    /// The sector that is being erased, and how many polls that still takes.
    erasing: Option<(usize, u32)>,
    /// So many steps are left until power fails: a byte of a write or a poll of an erase.
    power: Option<u32>,
    off: bool,
    chance: u64,
}

impl FuzzFlash {
    /// An erased one; `seed` decides how doubtful bits read.
    pub fn new(seed: u8) -> Self {
        Self {
            words: [BLANK; WORDS],
            begun: [false; WORDS],
            unfirm: [0; WORDS],
            any_unfirm: false,
            erasing: None,
            power: None,
            off: false,
            chance: u64::from(seed) << 32 | 0x9E37_79B9,
        }
    }

    /// Power fails after so many steps.
    pub fn cut_after(&mut self, steps: u32) {
        self.power = Some(steps);
    }

    /// True if power has failed.
    pub fn is_off(&self) -> bool {
        self.off
    }

    /// Power is on again.
    pub fn power_on(&mut self) {
        if let Some((sector, _)) = self.erasing.take() {
            // Some bits are erased, some not yet, and none is firm.
            for at in sector * WORDS / 2..(sector + 1) * WORDS / 2 {
                self.unfirm[at] = u32::MAX;
                self.begun[at] = true;
            }
            self.any_unfirm = true;
        }
        if core::mem::take(&mut self.any_unfirm) {
            for at in 0..WORDS {
                let unfirm = self.unfirm[at];
                if unfirm != 0 {
                    self.words[at] = self.words[at] & !unfirm | self.doubt(self.words[at]) & unfirm;
                    self.any_unfirm = true;
                }
            }
        }
        self.off = false;
        self.power = None;
    }

    /// Changes bits that nobody has written: they have decayed.
    pub fn decay(&mut self, at: usize, bits: u32) {
        self.words[at % WORDS] ^= bits;
    }

    /// All zeros, all ones, as it was, or anything.
    fn doubt(&mut self, was: u32) -> u32 {
        // xorshift64.
        self.chance ^= self.chance << 13;
        self.chance ^= self.chance >> 7;
        self.chance ^= self.chance << 17;
        match self.chance & 3 {
            0 => 0,
            1 => u32::MAX,
            2 => was,
            _ => (self.chance >> 32) as u32,
        }
    }

    /// Takes steps; how many were taken before power failed, if it did.
    fn pass(&mut self, steps: u32) -> Result<(), u32> {
        match &mut self.power {
            Some(left) if *left < steps => {
                self.off = true;
                Err(*left)
            }
            Some(left) => {
                *left -= steps;
                Ok(())
            }
            None => Ok(()),
        }
    }
}

impl ErrorType for FuzzFlash {
    type Error = Off;
}

impl ReadNorFlash for FuzzFlash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Off> {
        if self.off {
            return Err(Off);
        }
        assert!(self.erasing.is_none(), "a read while it erases");
        for (at, byte) in (offset as usize..).zip(bytes) {
            *byte = self.words[at / 4].to_le_bytes()[at % 4];
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        2 * SECTOR
    }
}

impl NorFlash for FuzzFlash {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = SECTOR;

    fn erase(&mut self, from: u32, _: u32) -> Result<(), Off> {
        self.start_erase(from)
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Off> {
        if self.off {
            return Err(Off);
        }
        let at = offset as usize / 4;
        let [a, b, c, d] = *bytes else {
            panic!("{} bytes at {offset}", bytes.len());
        };
        let value = u32::from_le_bytes([a, b, c, d]);
        assert!(offset.is_multiple_of(4) && self.erasing.is_none());
        assert!(
            !self.begun[at] || value == 0,
            "word {at} is written a second time"
        );
        if let Err(passed) = self.pass(4) {
            if passed > 0 {
                self.begun[at] = true;
                self.unfirm[at] |= self.words[at] & !value;
                self.any_unfirm = true;
            }
            return Err(Off);
        }
        self.begun[at] = true;
        self.unfirm[at] = 0;
        self.words[at] &= value;
        Ok(())
    }
}

impl Flash for FuzzFlash {
    fn start_erase(&mut self, offset: u32) -> Result<(), Off> {
        if self.off {
            return Err(Off);
        }
        assert!((offset as usize).is_multiple_of(SECTOR));
        self.erasing = Some((offset as usize / SECTOR, ERASE_POLLS));
        Ok(())
    }

    fn poll_erase(&mut self) -> nb::Result<(), Off> {
        let Some((sector, left)) = self.erasing else {
            return Ok(());
        };
        if self.off || self.pass(1).is_err() {
            return Err(nb::Error::Other(Off));
        }
        if left > 0 {
            self.erasing = Some((sector, left - 1));
            return Err(nb::Error::WouldBlock);
        }
        self.erasing = None;
        let half = sector * WORDS / 2..(sector + 1) * WORDS / 2;
        self.words[half.clone()].fill(BLANK);
        self.begun[half.clone()].fill(false);
        self.unfirm[half].fill(0);
        Ok(())
    }
}
