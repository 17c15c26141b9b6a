//! The cost of the tick, in instructions of the shipped image, while it goes through every state.

mod image;

use hil_sim::emulator::Setup;
use hil_sim::script::Script;
use image::{Client, emulated};

/// Half the ticks cost no more.
const MEDIAN: u64 = 1500;
/// No tick costs more.
const MAXIMUM: u64 = 4000;

#[test]
fn a_tick_is_cheap() {
    // Hold, accelerate, cruise, decelerate on both axes, alone and together; new commands on the way; a correction; a stop; a disable.
    let script = "
0.0  ResetPos 0 0 0 1e-4 0 0 1e-4 0 1
0.2  Stream 0.01
0.5  m 0.6 0.3 0.5
1.0  t 90 60 120
2.0  ObservePos 0.3 0 20 1e-4 0 0 1e-4 0 1
3.0  m inf 0.2
3.5  t -inf 20
4.5  m -0.2
5.5  Stop
6.5  t 720 180
7.5  EStop
8.5  ClearFault
8.6  Disable
9.0  Enable
9.1  m 0.1
";
    let mut base = emulated(&Setup::default());
    base.count(false).unwrap();
    let mut client = Client::new(base);
    client.play(&Script::parse(script, "states").unwrap());
    let counts = client.base.counts().unwrap();
    println!("{counts}");
    assert!(counts.median() <= MEDIAN, "median {}", counts.median());
    assert!(counts.maximum() <= MAXIMUM, "maximum {}", counts.maximum());
}
