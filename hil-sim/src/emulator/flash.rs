//! The flash interface (RM0090 chapter 3): unlocking, erasing a sector, programming, the errors of both, and how long they take.
//!
//! What the array holds outlives resets, and can be taken out and put back. What this firmware does not do (mass erase, option bytes) is reported,
//! which fails a run. Not modelled: the core does not stall while it fetches from the bank that is busy.

use super::part::{FLASH_BASE, FLASH_BYTES};
use rigless::device::{Device, DeviceContext, RegisterFile};
use rigless::soc::Width;
use rigless::soc::stm32f427::generated::flash::{Register, cr, sr};
use rigless::time::{EventId, VirtualNanos};

/// KEY1 and KEY2 of section 3.6.1.
const KEYS: [u64; 2] = [0x4567_0123, 0xCDEF_89AB];
/// LOCK, bit 31 of the control register (section 3.9.8).
const LOCK: u64 = 1 << 31;
/// STRT, bit 16.
const STRT: u64 = 1 << 16;
/// The first interrupt of the interface, its only one.
const INTERRUPT: usize = 0;
/// What an erased byte reads.
const ERASED: u8 = 0xFF;

/// How long operations take (DS9405 table 48, at parallelism x32, typical).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Times {
    /// Programming a byte, half-word or word, ns.
    pub program_ns: u64,
    /// Erasing a sector of 16, 64 and 128 KiB, ns.
    pub erase_ns: [u64; 3],
}

impl Default for Times {
    fn default() -> Self {
        Self {
            program_ns: 16_000,
            erase_ns: [250_000_000, 550_000_000, 1_000_000_000],
        }
    }
}

/// How far the unlock sequence has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Lock {
    Locked,
    HalfOpen,
    Open,
    /// A wrong key locks until the next reset.
    Shut,
}

/// What keeps the interface busy.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Operation {
    Program,
    /// The sector's first byte in the array, and its length.
    Erase(usize, usize),
    /// An erase in the midst of which power fails.
    CutErase,
}

/// An erase is cut at a time that is counted so, ns.
const CUT_STEP_NS: u64 = 1_000_000;

/// The flash interface with its array.
pub struct Flash {
    array: Vec<u8>,
    times: Times,
    lock: Lock,
    control: u64,
    status: u64,
    busy: Option<(EventId, Operation)>,
    /// Power fails after so many further bytes, or milliseconds of an erase.
    cut: Option<u64>,
    /// Power has failed, and has not come back.
    pub(super) lost_power: bool,
}

impl std::fmt::Debug for Flash {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter
            .debug_struct("Flash")
            .field("lock", &self.lock)
            .field("busy", &self.busy)
            .finish_non_exhaustive()
    }
}

impl Default for Flash {
    fn default() -> Self {
        Self::new(Times::default())
    }
}

impl Flash {
    /// An erased flash.
    #[must_use]
    pub fn new(times: Times) -> Self {
        Self {
            array: vec![ERASED; FLASH_BYTES as usize],
            times,
            lock: Lock::Locked,
            control: LOCK,
            status: 0,
            busy: None,
            cut: None,
            lost_power: false,
        }
    }

    /// Power fails after so many further bytes that are programmed, or milliseconds of an erase.
    pub(super) fn cut_after(&mut self, bytes: u64) {
        self.cut = Some(bytes);
    }

    /// Lets bytes or milliseconds pass; if power fails among them, after how many.
    fn pass(&mut self, amount: u64) -> Option<u64> {
        let left = self.cut?;
        if left < amount {
            self.cut = None;
            return Some(left);
        }
        self.cut = Some(left - amount);
        None
    }

    fn lose_power(&mut self, context: &mut DeviceContext<'_>) {
        self.note_power_loss();
        context.request_power(false);
    }

    /// Power has failed; it does not fail a second time for the same reason.
    pub(super) fn note_power_loss(&mut self) {
        self.lost_power = true;
        self.cut = None;
    }

