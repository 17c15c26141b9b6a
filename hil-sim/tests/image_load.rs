//! A minute with the serial line full both ways: the tick is never late, no byte is lost, every line is answered in its order.

mod image;

use hil_sim::base::Base;
use hil_sim::emulator::Setup;
use image::{Client, emulated};
use std::collections::VecDeque;

/// Lines that may be unanswered.
const OUTSTANDING: usize = 4;
/// The latest start of a tick after the earliest, µs.
const JITTER: f64 = 5.0;

/// What is asked, over and over, and how each answer begins; the base drives in circles meanwhile.
const LINES: [(&str, &str); 8] = [
    ("GetEstPos", "EstPos "),
    ("m inf 0.2", "OK"),
    ("GetWheels", "Wheels "),
    ("GetState", "State "),
    ("t inf 30", "OK"),
    ("GetEstSpeed", "EstSpeed "),
    ("ListParams", "Params "),
    ("GetBattery", "Battery "),
];

#[test]
fn a_minute_at_full_load() {
    let mut base = emulated(&Setup::default());
    base.count(false).unwrap();
    let mut client = Client::new(base);
    client.wait_for("! boot", 100);
    client.ask("Stream 0.02");
    let mut expected: VecDeque<(usize, &str)> = VecDeque::new();
    let (mut next, mut answered, mut read) = (0_usize, 0_usize, client.lines.len());
    while client.time < 60_000 {
        while expected.len() < OUTSTANDING {
            let (line, reply) = LINES[next % LINES.len()];
            client.send(&format!("@{} {line}", next % 65_536));
            expected.push_back((next % 65_536, reply));
            next += 1;
        }
        client.tick();
        for (_, line) in &client.lines[read..] {
            if line.starts_with(['!', '~']) {
                continue;
            }
            let (tag, reply) = expected.pop_front().unwrap();
            let wanted = format!("@{tag} {reply}");
            assert!(line.starts_with(&wanted), "{wanted} was answered {line}");
            answered += 1;
        }
        read = client.lines.len();
    }
    let counts = client.base.counts().unwrap();
    let ticks = counts.starts.len();
    println!(
        "{answered} lines answered; {ticks} ticks, jitter {:.3} us, median {} and maximum {} instructions",
        counts.jitter(),
        counts.median(),
        counts.maximum()
    );
    // The first comes a millisecond after the timer was started, some time after power-on.
    assert!((59_990..=60_000).contains(&ticks), "{ticks} ticks");
    assert!(counts.jitter() <= JITTER, "{} us", counts.jitter());
    assert!(answered > 2000, "{answered} lines");
    assert!(client.base.plant().pose()[2] > 10.0, "it did not drive");
}
