//! What lines from a base look like.

use vehicle_controller::controller::{Estimate, Snapshot};
use vehicle_controller::params::{DEGREES, Id, Params};

use crate::grammar::Ask;
use crate::protocol::LONGEST;

/// Takes the whole lines out of what was received; each is printable, not empty and not too long.
///
/// # Panics
/// If one is not.
pub fn lines(received: &[u8]) -> impl Iterator<Item = &[u8]> {
    let text = received.strip_suffix(b"\r\n");
    assert!(
        received.is_empty() || text.is_some(),
        "part of a line: {:?}",
        received.escape_ascii().to_string()
    );
    let mut rest = text;
    std::iter::from_fn(move || {
        let all = rest?;
        let end = all.iter().position(|b| *b == b'\r').unwrap_or(all.len());
        let (line, tail) = all.split_at(end);
        rest = tail.strip_prefix(b"\r\n");
        assert!(rest.is_some() || tail.is_empty(), "a CR in a line");
        let fine = line.iter().all(|b| (b' '..=b'~').contains(b));
        assert!(
            fine && (1..=LONGEST).contains(&line.len()),
            "{:?}",
            line.escape_ascii().to_string()
        );
        Some(line)
    })
}

/// A data line: its name, and so many words after it.
///
/// # Panics
/// If it is not that.
pub fn words<'a, const N: usize>(reply: &'a str, name: &str) -> [&'a str; N] {
    let mut words = reply.split(' ');
    assert_eq!(words.next(), Some(name), "{reply}");
    let all = [(); N].map(|()| words.next().unwrap_or_else(|| panic!("{reply}")));
    assert_eq!(words.next(), None, "{reply}");
    all
}

/// A data line of numbers with so many decimals each.
///
/// # Panics
/// If it is not that.
pub fn numbers<const N: usize>(reply: &str, name: &str, decimals: [usize; N]) -> [f64; N] {
    let words = words::<N>(reply, name);
    std::array::from_fn(|i| {
        assert_eq!(decimals_of(words[i]), decimals[i], "{reply}");
        number(words[i])
    })
}

fn decimals_of(word: &str) -> usize {
    let fraction = word.split_once('.').map_or("", |(_, fraction)| fraction);
    fraction.split('e').next().map_or(0, str::len)
}

fn number(word: &str) -> f64 {
    let fine = word.bytes().all(|b| b"0123456789.-e".contains(&b));
    let x: f64 = word.parse().unwrap_or(f64::NAN);
    assert!(fine && x.is_finite() && word != "-0", "number {word}");
    x
}

fn close(printed: f64, x: f64, unit: f64) -> bool {
    // What does not fit saturates.
    (printed - x).abs() <= 0.51 * unit + 1e-12 * x.abs() || x.abs() >= 1e18 * unit
}

/// `EstPos x y θ Cxx Cxy Cxθ Cyy Cyθ Cθθ`, of this estimate.
///
/// # Panics
/// If it is not that.
pub fn est_pos(reply: &str, estimate: &Estimate) {
    let said = numbers(reply, "EstPos", [6, 6, 5, 5, 5, 5, 5, 5, 5]);
    let (pose, c) = (&estimate.pose, &estimate.covariance);
    let theta = pose.theta * DEGREES;
    let turns = (said[2] - theta) / 360.0;
    let angle = said[2] > -180.0
        && said[2] <= 180.0
        && (turns - turns.round()).abs() * 360.0 < 1e-5 + 1e-9 * theta.abs();
    let d = DEGREES;
    let covariance = [c.m11, c.m12, c.m13 * d, c.m22, c.m23 * d, c.m33 * d * d];
    let same = said[3..]
        .iter()
        .zip(covariance)
        .all(|(said, c)| (said - c).abs() <= 5.1e-6 * c.abs());
    assert!(
        close(said[0], pose.x, 1e-6) && close(said[1], pose.y, 1e-6) && angle && same,
        "{reply} of {estimate:?}"
    );
}

