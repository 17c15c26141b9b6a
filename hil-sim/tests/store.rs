//! The parameter store on a fake flash: what other firmware has stored, garbage, wear. Power cuts have a file of their own.

use embedded_storage::nor_flash::{NorFlash, ReadNorFlash};
use hil_sim::peripherals::{FakeFlash, stored};
use vehicle_controller::params::store::{Blocking, Store, StoreError};
use vehicle_controller::params::{Fallback, Id, Params, Restored};

const SECTOR: usize = 16_384;
const SLOT: usize = 1024;
type Flash = FakeFlash<SECTOR>;

fn save(store: &mut Store<Flash>, params: &Params) {
    store.start_save();
    loop {
        match store.poll(params) {
            None => {}
            Some(result) => return assert_eq!(result, Ok(())),
        }
    }
}

fn with_gate(gate: f32) -> Params {
    let mut params = Params::default();
    params.set(Id::Gate, gate).unwrap();
    params
}

/// CRC-32/ISO-HDLC, bit by bit.
fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(u32::MAX, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |crc, _| {
            (crc >> 1) ^ if crc & 1 == 0 { 0 } else { 0xEDB8_8320 }
        })
    })
}

/// A slot as the format says, written here a second time: claim, format, sequence, number, entries, CRC, and at the end commit, seal, drop.
fn slot(sequence: u32, entries: &[(u32, f32)]) -> Vec<u8> {
    let mut words = vec![u32::from_le_bytes(*b"VCP1"), sequence, entries.len() as u32];
    words.extend(
        entries
            .iter()
            .flat_map(|(key, value)| [*key, value.to_bits()]),
    );
    let mut bytes = vec![0; 4];
    bytes.extend(words.iter().flat_map(|word| word.to_le_bytes()));
    let crc = crc32(&bytes[4..]);
    bytes.extend(crc.to_le_bytes());
    bytes.resize(SLOT, 0xFF);
    bytes[253 * 4..255 * 4].fill(0);
    bytes
}

fn key(name: &str) -> u32 {
    crc32(name.as_bytes())
}

fn flash_with(content: &[(usize, Vec<u8>)]) -> Flash {
    let mut flash = Flash::new(1, 1);
    for (offset, bytes) in content {
        flash.place(*offset, bytes);
    }
    flash
}

fn load(content: &[(usize, Vec<u8>)]) -> Result<Restored, StoreError> {
    Store::open(flash_with(content)).load(&Params::default())
}

fn fallbacks(restored: &Restored) -> Vec<Fallback> {
    let mut left = restored.fallbacks;
    std::iter::from_fn(|| left.take()).collect()
}

#[test]
fn a_set_is_stored_as_the_format_says() {
    let params = with_gate(9.0);
    let entries: Vec<_> = params
        .ids()
        .map(|id| (key(id.spec().name), params.get(id)))
        .collect();
    let mut expected = slot(1, &entries);
    while expected.last() == Some(&0xFF) {
        expected.pop();
    }
    assert_eq!(stored(&params), expected);
}

#[test]
fn an_older_firmware_knew_fewer_parameters_in_another_order() {
    let older = [(key("gate"), 9.0), (key("wheel_base"), 0.3)];
    let restored = load(&[(0, slot(1, &older))]).unwrap();
    let mut expected = with_gate(9.0);
    expected.set(Id::WheelBase, 0.3).unwrap();
    assert_eq!(restored.params, expected);
    assert_eq!(fallbacks(&restored), [], "what it did not know is not told");
}

#[test]
fn a_newer_firmware_knew_more_and_wider_ones() {
    let newer = [
        (key("warp_factor"), 9.9),
        (key("gate"), 9.0),
        (key("wheel_base"), 1e6),
        (key("require_crc"), 0.5),
        (key("supply"), f32::NAN),
        (key("phaser_setting"), 1.0),
    ];
    let restored = load(&[(0, slot(1, &newer))]).unwrap();
    assert_eq!(restored.params, with_gate(9.0));
    let told = [
        Fallback::Default(Id::WheelBase),
        Fallback::Default(Id::Supply),
        Fallback::Default(Id::RequireCrc),
        Fallback::Unknown(2),
    ];
    assert_eq!(fallbacks(&restored), told);
}

#[test]
fn what_is_at_odds_is_lowered_and_no_limit_is_widened() {
    // The default of move_speed, 0.3, is allowed under 0.5 and not under 0.2.
    for (move_speed, max_speed, expected) in [(0.6, 0.5, 0.3), (0.6, 0.2, 0.2)] {
        let entries = [
            (key("move_speed"), move_speed),
            (key("max_speed"), max_speed),
        ];
        let restored = load(&[(0, slot(1, &entries))]).unwrap();
        assert_eq!(restored.params.get(Id::MaxSpeed), max_speed);
        assert_eq!(restored.params.get(Id::MoveSpeed), expected);
        assert_eq!(fallbacks(&restored), [Fallback::Default(Id::MoveSpeed)]);
        // It is a set that could have been set.
        let mut set = restored.params;
        assert_eq!(set.set(Id::Gate, 1.0), Ok(()));
    }
}

