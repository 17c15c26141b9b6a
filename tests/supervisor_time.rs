//! The supervisor alone: missed ticks, silence, jumps, heartbeats.

#[path = "supervised/cycles.rs"]
mod cycles;

use cycles::{CLOSELY, CONFIG, DT, FINE, STILL};
use vehicle_controller::supervisor::{Config, Cycle, Fault, Heartbeat, Place, Supervisor};

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
    for max_wheel_speed in [1.0, 2.0, 0.25] {
        let config = Config {
            max_wheel_speed,
            ..CONFIG
        };
        let budget = 3.0_f32 * 0.01 * max_wheel_speed;
        for sign in [1.0, -1.0] {
            let jump = |way: f32| Supervisor::default().jumps(&config, [0.0, sign * way], 0.0);
            assert_eq!(jump(budget), None);
            assert_eq!(jump(budget.next_up()), Some(Place::Right));
        }
    }
}

#[test]
fn a_jump_is_told_once_however_far_it_was() {
    // 9 cm, what 16 bits of coarse counts can be, and what 32 bits can.
    for way in [0.093, 400.0, 2e5] {
        let mut supervisor = Supervisor::default();
        assert_eq!(supervisor.jumps(&CONFIG, [way, 0.0], DT), Some(Place::Left));
        assert_eq!(supervisor.jumps(&CONFIG, [0.003, 0.003], DT), None, "{way}");
        // Nothing is left of the budget, until it has been made up for.
        assert_eq!(
            supervisor.jumps(&CONFIG, [0.0031, 0.0], DT),
            Some(Place::Left)
        );
        // 3 mm a tick are made up for, and the budget has 3 cm.
        for _ in 0..11 {
            assert_eq!(supervisor.jumps(&CONFIG, [0.0; 2], DT), None);
        }
        assert_eq!(supervisor.jumps(&CONFIG, [0.032, 0.032], DT), None);
    }
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
