//! The flash interface, alone on a bus.

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

#[test]
fn a_power_loss_is_the_end_of_one_that_was_to_come() {
    let mut flash = Flash::default();
    flash.cut_after(3);
    assert_eq!(flash.pass(2), None);
    assert_eq!(flash.pass(2), Some(1), "it comes in the midst of this");
    assert_eq!(flash.pass(100), None, "and once");
    flash.cut_after(3);
    flash.note_power_loss();
    assert!(flash.lost_power);
    assert_eq!(flash.pass(100), None, "power has failed before");
}
