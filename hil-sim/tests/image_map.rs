//! The map at capacity on the shipped image: what its questions cost, and that nothing else has to wait for them.

mod image;

use hil_sim::emulator::{Counts, ImageBase, Setup};
use hil_sim::script::{Action, Script, Step};
use image::{Client, emulated};
use std::path::Path;

/// Half the ticks cost no more, and none costs more.
const TICK: [u64; 2] = [1500, 4000];
/// Instructions of a piece of a question: 2.5 ms at 168 MHz and 1.4 cycles each. Idle must come around within 10.
const PIECE: u64 = 300_000;
/// A question is answered within so many milliseconds.
const PATIENCE: u64 = 400;

/// What only the first place has, and tells its heading.
const GATE: &str = "Sight gate 90 0.5 30 0.05";

/// 32 places on a line, 0.2 m apart, each of which sees two or three of the others, and a lamp: 96 arcs, 4 labels a place.
fn fill(client: &mut Client<ImageBase>) {
    for line in [
        "SetParam max_turn_speed 720",
        "SetParam move_speed 0.5",
        "SetParam move_accel 2",
    ] {
        assert_eq!(client.ask(line), "OK");
    }
    for place in 0..32_i32 {
        if place > 0 {
            client.ask("m 0.2");
            client.wait_for("! move done", 2000);
        }
        assert_eq!(
            client.ask(&format!("Mark p{place}")),
            format!("Marked p{place}")
        );
        for back in 2..=4 {
            let seen = place - back;
            // The last six see a third one: 31 + 30 + 29 + 6 arcs.
            let reply = if seen >= 0 && (back < 4 || place >= 26) {
                let range = 0.2 * f64::from(back);
                client.ask(&format!("Sight p{seen} 180 2 {range:.1} 0.05"))
            } else if place == 0 && back == 4 {
                client.ask(GATE)
            } else {
                client.ask(&format!("Sight wall{back} 90 2"))
            };
            assert_eq!(reply, format!("Added p{place}"));
        }
        assert_eq!(client.ask(&format!("Label p{place} lamp")), "OK");
    }
    assert_eq!(client.ask("Mark p32"), "ERR full no room in the map");
    assert_eq!(client.ask("Label p0 door"), "ERR full no room in the map");
    let head = client.ask("GetMap");
    assert_eq!(head, "Map 32 128 96 p0");
    // 256 rows: 15 KB at 115 200 baud, and some milliseconds each.
    client.run(4000);
    for row in 1..32 {
        assert_eq!(
            client.ask(&format!("Freeway p{} p{row} 0.5", row - 1)),
            "OK"
        );
    }
}

/// Of the functions whose name ends so: instructions in all, and of the longest call.
fn spent(counts: &Counts, name: &str) -> (u64, u64) {
    let parts = counts
        .outside
        .iter()
        .filter(|(part, _)| part.ends_with(name));
    parts.fold((0, 0), |(total, most), (_, part)| {
        (total + part.total, most.max(part.most))
    })
}

/// Asks, and tells what it has cost: instructions beyond what recording alone takes, and milliseconds.
fn cost(client: &mut Client<ImageBase>, line: &str) -> String {
    // What recording and asking whether there is anything to do take, all the time.
    let quiet = client.base.counts().unwrap();
    client.run(100);
    let before = client.base.counts().unwrap();
    let idle = (spent(&before, "::chart").0 - spent(&quiet, "::chart").0) / 100;
    let sent = client.time;
    let from = client.lines.len();
    client.send(line);
    let mut reply = String::new();
    for _ in 0..PATIENCE {
        client.tick();
        let answered = client.lines[from..]
            .iter()
            .find(|line| !line.1.starts_with(['!', '~']));
        if let Some((_, line)) = answered {
            reply.clone_from(line);
            break;
        }
    }
    assert!(!reply.is_empty(), "{line} was not answered");
    let milliseconds = client.time - sent;
    client.run(100);
    let after = client.base.counts().unwrap();
    let since = |name| spent(&after, name).0 - spent(&before, name).0;
    // What is worked on is a part of `chart`.
    let all = since("::chart") + since("::ask") + since("::answer_map");
    let all = all.saturating_sub(idle * (milliseconds + 100));
    println!("{line:30} {reply:40} {all:9} instructions, {milliseconds} ms");
    reply
}

#[test]
fn questions_at_capacity_are_answered_and_nothing_waits_for_them() {
    let mut client = Client::new(emulated(&Setup::default()));
    fill(&mut client);
    // All the way back, so that there is something to reason about.
    client.ask("m -6.2");
    client.wait_for("! move done", 20_000);
    client.base.count(true).unwrap();
    assert!(cost(&mut client, "AmIThere p3").starts_with("AmIThere p3 "));
    assert!(cost(&mut client, "AmIThere").starts_with("AmIThere 32"));
    client.run(300);
    assert!(cost(&mut client, "Route p0 p31 0.4").starts_with("Route 32"));
    client.run(500);
    assert!(cost(&mut client, "Crosses p0 p9 p20 p31").starts_with("Crosses "));
    // After that, where the places lie has to be worked out again.
    assert!(cost(&mut client, "AmIThere p3").starts_with("AmIThere p3 "));
    // Any of them may be the one.
    assert!(cost(&mut client, "Sight lamp").starts_with("Unsure "));
    // Back where it began: what that tells of the stops since is checked, and taken over.
    let confirmed = cost(&mut client, GATE);
    let shrunk = confirmed.strip_prefix("Confirmed p0 ");
    let shrunk: u32 = shrunk
        .unwrap_or_else(|| panic!("{confirmed}"))
        .parse()
        .unwrap();
    assert!(shrunk > 10, "{confirmed}");
    assert!(cost(&mut client, "AmIThere p3").starts_with("AmIThere p3 "));
    let counts = client.base.counts().unwrap();
    println!("{counts}");
    for name in ["::ask", "::answer_map", "::chart"] {
        let (total, most) = spent(&counts, name);
        println!("{name}: {most} at most");
        assert!(total > 0 && most <= PIECE, "{name}: {most}");
    }
}

#[test]
fn the_tick_keeps_its_limits_while_the_map_works() {
    let mut client = Client::new(emulated(&Setup::default()));
    fill(&mut client);
    // What the tick is measured by without a map, and questions all the time.
    let scenario = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/every_state.script");
    let mut script = Script::load(&scenario).unwrap();
    let last = script.steps.last().map_or(0.0, |step| step.time);
    let questions = [
        "AmIThere p3",
        "Sight lamp",
        "Crosses p0 p9 p20 p31",
        "Route p0 p31 0.4",
    ];
    for (index, question) in questions.iter().cycle().enumerate() {
        let time = 0.313 * (1 + index) as f64;
        if time > last {
            break;
        }
        let action = Action::Send((*question).to_owned());
        script.steps.push(Step { time, action });
    }
    let begun = client.time as f64 * 1e-3;
    for step in &mut script.steps {
        step.time += begun;
    }
    script.steps.sort_by(|a, b| a.time.total_cmp(&b.time));
    client.base.count(false).unwrap();
    client.play(&script);
    let counts = client.base.counts().unwrap();
    println!("{counts}");
    assert!(counts.median() <= TICK[0], "median {}", counts.median());
    assert!(counts.maximum() <= TICK[1], "maximum {}", counts.maximum());
}
