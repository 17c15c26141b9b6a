//! Faults on the simulated base: what its counters and motors make of them.

mod bench;

use bench::Bench;
use hil_sim::faults::{EncoderFault, Fault, Side};
use hil_sim::plant::Plant;

const SIDES: [Side; 3] = [Side::Left, Side::Right, Side::Both];

/// What the encoders of the controller count, and what they truly counted, in a second of driving. It does not look at what the base makes of it.
fn count(bench: &mut Bench) -> [(i64, i64); 2] {
    let seen = |bench: &Bench| {
        let row = bench.rig.row();
        [row.left_count, row.right_count]
    };
    let before = (seen(bench), bench.rig.plant().counts());
    bench.run(1.0);
    let after = (seen(bench), bench.rig.plant().counts());
    [0, 1].map(|wheel| {
        (
            after.0[wheel] - before.0[wheel],
            after.1[wheel] - before.1[wheel],
        )
    })
}

/// A robot that turns its wheels to one side and to the other, whatever its encoders say: as no controller does it, somebody pushes.
fn pushed(seed: u64) -> Bench {
    let mut bench = Bench::new("default", seed);
    bench.send("Disable");
    bench.run(0.1);
    bench.rig.push(14.0, 0.3, 100.0);
    bench.run(1.0);
    bench
}

fn expect(fault: EncoderFault, check: impl Fn(i64, i64)) {
    for seed in 0..3 {
        for side in SIDES {
            let mut bench = pushed(seed);
            bench.rig.inject(Fault::Encoder(side, fault)).unwrap();
            // A jump and the edge of a break are not part of what is counted.
            bench.run(0.002);
            let faulty = count(&mut bench);
            bench.rig.clear_faults();
            bench.run(0.002);
            let cleared = count(&mut bench);
            for wheel in [0, 1] {
                let (seen, truth) = faulty[wheel];
                assert!(truth > 2000, "the push turns the wheels: {truth}");
                if side.wheels().any(|other| other == wheel) {
                    check(seen, truth);
                } else {
                    assert_eq!(seen, truth, "the other wheel is sound");
                }
                assert_eq!(cleared[wheel].0, cleared[wheel].1, "{fault} is gone");
            }
        }
    }
}

#[test]
fn a_stuck_encoder_counts_nothing() {
    expect(EncoderFault::Stuck, |seen, _| assert_eq!(seen, 0));
}

#[test]
fn an_open_channel_leaves_one_count() {
    for fault in [EncoderFault::OpenA, EncoderFault::OpenB] {
        expect(fault, |seen, _| assert!(seen.abs() <= 1, "{seen}"));
    }
}

#[test]
fn exchanged_channels_count_backward() {
    expect(EncoderFault::Swapped, |seen, truth| {
        assert_eq!(seen, -truth)
    });
}

#[test]
fn another_disc_counts_in_proportion() {
    expect(EncoderFault::Scale(2.0), |seen, truth| {
        assert_eq!(seen, 2 * truth);
    });
    expect(EncoderFault::Scale(0.5), |seen, truth| {
        assert!((2 * seen - truth).abs() <= 1);
    });
}

#[test]
fn half_of_the_counts_are_lost() {
    expect(EncoderFault::Drop(0.5), |seen, truth| {
        // Binomial: four standard deviations of √(n/4).
        let (seen, truth) = (seen as f64, truth as f64);
        assert!(
            (seen - 0.5 * truth).abs() < 4.0 * (0.25 * truth).sqrt(),
            "{seen} {truth}"
        );
    });
}

/// At the clearing and at the jump itself: what the controller sees is what the encoder moved, and the jump.
#[test]
fn a_jump_is_there_at_once_and_stays() {
    for jump in [500, -500] {
        let mut bench = pushed(1);
        let seen = bench.rig.row().left_count;
        let truth = bench.rig.plant().counts()[0];
        let fault = Fault::Encoder(Side::Left, EncoderFault::Jump(jump));
        bench.rig.inject(fault).unwrap();
        for _ in 0..10 {
            bench.run(0.001);
            let moved = bench.rig.plant().counts()[0] - truth;
            assert_eq!(bench.rig.row().left_count - seen, moved + jump);
        }
        bench.rig.clear_faults();
        bench.run(0.1);
        let moved = bench.rig.plant().counts()[0] - truth;
        assert_eq!(bench.rig.row().left_count - seen, moved + jump);
    }
}

/// The robot's counters have 16 bits: at twice the counts they wrap within seconds, and the controller's count does not.
#[test]
fn counters_wrap_under_a_fault() {
    let mut bench = pushed(1);
    let fault = Fault::Encoder(Side::Both, EncoderFault::Scale(-2.0));
    bench.rig.inject(fault).unwrap();
    let row = bench.rig.row();
    let truth = bench.rig.plant().counts();
    bench.rig.push(14.0, 0.0, 100.0);
    bench.run(8.0);
    let moved = bench.rig.plant().counts()[0] - truth[0];
    assert!(moved > 40_000, "twice it is more than 16 bits: {moved}");
    assert_eq!(bench.rig.row().left_count - row.left_count, -2 * moved);
}

/// Two runs with the same seed, and one with another.
#[test]
fn faults_repeat_by_their_seed() {
    let run = |seed| {
        let mut bench = pushed(seed);
        let fault = Fault::Encoder(Side::Both, EncoderFault::Drop(0.5));
        bench.rig.inject(fault).unwrap();
        bench.run(1.0);
        (bench.rig.row(), bench.rig.plant().clone())
    };
    let bits = |(row, plant): (hil_sim::trace::Row, Plant)| (row, plant.pose().map(f64::to_bits));
    assert_eq!(bits(run(1)), bits(run(1)));
    assert_ne!(bits(run(1)).0.left_count, bits(run(2)).0.left_count);
}
