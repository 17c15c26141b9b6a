//! The image answers as the library on this computer does, and goes where it goes.

mod image;

use hil_sim::base::Base;
use hil_sim::emulator::Setup;
use hil_sim::script::Script;
use image::{Client, emulated, emulated_on, host_on};
use std::path::Path;

/// The two do the same in each tick, but idle takes its time: a line may take effect a tick later, and be answered from the state of a tick earlier. A
/// speed that is asked for while it changes differs by what it changes in two ticks, m/s and °/s.
const SPEED: [f64; 2] = [5e-3, 1.0];
/// A pose that is asked for while it moves at up to 0.5 m/s and 90 °/s, m, m, °.
const POSE: [f64; 3] = [1e-3, 1e-3, 0.2];
/// Variances follow the pose.
const COVARIANCE: f64 = 0.01;
/// The remainder of a motion at its end: the tolerances of the base itself, m and °.
const RESIDUAL: [f64; 2] = [1e-3, 0.2];
/// Where they end, m and °.
const END: [f64; 2] = [0.5e-3, 0.05];

fn numbers(line: &str) -> Vec<f64> {
    line.split_whitespace()
        .filter_map(|word| word.parse().ok())
        .collect()
}

/// The words of a line that are no numbers.
fn words(line: &str) -> Vec<&str> {
    let words = line.split_whitespace();
    words.filter(|word| word.parse::<f64>().is_err()).collect()
}

/// What must be the same in both: the target's name is the only word that may differ.
fn same(host: &str, image: &str) -> Result<(), String> {
    let image = image.replace("nucleo-f429zi", "hil-sim");
    let (ours, theirs) = (numbers(host), numbers(&image));
    if words(host) != words(&image) || ours.len() != theirs.len() {
        return Err("other words".into());
    }
    for (place, (a, b)) in ours.iter().zip(&theirs).enumerate() {
        let allowed = match (words(host)[0], place) {
            ("EstSpeed", place) => SPEED[place],
            ("EstPos", place @ 0..=2) => POSE[place],
            // A covariance is measured by the variances; a thousandth of a degree times a millimetre is nothing.
            ("EstPos", _) => COVARIANCE * a.abs() + 2e-4,
            ("!", _) => RESIDUAL[usize::from(host.starts_with("! turn"))],
            ("Observed" | "ERR", _) => 0.01 * a.abs() + 0.01,
            _ => 0.0,
        };
        if (a - b).abs() > allowed {
            return Err(format!("{a} and {b} differ by more than {allowed}"));
        }
    }
    Ok(())
}

/// The replies alone, and the events alone: a reply may overtake an event that happened in the same few milliseconds. Telemetry is left out: it is of
/// the instant at which it is sent.
fn replies_and_events(lines: &[(u64, String)]) -> [Vec<&str>; 2] {
    let of = |events: bool| {
        let lines = lines.iter().map(|(_, line)| line.as_str());
        lines
            .filter(|line| !line.starts_with('~') && line.starts_with('!') == events)
            .collect()
    };
    [of(false), of(true)]
}

fn agree(name: &str, script: &Script) {
    agree_on("default", name, script);
}

fn agree_on(robot: &str, name: &str, script: &Script) {
    let mut library = Client::new(host_on(robot));
    library.play(script);
    let mut shipped = Client::new(emulated_on(robot));
    shipped.play(script);

    let ours = replies_and_events(&library.lines);
    let theirs = replies_and_events(&shipped.lines);
    for (ours, theirs) in ours.iter().zip(&theirs) {
        for (a, b) in ours.iter().zip(theirs) {
            if let Err(difference) = same(a, b) {
                panic!("{name}: {difference}:\n  library {a}\n  image   {b}");
            }
        }
        assert_eq!(ours.len(), theirs.len(), "{name}: {ours:?} {theirs:?}");
    }

    let (a, b) = (library.base.row(), shipped.base.row().unwrap());
    let ends = [
        (
            "true",
            [a.true_x, a.true_y, a.true_theta],
            [b.true_x, b.true_y, b.true_theta],
        ),
        (
            "estimated",
            [a.est_x, a.est_y, a.est_theta],
            [b.est_x, b.est_y, b.est_theta],
        ),
    ];
    assert_eq!(library.base.holds().unwrap(), shipped.base.holds().unwrap());
    for (what, a, b) in ends {
        let apart = (a[0] - b[0]).hypot(a[1] - b[1]);
        let turned = (a[2] - b[2]).to_degrees().abs();
        assert!(
            apart < END[0],
            "{name}: {what} ends {:.3} mm apart",
            apart * 1e3
        );
        assert!(turned < END[1], "{name}: {what} ends {turned:.4}° apart");
        println!(
            "{name}: {what} ends {:.4} mm and {turned:.5}° apart",
            apart * 1e3
        );
    }
}