    /// Puts bytes into the array, as a programming tool does before power-on. False if they do not fit.
    #[must_use]
    pub fn place(&mut self, address: u64, bytes: &[u8]) -> bool {
        let place = self.offset(address, bytes.len());
        let Some(array) = place.and_then(|at| self.array.get_mut(at..at + bytes.len())) else {
            return false;
        };
        array.copy_from_slice(bytes);
        true
    }

    /// What the array holds.
    #[must_use]
    pub fn content(&self, address: u64, length: usize) -> Option<&[u8]> {
        let at = self.offset(address, length)?;
        self.array.get(at..at + length)
    }

    /// Where an address is in the array, if all of it is inside.
    fn offset(&self, address: u64, length: usize) -> Option<usize> {
        let at = usize::try_from(address.checked_sub(FLASH_BASE)?).ok()?;
        (at.checked_add(length)? <= self.array.len()).then_some(at)
    }

    /// A reset: locked, idle, the array as it is. An operation that was under way leaves it half done.
    pub(super) fn restart(&mut self) {
        self.lock = Lock::Locked;
        self.control = LOCK;
        self.status = 0;
        self.busy = None;
    }

    fn unlock(&mut self, key: u64, context: &mut DeviceContext<'_>) {
        self.lock = match self.lock {
            Lock::Locked if key == KEYS[0] => Lock::HalfOpen,
            Lock::HalfOpen if key == KEYS[1] => {
                self.control &= !LOCK;
                Lock::Open
            }
            Lock::Open => Lock::Open,
            _ => {
                context.tell(
                    "KEYR",
                    "RM0090 section 3.6.1: a wrong key locks until reset",
                );
                Lock::Shut
            }
        };
    }

    fn write_control(&mut self, value: u64, context: &mut DeviceContext<'_>) {
        if self.lock != Lock::Open {
            context.tell("CR", "RM0090 section 3.6.1: written while it is locked");
            return;
        }
        if self.busy.is_some() {
            context.tell("CR", "RM0090 section 3.6.1: written while BSY stands");
            return;
        }
        self.control = value;
        if value & LOCK != 0 {
            self.lock = Lock::Locked;
            return;
        }
        if cr::MER.is_set(value) || cr::MER1.is_set(value) {
            context.tell("CR", "a mass erase is not modelled");
            return;
        }
        if value & STRT != 0 {
            self.start_erase(value, context);
        }
    }

    /// Section 3.6.3. While it lasts the sector reads neither as before nor erased.
    fn start_erase(&mut self, control: u64, context: &mut DeviceContext<'_>) {
        let sector = cr::SER
            .is_set(control)
            .then(|| sector(cr::SNB.get(control)))
            .flatten();
        let Some((at, length)) = sector else {
            self.control &= !STRT;
            self.status |= sr::WRPERR.mask();
            return;
        };
        self.wipe(at, length / 2, context);
        let time = match length >> 10 {
            16 => self.times.erase_ns[0],
            64 => self.times.erase_ns[1],
            _ => self.times.erase_ns[2],
        };
        match self.pass(time / CUT_STEP_NS) {
            Some(steps) => self.begin(Operation::CutErase, steps * CUT_STEP_NS + 1, context),
            None => self.begin(Operation::Erase(at, length), time, context),
        }
    }

    fn wipe(&mut self, at: usize, length: usize, context: &mut DeviceContext<'_>) {
        if let Some(bytes) = self.array.get_mut(at..at + length) {
            bytes.fill(ERASED);
        }
        for word in (at..at + length).step_by(8) {
            context.program(FLASH_BASE + word as u64, Width::W64, u64::MAX, 0);
        }
    }

    fn begin(&mut self, operation: Operation, time: u64, context: &mut DeviceContext<'_>) {
        let end = context.schedule(VirtualNanos(context.now().0 + time));
        self.busy = Some((end, operation));
    }

