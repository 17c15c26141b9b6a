//! Noise on a line that requires checks (`require_crc`): what is flipped is not obeyed.
//!
//! Five tests send some million lines each, ten million with one or two flips together; `NOISE_LINES=10000000` makes it ten million each.
//!
//! Two things are counted apart. The hex digits of a check may be of either case, so a flip that only makes a `B` of a `b` changes nothing of what the
//! line says: it is obeyed, and rightly. And `Stop` and `EStop` need no check: noise may make one of something else.

mod common;

use common::{Random, Rig, checked, crc};
use vehicle_controller::params::{Id, Params};

const LINES: &[&str] = &[
    "m 1",
    "m -0.5, 0.2",
    "move inf 0.3 0.5",
    "M 0.25",
    "t 90",
    "turn -inf 20",
    "@17 t 1e-3 0",
    "Stop",
    "EStop",
    "GetEstPos",
    "CorrectPos 0.1 0 2 0.5 0 0 0 0.5 0 0 0 0.5",
    "ResetPos 1 2 90 0.01 0 0 0.02 0 4",
    "ObservePos 1 2 3 0.1 0 0 0.1 0 5 0.25",
    "@3\tObserveScalar 0.1 0.04 0.6 0.8 0.01 1",
    "GetStatus",
    "Stream 0.1 t x cxx ctt v_s",
    "Version",
    "Help move",
    "ClearFault",
    "Enable",
    "Disable",
    "GetParam gate",
    "SetParam gate 9",
    "SetParam require_crc 0",
    "SetParam max_speed 2",
    "ListParams",
    "ResetParams",
    "@65535 GetWheels",
];

/// A base that requires checks.
fn strict() -> Rig {
    let mut params = Params::default();
    params.set(Id::RequireCrc, 1.0).unwrap();
    let mut rig = Rig::with(params);
    rig.bytes();
    rig
}

/// What became of some lines.
#[derive(Debug, Default, PartialEq)]
struct Count {
    sent: u64,
    /// The check was right, though the line was not what had been sent.
    passed: u64,
    /// Of these, so many were obeyed …
    obeyed: u64,
    /// Only the case of the check's letters was different: not among the above.
    same: u64,
    /// A Stop or EStop lost its check, so it needed none: not among the above.
    stops: u64,
    /// A Stop or EStop without a check came of another line: not among the above.
    made_stops: u64,
}

/// Sends damaged lines to a base, and counts what it obeys.
struct Noise {
    rig: Rig,
    untouched: String,
    next: Vec<u8>,
    count: Count,
}

impl Noise {
    fn new() -> Self {
        let rig = strict();
        Self {
            untouched: rig.state(),
            rig,
            next: checked("GetTime").into_bytes(),
            count: Count::default(),
        }
    }

    /// Sends what has become of a line, its LF included. If that is gone, the next line is taken for the rest of this one.
    fn send(&mut self, original: &[u8], damaged: &[u8]) {
        self.count.sent += 1;
        self.rig.receive(damaged);
        if damaged.last().is_none_or(|end| !is_end(*end)) {
            self.rig.receive(&self.next);
            self.rig.receive(b"\n");
        }
        self.rig.pump();
        let mut replies = replies(&self.rig.bytes());
        let lines = damaged
            .split(|b| is_end(*b))
            .filter(|line| line.iter().any(|b| !b" \t".contains(b)));
        let mut touched = false;
        let mut answered = 0;
        for line in lines {
            // After one that is obeyed, the others wait for a tick.
            while replies.len() <= answered {
                self.rig.tick();
                touched = true;
                replies.extend(self::replies(&self.rig.bytes()));
            }
            let reply = &replies[answered];
            answered += 1;
            let code = code(reply);
            touched |= code.is_none();
            if let Some(b"checksum" | b"bad-byte" | b"too-long" | b"busy") = code {
            } else if is_stop(line)
                && original
                    .to_ascii_lowercase()
                    .windows(5)
                    .any(|w| w == b"stop*")
            {
                self.count.stops += 1;
            } else if is_stop(line) {
                self.count.made_stops += 1;
            } else if damaged.len() == original.len() && is_same(original, damaged) {
                self.count.same += 1;
            } else {
                self.count.passed += 1;
                self.count.obeyed += u64::from(code.is_none());
            }
        }
        if touched {
            self.rig = strict();
        } else if self.count.sent.is_multiple_of(10_000) {
            self.rig.assert_unchanged(&self.untouched, "noise");
        }
    }
}

