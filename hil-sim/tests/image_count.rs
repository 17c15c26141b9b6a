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

/// What idle may take for one piece of work, in instructions. It is taken for dead after ten ticks of 168 000 cycles; with two cycles to an instruction, which
/// is more than the flash's wait states make of it, this is a third of them.
const PIECE: u64 = 280_000;
/// The follower's share of a tick's time: a twentieth.
const UPDATE: u64 = 8_400;

/// A path through as many postures as there is room for, short legs and hairpins among them, so that corners have to be searched for.
fn winding() -> String {
    let (mut x, mut y) = (0.0_f64, 0.0_f64);
    let postures = (0..32).map(|k| {
        let length = [0.25, 0.6, 0.12, 0.4][k % 4];
        let heading = [20.0_f64, 100.0, -30.0, 140.0][k % 4].to_radians();
        x += length * heading.cos();
        y += length * heading.sin();
        format!("{:.2} Follow {x:.3} {y:.3}", 0.02 * (k + 1) as f64)
    });
    let postures: Vec<_> = postures.collect();
    let mut script = format!("0 SetParam corner 0.15\n{}\n", postures.join("\n"));
    script += "1 Follow start\n6 ObservePos 0.1 0.3 60 1e-4 0 0 1e-4 0 1\n9 GetPath\n";
    script += "12 Chase 0 0\n12.5 Chase 0.1 0\n14 GoTo 0 0 90\n17 !end\n";
    script
}

#[test]
fn a_path_leaves_the_tick_alone_and_idle_its_time() {
    let script = Script::parse(&winding(), "winding").unwrap();
    let mut base = emulated(&Setup::default());
    base.count(true).unwrap();
    let mut client = Client::new(base);
    client.play(&script);
    let passed = |line: &&(u64, String)| line.1.starts_with("! posture");
    assert!(client.lines.iter().filter(passed).count() >= 2);
    let counts = client.base.counts().unwrap();
    println!("{counts}");
    assert!(counts.maximum() <= MAXIMUM, "maximum {}", counts.maximum());
    let most = |name: &str| {
        let of = counts
            .outside
            .iter()
            .filter(|(part, _)| part.ends_with(name));
        of.map(|(_, part)| part.most).max().unwrap_or_default()
    };
    let (plan, update) = (most("Follower<_>::start"), most("Follower<_>::update"));
    // It was planned, and followed.
    assert!(plan > 10_000 && plan <= PIECE, "a plan takes {plan}");
    assert!(
        update > 1_000 && update <= UPDATE,
        "an update takes {update}"
    );
}
