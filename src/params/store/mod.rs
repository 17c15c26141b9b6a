//! Parameters in flash: sets that survive, and are whole after power has failed at any instant.
//!
//! Two sectors, each a row of slots (see [`slot`](self) in the source for their words). A save takes the next free slot of the sector with the newest set;
//! when there is none, it erases the other sector and takes the first slot there, so the newest set is never erased. A sector is written to only after an
//! erase that was seen to end. Each set is complete, under keys made of the parameters' names: a firmware with other parameters reads it all the same.
//!
//! ```text
//!              start_save                  same as the newest
//!     idle ──────────────▶ begin ────────────────────────────────▶ idle
//!                            │ └──── no free slot ───▶ erase ──┐
//!                            ▼                                 ▼
//!                          fill, a word a step ◀───────────────┘
//!                            ▼
//!                          check ──▶ commit ──▶ seal ─────────────▶ idle
//! ```
//!
//! Nothing here waits: each [`Store::poll`] does a step that takes at most some 0.2 ms, and an erase is asked after, not waited for.
//!
//! Wear: with slots of 1 KiB in sectors of 16 KiB every 16th save erases a sector, and each sector is erased at every 32nd: flash that endures 10 000
//! erases endures 320 000 saves. A save that changes nothing writes nothing.

mod flash;
mod slot;

pub use flash::{Blocking, Flash};

use super::Params;
use super::restore::Restored;
use slot::{Mark, SLOT_BYTES, Slot, crc_at};

/// Why a set was not saved or loaded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum StoreError {
    /// Nothing was ever saved.
    Empty,
    /// Something is in the flash, but no set that is whole.
    Damaged,
    /// The flash refused, or does not hold what was written.
    Flash,
}

impl core::fmt::Display for StoreError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(self.text())
    }
}
impl core::error::Error for StoreError {}

impl StoreError {
    /// A text for people.
    #[must_use]
    pub const fn text(self) -> &'static str {
        match self {
            Self::Empty => "nothing is stored",
            Self::Damaged => "what is stored is damaged",
            Self::Flash => "the flash does not hold what was written",
        }
    }
}

/// The newest set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Newest {
    slot: Slot,
    sequence: u32,
}

/// What is to be done next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Job {
    Idle,
    Begin,
    /// This slot is the first of the sector that is being erased.
    Erase(Slot),
    /// The next word.
    Fill(Slot, u32),
    Check(Slot),
    Commit(Slot),
    Seal(Slot),
}

/// The parameter store on a flash of two sectors.
#[derive(Clone, Debug)]
pub struct Store<F> {
    flash: F,
    newest: Result<Newest, StoreError>,
    /// A newer one has decayed.
    outdated: bool,
    job: Job,
}

impl<F: Flash> Store<F> {
    const SLOTS_PER_SECTOR: u32 = {
        assert!(4 % F::WRITE_SIZE == 0 && 4 % F::READ_SIZE == 0);
        let slots = F::ERASE_SIZE as u32 / SLOT_BYTES;
        assert!(slots > 0);
        slots
    };
    const SLOTS: u32 = 2 * Self::SLOTS_PER_SECTOR;

    /// Finds the newest set. If the last save was cut off, this decides for good whether it counts, which takes a few words to write.
    pub fn open(flash: F) -> Self {
        let mut store = Self {
            flash,
            newest: Err(StoreError::Empty),
            outdated: false,
            job: Job::Idle,
        };
        store.newest = store.find();
        store
    }

    /// The flash.
    pub fn flash(&self) -> &F {
        &self.flash
    }

    /// The flash, to meddle with.
    pub fn flash_mut(&mut self) -> &mut F {
        &mut self.flash
    }

    /// The flash, when the store is no longer needed.
    pub fn into_flash(self) -> F {
        self.flash
    }