/// The replies among what was sent: neither events nor lists.
fn replies(sent: &[u8]) -> Vec<Vec<u8>> {
    sent.split(|b| *b == b'\n')
        .filter(|line| !matches!(line, [] | [b'!' | b'~', ..]))
        .map(<[u8]>::to_vec)
        .collect()
}

fn is_end(byte: u8) -> bool {
    matches!(byte, b'\r' | b'\n')
}

/// The code of a reply, after its tag; none if it is no refusal.
fn code(reply: &[u8]) -> Option<&[u8]> {
    let at = reply.windows(4).position(|four| four == b"ERR ")?;
    reply[at + 4..].split(|b| *b == b' ').next()
}

/// A Stop or EStop, perhaps with a tag, without a check.
fn is_stop(line: &[u8]) -> bool {
    let line = line.trim_ascii().to_ascii_lowercase();
    let command = match line.strip_prefix(b"@") {
        Some(tagged) => {
            let end = tagged.iter().position(|b| !b.is_ascii_digit());
            tagged[end.unwrap_or(tagged.len())..].trim_ascii()
        }
        None => &line,
    };
    matches!(command, b"stop" | b"estop")
}

/// Lines, with their LF, that differ in nothing but the case of the check's letters.
fn is_same(a: &[u8], b: &[u8]) -> bool {
    let at = a.len() - 5;
    a[..at] == b[..at] && a[at..].eq_ignore_ascii_case(&b[at..])
}

fn flip(line: &mut [u8], bit: usize) {
    line[bit / 8] ^= 1 << (bit % 8);
}

/// The lines as they are sent; every other one with a check in lower case.
fn sent() -> Vec<Vec<u8>> {
    let cased = |(n, line): (usize, &&str)| {
        let mut line = checked(line).into_bytes();
        let at = line.len() - 4;
        if n % 2 == 1 {
            line[at..].make_ascii_lowercase();
        }
        line.push(b'\n');
        line
    };
    LINES.iter().enumerate().map(cased).collect()
}

fn how_many(usually: u64) -> u64 {
    let asked = std::env::var("NOISE_LINES").ok();
    asked.map_or(usually, |n| n.parse().expect("a number of lines"))
}

#[test]
fn undamaged_lines_are_obeyed() {
    let obeyed = |line: &Vec<u8>| {
        let mut rig = strict();
        rig.receive(line);
        rig.pump();
        code(&rig.bytes()).is_none()
    };
    let lines = sent();
    // But for ObserveScalar's age: so long there is no past.
    assert_eq!(
        lines.iter().filter(|line| obeyed(line)).count(),
        lines.len() - 2
    );
}

#[test]
fn every_one_and_every_two_flips_of_every_line_are_noticed() {
    let mut noise = Noise::new();
    for line in sent() {
        for first in 0..line.len() * 8 {
            for second in first..line.len() * 8 {
                let mut damaged = line.clone();
                flip(&mut damaged, first);
                if second > first {
                    flip(&mut damaged, second);
                }
                noise.send(&line, &damaged);
            }
        }
    }
    let count = noise.count;
    println!("{count:?}");
    assert_never(&count);
    assert!(count.sent > 400_000);
}

