//! What is found of faults with motors whose duty nobody knows: without a motor model how the axes follow, the speeds and the counts are left.

mod bench;
mod outside;

use bench::Bench;
use hil_sim::faults::{EncoderFault, Fault as Injected, MotorFault, Side};
use outside::robot;
use vehicle_controller::supervisor::Fault;

/// Drives at 0.3 m/s and lets something go wrong. What is found, after how many milliseconds, and how far the base has gone till then: m and degrees.
fn found(
    preset: &str,
    drive: &str,
    wrong: Injected,
    moving: bool,
) -> Option<(Fault, u32, f64, f64)> {
    let mut bench = Bench::of(&robot(preset, drive), 1);
    bench.send("m inf 0.3 0.5");
    if moving {
        bench.run(2.0);
    }
    bench.rig.inject(wrong).unwrap();
    let from = bench.truth();
    for k in 0..6000 {
        bench.tick();
        if let Some(fault) = bench.rig.snapshot().fault {
            let to = bench.truth();
            let gone = (to.x - from.x).hypot(to.y - from.y);
            return Some((fault, k, gone, to.heading - from.heading));
        }
    }
    None
}

/// Found as a following fault within so many milliseconds, metres and degrees.
fn assert_follows_not(robot: (&str, &str), wrong: Injected, most: (u32, f64, f64)) {
    let (preset, drive) = robot;
    for moving in [true, false] {
        let name = format!("{preset} {drive}, {wrong}, moving: {moving}");
        let Some((fault, after, gone, turned)) = found(preset, drive, wrong, moving) else {
            panic!("{name}: not found");
        };
        println!("{name}: {fault:?} after {after} ms, {gone:.3} m, {turned:.1}°");
        assert_eq!(fault, Fault::Following, "{name}");
        let (ms, metres, degrees) = most;
        let within = after <= ms && gone <= metres && turned.abs() <= degrees;
        assert!(within, "{name}: {after} ms, {gone} m, {turned}°");
    }
}

const SIDES: [Side; 3] = [Side::Left, Side::Right, Side::Both];

#[test]
fn a_motor_controller_that_takes_its_orders_and_does_nothing_is_found() {
    // Until the wheel has run out, and then the second for which an axis may be held up. The base is as far as it runs out by itself.
    for side in SIDES {
        let dead = Injected::Controller(side);
        assert_follows_not(("default", "speed"), dead, (1500, 0.08, 5.0));
        assert_follows_not(("default", "increment"), dead, (1500, 0.08, 5.0));
        assert_follows_not(("increments", "increment"), dead, (1700, 0.11, 2.0));
    }
    let dead = Injected::Controller(Side::Left);
    assert_follows_not(("tricycle", "increment"), dead, (1600, 0.09, 1.0));
    let dead = Injected::Controller(Side::Both);
    assert_follows_not(("cycab", "increment"), dead, (2200, 0.18, 1.0));
    // A car goes on straight ahead with one of two motors, and follows as it should: nothing is to be found.
    let dead = Injected::Controller(Side::Left);
    assert_eq!(found("cycab", "increment", dead, true), None);
    // What has no power is no other thing.
    let open = Injected::Motor(Side::Left, MotorFault::Open);
    assert_follows_not(("default", "increment"), open, (1500, 0.08, 5.0));
}

/// With a bridge the motor model finds what an encoder says wrongly within 0.2 s: `no-motion`, `encoder-channel`, `encoder-sign`, `mismatch` (tests/faults.rs).
/// Without one there is only what the axes make of it: a reference that waits for a second (`HeldUp`), or an error of five lags (`FarOff`).
#[test]
fn of_encoders_that_stand_or_count_backward_only_the_axes_tell() {
    for drive in ["speed", "increment"] {
        for fault in [
            EncoderFault::Stuck,
            EncoderFault::OpenA,
            EncoderFault::OpenB,
        ] {
            for side in SIDES {
                // The base turns about the wheel that seems to stand, at the crawl that a reference that waits leaves it.
                let wrong = Injected::Encoder(side, fault);
                assert_follows_not(("default", drive), wrong, (1300, 0.08, 36.0));
            }
        }
        let swapped = Injected::Encoder(Side::Left, EncoderFault::Swapped);
        assert_follows_not(("default", drive), swapped, (650, 0.04, 20.0));
        let twice = Injected::Encoder(Side::Left, EncoderFault::Scale(2.0));
        assert_follows_not(("default", drive), twice, (1300, 0.22, 36.0));
        // The one watch that is as quick as ever.
        let jump = Injected::Encoder(Side::Left, EncoderFault::Jump(5000));
        let jumped = found("default", drive, jump, true).unwrap();
        assert_eq!((jumped.0, jumped.1), (Fault::EncoderJump, 0));
    }
}

/// A bridge's motor model calls the first of them `mismatch`. Nothing here does: the axes follow what the encoders say, and the base goes in circles.
#[test]
fn an_encoder_that_loses_counts_is_not_found() {
    for drive in ["speed", "increment"] {
        for fault in [EncoderFault::Scale(0.5), EncoderFault::Drop(0.3)] {
            let wrong = Injected::Encoder(Side::Left, fault);
            assert_eq!(found("default", drive, wrong, true), None, "{wrong}");
        }
    }
    let scale = Injected::Encoder(Side::Left, EncoderFault::Scale(0.5));
    let by_model = found("default", "bridge", scale, true).unwrap();
    assert_eq!(by_model.0, Fault::Mismatch);
    // Nor one of a car's that stands: the other wheel's counts are half of the motion, and the steering makes up for the rest.
    let stuck = Injected::Encoder(Side::Left, EncoderFault::Stuck);
    assert_eq!(found("cycab", "increment", stuck, true), None);
}

#[test]
fn a_motor_controller_that_hears_nothing_stops_by_itself() {
    // The board is reset or hangs: no more orders. Here the plant and the motor controllers go on without it.
    let mut bench = Bench::of(&robot("default", "increment"), 1);
    bench.send("m inf 0.3 0.5");
    bench.run(2.0);
    let from = bench.truth().x;
    for _ in 0..2000 {
        bench.rig.tick_without_board();
    }
    let truth = bench.truth();
    assert!(truth.speed.abs() < 1e-3, "{truth:?}");
    // It holds where the last increment took it, and is shorted after a tenth of a second.
    assert!(truth.x - from < 0.03, "{} m", truth.x - from);
}
