//! A slot: room for one set, and the words that say what has become of it.
//!
//! ```text
//!     word  0          claim    0: the slot is taken
//!           1          format   magic number
//!           2          sequence number, the newest set has the highest (it wraps)
//!           3          n        how many entries follow
//!           4 …        entries  key, value: n times
//!           4 + 2n     CRC-32 of words 1 to 3 + 2n
//!           …          blank
//!           253        commit   not blank: the set is whole
//!           254        seal     not blank: the commit before it is written through
//!           255        drop     not blank: it came to nothing
//! ```
//!
//! They are written in this order. Of a word whose writing was cut off any bit may read either way, and at the next start the other way; all before it
//! are firm, and all behind it untouched. So the doubtful word is one of these:
//!
//! * claim: the slot is taken, or is claimed again, by writing the same zero;
//! * an entry or the CRC: the commit was never begun, and never will be;
//! * commit: the set is there or not, as it reads; whoever reads it first settles that ([`Slot::settle`]) by a seal or a drop;
//! * seal: the commit is firm.
//!
//! A seal outweighs a drop, which outweighs a commit.

use super::{Flash, StoreError};
use crate::params::{Id, Params};

/// Bytes of a slot.
pub(super) const SLOT_BYTES: u32 = 1024;
/// What an erased word reads.
const BLANK: u32 = u32::MAX;
/// Marks the format and its version.
const FORMAT: u32 = u32::from_le_bytes(*b"VCP1");

const CLAIM_AT: u32 = 0;
const FORMAT_AT: u32 = 1;
const SEQUENCE_AT: u32 = 2;
const COUNT_AT: u32 = 3;
const ENTRIES_AT: u32 = 4;
const COMMIT_AT: u32 = 253;
const SEAL_AT: u32 = 254;
const DROP_AT: u32 = 255;
/// As many entries as there is room for.
const MAX_ENTRIES: u32 = (COMMIT_AT - 1 - ENTRIES_AT) / 2;
const _: () = assert!(
    Id::COUNT as u32 <= MAX_ENTRIES,
    "a set does not fit its slot"
);

/// Where the CRC of a set that is written comes; what is before it is [written](Slot::write) from the parameters.
pub(super) fn crc_at(params: &Params) -> u32 {
    ENTRIES_AT + 2 * params.count() as u32
}

/// CRC-32/ISO-HDLC, least significant bit first, four bits at a time: a third of the code of the crate's, and four times as fast.
static NIBBLES: [u32; 16] = {
    const POLYNOMIAL: u32 = 0xEDB8_8320;
    let mut table = [0; 16];
    let mut nibble = 0;
    while nibble < 16 {
        let mut crc = nibble;
        let mut bit = 0;
        while bit < 4 {
            crc = (crc >> 1) ^ (POLYNOMIAL * (crc & 1));
            bit += 1;
        }
        table[nibble as usize] = crc;
        nibble += 1;
    }
    table
};

/// What a slot says of itself, before its set is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mark {
    /// No set is in it.
    None,
    /// A set was begun and never committed.
    Unfinished,
    /// A set with this sequence number.
    Committed(u32),
}

/// A slot by its number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Slot(pub(super) u32);

impl Slot {
    fn read<F: Flash>(self, flash: &mut F, at: u32) -> Result<u32, StoreError> {
        let mut bytes = [0; 4];
        flash
            .read(self.0 * SLOT_BYTES + at * 4, &mut bytes)
            .map_err(|_| StoreError::Flash)?;
        Ok(u32::from_le_bytes(bytes))
    }

    fn write_word<F: Flash>(self, flash: &mut F, at: u32, word: u32) -> Result<(), StoreError> {
        flash
            .write(self.0 * SLOT_BYTES + at * 4, &word.to_le_bytes())
            .map_err(|_| StoreError::Flash)
    }

    /// What it says of itself.
    pub(super) fn mark<F: Flash>(self, flash: &mut F) -> Result<Mark, StoreError> {
        if self.read(flash, FORMAT_AT)? != FORMAT {
            return Ok(Mark::None);
        }
        let sealed = self.read(flash, SEAL_AT)? != BLANK;
        let committed = self.read(flash, COMMIT_AT)? != BLANK;
        let dropped = self.read(flash, DROP_AT)? != BLANK;
        Ok(if sealed || (committed && !dropped) {
            Mark::Committed(self.read(flash, SEQUENCE_AT)?)
        } else {
            Mark::Unfinished
        })
    }

    /// True if something is in it that no save has left there, whole or cut off.
    pub(super) fn is_foreign<F: Flash>(self, flash: &mut F) -> Result<bool, StoreError> {
        let format = self.read(flash, FORMAT_AT)?;
        if format == FORMAT {
            return Ok(false);
        }
        // The format may be half written; then nothing has come after it.
        let mut foreign = format & FORMAT != FORMAT;
        for at in SEQUENCE_AT..DROP_AT {
            foreign |= self.read(flash, at)? != BLANK;
        }
        Ok(foreign)
    }