    /// The newest set, with `defaults` for what is not in it or cannot be used.
    ///
    /// # Errors
    /// [`StoreError`] if there is none, or only an older one.
    pub fn load(&mut self, defaults: &Params) -> Result<Restored, StoreError> {
        let mut restored = Restored::new(defaults);
        self.load_into(&mut restored, defaults)?;
        if self.outdated {
            return Err(StoreError::Damaged);
        }
        Ok(restored)
    }

    /// What a base begins with: the newest set that is whole, or the defaults.
    #[inline(never)]
    pub fn load_or_defaults(&mut self, defaults: &Params) -> Restored {
        let mut restored = Restored::new(defaults);
        let loaded = self.load_into(&mut restored, defaults);
        restored.lost = self.outdated;
        if let Err(error) = loaded {
            restored.params = *defaults;
            // An empty store is as it should be.
            restored.lost = error != StoreError::Empty;
        }
        restored
    }

    fn load_into(&mut self, restored: &mut Restored, defaults: &Params) -> Result<(), StoreError> {
        let mut newest = self.newest?.slot;
        if !newest.is_whole(&mut self.flash)? {
            // It has decayed since it was found. There may still be an older one.
            self.newest = self.find();
            newest = self.newest?.slot;
            self.outdated = true;
        }
        newest.entries(&mut self.flash, |key, value| restored.take(key, value))?;
        restored.resolve(defaults);
        Ok(())
    }

    /// Asks for a save. [`Store::poll`] does it, and tells how it ended.
    pub fn start_save(&mut self) {
        self.job = Job::Begin;
    }

    /// Does a step of a save of `params`, the same in every step; the result when it has ended. What has not ended well has changed nothing.
    ///
    /// # Errors
    /// [`StoreError::Flash`].
    pub fn poll(&mut self, params: &Params) -> Option<Result<(), StoreError>> {
        match self.step(params) {
            Ok(Job::Idle) if self.job == Job::Idle => None,
            Ok(job) => {
                self.job = job;
                (job == Job::Idle).then_some(Ok(()))
            }
            Err(error) => {
                if let Job::Fill(slot, _) | Job::Check(slot) | Job::Commit(slot) = self.job {
                    // If this fails too, there is no more to be done.
                    let _ = slot.drop_set(&mut self.flash);
                }
                self.job = Job::Idle;
                Some(Err(error))
            }
        }
    }

    /// One step; gives the next.
    fn step(&mut self, params: &Params) -> Result<Job, StoreError> {
        let sequence = self.newest.map_or(0, |newest| newest.sequence);
        let flash = &mut self.flash;
        Ok(match self.job {
            Job::Idle => Job::Idle,
            Job::Begin => {
                if self.newest.is_err() {
                    // What could not be read may still be there.
                    self.newest = self.find();
                    if self.newest == Err(StoreError::Flash) {
                        return Err(StoreError::Flash);
                    }
                    return self.next_slot();
                }
                if let Ok(Newest { slot, sequence }) = self.newest
                    && !self.outdated
                    && slot.holds(flash, sequence, params)?
                    && slot.is_whole(flash)?
                {
                    return Ok(Job::Idle);
                }
                self.next_slot()?
            }
            Job::Erase(slot) => match flash.poll_erase() {
                Ok(()) => Job::Fill(slot, 0),
                Err(nb::Error::WouldBlock) => self.job,
                Err(nb::Error::Other(_)) => return Err(StoreError::Flash),
            },
            Job::Fill(slot, at) => {
                slot.write(flash, at, sequence.wrapping_add(1), params)?;
                let next = at + 1;
                if next < crc_at(params) {
                    Job::Fill(slot, next)
                } else {
                    Job::Check(slot)
                }
            }
            Job::Check(slot) => {
                if !slot.holds(flash, sequence.wrapping_add(1), params)? {
                    return Err(StoreError::Flash);
                }
                slot.write_crc(flash, params)?;
                Job::Commit(slot)
            }
            Job::Commit(slot) => {
                if !slot.is_whole(flash)? {
                    return Err(StoreError::Flash);
                }
                slot.commit(flash)?;
                self.newest = Ok(Newest {
                    slot,
                    sequence: sequence.wrapping_add(1),
                });
                self.outdated = false;
                Job::Seal(slot)
            }
            Job::Seal(slot) => {
                // The set is valid. Should this fail, the next start does it.
                let _ = slot.seal(flash);
                Job::Idle
            }
        })
    }