/// The data line of a command that tells something of a snapshot.
///
/// # Panics
/// If it is not that.
pub fn of_snapshot(command: &str, reply: &str, snapshot: &Snapshot) {
    let (translation, rotation) = (&snapshot.translation, &snapshot.rotation);
    match command {
        "GetEstPos" => est_pos(reply, &snapshot.estimator.present()),
        "GetEstSpeed" => {
            let [v, w] = numbers(reply, "EstSpeed", [6, 5]);
            let same = close(v, f64::from(translation.speed), 1e-6)
                && close(w, f64::from(rotation.speed) * DEGREES, 1e-5);
            assert!(same, "{reply} of {snapshot:?}");
        }
        "GetGains" => {
            let [right, left, base, deviations @ ..] = numbers(reply, "Gains", [6; 6]);
            let known = [right, left, base]
                .iter()
                .all(|gain| (0.8..=1.25).contains(gain));
            let fine = deviations
                .iter()
                .all(|deviation| (0.0..2.0).contains(deviation));
            assert!(known && fine, "{reply}");
        }
        "GetStatus" => {
            let [moves, turns, flags, fault] = words(reply, "Status");
            let enabled = if snapshot.enabled {
                "enabled"
            } else {
                "disabled"
            };
            let expected = snapshot.fault.map_or("none", |fault| fault.name());
            let states = [moves, turns]
                .into_iter()
                .all(|state| ["HOLD", "ACCEL", "MOVE", "DECCEL"].contains(&state));
            assert!(
                states && (flags, fault) == (enabled, expected),
                "{reply} of {snapshot:?}"
            );
        }
        "GetState" => {
            let said = numbers(reply, "State", [6, 6, 6, 6, 5, 5, 5]);
            let same = close(said[1], translation.displacement.to_f64(), 1e-6)
                && close(said[4], rotation.displacement.to_f64() * DEGREES, 1e-5);
            assert!(same, "{reply} of {snapshot:?}");
        }
        "GetTime" => {
            let [t] = numbers(reply, "Time", [6]);
            assert!(
                close(t, snapshot.time.ticks() as f64 * 1e-6, 1e-6),
                "{reply}"
            );
        }
        "GetBattery" => {
            let [volts] = numbers(reply, "Battery", [3]);
            assert!(close(volts, f64::from(snapshot.supply), 1e-3), "{reply}");
        }
        "GetSteering" => {
            // The fuzzed base is a differential drive.
            assert_eq!(numbers(reply, "Steering", [4]), [0.0]);
        }
        "GetWheels" => {
            let said = numbers(reply, "Wheels", [0, 0, 6, 6, 4, 4]);
            let [left, right] = &snapshot.wheels;
            assert!(
                said[0] == left.count as f64 && said[1] == right.count as f64,
                "{reply} of {snapshot:?}"
            );
        }
        "Version" => {
            let [name, _, target, version] = words(reply, "Version");
            assert_eq!([name, target, version], ["vehicle-controller", "fuzz", "1"]);
        }
        other => panic!("{other:?} is answered {reply:?}"),
    }
}

/// `Param name value unit`.
///
/// # Panics
/// If it is not that.
pub fn param(reply: &str, params: &Params, id: Id) {
    let [name, value, unit] = words(reply, "Param");
    let spec = id.spec();
    assert_eq!((name, unit), (spec.name, spec.unit), "{reply}");
    assert_eq!(value.parse(), Ok(params.get(id)), "{reply}");
}

/// `~ name value min max unit`.
///
/// # Panics
/// If it is not that.
pub fn row(row: &str, params: &Params, id: Id) {
    let [name, value, min, max, unit] = words(row, "~");
    let spec = id.spec();
    assert_eq!((name, unit), (spec.name, spec.unit), "{row}");
    assert_eq!(value.parse(), Ok(params.get(id)), "{row}");
    assert_eq!((min.parse(), max.parse()), (Ok(spec.min), Ok(spec.max)));
}

/// What a command of the map is answered.
///
/// # Panics
/// If it is not that.
pub fn of_map(ask: Ask, reply: &str) {
    let (name, rest) = reply.split_once(' ').unwrap_or((reply, ""));
    let fine = match ask {
        Ask::Map("Mark", _) => ["Marked", "Confirmed"].contains(&name),
        Ask::Map("Sight", _) => ["Added", "Confirmed", "Unsure"].contains(&name),
        Ask::Map("AmIThere", true) => {
            let [_, answer, probability] = words(reply, "AmIThere");
            is_there(answer, probability)
        }
        Ask::Map("AmIThere", false) => name == "AmIThere",
        Ask::Map("Route", _) => name == "Route",
        Ask::Map("Crosses", _) => name == "Crosses" && ["must", "may", "cannot"].contains(&rest),
        Ask::Plain("GetMap") => name == "Map",
        _ => reply == "OK",
    };
    assert!(fine, "{ask:?} is answered {reply}");
}

fn is_there(answer: &str, probability: &str) -> bool {
    let possible = ["yes-maybe", "no"].contains(&answer);
    possible && (probability == "-" || (0.0..=1.0).contains(&number(probability)))
}

/// How many rows follow a list's head.
///
/// # Panics
/// If it is none.
pub fn map_rows(ask: Ask, reply: &str) -> usize {
    let count = |word: &str| -> usize { word.parse().unwrap_or_else(|_| panic!("{reply}")) };
    let mut words = reply.split(' ').skip(1).map(count);
    match ask {
        Ask::Map("AmIThere", true) => 0,
        Ask::Map(..) => words.next().unwrap_or_default(),
        // The last word is the place where the journey began.
        _ => words.take(3).sum(),
    }
}