    /// True if it was said of it that it came to nothing.
    pub(super) fn is_dropped<F: Flash>(self, flash: &mut F) -> Result<bool, StoreError> {
        Ok(self.read(flash, DROP_AT)? == 0)
    }

    /// True if a set can be written into it: nothing is in it, nor has an erase that was cut off left anything.
    pub(super) fn is_free<F: Flash>(self, flash: &mut F) -> Result<bool, StoreError> {
        for at in CLAIM_AT..=DROP_AT {
            if self.read(flash, at)? != BLANK {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// True if its CRC is right.
    pub(super) fn is_whole<F: Flash>(self, flash: &mut F) -> Result<bool, StoreError> {
        let count = self.read(flash, COUNT_AT)?;
        if count > MAX_ENTRIES {
            return Ok(false);
        }
        let end = ENTRIES_AT + 2 * count;
        Ok(self.crc(flash, end)? == self.read(flash, end)?)
    }

    fn crc<F: Flash>(self, flash: &mut F, end: u32) -> Result<u32, StoreError> {
        let mut crc = u32::MAX;
        for at in FORMAT_AT..end {
            crc ^= self.read(flash, at)?;
            for _ in 0..u32::BITS / 4 {
                let nibble = NIBBLES.get(crc as usize & 15).copied();
                crc = (crc >> 4) ^ nibble.unwrap_or_default();
            }
        }
        Ok(!crc)
    }

    /// Makes sure that a committed set stays so, and one that is not committed too, however the word reads at which its writing was cut off.
    pub(super) fn settle<F: Flash>(self, flash: &mut F, committed: bool) -> Result<(), StoreError> {
        if committed {
            if self.read(flash, SEAL_AT)? != 0 {
                self.write_word(flash, COMMIT_AT, 0)?;
                self.write_word(flash, SEAL_AT, 0)?;
            }
        } else if self.read(flash, DROP_AT)? != 0 {
            self.drop_set(flash)?;
        }
        Ok(())
    }

    /// Marks what was written as come to nothing.
    pub(super) fn drop_set<F: Flash>(self, flash: &mut F) -> Result<(), StoreError> {
        self.write_word(flash, DROP_AT, 0)
    }

    /// Calls `take` with each key and value of a whole set.
    pub(super) fn entries<F: Flash>(
        self,
        flash: &mut F,
        mut take: impl FnMut(u32, f32),
    ) -> Result<(), StoreError> {
        let count = self.read(flash, COUNT_AT)?.min(MAX_ENTRIES);
        for entry in 0..count {
            let at = ENTRIES_AT + 2 * entry;
            let key = self.read(flash, at)?;
            take(key, f32::from_bits(self.read(flash, at + 1)?));
        }
        Ok(())
    }

    /// Writes one of the words before the CRC.
    pub(super) fn write<F: Flash>(
        self,
        flash: &mut F,
        at: u32,
        sequence: u32,
        params: &Params,
    ) -> Result<(), StoreError> {
        self.write_word(flash, at, word(at, sequence, params))
    }

    /// True if all before the CRC is as it was written. All of it is read in one go: parameters that changed in the meantime make no mixture.
    pub(super) fn holds<F: Flash>(
        self,
        flash: &mut F,
        sequence: u32,
        params: &Params,
    ) -> Result<bool, StoreError> {
        for at in FORMAT_AT..crc_at(params) {
            if self.read(flash, at)? != word(at, sequence, params) {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Writes the CRC of what is there.
    pub(super) fn write_crc<F: Flash>(
        self,
        flash: &mut F,
        params: &Params,
    ) -> Result<(), StoreError> {
        let end = crc_at(params);
        let crc = self.crc(flash, end)?;
        self.write_word(flash, end, crc)
    }

    /// Makes the set valid.
    pub(super) fn commit<F: Flash>(self, flash: &mut F) -> Result<(), StoreError> {
        self.write_word(flash, COMMIT_AT, 0)?;
        if self.read(flash, COMMIT_AT)? == 0 {
            Ok(())
        } else {
            Err(StoreError::Flash)
        }
    }

    /// Says that the commit is written through.
    pub(super) fn seal<F: Flash>(self, flash: &mut F) -> Result<(), StoreError> {
        self.write_word(flash, SEAL_AT, 0)
    }
}

/// The words of a set, up to its CRC.
fn word(at: u32, sequence: u32, params: &Params) -> u32 {
    match at {
        CLAIM_AT => 0,
        FORMAT_AT => FORMAT,
        SEQUENCE_AT => sequence,
        COUNT_AT => params.count() as u32,
        _ => {
            let entry = (at - ENTRIES_AT) / 2;
            let Some(id) = params.ids().nth(entry as usize) else {
                return BLANK;
            };
            if (at - ENTRIES_AT).is_multiple_of(2) {
                id.key()
            } else {
                params.get(id).to_bits()
            }
        }
    }
}