fn scenario(name: &str) {
    let scenarios = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios");
    agree(name, &Script::load(&scenarios.join(name)).unwrap());
}

/// Robots whose parameters are not those that the image was built with: it finds theirs in its flash.
#[test]
fn metre_on_other_robots() {
    let scenarios = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios");
    let script = Script::load(&scenarios.join("metre.script")).unwrap();
    for robot in ["uncalibrated", "robuter"] {
        agree_on(robot, robot, &script);
    }
}

#[test]
fn correction() {
    scenario("correction.script");
}

#[test]
fn every_state() {
    scenario("every_state.script");
}

#[test]
fn keep_going() {
    scenario("keep_going.script");
}

#[test]
fn metre() {
    scenario("metre.script");
}

#[test]
fn push() {
    scenario("push.script");
}

#[test]
fn square() {
    scenario("square.script");
}

#[test]
fn tour() {
    scenario("tour.script");
}

#[test]
fn velocity() {
    scenario("velocity.script");
}

/// Every command, with what refuses it.
#[test]
fn every_command_is_answered_alike() {
    let script = "
0     Version
0.1   help
0.2   Help move
0.3   nonsense
0.4   move 1 2 3 4
0.5   m x
0.6   m 0.1 99
0.7   GetStatus
0.8   GetParam wheel_base
0.9   SetParam wheel_base 0.21
1.0   GetParam wheel_base
1.1   SetParam wheel_base 99
1.2   SetParam no_such_thing 1
1.3   ResetParams
1.4   GetParam wheel_base
1.5   @17 GetStatus
1.6   @17
1.7   GetStatus*0000
1.8   Disable
1.9   m 0.1
2.0   Enable
2.1   EStop
2.2   GetStatus
2.3   m 0.1
2.4   ClearFault
2.5   GetStatus
2.6   ResetPos 1 2 90 1e-4 0 0 1e-4 0 4
2.7   GetEstPos
2.8   ResetPos 1 2 90 1e-4 9 0 1e-4 0 4
2.9   CorrectPos 0.1 0 0 1 0 0 0 1 0 0 0 1
3.0   GetEstPos
3.1   Stop
3.12  Mark a 0.5
3.14  Sight lamp 0 2 3
3.16  AmIThere a
3.18  AmIThere nowhere
3.2   m 0.2
4.5   t -30
6.5   GetEstPos
6.6   Stream 0
6.8   GetStatus
6.82  Mark b
6.84  Crosses a b b a
6.9   Route a b 0.5
6.92  Freeway a b 1
6.94  Route a b 0.5
7.0   Sight lamp
7.1   Label b c*d
7.12  Mark a
7.2   GetMap
7.3   ForgetMap
";
    agree("commands", &Script::parse(script, "commands").unwrap());
}

/// Paths, a target, and what ends them.
#[test]
fn paths_are_driven_alike() {
    let script = "
0     Follow 0.5 0
0.1   Follow 0.5 0.5 - 0.2
0.2   Follow 0 0.5 180
0.3   GetPath
0.4   Follow start
3     ObservePos 0.45 0.02 20 1e-4 0 0 1e-4 0 4
12    GetPath
12.1  GoTo 0 0 0
13    Stop
14    Follow start
20    GetEstPos
20    Chase 0.3 0.1
20.5  Chase 0.35 0.1
21    Chase 0.4 0.1
24    Chase 1 0
24.5  EStop
25    ClearFault
25.1  Follow 0 0 0 99
25.2  GetPath
";
    agree("paths", &Script::parse(script, "paths").unwrap());
}

/// Two runs are the same, byte for byte and bit for bit.
#[test]
fn runs_repeat() {
    let script = Script::parse(
        "0 Stream 0.05\n0.3 m 0.2\n0.4 t 40\n1.5 m -0.1\n2.5 !end\n",
        "repeat",
    )
    .unwrap();
    let run = || {
        let mut client = Client::new(emulated(&Setup::default()));
        client.play(&script);
        let row = client.base.row().unwrap();
        (
            client.lines,
            row,
            client.base.plant().pose().map(f64::to_bits),
        )
    };
    assert_eq!(run(), run());
}
