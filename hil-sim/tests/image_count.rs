//! The cost of the tick, in instructions of the shipped image, while it goes through every state.

mod image;

use hil_sim::emulator::Setup;
use hil_sim::script::Script;
use image::{Client, emulated, host};
use std::collections::HashSet;
use std::path::Path;
use vehicle_controller::controller::State;

/// Half the ticks cost no more.
const MEDIAN: u64 = 1500;
/// No tick costs more.
const MAXIMUM: u64 = 4000;

#[test]
fn a_tick_is_cheap() {
    let scenario = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/every_state.script");
    let mut base = emulated(&Setup::default());
    base.count(false).unwrap();
    let mut client = Client::new(base);
    client.play(&Script::load(&scenario).unwrap());
    let counts = client.base.counts().unwrap();
    // The library on this computer goes the same way, and is easier to look into.
    let mut seen = HashSet::new();
    let mut library = Client::new(host());
    library.play_and(&Script::load(&scenario).unwrap(), |base| {
        let snapshot = base.snapshot();
        seen.insert((snapshot.translation.state, snapshot.rotation.state));
    });
    for state in [State::Hold, State::Accel, State::Move, State::Deccel] {
        assert!(
            seen.iter().any(|(translation, _)| *translation == state),
            "{state:?}"
        );
        assert!(
            seen.iter().any(|(_, rotation)| *rotation == state),
            "{state:?}"
        );
    }
    println!("{counts}");
    assert!(counts.median() <= MEDIAN, "median {}", counts.median());
    assert!(counts.maximum() <= MAXIMUM, "maximum {}", counts.maximum());
}
