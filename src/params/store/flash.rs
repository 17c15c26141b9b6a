//! What the store asks of a flash.

use embedded_storage::nor_flash::{ErrorType, NorFlash, ReadNorFlash};

/// A NOR flash whose erase is begun and then asked after: an erase takes a second, and whoever waits for it has other things to do.
///
/// The store writes single words of 4 bytes, each once after an erase, with one exception: a word may be written to zero whatever it holds, also when an
/// earlier write of it was cut off. Every NOR flash can do that, those with error correction included.
pub trait Flash: NorFlash {
    /// Begins to erase the sector ([`NorFlash::ERASE_SIZE`] bytes) that begins at `offset`.
    ///
    /// # Errors
    /// The flash's own, if it refuses.
    fn start_erase(&mut self, offset: u32) -> Result<(), Self::Error>;

    /// [`nb::Error::WouldBlock`] until the erase has ended.
    ///
    /// # Errors
    /// The flash's own, if the erase has failed.
    fn poll_erase(&mut self) -> nb::Result<(), Self::Error>;
}

/// Any NOR flash, for those who can wait: it erases when the erase is begun.
#[derive(Clone, Copy, Debug)]
pub struct Blocking<F>(pub F);

impl<F: ErrorType> ErrorType for Blocking<F> {
    type Error = F::Error;
}

impl<F: ReadNorFlash> ReadNorFlash for Blocking<F> {
    const READ_SIZE: usize = F::READ_SIZE;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Self::Error> {
        self.0.read(offset, bytes)
    }

    fn capacity(&self) -> usize {
        self.0.capacity()
    }
}

impl<F: NorFlash> NorFlash for Blocking<F> {
    const WRITE_SIZE: usize = F::WRITE_SIZE;
    const ERASE_SIZE: usize = F::ERASE_SIZE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Self::Error> {
        self.0.erase(from, to)
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Self::Error> {
        self.0.write(offset, bytes)
    }
}

impl<F: NorFlash> Flash for Blocking<F> {
    fn start_erase(&mut self, offset: u32) -> Result<(), Self::Error> {
        self.0.erase(offset, offset + F::ERASE_SIZE as u32)
    }

    fn poll_erase(&mut self) -> nb::Result<(), Self::Error> {
        Ok(())
    }
}
