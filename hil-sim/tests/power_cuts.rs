//! Power fails at any byte of a save, and again at any byte of what follows: the old or the new set is whole, and what a start has found stays.

use hil_sim::peripherals::FakeFlash;
use vehicle_controller::params::Params;
use vehicle_controller::params::store::{Store, StoreError};

/// So many saves in a row.
const SAVES: u32 = 50;
/// Polls of an erase.
const ERASE_STEPS: u64 = 4;
/// All pairs of cuts are tried with this variable set; else those of which there is not another one that is the same.
const ALL: &str = "VEHICLE_CONTROLLER_ALL_CUTS";

/// Sectors of four slots: every fourth save erases.
type Flash = FakeFlash<4096>;

/// The set of a save: every value differs from those of all other sets.
fn set(nth: u32) -> Params {
    let mut params = Params::default();
    let mut values = Vec::new();
    for id in params.ids() {
        let spec = id.spec();
        let share = (nth as f32 + 1.0) / 512.0;
        let value = spec.min + (spec.max - spec.min) * share;
        if id.allows(value) {
            values.push((id, value));
        }
    }
    params.set_all(&values).unwrap();
    params
}

/// Saves; None if power failed before it was told how it ended.
fn save(store: &mut Store<Flash>, params: &Params) -> Option<Result<(), StoreError>> {
    store.start_save();
    loop {
        let result = store.poll(params);
        if store.flash().is_off() {
            return result.filter(Result::is_ok);
        }
        if result.is_some() {
            return result;
        }
    }
}

fn restart(store: Store<Flash>) -> Store<Flash> {
    let mut flash = store.into_flash();
    flash.power_on();
    Store::open(flash)
}

fn load(store: &mut Store<Flash>) -> Params {
    match store.load(&Params::default()) {
        Ok(restored) => restored.params,
        // Before the first set the parameters are the defaults.
        Err(StoreError::Empty) => Params::default(),
        Err(error) => panic!("{error}"),
    }
}

/// Bytes and polls of a save from here, and the store after it.
fn cost(store: &Store<Flash>, params: &Params) -> (u64, Store<Flash>) {
    let mut probe = store.clone();
    let enough = 1 << 32;
    let before = probe.flash().wear();
    assert_eq!(save(&mut probe, params), Some(Ok(())));
    let after = probe.flash().wear();
    let erased: u64 = after.erased.iter().sum::<u64>() - before.erased.iter().sum::<u64>();
    let cost = after.written - before.written + erased * ERASE_STEPS;
    assert!(cost < enough);
    (cost, probe)
}

/// What must be so in the end: a start finds the same again, and a save succeeds.
fn is_sound(mut store: Store<Flash>, expected: &Params, case: (u32, u64, u64)) {
    assert_eq!(load(&mut store), *expected, "{case:?}");
    store = restart(store);
    assert_eq!(
        load(&mut store),
        *expected,
        "{case:?}: the next start finds another set"
    );
    let last = set(200 + case.0);
    assert_eq!(save(&mut store, &last), Some(Ok(())), "{case:?}");
    store = restart(store);
    assert_eq!(load(&mut store), last, "{case:?}");
    assert_eq!(store.flash().wear().offences, 0, "{case:?}");
}

/// The set that is found after the cut must be one of these; gives it.
fn one_of(
    store: &mut Store<Flash>,
    sets: [&Params; 2],
    told: bool,
    case: (u32, u64, u64),
) -> Params {
    let found = load(store);
    let allowed = if told { &sets[1..] } else { &sets[..] };
    assert!(allowed.contains(&&found), "{case:?}: lost, or mixed");
    found
}

