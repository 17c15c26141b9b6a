//! Noise on the line: whatever comes, nothing panics, nothing becomes infinite, and the next good line is answered.

mod common;

use common::{Random, Rig, checked, is_unsolicited, unchecked};

const LINES: &[&str] = &[
    "m",
    "m 1",
    "m -0.5, 0.2",
    "move inf 0.3 0.5",
    "t 90",
    "turn -inf 20",
    "t 1e-3 0",
    "Stop",
    "GetEstPos",
    "GetEstSpeed",
    "CorrectPos 0.1 0 2 0.5 0 0 0 0.5 0 0 0 0.5",
    "ResetPos 1 2 3",
    "ResetPos 1 2 90 0.01 0 0 0.02 0 4",
    "ObservePos 1 2 3 0.1 0 0 0.1 0 5 0.25",
    "ObserveScalar 0.1 0.04 0.6 0.8 0.01 1",
    "GetStatus",
    "GetState",
    "GetTime",
    "GetBattery",
    "GetWheels",
    "Stream 0.05",
    "Stream 0.1 t x cxx ctt v_s",
    "Stream 0",
    "Version",
    "Help",
    "Help m",
    "EStop",
    "ClearFault",
    "ClearFault",
    "ClearFault",
    "Enable",
    "Enable",
    "Disable",
    "GetParam gate",
    "SetParam gate 9",
    "SetParam wheel_base 0.3",
    "SetParam max_speed 2",
    "SetParam noise_s 1e-4",
    "ListParams",
    "SaveParams",
    "LoadParams",
    "ResetParams",
    "@17 m 1",
    "@65535 GetStatus",
    "@3 ObserveScalar 1 1 1 0 0",
];

fn assert_finite(rig: &Rig, after: &[u8]) {
    let snapshot = rig.snapshot();
    let estimate = rig.estimate();
    let pose = [estimate.pose.x, estimate.pose.y, estimate.pose.theta];
    let axes = [snapshot.translation, snapshot.rotation].map(|axis| {
        [axis.displacement.to_f64()].into_iter().chain(
            [
                axis.error,
                axis.speed,
                axis.reference_speed,
                axis.acceleration,
                snapshot.supply,
            ]
            .map(f64::from),
        )
    });
    let finite = pose
        .into_iter()
        .chain(axes.into_iter().flatten())
        .all(f64::is_finite)
        && estimate.covariance.iter().all(|e| e.is_finite())
        && snapshot
            .wheels
            .iter()
            .all(|w| w.speed.is_finite() && w.duty.is_finite());
    assert!(
        finite,
        "{:?} made {snapshot:?}",
        String::from_utf8_lossy(after)
    );
}

/// How many replies some bytes must get: one for each line that is not blank.
fn due(bytes: &[u8]) -> usize {
    bytes
        .split(|b| matches!(b, b'\r' | b'\n'))
        .filter(|line| line.iter().any(|b| !matches!(b, b' ' | b'\t')))
        .count()
}

/// Feeds whole lines and counts the replies; returns how many were not refusals.
fn feed(rig: &mut Rig, bytes: &[u8]) -> usize {
    let expected = due(bytes);
    let (mut replies, mut accepted) = (0, 0);
    let mut count = |rig: &mut Rig| {
        for line in rig.lines().iter().filter(|line| !is_unsolicited(line)) {
            replies += 1;
            accepted += usize::from(!line.contains("ERR "));
        }
        replies
    };
    for piece in bytes.chunks(1) {
        while !rig.can_receive() {
            rig.tick();
            count(rig);
        }
        rig.receive(piece);
    }
    rig.pump();
    let mut waited = 0;
    while count(rig) < expected {
        rig.tick();
        waited += 1;
        assert!(
            waited < 1000,
            "{:?} is not answered",
            String::from_utf8_lossy(bytes)
        );
    }
    rig.tick();
    assert_eq!(count(rig), expected, "{:?}", String::from_utf8_lossy(bytes));
    accepted
}

/// A good line, with a check in case one is required.
fn assert_answers(rig: &mut Rig, after: &[u8]) {
    let reply = rig.ask(&checked("@7 GetStatus"));
    assert!(
        unchecked(&reply).starts_with("@7 Status "),
        "{:?}: {reply}",
        String::from_utf8_lossy(after)
    );
}

#[test]
fn after_any_one_or_two_bytes_the_next_line_is_answered() {
    let ones = (0..=255_u8).map(|a| vec![a]);
    let twos = (0..=u16::MAX).map(|ab| ab.to_be_bytes().to_vec());
    for noise in ones.chain(twos) {
        let mut rig = Rig::new();
        let expected = due(&noise) + 1;
        let mut bytes = noise.clone();
        bytes.extend(b"\n@7 GetStatus\n");
        let replies = rig.ask_all(&bytes, expected);
        assert_eq!(replies.len(), expected, "{noise:?}");
        let last = &replies[expected - 1];
        assert!(last.starts_with("@7 Status "), "{noise:?}: {last}");
        assert_finite(&rig, &noise);
    }
}

/// Some damage that lines meet on their way.
fn damage(line: &mut Vec<u8>, random: &mut Random) {
    let at = random.below(line.len().max(1));
    match random.below(7) {
        0 if !line.is_empty() => line[at] ^= 1 << random.below(8),
        1 if !line.is_empty() => {
            line.remove(at);
        }
        2 if !line.is_empty() => line.insert(at, line[at]),
        3 => {
            let other = LINES[random.below(LINES.len())].as_bytes();
            line.truncate(at);
            line.extend(&other[random.below(other.len())..]);
        }
        4 => line.insert(at.min(line.len()), random.next() as u8),
        5 => line.insert(at.min(line.len()), b"0123456789.-e,*@ \t"[random.below(18)]),
        _ => {
            let half = line[at.min(line.len())..].to_vec();
            for _ in 0..random.below(40) {
                line.extend(&half);
            }
        }
    }
}

/// Until so many bytes were sent, in bursts of one to six lines. Returns how many lines were taken.
fn storm(total: usize, seed: u64, mut line: impl FnMut(&mut Random, &mut Vec<u8>)) -> usize {
    let mut random = Random(seed);
    let mut rig = Rig::new();
    let (mut sent, mut bursts, mut accepted) = (0, 0, 0);
    while sent < total {
        let mut bytes = Vec::new();
        for _ in 0..=random.below(6) {
            line(&mut random, &mut bytes);
            bytes.extend(["\n", "\r", "\r\n"][random.below(3)].as_bytes());
        }
        accepted += feed(&mut rig, &bytes);
        // What was taken shall have its effect.
        rig.run(f64::from(random.next() % 100) * 1e-3);
        sent += bytes.len();
        bursts += 1;
        if bursts % 16 == 0 {
            assert_finite(&rig, &bytes);
            assert_answers(&mut rig, &bytes);
        }
    }
    accepted
}

#[test]
fn five_million_random_bytes_do_no_harm() {
    let _ = storm(5_000_000, 3, |random, bytes| {
        for _ in 0..random.below(300) {
            bytes.push(random.next() as u8);
        }
    });
}

#[test]
fn five_million_bytes_of_damaged_lines_do_no_harm() {
    let accepted = storm(5_000_000, 4, |random, bytes| {
        let mut line = LINES[random.below(LINES.len())].as_bytes().to_vec();
        if random.below(4) == 0 {
            line = checked(&String::from_utf8_lossy(&line)).into_bytes();
        }
        for _ in 0..random.below(4) {
            damage(&mut line, random);
        }
        bytes.extend(line);
    });
    assert!(accepted > 10_000, "only {accepted} lines said something");
}
