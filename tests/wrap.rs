//! Encoder counters are modular: nothing happens when they wrap.

mod counts;

use counts::{Bits, config, geometry, vehicle};
use vehicle_controller::vehicle::differential::Config;
use vehicle_controller::vehicle::{Motion, VirtualVehicle};

/// What the vehicle makes of counters that begin at `start` and go on by these steps per millisecond.
fn motions<B: Bits>(config: &Config, start: i64, steps: &[[i64; 2]]) -> Vec<Motion> {
    let (mut vehicle, counts) = vehicle::<B>(config, [start, start]);
    let mut motions = Vec::new();
    for step in steps {
        for (count, step) in counts.iter().zip(step) {
            count.set(count.get() + step);
        }
        motions.push(vehicle.sense(1e-3));
    }
    motions
}

/// 500 ms forward, 500 ms back, and both wheels against each other, at about ten counts a millisecond.
fn there_and_back() -> Vec<[i64; 2]> {
    (0..1500)
        .map(|k: i64| match k / 500 {
            0 => [10 + k % 2, 11 - k % 3],
            1 => [-10 - k % 2, -11 + k % 3],
            _ => [-7 - k % 5, 8 + k % 4],
        })
        .collect()
}

#[test]
fn a_16_bit_wrap_changes_no_bit_of_the_increments_in_either_direction() {
    let steps = there_and_back();
    let far = motions::<u16>(&config(geometry()), 30_000, &steps);
    // From 65 000 the first wrap is upward and the second downward; from 100 the other way round; the rest sit on the edge.
    for start in [65_000, 100, 65_535, 0, -1, 1_000_000] {
        let near = motions::<u16>(&config(geometry()), start, &steps);
        assert_eq!(near, far, "from {start}");
    }
}

#[test]
fn a_32_bit_wrap_changes_no_bit_of_the_increments_in_either_direction() {
    let steps = there_and_back();
    let far = motions::<u32>(&config(geometry()), 1_000_000_000, &steps);
    let top = i64::from(u32::MAX);
    for start in [top - 500, 100, top, 0, 1 << 31, (1 << 31) - 1] {
        let near = motions::<u32>(&config(geometry()), start, &steps);
        assert_eq!(near, far, "from {start}");
    }
}

#[test]
fn sixteen_and_thirty_two_bits_give_the_same_over_many_turns_of_the_counter() {
    // 3 million counts: 46 turns of a 16-bit counter.
    let steps = vec![[29, 31]; 100_000];
    let narrow = motions::<u16>(&config(geometry()), 0, &steps);
    assert_eq!(narrow, motions::<u32>(&config(geometry()), 0, &steps));
}

#[test]
fn reversed_encoders_wrap_as_well() {
    let config = Config {
        encoder_reversed: [true, false],
        ..config(geometry())
    };
    let steps = there_and_back();
    let far = motions::<u16>(&config, 30_000, &steps);
    assert_eq!(motions::<u16>(&config, 65_000, &steps), far);
    let mirrored: Vec<_> = steps.iter().map(|[left, right]| [-left, *right]).collect();
    let straight = motions::<u16>(&counts::config(geometry()), 100, &mirrored);
    assert_eq!(straight, far);
}

#[test]
fn a_step_of_just_less_than_half_the_range_is_taken_whole() {
    let config = config(geometry());
    for half in [32_767, -32_767] {
        let narrow = motions::<u16>(&config, 50_000, &[[half, half]]);
        assert_eq!(narrow, motions::<u32>(&config, 50_000, &[[half, half]]));
        let moved = f64::from(narrow[0].increment.translation);
        // One f32 in the end: 6e-8 of 3.09 m, and the tail of the coefficient.
        assert!(
            (moved - half as f64 * counts::COUNT).abs() < 5e-7,
            "{moved}"
        );
    }
}

#[test]
fn half_the_range_at_once_is_ambiguous_but_does_not_panic() {
    let mut config = config(geometry());
    for reversed in [false, true] {
        config.encoder_reversed = [reversed, reversed];
        for step in [1 << 31, -(1 << 31), 1 << 15] {
            let wide = motions::<u32>(&config, 7, &[[step, step], [-step, step], [step, -step]]);
            let narrow = motions::<u16>(&config, 7, &[[step, step], [-step, step]]);
            for motion in wide.iter().chain(&narrow) {
                assert!(motion.increment.translation.is_finite());
                assert!(motion.increment.rotation.is_finite());
            }
        }
    }
}