    fn sector(slot: Slot) -> u32 {
        slot.0 / Self::SLOTS_PER_SECTOR
    }

    /// The slots of a sector behind this one.
    fn behind(slot: Slot) -> impl Iterator<Item = Slot> {
        let ends = (slot.0 + 1).next_multiple_of(Self::SLOTS_PER_SECTOR);
        (slot.0 + 1..ends).map(Slot)
    }

    /// Where the next set goes.
    fn next_slot(&mut self) -> Result<Job, StoreError> {
        const FIRST: Slot = Slot(0);
        let second = Self::SLOTS_PER_SECTOR;
        let (last, other) = match self.newest {
            Ok(Newest { slot, .. }) if slot.0 < second => (Some(slot), second),
            Ok(Newest { slot, .. }) => (Some(slot), FIRST.0),
            // The first save of all was cut off, behind its erase.
            Err(StoreError::Empty) if FIRST.mark(&mut self.flash)? == Mark::Unfinished => {
                (Some(FIRST), FIRST.0)
            }
            Err(_) => (None, FIRST.0),
        };
        for free in last.into_iter().flat_map(Self::behind) {
            if free.is_free(&mut self.flash)? {
                return Ok(Job::Fill(free, 0));
            }
        }
        self.flash
            .start_erase(other * SLOT_BYTES)
            .map_err(|_| StoreError::Flash)?;
        Ok(Job::Erase(Slot(other)))
    }

    /// Looks for the newest set, and settles what a cut left in doubt.
    fn find(&mut self) -> Result<Newest, StoreError> {
        let mut newest = Err(StoreError::Empty);
        // The later slots first: they have the higher numbers, and the CRC of few sets has to be computed.
        for slot in (0..Self::SLOTS).rev().map(Slot) {
            match slot.mark(&mut self.flash)? {
                Mark::None => {}
                // What cannot be settled now can still be read, and is settled at the next start.
                Mark::Unfinished => drop(slot.settle(&mut self.flash, false)),
                Mark::Committed(sequence) => {
                    // In a sector the later slot is the newer one, whatever has become of the numbers between.
                    let is_older = |newest: Newest| {
                        let together = Self::sector(slot) == Self::sector(newest.slot);
                        together || !is_newer(sequence, newest.sequence)
                    };
                    if newest.is_ok_and(is_older) {
                        continue;
                    }
                    if slot.is_whole(&mut self.flash)? {
                        newest = Ok(Newest { slot, sequence });
                    } else if newest.is_err() {
                        newest = Err(StoreError::Damaged);
                    }
                }
            }
        }
        self.outdated = false;
        if let Ok(Newest { slot, .. }) = newest {
            let _ = slot.settle(&mut self.flash, true);
            // What was committed behind it has decayed. In the other sector nobody knows what was there, and what the cut of an erase has left.
            for later in Self::behind(slot) {
                let flash = &mut self.flash;
                self.outdated |= matches!(later.mark(flash)?, Mark::Committed(_))
                    || (later.is_foreign(flash)? && !later.is_dropped(flash)?);
            }
        }
        if newest == Err(StoreError::Empty) {
            for slot in (0..Self::SLOTS).map(Slot) {
                if slot.is_foreign(&mut self.flash)? {
                    return Err(StoreError::Damaged);
                }
            }
        }
        newest
    }
}

/// Sequence numbers wrap.
fn is_newer(a: u32, b: u32) -> bool {
    a.wrapping_sub(b).cast_signed() > 0
}