#[test]
fn the_newest_set_counts_and_numbers_wrap() {
    let set = |sequence, gate| slot(sequence, &[(key("gate"), gate)]);
    for (first, second, newest) in [
        (7, 6, 1.0),
        (6, 7, 2.0),
        (u32::MAX, 0, 2.0),
        (0, u32::MAX, 1.0),
    ] {
        let restored = load(&[(0, set(first, 1.0)), (SECTOR, set(second, 2.0))]).unwrap();
        assert_eq!(restored.params.get(Id::Gate), newest, "{first} {second}");
    }
    let mut flash = Flash::new(1, 1);
    flash.place(0, &set(u32::MAX - 1, 1.0));
    let mut store = Store::open(flash);
    for nth in 0_u8..40 {
        let params = with_gate(f32::from(nth));
        save(&mut store, &params);
        store = Store::open(store.into_flash());
        assert_eq!(store.load(&Params::default()).unwrap().params, params);
    }
}

#[test]
fn every_wrong_bit_of_a_set_is_noticed() {
    let old = slot(1, &[(key("gate"), 1.0)]);
    let entries: Vec<_> = Params::default()
        .ids()
        .map(|id| (id.key(), id.spec().default))
        .collect();
    let new = slot(2, &entries);
    let whole = 4 * (4 + 2 * Params::default().count() + 1);
    for bit in 32..8 * whole {
        let mut wrong = new.clone();
        wrong[bit / 8] ^= 1 << (bit % 8);
        let mut store = Store::open(flash_with(&[(0, old.clone()), (SLOT, wrong)]));
        let restored = store.load_or_defaults(&Params::default());
        assert_eq!(restored.params.get(Id::Gate), 1.0, "bit {bit}");
        assert!(restored.lost, "bit {bit}");
    }
}

#[test]
fn an_older_set_in_force_is_told_until_something_is_saved() {
    let sets = [1, 2, 3].map(|n| slot(n, &[(key("gate"), n as f32)]));
    let [first, mut second, mut third] = sets;
    second[16] ^= 1;
    third[20] ^= 1;
    for content in [
        [(0, first.clone()), (SLOT, second.clone())],
        [(SECTOR, first.clone()), (SECTOR + SLOT, third)],
    ] {
        let mut store = Store::open(flash_with(&content));
        let defaults = Params::default();
        for _ in 0..2 {
            let restored = store.load_or_defaults(&defaults);
            assert_eq!((restored.params, restored.lost), (with_gate(1.0), true));
            assert_eq!(store.load(&defaults), Err(StoreError::Damaged));
            store = Store::open(store.into_flash());
        }
        // Also if it is just what is in force.
        save(&mut store, &with_gate(1.0));
        assert_eq!(store.load(&defaults).unwrap().params, with_gate(1.0));
        store = Store::open(store.into_flash());
        let restored = store.load_or_defaults(&defaults);
        assert_eq!((restored.params, restored.lost), (with_gate(1.0), false));
    }
    // What an interrupted erase has left in the other sector is no loss.
    let mut store = Store::open(flash_with(&[(0, first), (SECTOR, second)]));
    assert!(!store.load_or_defaults(&Params::default()).lost);
}

#[test]
fn garbage_is_told_from_nothing() {
    assert_eq!(load(&[]), Err(StoreError::Empty));
    let mut noise = 1_u64;
    let mut garbage = |length: usize| -> Vec<u8> {
        let mut byte = || {
            noise = noise.wrapping_mul(0x5851_F42D_4C95_7F2D).wrapping_add(1);
            (noise >> 56) as u8
        };
        (0..length).map(|_| byte()).collect()
    };
    for _ in 0..20 {
        for content in [
            vec![(0, garbage(2 * SECTOR))],
            vec![(SECTOR, garbage(SECTOR))],
            vec![(5 * SLOT + 100, garbage(64))],
        ] {
            assert_eq!(load(&content), Err(StoreError::Damaged));
            let mut store = Store::open(flash_with(&content));
            assert!(store.load_or_defaults(&Params::default()).lost);
            save(&mut store, &with_gate(9.0));
            let mut store = Store::open(store.into_flash());
            let restored = store.load_or_defaults(&Params::default());
            assert_eq!((restored.params, restored.lost), (with_gate(9.0), false));
            assert_eq!(store.flash().wear().offences, 0);
        }
        // Beside a good set, garbage does no harm.
        let good = slot(3, &[(key("gate"), 9.0)]);
        let restored = load(&[(0, good), (SECTOR, garbage(SECTOR))]).unwrap();
        assert_eq!(restored.params, with_gate(9.0));
    }
    for fill in [0x00, 0x5A] {
        let content = [(0, vec![fill; 2 * SECTOR])];
        assert_eq!(load(&content), Err(StoreError::Damaged));
    }
}

