//! Encoders that lose counts or make too many, however many: what the matrix has between its points.

mod bench;

use bench::Bench;
use hil_sim::faults::Fault;

/// The base goes straight on at `speed` with motors of this strength when the left encoder, or both, go wrong; after how long that was latched, s, and how
/// far the base turned, °.
fn found(words: &[&str], speed: f64, strength: f64) -> Option<(f64, f64)> {
    let mut bench = Bench::new("default", 1);
    let weak = ["both", "motor", "weak", &strength.to_string()];
    bench.rig.inject(Fault::parse(&weak).unwrap()).unwrap();
    bench.send(&format!("m inf {speed} 1"));
    bench.run(1.5);
    let heading = bench.truth().heading;
    bench.rig.inject(Fault::parse(words).unwrap()).unwrap();
    for tick in 0..2000 {
        bench.tick();
        if bench.rig.snapshot().fault.is_some() {
            let turned = (bench.truth().heading - heading).abs();
            return Some((f64::from(tick) * 1e-3, turned));
        }
    }
    None
}

#[test]
fn no_share_of_lost_counts_goes_unnoticed() {
    for side in ["left", "both"] {
        for speed in [0.3, 0.5] {
            for percent in (50..=100).step_by(1) {
                for (kind, share) in [
                    ("drop", f64::from(percent) / 100.0),
                    ("scale", 1.0 - f64::from(percent) / 100.0),
                ] {
                    let words = [side, "encoder", kind, &format!("{share:.2}")];
                    let (seconds, turned) =
                        found(&words, speed, 1.0).unwrap_or_else(|| panic!("{words:?} {speed}"));
                    println!("{words:?} {speed}: {seconds:.3} s {turned:.1}°");
                    assert!(seconds <= 0.25, "{words:?} {speed}: {seconds} s");
                }
            }
        }
    }
}

/// A weaker motor hides some of what its encoder makes too many. docs/safety.md names these times.
#[test]
fn weaker_motors_take_longer_to_give_a_double_count_away() {
    for (speed, strength, at_most) in [
        (0.5, 1.0, 0.15),
        (0.3, 1.0, 0.15),
        (0.5, 0.85, 0.15),
        (0.3, 0.85, 0.5),
        (0.27, 0.85, 0.9),
    ] {
        let (seconds, _) = found(&["left", "encoder", "scale", "2"], speed, strength).unwrap();
        println!("{speed} m/s, {strength}: {seconds} s");
        assert!(seconds <= at_most, "{speed} m/s, {strength}: {seconds} s");
    }
}
