//! A fake of the flash that parameters are stored in: two sectors, words that are written once, and power that fails at any byte.

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use vehicle_controller::params::store::Flash;

/// What an erased word reads.
const BLANK: u32 = u32::MAX;
/// Bytes of a word.
const WORD: usize = 4;

/// Why the flash refuses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FlashError {
    /// Power is off.
    Off,
    /// There is no such place, or it is not one of a whole word.
    Place,
    /// A word was written for the second time since it was erased, and not to zero.
    Twice,
    /// It erases.
    Busy,
}

impl NorFlashError for FlashError {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Self::Place => NorFlashErrorKind::OutOfBounds,
            _ => NorFlashErrorKind::Other,
        }
    }
}

/// What was done to the flash.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Wear {
    /// Bytes that were written.
    pub written: u64,
    /// How often each sector was erased.
    pub erased: [u64; 2],
    /// What was tried that no flash allows.
    pub offences: u64,
}

/// A word with bits that were being changed when power failed.
#[derive(Clone, Copy, Debug)]
struct Weak {
    word: usize,
    /// The bits that are not firm; they were ones.
    bits: u32,
}

#[derive(Clone, Copy, Debug)]
struct Erase {
    sector: usize,
    steps_left: u64,
}

/// A NOR flash of two sectors of `SECTOR` bytes.
///
/// A write or an erase that power failure cuts off leaves each bit that it was changing as it was, or changed, by chance; and at each further power-on by
/// chance again, until the sector is erased.
#[derive(Clone, Debug)]
pub struct FakeFlash<const SECTOR: usize = 16_384> {
    words: Vec<u32>,
    /// Words that were written, or begun to be written, since they were erased.
    begun: Vec<bool>,
    weak: Vec<Weak>,
    random: ChaCha8Rng,
    erase_steps: u64,
    erase: Option<Erase>,
    /// Power fails after so many further bytes or steps of an erase.
    cut: Option<u64>,
    off: bool,
    wear: Wear,
}

impl<const SECTOR: usize> FakeFlash<SECTOR> {
    /// An erased flash. An erase takes this many polls.
    pub fn new(seed: u64, erase_steps: u64) -> Self {
        let words = 2 * SECTOR / WORD;
        Self {
            words: vec![BLANK; words],
            begun: vec![false; words],
            weak: Vec::new(),
            random: ChaCha8Rng::seed_from_u64(seed),
            erase_steps,
            erase: None,
            cut: None,
            off: false,
            wear: Wear::default(),
        }
    }

    /// What it holds.
    pub fn bytes(&self) -> Vec<u8> {
        self.words
            .iter()
            .flat_map(|word| word.to_le_bytes())
            .collect()
    }

    /// Puts bytes into it, as a programming tool does. What does not fit is left out.
    pub fn place(&mut self, offset: usize, bytes: &[u8]) {
        for (at, byte) in (offset..2 * SECTOR).zip(bytes) {
            let mut word = self.words[at / WORD].to_le_bytes();
            word[at % WORD] = *byte;
            self.words[at / WORD] = u32::from_le_bytes(word);
            self.begun[at / WORD] = self.words[at / WORD] != BLANK;
        }
    }

    /// What was done to it.
    pub fn wear(&self) -> Wear {
        self.wear
    }

    /// True while it erases.
    pub fn is_erasing(&self) -> bool {
        self.erase.is_some()
    }

    /// Power fails after this many further bytes have been written, or this many polls of an erase, both counted together: in the midst of what comes next.
    pub fn cut_after(&mut self, bytes: u64) {
        self.cut = Some(bytes);
    }

    /// True once power has failed.
    pub fn is_off(&self) -> bool {
        self.off
    }

    /// Power comes back: what is not firm reads anew.
    pub fn power_on(&mut self) {
        self.cut_off_erase();
        self.off = false;
        self.cut = None;
        let weak = std::mem::take(&mut self.weak);
        for Weak { word, bits } in &weak {
            let written = self.chance() & bits;
            self.words[*word] = (self.words[*word] | bits) & !written;
        }
        self.weak = weak;
    }

    /// Some bits, none or all of them.
    fn chance(&mut self) -> u32 {
        match self.random.random_range(0..4) {
            0 => 0,
            1 => u32::MAX,
            _ => self.random.random(),
        }
    }

    /// Lets bytes or steps pass; false if power fails before all of them, and after how many.
    fn pass(&mut self, amount: u64) -> Result<(), u64> {
        match &mut self.cut {
            Some(left) if *left < amount => {
                self.off = true;
                Err(*left)
            }
            Some(left) => {
                *left -= amount;
                Ok(())
            }
            None => Ok(()),
        }
    }

