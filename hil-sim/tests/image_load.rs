//! A minute with the serial line full both ways: the tick is never late, no byte is lost, every line is answered in its order.

mod image;

use hil_sim::base::Base;
use hil_sim::emulator::Setup;
use image::{Client, emulated};
use std::collections::VecDeque;

/// Lines that may be unanswered.
const OUTSTANDING: usize = 4;
/// Each line is padded to so many bytes with its end: four of them keep the line to the base full until the first is answered.
const LINE_BYTES: usize = 250;
/// What 115 200 baud can carry, bytes.
const FULL: usize = 11_520 * 60;
/// The least part of it that counts as full: four lines of 250 bytes leave the line for a moment if their replies wait behind telemetry.
const SATURATED: f64 = 0.92;
/// The latest start of a tick after the earliest, µs.
const JITTER: f64 = 5.0;

/// What is asked, over and over, and how each answer begins; the base drives in circles meanwhile.
const LINES: [(&str, &str); 7] = [
    ("GetEstPos", "EstPos "),
    ("m inf 0.2", "OK"),
    ("GetWheels", "Wheels "),
    ("GetState", "State "),
    ("t inf 30", "OK"),
    ("GetEstSpeed", "EstSpeed "),
    ("GetBattery", "Battery "),
];

#[test]
fn a_minute_at_full_load() {
    let mut base = emulated(&Setup::default());
    base.count(false).unwrap();
    let mut client = Client::new(base);
    client.wait_for("! boot", 100);
    // As much as the line has left beside the replies.
    let fields = "t x y theta v_s v_alpha s s_ref alpha alpha_ref left_count right_count battery";
    client.ask(&format!("Stream 0.012 {fields}"));
    let (mut to_base, from_base) = (0, client.received);
    let mut expected: VecDeque<(usize, &str)> = VecDeque::new();
    let (mut next, mut answered, mut read) = (0_usize, 0_usize, client.lines.len());
    while client.time < 60_000 {
        while expected.len() < OUTSTANDING {
            let (line, reply) = LINES[next % LINES.len()];
            let line = format!("@{} {line}", next % 65_536);
            client.send(&format!("{line:<width$}", width = LINE_BYTES - 1));
            to_base += LINE_BYTES;
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
    let from_base = client.received - from_base;
    println!("{to_base} bytes to the base, {from_base} from it");
    for bytes in [to_base, from_base] {
        assert!(bytes as f64 > SATURATED * FULL as f64, "{bytes} bytes");
    }
    assert_eq!(ticks, 60_000);
    assert!(counts.jitter() <= JITTER, "{} us", counts.jitter());
    assert!(answered > 2000, "{answered} lines");
    assert!(client.base.plant().pose()[2] > 10.0, "it did not drive");
}

/// Cycles of the processor in a period of the tick.
const CYCLES: f64 = 168e3;
/// An instruction takes one cycle at least, and on average not more than three.
const CYCLES_EACH: [f64; 2] = [1.0, 3.0];
/// Instructions of the handler behind the one that looks at the timer.
const BEHIND: f64 = 60.0;

#[test]
fn the_tick_load_is_what_the_ticks_take() {
    let mut base = emulated(&Setup::default());
    base.count(false).unwrap();
    let mut client = Client::new(base);
    client.wait_for("! boot", 100);
    assert_eq!(client.ask("Stream 0.05 t tick_load"), "OK");
    assert_eq!(client.ask("m 0.2 0.3"), "OK");
    assert_eq!(client.ask("t 90 60"), "OK");
    client.run(2500);
    let counts = client.base.counts().unwrap();
    let rows: Vec<[f64; 2]> = client
        .lines
        .iter()
        .filter_map(|(_, line)| {
            let mut words = line.strip_prefix("~ ")?.split(' ');
            let mut number = || words.next()?.parse().ok();
            Some([number()?, number()?])
        })
        .collect();
    assert!(rows.len() > 40, "{} lines", rows.len());
    // The first line has no beginning.
    for pair in rows.windows(2) {
        let [[from, _], [to, load]] = [pair[0], pair[1]];
        let most = counts.starts.iter().zip(&counts.ticks);
        // The emulated clock runs from the reset, the base's from its first tick: a few ms more on either side hold what may be meant.
        let within = |start: u64, margin: f64| {
            let t = start as f64 * 1e-9;
            t > from - margin && t < to + margin
        };
        let largest = |margin: f64| {
            let counted = most.clone().filter(|(start, _)| within(**start, margin));
            counted.map(|(_, count)| *count as f64).fold(0.0, f64::max)
        };
        let low = (largest(-0.01) - BEHIND) * CYCLES_EACH[0] / CYCLES;
        let high = largest(0.1) * CYCLES_EACH[1] / CYCLES;
        assert!(
            (low - 5e-4..=high).contains(&load),
            "{load} is not within {low} and {high} at {to} s"
        );
    }
    let most = rows.iter().map(|row| row[1]).fold(0.0, f64::max);
    println!(
        "tick_load up to {most}, of {} instructions",
        counts.maximum()
    );
}
