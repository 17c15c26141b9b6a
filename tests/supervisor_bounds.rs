//! The supervisor alone: bounds of speed, current, supply and following, missed ticks, silence, jumps; and what its memory is made of.

use vehicle_controller::supervisor::{
    Config, Cycle, Fault, Following, Heartbeat, MotorModel, Place, Supervisor,
};
use vehicle_controller::vehicle::Wheel;

const CLOSELY: [Following; 2] = [Following::Closely; 2];
/// A tick, s.
const DT: f32 = 1e-3;

/// No motor model, so that nothing but the bounds is looked at.
const CONFIG: Config = Config {
    motor: MotorModel {
        static_friction: 0.0,
        speed_gain: 0.0,
        acceleration_gain: 0.0,
        resistance: 0.0,
        tolerance: 0.0,
        floor: 0.0,
        rest_floor: 0.0,
    },
    max_wheel_speed: 1.0,
    max_current: 4.0,
    supply: [9.0, 15.0],
    deadman: 1.0,
};

const STILL: Wheel = Wheel {
    count: 0,
    speed: 0.0,
    duty: 0.0,
};

const FINE: Cycle = Cycle {
    dt: DT,
    steps: 1,
    wheels: [STILL; 2],
    currents: [None; 2],
    supply: 12.0,
    motor_supply: 12.0,
    turns: false,
    estimate_is_finite: true,
};

/// A cycle that is out of bounds in some way, or hardly within them.
type Case = (Cycle, [Following; 2]);

fn speeds(left: f32, right: f32) -> Case {
    let wheels = [left, right].map(|speed| Wheel { speed, ..STILL });
    (Cycle { wheels, ..FINE }, CLOSELY)
}

fn currents(left: Option<f32>, right: Option<f32>) -> Case {
    let currents = [left, right];
    (Cycle { currents, ..FINE }, CLOSELY)
}

fn supply(supply: f32) -> Case {
    (Cycle { supply, ..FINE }, CLOSELY)
}

fn following(translation: Following, rotation: Following) -> Case {
    (FINE, [translation, rotation])
}

/// After how many ticks of a cycle, at most so many, something is found.
fn found(supervisor: &mut Supervisor, case: &Case, most: u32) -> Option<(u32, Fault, Place)> {
    (1..=most).find_map(|tick| {
        let (fault, place) = supervisor.watch(&CONFIG, &case.0, || case.1)?;
        Some((tick, fault, place))
    })
}

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

/// Ticks that come after so many periods, again and again: after how many something is found.
fn overrun(pattern: &[u32], most: usize) -> Option<usize> {
    let mut supervisor = Supervisor::default();
    let steps = pattern.iter().cycle().take(most);
    let mut ticks = steps.map(|steps| {
        let cycle = Cycle {
            steps: *steps,
            dt: *steps as f32 * DT,
            ..FINE
        };
        supervisor.watch(&CONFIG, &cycle, || CLOSELY)
    });
    let at = ticks.position(|found| {
        assert!(matches!(found, None | Some((Fault::Overrun, Place::Base))));
        found.is_some()
    })?;
    Some(at + 1)
}

#[test]
fn a_gap_of_twenty_periods_is_an_overrun_and_one_of_nineteen_is_not() {
    assert_eq!(overrun(&[20], 1), Some(1));
    assert_eq!(overrun(&[1000], 1), Some(1));
    // 19 periods leave 18 missed ticks, 36 halves, less the one that the tick itself forgives; 35 more ticks forgive the rest.
    let forgiven = [&[19][..], &[1; 35]].concat();
    assert_eq!(overrun(&forgiven, 100_000), None);
    // With two halves left, another such gap makes 37. With one, it is the third gap that does.
    let too_soon = [&[19][..], &[1; 33]].concat();
    assert_eq!(overrun(&too_soon, 1000), Some(35));
    let late = [&[19][..], &[1; 34]].concat();
    assert_eq!(overrun(&late, 1000), Some(2 * 35 + 1));
}

#[test]
fn every_third_tick_may_be_missed_and_no_more() {
    // A tick that comes forgives half a missed one: 1, 2, 1, 2 … misses one of three.
    assert_eq!(overrun(&[1, 2], 1_000_000), None);
    assert_eq!(overrun(&[1], 100_000), None);
    assert_eq!(overrun(&[0, 1], 100_000), None);
    // Half a missed one remains of each two that are late, and 37 halves are too many.
    assert_eq!(overrun(&[2], 1000), Some(37));
    let at = overrun(&[2, 2, 1], 1000).expect("found");
    assert!(at.abs_diff(3 * 36) <= 2, "{at}");
    // Double ticks forgive like others.
    assert_eq!(overrun(&[2, 2, 1, 0], 1_000_000), None);
}

