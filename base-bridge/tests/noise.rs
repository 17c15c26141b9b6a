//! A line that damages what it carries: the base is driven all the same, and stopped.
#![cfg(unix)]

mod common;

use base_bridge::params::Params;
use common::cable::Noisy;
use common::{Base, Bridge, sleep};

/// One byte in so many is another one: of the lines there and back, one in ten.
const SHARE: f64 = 1.0 / 300.0;

#[test]
fn a_base_beside_a_motor_is_driven_and_stopped() {
    let bases: Vec<_> = (0..4_u64)
        .map(|seed| {
            std::thread::spawn(move || {
                let base = Base::start("default", seed, &[]);
                let door = Noisy {
                    base: base.clone(),
                    seed,
                    share: SHARE,
                };
                let params = Params {
                    line_checks: true,
                    ..Params::default()
                };
                let bridge = Bridge::start(door, params);
                bridge.wait_for_motion(0);
                for _ in 0..5 {
                    let mark = bridge.mark();
                    bridge.wait_for_motion(mark);
                    bridge.drive_until(0.3, 0.0, || base.speed().0 > 0.25);
                    let silent = base.now().t;
                    // The silence, a Stop that is damaged twice, and the ramp.
                    base.wait_until(silent + 0.25 + 2.0 * 0.5 + 0.3 + 0.2);
                    let (speed, _) = base.speed();
                    assert!(speed < 5e-3, "seed {seed}: {speed}");
                    let stopped = base.now().pose;
                    sleep(0.5);
                    let now = base.now().pose;
                    assert!((now[0] - stopped[0]).abs() < 1e-3, "seed {seed}: by itself");
                }
                // What is told of it is never far off: a number that is damaged moves odom by less than a base can.
                for pair in bridge.motions(0).windows(2) {
                    let moved = pair[0].odom.inverse().then(&pair[1].odom);
                    let dt = (pair[1].stamp - pair[0].stamp) as f64 * 1e-9;
                    assert!(
                        moved.x.hypot(moved.y) < 1.5 * 0.7 * dt.max(0.02) + 0.1,
                        "{pair:?}"
                    );
                }
            })
        })
        .collect();
    for base in bases {
        base.join().unwrap();
    }
}