/// Cuts at which a store in this state must be looked at, of `cost` bytes and polls. Of the words of the entries all but the first, the one in the midst
/// and the last leave the same behind: a slot that is taken, whose format is there and whose commit was never begun. No more of it is ever read.
fn cuts(cost: u64, erases: bool, all: bool) -> Vec<u64> {
    let start = if erases { ERASE_STEPS } else { 0 };
    let entries = 4 * Params::default().count() as u64 * 2;
    let first = start + 16;
    let representative = |at: u64| {
        let entry = at.checked_sub(first).filter(|at| *at < entries);
        entry.is_none_or(|at| at < 4 || at / 4 == entries / 8 || at + 4 >= entries)
    };
    (0..cost).filter(|at| all || representative(*at)).collect()
}

fn erases(store: &Store<Flash>, after: &Store<Flash>) -> bool {
    store.flash().wear().erased != after.flash().wear().erased
}

#[test]
fn every_byte_of_every_save() {
    let mut store = Store::open(Flash::new(1, ERASE_STEPS));
    let mut old = Params::default();
    let mut cases = 0;
    for nth in 0..SAVES {
        let new = set(nth);
        let (cost, after) = cost(&store, &new);
        for cut in 0..=cost {
            let mut store = store.clone();
            store.flash_mut().cut_after(cut);
            let told = save(&mut store, &new).is_some();
            assert_eq!(store.flash().is_off(), cut < cost);
            let mut store = restart(store);
            let found = one_of(&mut store, [&old, &new], told, (nth, cut, 0));
            is_sound(store, &found, (nth, cut, 0));
            cases += 1;
        }
        (store, old) = (after, new);
    }
    println!("{cases} cuts");
}

/// The pairs of the saves `nth` and `nth + 1`, for each `nth` of a share of the saves.
fn pairs(seed: u64, share: u32, shares: u32, all: bool) -> u64 {
    let mut store = Store::open(Flash::new(seed, ERASE_STEPS));
    let mut old = Params::default();
    let mut cases = 0;
    for nth in 0..SAVES {
        let (new, next) = (set(nth), set(nth + 100));
        let (first_cost, after) = cost(&store, &new);
        if nth % shares == share {
            for first in cuts(first_cost, erases(&store, &after), all) {
                let mut cut_once = store.clone();
                cut_once.flash_mut().cut_after(first);
                let told = save(&mut cut_once, &new).is_some();
                // What the first start does to settle is part of what the second cut can meet: it counts from the power-on.
                let mut started = restart(cut_once.clone());
                let settling = started.flash().wear().written - cut_once.flash().wear().written;
                let found = one_of(&mut started, [&old, &new], told, (nth, first, 0));
                let (second_cost, saved) = cost(&started, &next);
                let second = cuts(second_cost, erases(&started, &saved), all);
                let second = (0..settling).chain(second.into_iter().map(|at| at + settling));
                for second in second {
                    let case = (nth, first, second);
                    let mut flash = cut_once.clone().into_flash();
                    flash.power_on();
                    flash.cut_after(second);
                    let mut store = Store::open(flash);
                    if store.flash().is_off() {
                        // It fell before anybody was told what was found.
                        let mut store = restart(store);
                        let found = one_of(&mut store, [&old, &new], told, case);
                        is_sound(store, &found, case);
                    } else {
                        let told = save(&mut store, &next).is_some();
                        let mut store = restart(store);
                        let found = one_of(&mut store, [&found, &next], told, case);
                        is_sound(store, &found, case);
                    }
                    cases += 1;
                }
            }
        }
        (store, old) = (after, new);
    }
    cases
}

#[test]
fn every_pair_of_cuts() {
    let all = std::env::var_os(ALL).is_some();
    let start = std::time::Instant::now();
    let shares = 2;
    let cases: u64 = std::thread::scope(|scope| {
        let workers: Vec<_> = (0..shares)
            .map(|share| scope.spawn(move || pairs(2, share, shares, all)))
            .collect();
        workers
            .into_iter()
            .map(|worker| worker.join().unwrap())
            .sum()
    });
    println!(
        "{cases} pairs of cuts in {:.1} s",
        start.elapsed().as_secs_f64()
    );
    assert!(cases > 50 * 40 * 40);
}