    fn write_word(&mut self, at: usize, value: u32) -> Result<(), FlashError> {
        if self.begun[at] && value != 0 {
            self.wear.offences += 1;
            return Err(FlashError::Twice);
        }
        self.begun[at] = true;
        let passed = self.pass(WORD as u64);
        if let Err(bytes) = passed {
            // Before its first byte nothing shows yet, at its last everything does; in neither case is it firm.
            let written = match bytes {
                0 => 0,
                1 | 2 => self.random.random(),
                _ => u32::MAX,
            };
            let unfirm = self.unfirm(at);
            let bits = (self.words[at] | unfirm) & !value;
            self.weak.retain(|weak| weak.word != at);
            self.weak.push(Weak { word: at, bits });
            self.words[at] &= !(bits & written);
            return Err(FlashError::Off);
        }
        self.weak.retain(|weak| weak.word != at);
        self.words[at] &= value;
        self.wear.written += WORD as u64;
        Ok(())
    }

    /// The bits of a word that are not firm.
    fn unfirm(&self, at: usize) -> u32 {
        let weak = self.weak.iter().find(|weak| weak.word == at);
        weak.map_or(0, |weak| weak.bits)
    }

    fn sector(sector: usize) -> std::ops::Range<usize> {
        let words = SECTOR / WORD;
        sector * words..(sector + 1) * words
    }

    /// Whatever was being erased is half erased: some words are, some are not, some are neither.
    fn cut_off_erase(&mut self) {
        let Some(Erase { sector, .. }) = self.erase.take() else {
            return;
        };
        for at in Self::sector(sector) {
            let bits = !self.words[at] | self.unfirm(at);
            self.weak.retain(|weak| weak.word != at);
            if bits != 0 {
                self.weak.push(Weak { word: at, bits });
            }
        }
    }

    fn refuse(&mut self, error: FlashError) -> FlashError {
        self.wear.offences += 1;
        error
    }

    /// Whether something can be done at all.
    fn ready(&mut self) -> Result<(), FlashError> {
        if self.off {
            return Err(FlashError::Off);
        }
        if self.erase.is_some() {
            return Err(self.refuse(FlashError::Busy));
        }
        Ok(())
    }

    fn place_of(&mut self, offset: u32, length: usize) -> Result<usize, FlashError> {
        let at = offset as usize;
        if !at.is_multiple_of(WORD) || !length.is_multiple_of(WORD) || at + length > 2 * SECTOR {
            return Err(self.refuse(FlashError::Place));
        }
        Ok(at / WORD)
    }
}

impl<const SECTOR: usize> ErrorType for FakeFlash<SECTOR> {
    type Error = FlashError;
}

impl<const SECTOR: usize> ReadNorFlash for FakeFlash<SECTOR> {
    const READ_SIZE: usize = WORD;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashError> {
        self.ready()?;
        let at = self.place_of(offset, bytes.len())?;
        for (chunk, word) in bytes.chunks_exact_mut(WORD).zip(&self.words[at..]) {
            chunk.copy_from_slice(&word.to_le_bytes());
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        2 * SECTOR
    }
}

impl<const SECTOR: usize> NorFlash for FakeFlash<SECTOR> {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = SECTOR;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashError> {
        for offset in (from..to).step_by(SECTOR) {
            self.start_erase(offset)?;
            while let Err(error) = self.poll_erase() {
                if let nb::Error::Other(error) = error {
                    return Err(error);
                }
            }
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        self.ready()?;
        let at = self.place_of(offset, bytes.len())?;
        for (at, chunk) in (at..).zip(bytes.chunks_exact(WORD)) {
            let mut word = [0; WORD];
            word.copy_from_slice(chunk);
            self.write_word(at, u32::from_le_bytes(word))?;
        }
        Ok(())
    }
}

impl<const SECTOR: usize> Flash for FakeFlash<SECTOR> {
    fn start_erase(&mut self, offset: u32) -> Result<(), FlashError> {
        self.ready()?;
        let at = self.place_of(offset, SECTOR)?;
        if !(offset as usize).is_multiple_of(SECTOR) {
            return Err(self.refuse(FlashError::Place));
        }
        let sector = at * WORD / SECTOR;
        self.erase = Some(Erase {
            sector,
            steps_left: self.erase_steps,
        });
        Ok(())
    }

    fn poll_erase(&mut self) -> nb::Result<(), FlashError> {
        if self.off {
            return Err(nb::Error::Other(FlashError::Off));
        }
        let Some(mut erase) = self.erase else {
            return Ok(());
        };
        if self.pass(1).is_err() {
            self.cut_off_erase();
            return Err(nb::Error::Other(FlashError::Off));
        }
        erase.steps_left = erase.steps_left.saturating_sub(1);
        self.erase = Some(erase);
        if erase.steps_left > 0 {
            return Err(nb::Error::WouldBlock);
        }
        self.erase = None;
        let words = Self::sector(erase.sector);
        self.words[words.clone()].fill(BLANK);
        self.begun[words.clone()].fill(false);
        self.weak.retain(|weak| !words.contains(&weak.word));
        self.wear.erased[erase.sector] += 1;
        Ok(())
    }
}
