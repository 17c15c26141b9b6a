//! The supervisor alone: bounds of speed, current, supply and following, and what persists.

#[path = "supervised/cycles.rs"]
mod cycles;

use cycles::{CLOSELY, CONFIG, Case, DT, FINE, STILL, currents, following, found, speeds, supply};
use vehicle_controller::supervisor::{Config, Cycle, Fault, Following, Place, Supervisor};

/// What each bound is, for how long it may be exceeded (s), and how it is told.
fn cases() -> Vec<(Case, f32, Fault, Place)> {
    use Following::{Closely, FarOff, HeldUp};
    let above = 1.25_f32.next_up();
    let base = Place::Base;
    let mut cases = Vec::new();
    for speeds in [
        speeds(above, 0.0),
        speeds(0.0, above),
        speeds(-above, 0.0),
        speeds(0.0, -9.0),
    ] {
        cases.push((speeds, 0.03, Fault::Overspeed, base));
    }
    let above = 4.0_f32.next_up();
    for (left, right, place) in [
        (Some(above), None, Place::Left),
        (Some(-above), Some(4.0), Place::Left),
        (Some(-4.0), Some(-above), Place::Right),
        (None, Some(9.0), Place::Right),
        (Some(above), Some(-above), Place::Both),
    ] {
        cases.push((currents(left, right), 0.02, Fault::Overcurrent, place));
    }
    let [lowest, highest] = CONFIG.supply;
    for volts in [highest.next_up(), 99.0] {
        cases.push((supply(volts), 0.1, Fault::Overvoltage, base));
    }
    for volts in [lowest.next_down(), 0.0] {
        cases.push((supply(volts), 0.1, Fault::Undervoltage, base));
    }
    for [a, b] in [[FarOff, Closely], [Closely, FarOff], [HeldUp, FarOff]] {
        cases.push((following(a, b), 0.05, Fault::Following, base));
    }
    for [a, b] in [[HeldUp, Closely], [Closely, HeldUp], [HeldUp, HeldUp]] {
        cases.push((following(a, b), 1.0, Fault::Following, base));
    }
    cases
}

#[test]
fn what_is_out_of_bounds_for_longer_than_it_may_be_is_found_and_not_before() {
    for (case, limit, fault, place) in cases() {
        // Bounds are looked at in every other tick, until one is exceeded. Sums of milliseconds are a millisecond wide of the limit at most.
        let limit = (limit / DT).round() as u32;
        for phase in 0..4 {
            let mut supervisor = Supervisor::default();
            assert_eq!(found(&mut supervisor, &(FINE, CLOSELY), phase), None);
            let (tick, found_fault, found_place) =
                found(&mut supervisor, &case, 2000).unwrap_or_else(|| panic!("{fault:?}"));
            assert_eq!((found_fault, found_place), (fault, place), "{case:?}");
            assert!((limit..=limit + 2).contains(&tick), "{fault:?}: {tick}");
        }
    }
}

#[test]
fn what_is_within_bounds_to_the_last_bit_is_not_found() {
    for case in [
        speeds(1.25, -1.25),
        currents(Some(4.0), Some(-4.0)),
        currents(None, None),
        supply(9.0),
        supply(15.0),
    ] {
        assert_eq!(found(&mut Supervisor::default(), &case, 10_000), None);
    }
    // Nor while another bound is looked at more closely.
    let held_up = following(Following::HeldUp, Following::Closely).1;
    for (cycle, _) in [
        speeds(1.25, -1.25),
        currents(Some(4.0), Some(-4.0)),
        supply(9.0),
        supply(15.0),
    ] {
        let found = found(&mut Supervisor::default(), &(cycle, held_up), 2000);
        assert!(
            matches!(found, Some((1000..=1002, Fault::Following, Place::Base))),
            "{found:?}"
        );
    }
    // A sensor or a parameter without a limit knows none.
    let endless = Config {
        max_current: f32::INFINITY,
        supply: [f32::NEG_INFINITY, f32::INFINITY],
        ..CONFIG
    };
    let mut supervisor = Supervisor::default();
    for volts in [0.0, 1e6] {
        let cycle = Cycle {
            supply: volts,
            currents: [Some(1e6); 2],
            ..FINE
        };
        for _ in 0..10_000 {
            assert_eq!(supervisor.watch(&endless, &cycle, || CLOSELY), None);
        }
    }
}

#[test]
fn time_within_a_bound_is_taken_off_again() {
    for (case, limit, fault, place) in cases() {
        let limit = (limit / DT).round() as u32;
        let mut supervisor = Supervisor::default();
        // Half of the time beyond it for ever: no fault, as it never lasts.
        for _ in 0..50 {
            assert_eq!(found(&mut supervisor, &case, limit / 2), None);
            assert_eq!(
                found(&mut supervisor, &(FINE, CLOSELY), limit / 2 + 2),
                None
            );
        }
        // Beyond it for 80 %, within for 40 %, beyond again: what is left of the first time counts.
        assert_eq!(found(&mut supervisor, &case, limit * 8 / 10), None);
        let fine = limit * 4 / 10;
        assert_eq!(found(&mut supervisor, &(FINE, CLOSELY), fine), None);
        let (tick, ..) = found(&mut supervisor, &case, 2 * limit).expect("found");
        let expected = limit - limit * 8 / 10 + fine;
        assert!(tick.abs_diff(expected) <= 3, "{fault:?} {place:?}: {tick}");
    }
}