/// What one flip in a hex digit may do to its value: 'B' and 'C' are one flip from each other, and three bits.
fn changes_of_a_digit() -> Vec<u16> {
    let value = |digit: u8| char::from(digit).to_digit(16).map(|v| v as u16);
    let mut changes = Vec::new();
    for digit in 0..=127_u8 {
        for bit in 0..7 {
            if let (Some(a), Some(b)) = (value(digit), value(digit ^ (1 << bit))) {
                changes.push(a ^ b);
            }
        }
    }
    changes.sort_unstable();
    changes.dedup();
    changes
}

#[test]
fn no_two_flips_pass_in_a_line_of_any_length() {
    // The check is linear: two contents that differ by d have checks that differ by what d has, and that does not depend on the contents.
    let nothing = [0; 255];
    let of_a_flip = |bit: usize| {
        let mut one = nothing;
        flip(&mut one, bit);
        crc(&one) ^ crc(&nothing)
    };
    let mut seen = std::collections::BTreeSet::new();
    for bit in 0..nothing.len() * 8 {
        let difference = of_a_flip(bit);
        // Two in the content: no two do the same, none does nothing.
        assert!(difference != 0 && seen.insert(difference));
        // One in the content, one in the check.
        for digit in 0..4 {
            for change in changes_of_a_digit() {
                assert!(difference != change << (4 * digit), "bit {bit}");
            }
        }
    }
    // Two in the check: if in two digits, each is wrong or of the other case.
    assert_eq!(changes_of_a_digit(), [0, 1, 2, 3, 4, 6, 7, 8]);
}

fn storm(seed: u64, least: usize, most: usize) -> Count {
    let lines = sent();
    let mut random = Random(seed);
    let mut noise = Noise::new();
    let mut damaged = Vec::new();
    for _ in 0..how_many(5_000_000) {
        let line = &lines[random.below(lines.len())];
        damaged.clone_from(line);
        let flips = least + random.below(most - least + 1);
        let mut bits = [usize::MAX; 8];
        for n in 0..flips {
            let bit = loop {
                let bit = random.below(line.len() * 8);
                if !bits[..n].contains(&bit) {
                    break bit;
                }
            };
            bits[n] = bit;
            flip(&mut damaged, bit);
        }
        noise.send(line, &damaged);
    }
    println!("{:?}", noise.count);
    noise.count
}

/// At most 1 in 30 000.
fn assert_seldom(count: &Count) {
    assert!(count.passed * 30_000 <= count.sent, "{count:?}");
}

/// None.
fn assert_never(count: &Count) {
    assert_eq!((count.passed, count.made_stops), (0, 0), "{count:?}");
}

#[test]
fn of_lines_with_one_flip_none_is_obeyed() {
    assert_never(&storm(5, 1, 1));
}

#[test]
fn of_lines_with_two_flips_none_is_obeyed() {
    assert_never(&storm(6, 2, 2));
}

#[test]
fn of_lines_with_three_to_eight_flips_hardly_any_is_obeyed() {
    assert_seldom(&storm(7, 3, 8));
}

#[test]
fn of_random_bytes_hardly_any_are_obeyed() {
    let mut random = Random(8);
    let mut noise = Noise::new();
    for _ in 0..how_many(2_500_000) {
        let mut line: Vec<u8> = (0..random.below(40)).map(|_| random.next() as u8).collect();
        line.push(b'\n');
        noise.send(&[0; 6], &line);
    }
    println!("{:?}", noise.count);
    assert_seldom(&noise.count);
}

#[test]
fn of_good_commands_with_random_checks_hardly_any_are_obeyed() {
    let mut random = Random(9);
    let mut noise = Noise::new();
    for _ in 0..how_many(2_500_000) {
        let command = LINES[random.below(LINES.len())];
        let line = format!("{command}*{:04X}\n", random.next() & 0xFFFF);
        noise.send(&[0; 6], line.as_bytes());
    }
    let Count { sent, passed, .. } = noise.count;
    println!("{:?}", noise.count);
    // By chance it is the right one: 1 in 65 536.
    let expected = sent as f64 / 65_536.0;
    assert!(
        (passed as f64 - expected).abs() < 5.0 * expected.sqrt(),
        "{passed} of {sent}"
    );
}
