//! The flash of the parameters: sectors 12 and 13, at the start of bank 2. While bank 2 is busy, code runs on from bank 1.
//!
//! The HAL's driver waits for an erase, which takes a second.

use core::ptr;
use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};
use stm32f4xx_hal::pac;
use vehicle_controller::params::store;

/// Where bank 2 begins.
const BASE: usize = 0x0810_0000;
const SECTOR_BYTES: usize = 16 * 1024;
const CAPACITY: usize = 2 * SECTOR_BYTES;
/// What SNB has for sector 12 (RM0090 section 3.9.8); 13 follows it.
const SECTOR_12: u8 = 0b1_0000;
const KEYS: [u32; 2] = [0x4567_0123, 0xCDEF_89AB];
/// EOP, OPERR, WRPERR, PGAERR, PGPERR, PGSERR, RDERR: cleared by ones.
const FLAGS: u32 = 0x1F3;
/// The same without the first: nothing went wrong without them.
const ERRORS: u32 = 0x1F2;
/// Programming a word takes 16 µs, 100 at most (DS9405 table 48); a turn of the loop takes several cycles of 6 ns.
const PATIENCE: u32 = 20_000;

/// Why the flash refuses.
#[derive(Clone, Copy, Debug, defmt::Format)]
pub enum FlashError {
    /// Outside, or not a whole word.
    Place,
    /// The interface has set an error flag, or does not come to an end.
    Refused,
}

impl NorFlashError for FlashError {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Self::Place => NorFlashErrorKind::OutOfBounds,
            Self::Refused => NorFlashErrorKind::Other,
        }
    }
}

/// The two sectors. It is unlocked only while something is written.
pub struct ParamFlash(pac::FLASH);

impl ParamFlash {
    /// The flash, with nobody else to write to it.
    pub fn new(registers: pac::FLASH) -> Self {
        Self(registers)
    }

    fn is_busy(&self) -> bool {
        self.0.sr().read().bsy().bit_is_set()
    }

    fn unlock(&self) -> Result<(), FlashError> {
        if self.is_busy() {
            return Err(FlashError::Refused);
        }
        // The keys given twice would lock it until the next reset.
        if self.0.cr().read().lock().bit_is_set() {
            for key in KEYS {
                // SAFETY: these are the keys.
                self.0.keyr().write(|w| unsafe { w.key().bits(key) });
            }
        }
        // SAFETY: flags are cleared by ones, and the rest is read-only.
        self.0.sr().write(|w| unsafe { w.bits(FLAGS) });
        Ok(())
    }

    /// Locks it again, and tells whether all went well.
    fn lock(&self) -> Result<(), FlashError> {
        let errors = self.0.sr().read().bits() & ERRORS;
        self.0.cr().write(|w| w.lock().set_bit());
        if errors == 0 {
            Ok(())
        } else {
            Err(FlashError::Refused)
        }
    }

    fn program(&self, at: usize, word: u32) -> Result<(), FlashError> {
        // SAFETY: it lies in the sectors and is aligned; what is programmed there is no code and no variable of Rust's.
        unsafe { ptr::write_volatile((BASE + at) as *mut u32, word) };
        // The interface is asked only after it has taken the word.
        cortex_m::asm::dsb();
        let mut patience = PATIENCE;
        while self.is_busy() {
            patience -= 1;
            if patience == 0 {
                return Err(FlashError::Refused);
            }
        }
        Ok(())
    }

    /// What was erased may still be in the data cache, which can only be emptied while it is off.
    fn empty_cache(&self) {
        let cache = self.0.acr();
        cache.modify(|_, w| w.dcen().clear_bit());
        cache.modify(|_, w| w.dcrst().set_bit());
        cache.modify(|_, w| w.dcrst().clear_bit());
        cache.modify(|_, w| w.dcen().set_bit());
    }
}

/// Where a range of whole words begins, if it is inside.
fn place(offset: u32, length: usize) -> Result<usize, FlashError> {
    let at = offset as usize;
    if at.is_multiple_of(4) && length.is_multiple_of(4) && at <= CAPACITY && length <= CAPACITY - at
    {
        Ok(at)
    } else {
        Err(FlashError::Place)
    }
}

impl ErrorType for ParamFlash {
    type Error = FlashError;
}

impl ReadNorFlash for ParamFlash {
    const READ_SIZE: usize = 4;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashError> {
        let at = place(offset, bytes.len())?;
        for (at, chunk) in (at..).step_by(4).zip(bytes.chunks_exact_mut(4)) {
            // SAFETY: it lies in the sectors and is aligned; volatile, as it changes without any store of Rust's.
            let word = unsafe { ptr::read_volatile((BASE + at) as *const u32) };
            for (byte, read) in chunk.iter_mut().zip(word.to_le_bytes()) {
                *byte = read;
            }
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        CAPACITY
    }
}

impl NorFlash for ParamFlash {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = SECTOR_BYTES;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashError> {
        for offset in (from..to).step_by(SECTOR_BYTES) {
            store::Flash::start_erase(self, offset)?;
            loop {
                match store::Flash::poll_erase(self) {
                    Ok(()) => break,
                    Err(nb::Error::WouldBlock) => {}
                    Err(nb::Error::Other(error)) => return Err(error),
                }
            }
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        let at = place(offset, bytes.len())?;
        self.unlock()?;
        self.0.cr().write(|w| w.psize().psize32().pg().set_bit());
        let mut done = Ok(());
        for (at, chunk) in (at..).step_by(4).zip(bytes.chunks_exact(4)) {
            if let [a, b, c, d] = *chunk {
                done = done.and(self.program(at, u32::from_le_bytes([a, b, c, d])));
            }
        }
        done.and(self.lock())
    }
}

impl store::Flash for ParamFlash {
    fn start_erase(&mut self, offset: u32) -> Result<(), FlashError> {
        let sector = place(offset, SECTOR_BYTES)? / SECTOR_BYTES;
        self.unlock()?;
        let number = SECTOR_12 + sector as u8;
        let control = self.0.cr();
        // SAFETY: 16 and 17 are the sectors 12 and 13.
        control.write(|w| unsafe { w.psize().psize32().ser().set_bit().snb().bits(number) });
        control.modify(|_, w| w.strt().set_bit());
        Ok(())
    }

    fn poll_erase(&mut self) -> nb::Result<(), FlashError> {
        if self.is_busy() {
            return Err(nb::Error::WouldBlock);
        }
        let done = self.lock();
        self.empty_cache();
        done.map_err(nb::Error::Other)
    }
}