#[test]
fn silence_lasts_from_the_last_sign_of_life() {
    let mut supervisor = Supervisor::default();
    assert!(!supervisor.is_silent(&CONFIG, 0.75));
    assert!(
        !supervisor.is_silent(&CONFIG, 0.25),
        "exactly the deadman time"
    );
    assert!(supervisor.is_silent(&CONFIG, 1e-3));
    supervisor.sign_of_life();
    assert!(!supervisor.is_silent(&CONFIG, 0.0));
    assert!(!supervisor.is_silent(&CONFIG, 0.75));
    // Motors that are switched on are no sign of life.
    supervisor.start(&[STILL; 2]);
    assert!(!supervisor.is_silent(&CONFIG, 0.25));
    assert!(supervisor.is_silent(&CONFIG, 0.25));
    let patient = Config {
        deadman: f32::INFINITY,
        ..CONFIG
    };
    assert!(!supervisor.is_silent(&patient, 1e9));
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
fn a_wheel_may_roll_three_times_as_far_as_it_can_and_ten_milliseconds_more() {
    // 3 · 1 m/s · 1 ms, and 3 · 1 m/s · 10 ms of budget; f32 knows them to 1e-8.
    let most = 0.033;
    for (rolled, place) in [
        ([most + 1e-6, 0.0], Place::Left),
        ([0.0, most + 1e-6], Place::Right),
        ([-most - 1e-6, 0.0], Place::Left),
        ([0.0, -most - 1e-6], Place::Right),
        ([1.0, -1e6], Place::Both),
    ] {
        assert_eq!(
            Supervisor::default().jumps(&CONFIG, rolled, DT),
            Some(place)
        );
        let sound = rolled.map(|x: f32| x.clamp(1e-6 - most, most - 1e-6));
        assert_eq!(Supervisor::default().jumps(&CONFIG, sound, DT), None);
    }
    // For ever at what is three times too fast.
    let mut supervisor = Supervisor::default();
    for _ in 0..10_000 {
        assert_eq!(supervisor.jumps(&CONFIG, [0.003, -0.003], DT), None);
    }
    // At four times, 1 mm of the budget goes with each tick: gone after 30 ms.
    let at = (1..100).find(|_| supervisor.jumps(&CONFIG, [0.004, 0.0], DT).is_some());
    assert!(matches!(at, Some(30 | 31)), "{at:?}");
}

#[test]
fn the_budget_itself_is_no_jump() {
    let budget = 3.0_f32 * 0.01 * CONFIG.max_wheel_speed;
    for sign in [1.0, -1.0] {
        let jump = |rolled: f32| Supervisor::default().jumps(&CONFIG, [0.0, sign * rolled], 0.0);
        assert_eq!(jump(budget), None);
        assert_eq!(jump(budget.next_up()), Some(Place::Right));
    }
}

#[test]
fn a_jump_is_made_up_for_with_time() {
    let mut supervisor = Supervisor::default();
    assert_eq!(
        supervisor.jumps(&CONFIG, [0.093, 0.0], DT),
        Some(Place::Left)
    );
    // 9 cm ahead, and 3 mm a tick are made up for: 3 cm is no jump any more after 20 of them.
    let at = (1..100).find(|_| supervisor.jumps(&CONFIG, [0.0; 2], DT).is_none());
    assert!(matches!(at, Some(20 | 21)), "{at:?}");
    // What is left of the budget is little, until it has been made up for, too.
    assert_eq!(
        supervisor.jumps(&CONFIG, [0.01, 0.0], DT),
        Some(Place::Left)
    );
    for _ in 0..20 {
        supervisor.jumps(&CONFIG, [0.0; 2], DT);
    }
    assert_eq!(supervisor.jumps(&CONFIG, [0.032, 0.032], DT), None);
}

#[test]
fn counts_that_come_late_or_in_no_time_are_no_jump() {
    let mut supervisor = Supervisor::default();
    for _ in 0..1000 {
        // All of ten milliseconds comes in a tick that took no time, at three times the speed.
        assert_eq!(supervisor.jumps(&CONFIG, [0.029, -0.029], 0.0), None);
        assert_eq!(supervisor.jumps(&CONFIG, [0.0; 2], 0.01), None);
        // A tick that came twice.
        assert_eq!(supervisor.jumps(&CONFIG, [0.0; 2], 0.0), None);
    }
    // A gap of a second has room for a second's way.
    assert_eq!(supervisor.jumps(&CONFIG, [1.0, 1.0], 1.0), None);
    assert_eq!(
        supervisor.jumps(&CONFIG, [0.031, 0.0], 0.0),
        Some(Place::Left)
    );
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
fn a_heartbeat_is_overdue_after_its_deadline_and_not_before() {
    let mut heartbeat = Heartbeat::new(3);
    for _ in 0..3 {
        for _ in 0..3 {
            assert!(heartbeat.beat(false));
        }
        assert!(!heartbeat.beat(false));
        assert!(!heartbeat.beat(false));
        assert!(heartbeat.beat(true));
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