#[test]
fn a_long_cycle_counts_for_as_long_as_it_was() {
    for (case, limit, fault, place) in cases() {
        let long = |dt| (Cycle { dt, ..case.0 }, case.1);
        let mut supervisor = Supervisor::default();
        // The first tick belongs to a wheel.
        assert_eq!(found(&mut supervisor, &long(0.0), 1), None);
        // The limit itself is not beyond the limit …
        assert_eq!(found(&mut supervisor, &long(limit), 1), None, "{fault:?}");
        // … nor is no time at all …
        assert_eq!(found(&mut supervisor, &long(0.0), 1000), None, "{fault:?}");
        // … but any more is.
        assert_eq!(
            found(&mut supervisor, &long(limit * 1e-6), 1),
            Some((1, fault, place))
        );
    }
}

#[test]
fn of_several_the_one_that_demands_more_is_told() {
    let everything = Cycle {
        wheels: speeds(9.0, 0.0).0.wheels,
        currents: [Some(9.0), None],
        supply: 99.0,
        estimate_is_finite: false,
        ..FINE
    };
    let all = (
        Cycle {
            dt: 2.0,
            ..everything
        },
        [Following::FarOff; 2],
    );
    let order = [
        (Fault::Overspeed, Place::Base),
        (Fault::Overcurrent, Place::Left),
        (Fault::Overvoltage, Place::Base),
        (Fault::Following, Place::Base),
        (Fault::Estimator, Place::Base),
    ];
    let mut without = all;
    for (fault, place) in order {
        let mut supervisor = Supervisor::default();
        assert_eq!(
            found(&mut supervisor, &without, 2),
            Some((2, fault, place)),
            "{without:?}"
        );
        match fault {
            Fault::Overspeed => without.0.wheels = FINE.wheels,
            Fault::Overcurrent => without.0.currents = FINE.currents,
            Fault::Overvoltage => without.0.supply = 12.0,
            _ => without.1 = CLOSELY,
        }
    }
}

#[test]
fn an_estimate_that_is_no_number_is_found_at_once() {
    for phase in 0..4 {
        let mut supervisor = Supervisor::default();
        found(&mut supervisor, &(FINE, CLOSELY), phase);
        let broken = Cycle {
            estimate_is_finite: false,
            ..FINE
        };
        let (tick, fault, place) = found(&mut supervisor, &(broken, CLOSELY), 2).expect("found");
        assert!(tick <= 2);
        assert_eq!((fault, place), (Fault::Estimator, Place::Base));
        // And no longer than it lasts.
        assert_eq!(found(&mut supervisor, &(FINE, CLOSELY), 1000), None);
    }
}

#[test]
fn a_start_forgets_what_was_out_of_bounds() {
    for (case, limit, ..) in cases() {
        let ticks = (limit / DT).round() as u32;
        let mut supervisor = Supervisor::default();
        for _ in 0..5 {
            assert_eq!(found(&mut supervisor, &case, ticks - 1), None);
            supervisor.start(&[STILL; 2]);
        }
    }
    let late = Cycle { steps: 19, ..FINE };
    let mut supervisor = Supervisor::default();
    for _ in 0..5 {
        assert_eq!(found(&mut supervisor, &(late, CLOSELY), 1), None);
        supervisor.start(&[STILL; 2]);
    }
}

#[test]
fn a_cause_persists_as_long_as_it_is_out_of_bounds_now() {
    let finite = |estimate_is_finite| Cycle {
        estimate_is_finite,
        ..FINE
    };
    let (fast, above) = (1.0_f32.next_up(), 4.0_f32.next_up());
    for (fault, within, beyond) in [
        (
            Fault::Undervoltage,
            vec![supply(9.0).0, supply(99.0).0],
            vec![supply(9.0_f32.next_down()).0],
        ),
        (
            Fault::Overvoltage,
            vec![supply(15.0).0, supply(0.0).0],
            vec![supply(15.0_f32.next_up()).0],
        ),
        (
            Fault::Overcurrent,
            vec![FINE, currents(Some(4.0), Some(-4.0)).0],
            vec![
                currents(Some(above), None).0,
                currents(None, Some(-above)).0,
            ],
        ),
        (
            Fault::Overspeed,
            vec![speeds(1.0, -1.0).0],
            vec![speeds(fast, 0.0).0, speeds(0.0, -fast).0],
        ),
        (Fault::Estimator, vec![finite(true)], vec![finite(false)]),
    ] {
        for cycle in within {
            assert!(!CONFIG.persists(fault, &cycle), "{fault:?}: {cycle:?}");
        }
        for cycle in beyond {
            assert!(CONFIG.persists(fault, &cycle), "{fault:?}: {cycle:?}");
        }
    }
    // All others are gone when the motors are off, or the controller knows better.
    let worst = Cycle {
        wheels: speeds(9.0, 9.0).0.wheels,
        currents: [Some(99.0); 2],
        supply: 0.0,
        estimate_is_finite: false,
        ..FINE
    };
    for fault in Fault::ALL {
        let persists = matches!(
            fault,
            Fault::Undervoltage | Fault::Overcurrent | Fault::Overspeed | Fault::Estimator
        );
        assert_eq!(CONFIG.persists(*fault, &worst), persists, "{fault:?}");
    }
}

#[test]
fn places_have_the_protocol_s_names() {
    let places = [Place::Base, Place::Left, Place::Right, Place::Both];
    assert_eq!(
        places.map(Place::name),
        [None, Some("left"), Some("right"), Some("both")]
    );
}
