//! The cost of the tick, in instructions of the shipped image, while it goes through every state.

mod image;

use hil_sim::emulator::Setup;
use hil_sim::script::Script;
use image::{Client, emulated};
use std::path::Path;

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
    println!("{counts}");
    assert!(counts.median() <= MEDIAN, "median {}", counts.median());
    assert!(counts.maximum() <= MAXIMUM, "maximum {}", counts.maximum());
}