    /// Section 3.6.4: a store into the array. The error it sets, or none.
    fn program(
        &mut self,
        address: u64,
        width: Width,
        value: u64,
        context: &mut DeviceContext<'_>,
    ) -> u64 {
        let bytes = width.bytes() as usize;
        if self.busy.is_some() {
            context.tell("SR", "RM0090 section 3.6.1: programmed while BSY stands");
            return sr::PGSERR.mask();
        }
        if self.lock != Lock::Open || !cr::PG.is_set(self.control) {
            return sr::PGSERR.mask();
        }
        if cr::PSIZE.get(self.control) != u64::from(width.bytes().trailing_zeros()) {
            return sr::PGPERR.mask();
        }
        let place = self.offset(address, bytes);
        let Some(place) = place.filter(|place| place.is_multiple_of(bytes)) else {
            return sr::PGAERR.mask();
        };
        let cut = self.pass(bytes as u64);
        // What is behind the cut is not programmed, and what is there is half.
        let value = cut.map_or(value, |left| value | u64::MAX << (8 * left + 4));
        let cells = &mut self.array[place..place + bytes];
        let mut programmed = 0;
        for (lane, cell) in cells.iter_mut().enumerate() {
            let wanted = (value >> (8 * lane)) as u8;
            if wanted & !*cell != 0 {
                context.tell(
                    "CR",
                    "RM0090 section 3.6.4: ones programmed over zeros without an erase",
                );
            }
            *cell &= wanted;
            programmed |= u64::from(*cell) << (8 * lane);
        }
        context.program(address, width, programmed, 0);
        self.begin(Operation::Program, self.times.program_ns, context);
        if cut.is_some() {
            self.lose_power(context);
        }
        0
    }

    /// What the registers show, and the level of the interrupt.
    fn show(&self, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        let busy = if self.busy.is_some() {
            sr::BSY.mask()
        } else {
            0
        };
        registers.set(Register::Sr, self.status | busy);
        registers.set(Register::Cr, self.control);
        let ended = sr::EOP.is_set(self.status) && cr::EOPIE.is_set(self.control);
        let failed = sr::OPERR.is_set(self.status) && cr::ERRIE.is_set(self.control);
        context.interrupt(INTERRUPT, (ended || failed).into());
    }

    fn fail(&mut self, error: u64) {
        self.status |= error;
        if error != 0 && cr::ERRIE.is_set(self.control) {
            self.status |= sr::OPERR.mask();
        }
    }
}

/// The place and length of a sector by its number in SNB (section 3.9.8: bank 2 begins at 16), in the array.
fn sector(number: u64) -> Option<(usize, usize)> {
    const KIB: usize = 1 << 10;
    let (bank, index) = match number {
        0..=11 => (0, number as usize),
        16..=27 => (1024 * KIB, number as usize - 16),
        _ => return None,
    };
    let (at, length) = match index {
        0..=3 => (index * 16 * KIB, 16 * KIB),
        4 => (64 * KIB, 64 * KIB),
        _ => ((index - 4) * 128 * KIB, 128 * KIB),
    };
    Some((bank + at, length))
}

impl Device for Flash {
    type Register = Register;

    fn write(
        &mut self,
        register: Register,
        value: u64,
        registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) {
        match register {
            Register::Acr => {}
            Register::Keyr => self.unlock(value, context),
            Register::Cr => self.write_control(value, context),
            // Flags are cleared by writing ones.
            Register::Sr => self.status &= !value,
            Register::Optkeyr | Register::Optcr | Register::Optcr1 => {
                context.tell("OPTCR", "option bytes are not modelled");
            }
        }
        self.show(registers, context);
    }

    fn on_event(
        &mut self,
        event: EventId,
        registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) {
        let Some((_, operation)) = self.busy.filter(|(end, _)| *end == event) else {
            return;
        };
        self.busy = None;
        self.control &= !STRT;
        match operation {
            Operation::Erase(at, length) => self.wipe(at + length / 2, length / 2, context),
            Operation::CutErase => self.lose_power(context),
            Operation::Program => {}
        }
        if cr::EOPIE.is_set(self.control) {
            self.status |= sr::EOP.mask();
        }
        self.show(registers, context);
    }

    fn write_region(
        &mut self,
        address: u64,
        width: Width,
        value: u64,
        registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) -> bool {
        let error = self.program(address, width, value, context);
        self.fail(error);
        self.show(registers, context);
        true
    }

    fn reset(&mut self) {
        self.restart();
    }
}

#[cfg(test)]
mod tests;