/// A row of the map.
///
/// # Panics
/// If it is none.
pub fn map_row(row: &str) {
    let mut words = row.split(' ').skip(1);
    let kind = words.next().unwrap_or_default();
    let words: Vec<&str> = words.collect();
    let fine = match (kind, words.as_slice()) {
        ("place", [_, meadow]) => (0.0..=1000.0).contains(&number(meadow)),
        ("landmark", [_, _, d, beta, r]) => {
            let [d, r] = [d, r].map(|word| number(word));
            d >= 0.0 && r >= 0.0 && number(beta).abs() <= 180.0
        }
        ("arc", [_, _, d, beta, r, eta, alpha, freeway, likely @ ..]) => {
            let [d, r, alpha] = [d, r, alpha].map(|word| number(word));
            let angles = [beta, eta].map(|word| number(word));
            let free = *freeway == "-" || number(freeway) >= 0.0;
            let finite = likely.iter().all(|word| number(word).is_finite());
            let sizes = d >= 0.0 && r >= 0.0 && (0.0..=180.0).contains(&alpha);
            finite && sizes && free && angles.iter().all(|a| a.abs() <= 180.0) && likely.len() == 9
        }
        ("there", [_, answer, probability]) => is_there(answer, probability),
        ("route", [_]) | ("landmark", [_, _]) => true,
        _ => false,
    };
    assert!(fine, "{row}");
}

/// `Path n <errand>`: both.
///
/// # Panics
/// If it is not that.
pub fn path(reply: &str) -> (usize, &str) {
    let [count, errand] = words(reply, "Path");
    let count = count.parse().unwrap_or(usize::MAX);
    let known = ["idle", "path", "chase"].contains(&errand);
    assert!(count <= 32 && known, "{reply}");
    (count, errand)
}

/// `~ n x y θ v`, or `~ n passed`: its number.
///
/// # Panics
/// If it is neither.
pub fn posture(row: &str) -> u64 {
    let whole = |number: &str| number.parse().unwrap_or_else(|_| panic!("{row}"));
    if let Some(number) = row.strip_suffix(" passed") {
        let [number] = words(number, "~");
        return whole(number);
    }
    let [number, x, y, theta, v] = words(row, "~");
    let fine = [x, y]
        .into_iter()
        .all(|x| decimals_of(x) == 6 && number_fits(x, 1e7));
    let heading = theta == "-" || {
        let theta = self::number(theta);
        theta > -180.0 && theta <= 180.0
    };
    let speed = v == "-" || self::number(v) > 0.0;
    assert!(fine && heading && speed, "{row}");
    whole(number)
}

fn number_fits(word: &str, max: f64) -> bool {
    number(word).abs() <= max
}

/// What is told of a path or a chase.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PathEvent {
    /// A posture is behind the vehicle.
    Posture(u64),
    /// So is the last one.
    Done,
    /// The end before its time, of a chase or not, and why.
    End(bool, &'static str),
}

/// What an event tells of a path or a chase, if anything.
///
/// # Panics
/// If it looks like that, and is not.
pub fn path_event(line: &str) -> Option<PathEvent> {
    const ENDS: [&str; 7] = [
        "stop", "move", "turn", "fault", "replaced", "timeout", "refused",
    ];
    let words: Vec<&str> = line.split(' ').collect();
    match words[..] {
        ["!", "posture", number] => {
            let number = number.parse().ok().filter(|number| *number > 0);
            Some(PathEvent::Posture(
                number.unwrap_or_else(|| panic!("{line}")),
            ))
        }
        ["!", "path", "done"] => Some(PathEvent::Done),
        ["!", errand @ ("path" | "chase"), "end", why] => {
            let why = ENDS.into_iter().find(|end| *end == why);
            let why = why.unwrap_or_else(|| panic!("{line}"));
            // A path does not wait for anything, and what is chased is not judged.
            let is_its =
                (why != "timeout" || errand == "chase") && (why != "refused" || errand == "path");
            assert!(is_its, "{line}");
            Some(PathEvent::End(errand == "chase", why))
        }
        _ => None,
    }
}

/// An event or a line of telemetry.
///
/// # Panics
/// If it is neither.
pub fn unsolicited(line: &str) {
    if path_event(line).is_some() || line == "! map lost" {
        return;
    }
    if let Some(event) = line.strip_prefix("! ") {
        let known = ["boot ", "move done ", "turn done ", "fault ", "stop "];
        let rest = known.iter().find_map(|known| event.strip_prefix(known));
        let rest = rest.unwrap_or_else(|| panic!("{line}"));
        if event.contains("done") {
            number(rest);
        }
        return;
    }
    let fields = line.strip_prefix("~ ").unwrap_or_else(|| panic!("{line}"));
    assert!(fields.split(' ').count() <= 16, "{line}");
    for field in fields.split(' ') {
        let is_word = field == "-" || field.bytes().all(|b| b.is_ascii_alphabetic() || b == b'-');
        if !is_word {
            number(field);
        }
    }
}
