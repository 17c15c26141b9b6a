//! How long a speed takes from the network's door to the wheels' reference, over a line of 115 200 baud.
#![cfg(unix)]

mod common;

use base_bridge::params::Params;
use common::cable::Wire;
use common::{Base, Bridge, assert_prompt, sleep};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::time::{Duration, Instant};

/// Speeds that are said.
const SPEEDS: usize = 1000;

/// Whoever measures times needs a machine for himself.
#[test]
#[ignore = "timed: on a quiet machine"]
fn a_speed_reaches_the_wheels_in_3_ms() {
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let base = Base::start("default", 1, &[]);
    let bridge = Bridge::start(Wire(base.clone()), Params::default());
    bridge.wait_until_up(0);
    // Turning at 30 °/s all the while, so that the translation alone changes, from 0.2 m/s to rest and back: its line is 17 bytes, 1.5 ms.
    bridge.drive(0.2, 0.5, 2.0);
    let mut times = Vec::new();
    for speed in 0..SPEEDS {
        let v = if speed % 2 == 0 { 0.1 } else { 0.2 };
        let before = base.reference();
        let said = Instant::now();
        bridge.speeds(v, 0.5);
        while base.reference() == before && said.elapsed() < Duration::from_millis(200) {
            std::thread::sleep(Duration::from_micros(100));
        }
        times.push(said.elapsed().as_secs_f64() * 1e3);
        // The ramp of 0.1 m/s at 0.5 m/s² takes 0.2 s; in between, the speed is said again.
        sleep(0.12);
        bridge.speeds(v, 0.5);
        sleep(0.13 + random.random_range(0.0..0.02));
    }
    assert_prompt(times);
}
