//! Where a chasing base takes its target to be, against where it is.

use vehicle_controller::time::Instant;
use vehicle_controller::trajectory::{Chase, KinematicLimits, Posture};

fn limits() -> KinematicLimits {
    KinematicLimits {
        speed: 0.6,
        acceleration: 0.5,
        turn_speed: 1.5,
        turn_acceleration: 3.0,
        max_curvature: f32::INFINITY,
        curvature_rate: f32::INFINITY,
        wheel_speed: 0.75,
        half_track: 0.1,
        slowest: 0.05,
        turns_in_place: true,
    }
}

fn posture([x, y]: [f64; 2]) -> Posture {
    Posture {
        x,
        y,
        heading: None,
        speed: None,
    }
}

fn at(seconds: f64) -> Instant {
    Instant::from_ticks((seconds * 1e6).round() as u64)
}

/// A chase that has seen a target for so many seconds, so often a second.
fn seen(target: impl Fn(f64) -> [f64; 2], seconds: u32, hertz: u32) -> Chase {
    let mut chase = Chase::default();
    for update in 0..=seconds * hertz {
        let t = f64::from(update) / f64::from(hertz);
        chase.replace(posture(target(t)), at(t), &limits());
    }
    chase
}

fn goal(chase: &Chase, seconds: f64) -> [f64; 2] {
    let goal = chase.goal(at(seconds), &limits()).unwrap();
    [goal.x, goal.y]
}

fn apart(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

#[test]
fn on_a_line_the_goal_is_as_far_ahead_as_braking_takes() {
    let target = |t: f64| [100.0 + 0.24 * t, -0.18 * t];
    for hertz in [1, 5, 20, 50] {
        let chase = seen(target, 20, hertz);
        for age in [0.0, 0.5, 1.0] {
            let age = age / f64::from(hertz);
            // u²/2a of 0.3 m/s and 0.5 m/s² is 0.3 s of its way. 20 s of smoothing leave e⁻⁴⁰ of the way to u at 50 Hz, (1/3)²⁰ at 1 Hz; f32 leaves 1e-7.
            let off = apart(goal(&chase, 20.0 + age), target(20.3 + age));
            assert!(off < 1e-5, "{hertz} Hz, {age} s: {off}");
        }
    }
}

#[test]
fn on_a_circle_the_goal_turns_with_it() {
    let target = |t: f64| [(0.3 * t).sin(), 1.0 - (0.3 * t).cos()];
    for hertz in [1, 5, 20, 50] {
        let chase = seen(target, 20, hertz);
        let age = 0.5 / f64::from(hertz);
        let off = apart(goal(&chase, 20.0 + age), target(20.3 + age));
        // The arc's versine over what is ahead, 0.09 m and up to 0.15 m of age, and a twentieth of it for what smoothing takes from u: straight on, with u as it was
        // when it was measured, it would be 2 cm at 50 Hz and 10 cm at 1 Hz.
        let ahead = 0.3 * (0.3 + age);
        let most = 0.5 * ahead * ahead + 0.05 * ahead;
        assert!(off < most, "{hertz} Hz: {off}, not {most}");
    }
}

#[test]
fn a_target_that_is_not_seen_any_more_stays_where_it_went() {
    let chase = seen(|t| [0.3 * t, 0.0], 10, 5);
    // A quarter longer than the 0.2 s between two.
    let last = goal(&chase, 10.25);
    assert!(apart(last, [3.0 + 0.3 * 0.55, 0.0]) < 1e-5, "{last:?}");
    assert_eq!(goal(&chase, 10.26), last);
    assert_eq!(goal(&chase, 100.0), last);
}

#[test]
fn what_is_no_target_replaces_none_and_leaps_are_not_believed() {
    let mut chase = Chase::default();
    chase.replace(posture([f64::NAN, 0.0]), at(0.0), &limits());
    assert_eq!(chase.goal(at(0.0), &limits()), None);
    // From one end of the floor to the other, ten times a second, and twice in a tick.
    for update in 0..100 {
        let side = if update % 2 == 0 { 1e6 } else { -1e6 };
        let now = at(0.1 * f64::from(update));
        chase.replace(posture([side, -side]), now, &limits());
        chase.replace(posture([side, f64::INFINITY]), now, &limits());
        chase.replace(posture([side, side]), now, &limits());
        // No faster than the base itself: 0.6 m/s for its age and for 0.6 s.
        let off = apart(goal(&chase, 0.1 * f64::from(update)), [side, side]);
        assert!(off <= 0.6 * 0.8, "{off}");
    }
}
