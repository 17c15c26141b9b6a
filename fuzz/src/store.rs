//! The parameter store with power cuts: after each the old or the new set is there, whole, and stays.
//!
//! The input is a little program: change a parameter, save, save with a cut, start anew, let a word decay.

use vehicle_controller::params::store::Store;
use vehicle_controller::params::{Kind, Params};

use crate::base;
use crate::flash::FuzzFlash;

/// A save takes fewer polls than this.
const PATIENCE: usize = 1000;

/// Runs an input.
///
/// # Panics
/// If a promise is broken.
pub fn run(data: &[u8]) {
    let (seed, mut rest) = data.split_first().map_or((0, data), |(s, rest)| (*s, rest));
    let mut base = Base {
        store: Some(Store::open(FuzzFlash::new(seed))),
        params: base::defaults().params,
        saved: None,
        decayed: false,
    };
    while let [what, first, second, tail @ ..] = rest {
        rest = tail;
        let number = u16::from_le_bytes([*first, *second]);
        match what & 7 {
            0..=2 => base.change(*first, *second),
            3 => base.save(None, None),
            // Some power fails again while the store is opened.
            4 | 5 => base.save(
                Some(u32::from(number & 0x3FF)),
                (what & 8 != 0).then_some(u32::from(number >> 10)),
            ),
            6 => base.restart(None, Some(u32::from(number & 0x1F))),
            _ => base.decay(usize::from(number), 1 << (what >> 3)),
        }
    }
    base.restart(None, None);
    base.change(7, 99);
    base.save(None, None);
    base.restart(None, None);
}

struct Base {
    store: Option<Store<FuzzFlash>>,
    params: Params,
    /// The set that is there.
    saved: Option<Params>,
    /// Something in the flash has decayed: sets may be lost, but what is read is a set.
    decayed: bool,
}

impl Base {
    fn store(&mut self) -> &mut Store<FuzzFlash> {
        self.store.as_mut().expect("it is always put back")
    }

    fn change(&mut self, id: u8, value: u8) {
        let params = Params::default();
        let id = params.ids().nth(usize::from(id) % params.count());
        let id = id.expect("it is one of them");
        let spec = id.spec();
        let share = f32::from(value) / 255.0;
        let value = match spec.kind {
            Kind::Switch | Kind::Wiring => share.round(),
            Kind::Value | Kind::Geometry => {
                (spec.min + (spec.max - spec.min) * share).clamp(spec.min, spec.max)
            }
        };
        // Refused or not.
        let _ = self.params.set(id, value);
    }

    fn save(&mut self, cut: Option<u32>, again: Option<u32>) {
        let params = self.params;
        let store = self.store();
        if let Some(steps) = cut {
            store.flash_mut().cut_after(steps);
        }
        store.start_save();
        let result = (0..PATIENCE)
            .find_map(|_| store.poll(&params))
            .expect("a save ends");
        if store.flash().is_off() {
            self.restart(Some(&params), again);
            return;
        }
        if cut.is_some() {
            // Power was there long enough, and stays.
            self.store().flash_mut().cut_after(u32::MAX);
        }
        if !self.decayed {
            assert_eq!(result, Ok(()), "a save on a good flash");
        }
        if result.is_ok() {
            self.saved = Some(params);
            let loaded = self.store().load(&base::defaults().params);
            assert_eq!(loaded.map(|found| found.params), Ok(params));
        }
    }

    /// Power goes and comes: the set that was there is there, or the `new` one that was being saved. It may fail while the store is opened, too.
    fn restart(&mut self, new: Option<&Params>, cut: Option<u32>) {
        let mut flash = self
            .store
            .take()
            .expect("it is always put back")
            .into_flash();
        flash.power_on();
        if let Some(steps) = cut {
            flash.cut_after(steps);
            flash = Store::open(flash).into_flash();
            flash.power_on();
        }
        let mut store = Store::open(flash);
        let defaults = base::defaults().params;
        let found = store.load(&defaults);
        let set = found.ok().map(|found| found.params);
        if self.decayed {
            if let Some(set) = set {
                for id in set.ids() {
                    let (value, spec) = (set.get(id), id.spec());
                    assert!((spec.min..=spec.max).contains(&value), "{}", spec.name);
                }
            }
        } else {
            assert!(
                set == self.saved || new.is_some() && set.as_ref() == new,
                "neither the old set nor the new one: {found:?}"
            );
        }
        self.saved = set;
        self.store = Some(store);
    }

    fn decay(&mut self, at: usize, bits: u32) {
        self.decayed = true;
        self.store().flash_mut().decay(at, bits);
    }
}