#[test]
fn a_sector_is_erased_at_every_32nd_save() {
    const SAVES: u16 = 320;
    let mut store = Store::open(Flash::new(1, 3));
    for nth in 0..SAVES {
        save(&mut store, &with_gate(f32::from(nth)));
    }
    let wear = store.flash().wear();
    assert_eq!(wear.erased, [10, 10]);
    let words = 4 + 2 * Params::default().count() as u64 + 3;
    assert_eq!(wear.written, u64::from(SAVES) * 4 * words);
    assert_eq!(wear.offences, 0);
}

#[test]
fn a_save_that_changes_nothing_writes_nothing() {
    let mut store = Store::open(Flash::new(1, 3));
    save(&mut store, &with_gate(9.0));
    let before = (store.flash().wear(), store.flash().bytes());
    for _ in 0..3 {
        save(&mut store, &with_gate(9.0));
        store = Store::open(store.into_flash());
        assert_eq!((store.flash().wear(), store.flash().bytes()), before);
    }
    save(&mut store, &with_gate(8.0));
    assert!(store.flash().wear().written > before.0.written);
}

/// Somebody who changes the parameters while they are written gets an error and keeps the old set.
#[test]
fn parameters_that_change_while_they_are_saved_make_no_mixture() {
    let mut clean = Store::open(Flash::new(1, 1));
    save(&mut clean, &Params::default());
    let mut other = with_gate(9.0);
    other.set(Id::WheelBase, 0.3).unwrap();
    let (mut refused, mut saved) = (0, 0);
    for change in 0..120 {
        let mut store = clean.clone();
        store.start_save();
        let before = with_gate(8.0);
        let result =
            (0..).find_map(|step| store.poll(if step < change { &other } else { &before }));
        let found = Store::open(store.into_flash()).load(&Params::default());
        let found = found.unwrap().params;
        if result == Some(Ok(())) {
            assert!(found == other || found == before, "{change}");
            saved += 1;
        } else {
            assert_eq!(found, Params::default(), "{change}");
            refused += 1;
        }
    }
    assert!(refused > 20 && saved > 0, "{refused} {saved}");
}

/// The flash of a part that waits for its erase, and one that forgets a bit of what it is told.
#[test]
fn any_nor_flash_will_do_and_a_bad_one_is_noticed() {
    #[derive(Clone)]
    struct Plain {
        flash: Flash,
        broken_at: Option<u32>,
    }
    impl embedded_storage::nor_flash::ErrorType for Plain {
        type Error = hil_sim::peripherals::FlashError;
    }
    impl ReadNorFlash for Plain {
        const READ_SIZE: usize = 1;
        fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Self::Error> {
            self.flash.read(offset, bytes)
        }
        fn capacity(&self) -> usize {
            self.flash.capacity()
        }
    }
    impl NorFlash for Plain {
        const WRITE_SIZE: usize = 4;
        const ERASE_SIZE: usize = SECTOR;
        fn erase(&mut self, from: u32, to: u32) -> Result<(), Self::Error> {
            self.flash.erase(from, to)
        }
        fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Self::Error> {
            let mut word = [bytes[0], bytes[1], bytes[2], bytes[3]];
            if self.broken_at == Some(offset) {
                word[2] |= 0x08;
            }
            self.flash.write(offset, &word)
        }
    }
    let mut store = Store::open(Blocking(Plain {
        flash: Flash::new(1, 3),
        broken_at: None,
    }));
    let set = |store: &mut Store<Blocking<Plain>>, gate| {
        store.start_save();
        (0..1000).find_map(|_| store.poll(&with_gate(gate)))
    };
    assert_eq!(set(&mut store, 9.0), Some(Ok(())));
    // Words of the second slot, the commit among them, that have a zero where the cell is stuck.
    for at in [4, 8, 12, 4 * 253] {
        let mut store = store.clone();
        store.flash_mut().0.broken_at = Some(SLOT as u32 + at);
        assert_eq!(set(&mut store, 8.0), Some(Err(StoreError::Flash)), "{at}");
        let mut store = Store::open(store.into_flash());
        let found = store.load(&Params::default()).unwrap().params;
        assert_eq!(found, with_gate(9.0));
        assert_eq!(set(&mut store, 7.0), Some(Ok(())), "the next slot is sound");
    }
}
