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
}

/// The flash interface with its array.
pub struct Flash {
    array: Vec<u8>,
    times: Times,
    lock: Lock,
    control: u64,
    status: u64,
    busy: Option<(EventId, Operation)>,
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
        }
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
        self.begin(Operation::Erase(at, length), time, context);
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
        if let Operation::Erase(at, length) = operation {
            self.wipe(at + length / 2, length / 2, context);
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
mod tests {
    use super::*;
    use rigless::emulator::{Error, Memory};
    use rigless::mcu::{Operate, Single};
    use rigless::soc::stm32f427::{CPU, builder};
    use rigless::soc::{Bus, Layout, Peripheral, Region};
    use std::collections::BTreeMap;

    /// The first sector of bank 2.
    const SECTOR: u64 = 0x0810_0000;
    static ARRAY: [Region; 1] =
        [Region::flash("flash", FLASH_BASE, FLASH_BYTES).programmed_by("FLASH")];

    /// What the core would read.
    #[derive(Default)]
    struct Cells(BTreeMap<u64, u8>);

    impl Memory for Cells {
        fn read(&mut self, address: u64, width: Width) -> Result<u64, Error> {
            let bytes = 0..u64::from(width.bytes());
            let cell = |lane: u64| u64::from(*self.0.get(&(address + lane)).unwrap_or(&ERASED));
            Ok(bytes.map(|lane| cell(lane) << (8 * lane)).sum())
        }

        fn write(&mut self, address: u64, width: Width, _: u64) -> Result<(), Error> {
            Err(Error::Memory { address, width })
        }

        fn program(&mut self, address: u64, width: Width, value: u64) -> Result<(), Error> {
            for lane in 0..u64::from(width.bytes()) {
                self.0.insert(address + lane, (value >> (8 * lane)) as u8);
            }
            Ok(())
        }
    }

    struct Bench {
        mcu: Single<Flash>,
        cells: Cells,
        now: VirtualNanos,
        flash: Peripheral,
    }

    impl Bench {
        fn new() -> Self {
            let flash = *builder().build().unwrap().peripheral("FLASH").unwrap();
            let bus = Bus::builder(CPU, &ARRAY, [flash]);
            Self {
                mcu: Single::new(bus, "FLASH", Flash::default()).unwrap(),
                cells: Cells::default(),
                now: VirtualNanos(0),
                flash,
            }
        }

        fn address(&self, register: Register) -> u64 {
            self.flash.base + u64::from(register.spec().offset)
        }

        fn write(&mut self, register: Register, value: u64) {
            let address = self.address(register);
            self.mcu
                .write(self.now, address, Width::W32, value)
                .unwrap();
            self.settle();
        }

        fn store(&mut self, address: u64, width: Width, value: u64) {
            self.mcu.write(self.now, address, width, value).unwrap();
            self.settle();
        }

        fn settle(&mut self) {
            self.mcu.settle(&mut self.cells).unwrap();
        }

        fn status(&mut self) -> u64 {
            let address = self.address(Register::Sr);
            self.mcu.read(self.now, address, Width::W32).unwrap()
        }

        fn pass(&mut self, ns: u64) {
            self.now.0 += ns;
            self.mcu.advance_to(self.now);
            self.settle();
        }

        fn unlock(&mut self) {
            for key in KEYS {
                self.write(Register::Keyr, key);
            }
        }

        /// PG with parallelism x32.
        fn allow_programming(&mut self) {
            self.unlock();
            self.write(Register::Cr, cr::PG.mask() | cr::PSIZE.set(0, 2));
        }

        fn told(&mut self) -> usize {
            self.mcu.drain_told().len()
        }
    }

    #[test]
    fn a_word_is_programmed_and_takes_its_time() {
        let mut bench = Bench::new();
        bench.allow_programming();
        bench.store(SECTOR, Width::W32, 0x1234_5678);
        assert_eq!(bench.status(), sr::BSY.mask());
        bench.pass(15_999);
        assert_eq!(bench.status(), sr::BSY.mask());
        bench.pass(1);
        assert_eq!(bench.status(), 0);
        assert_eq!(bench.cells.read(SECTOR, Width::W32).unwrap(), 0x1234_5678);
        let kept = bench.mcu.model.content(SECTOR, 4).unwrap();
        assert_eq!(kept, 0x1234_5678_u32.to_le_bytes());
        assert_eq!(bench.told(), 0);
    }

    #[test]
    fn ones_over_zeros_stay_zeros_and_are_reported() {
        let mut bench = Bench::new();
        bench.allow_programming();
        bench.store(SECTOR, Width::W32, 0xFFFF_0000);
        bench.pass(16_000);
        bench.store(SECTOR, Width::W32, 0xF0F0_F0F0);
        assert_eq!(bench.cells.read(SECTOR, Width::W32).unwrap(), 0xF0F0_0000);
        assert!(bench.told() > 0);
    }

    #[test]
    fn what_is_not_allowed_sets_its_flag_and_changes_nothing() {
        let mut bench = Bench::new();
        bench.store(SECTOR, Width::W32, 0);
        assert_eq!(bench.status(), sr::PGSERR.mask(), "locked");
        bench.write(Register::Sr, u64::from(u32::MAX));
        assert_eq!(bench.status(), 0, "cleared");
        bench.allow_programming();
        bench.store(SECTOR, Width::W16, 0);
        assert_eq!(bench.status(), sr::PGPERR.mask(), "another width");
        bench.write(Register::Sr, u64::from(u32::MAX));
        bench.store(SECTOR + 2, Width::W32, 0);
        assert_eq!(bench.status(), sr::PGAERR.mask(), "misaligned");
        assert!(bench.cells.0.is_empty());
    }

    #[test]
    fn a_sector_is_erased_and_no_other() {
        let mut bench = Bench::new();
        bench.allow_programming();
        let ends = [SECTOR - 4, SECTOR, SECTOR + 0x3FFC, SECTOR + 0x4000];
        for address in ends {
            bench.store(address, Width::W32, 0);
            bench.pass(16_000);
        }
        bench.write(
            Register::Cr,
            cr::SER.mask() | cr::PSIZE.set(0, 2) | cr::SNB.set(0, 16) | STRT,
        );
        bench.pass(249_999_999);
        assert_eq!(bench.status(), sr::BSY.mask());
        bench.pass(1);
        assert_eq!(bench.status(), 0);
        let words = ends.map(|at| bench.cells.read(at, Width::W32).unwrap());
        assert_eq!(words, [0, 0xFFFF_FFFF, 0xFFFF_FFFF, 0]);
        assert_eq!(bench.told(), 0);
    }

    #[test]
    fn a_wrong_key_locks_until_reset() {
        let mut bench = Bench::new();
        bench.write(Register::Keyr, KEYS[1]);
        bench.unlock();
        bench.write(Register::Cr, cr::PG.mask());
        bench.store(SECTOR, Width::W8, 0);
        assert_eq!(bench.status(), sr::PGSERR.mask());
        bench.mcu.model.restart();
        bench.unlock();
        bench.write(Register::Cr, cr::PG.mask());
        bench.store(SECTOR, Width::W8, 0);
        assert_eq!(bench.cells.read(SECTOR, Width::W8).unwrap(), 0);
    }

    #[test]
    fn sectors_lie_where_the_manual_has_them() {
        assert_eq!(sector(0), Some((0, 16 << 10)));
        assert_eq!(sector(4), Some((64 << 10, 64 << 10)));
        assert_eq!(sector(11), Some((896 << 10, 128 << 10)));
        assert_eq!(sector(16), Some((1024 << 10, 16 << 10)));
        assert_eq!(sector(27), Some((1920 << 10, 128 << 10)));
        assert_eq!(sector(12), None);
    }

    #[test]
    fn what_is_placed_can_be_read() {
        let mut flash = Flash::default();
        assert!(flash.place(SECTOR, b"parameters"));
        assert_eq!(flash.content(SECTOR, 10), Some(&b"parameters"[..]));
        assert!(!flash.place(FLASH_BASE + FLASH_BYTES - 1, b"ab"));
        assert_eq!(flash.content(FLASH_BASE - 1, 1), None);
    }
}
