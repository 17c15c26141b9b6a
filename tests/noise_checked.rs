//! Noise on a line that requires checks (`require_crc`): what is flipped is not obeyed.
//!
//! Five tests send some million lines each, ten million with one or two flips together; `NOISE_LINES=10000000` makes it ten million each.
//!
//! Every line that is not refused counts. `Stop` and `EStop` need no check, so damaged ones stop the base or do nothing: they are looked at apart.

mod common;

use common::{Random, Rig, checked, crc};

const LINES: &[&str] = &[
    "m 1",
    "m -0.5, 0.2",
    "move inf 0.3 0.5",
    "M 0.25",
    "t 90",
    "turn -inf 20",
    "@17 t 1e-3 0",
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

const STOPS: &[&str] = &["Stop", "EStop", "@3 Stop", "@65535 estop"];

/// How a client writes the letters of its checks.
#[derive(Clone, Copy, PartialEq)]
enum Letters {
    Upper,
    Lower,
}

impl Letters {
    const BOTH: [Self; 2] = [Self::Upper, Self::Lower];

    /// A line with its check, without its end.
    fn checked(self, line: &str) -> Vec<u8> {
        let mut line = checked(line).into_bytes();
        if self == Self::Lower {
            let at = line.len() - 4;
            line[at..].make_ascii_lowercase();
        }
        line
    }

    /// Lines as they are sent.
    fn sent(self, lines: &[&str]) -> Vec<Vec<u8>> {
        let with_end = |line: &&str| [self.checked(line), b"\n".to_vec()].concat();
        lines.iter().map(with_end).collect()
    }
}

/// A base of which such a client has required checks.
fn strict(letters: Letters) -> Rig {
    let mut rig = Rig::new();
    let reply = rig.ask_bytes(&letters.sent(&["SetParam require_crc 1"])[0]);
    assert!(reply.starts_with("OK*"), "{reply}");
    rig.tick();
    rig
}

/// What became of some lines.
#[derive(Debug, Default, PartialEq)]
struct Count {
    sent: u64,
    /// The check was right, though the line was not what had been sent.
    passed: u64,
    /// Of these, so many were obeyed.
    obeyed: u64,
    /// What was to stop the base did so without its check, or in spite of it: not among the above.
    stops: u64,
}

impl Count {
    fn add(&mut self, other: &Self) {
        self.sent += other.sent;
        self.passed += other.passed;
        self.obeyed += other.obeyed;
        self.stops += other.stops;
    }
}

/// Sends damaged lines to a base, and counts what it obeys.
struct Noise {
    letters: Letters,
    rig: Rig,
    untouched: String,
    next: Vec<u8>,
    count: Count,
}

impl Noise {
    fn new(letters: Letters) -> Self {
        let rig = strict(letters);
        Self {
            letters,
            untouched: rig.state(),
            rig,
            next: letters.checked("GetTime"),
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
        for (n, line) in lines.enumerate() {
            // After one that is obeyed, the others wait for a tick.
            while replies.len() <= n {
                self.rig.tick();
                touched = true;
                replies.extend(self::replies(&self.rig.bytes()));
            }
            let code = code(&replies[n]);
            touched |= code.is_none();
            if let Some(b"checksum" | b"bad-byte" | b"too-long" | b"busy") = code {
            } else if is_stop(line) && is_stop(original) {
                self.count.stops += 1;
            } else {
                self.count.passed += 1;
                self.count.obeyed += u64::from(code.is_none());
            }
        }
        if touched {
            self.rig = strict(self.letters);
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

/// A Stop or EStop, perhaps with a tag or a check.
fn is_stop(line: &[u8]) -> bool {
    let line = line.to_ascii_lowercase();
    let content = line.split(|b| *b == b'*').next().unwrap_or_default();
    let content = content.trim_ascii();
    let command = match content.strip_prefix(b"@") {
        Some(tagged) => {
            let end = tagged.iter().position(|b| !b.is_ascii_digit());
            tagged[end.unwrap_or(tagged.len())..].trim_ascii()
        }
        None => content,
    };
    matches!(command, b"stop" | b"estop")
}

fn flip(line: &mut [u8], bit: usize) {
    line[bit / 8] ^= 1 << (bit % 8);
}

fn how_many(usually: u64) -> u64 {
    let asked = std::env::var("NOISE_LINES").ok();
    asked.map_or(usually, |n| n.parse().expect("a number of lines"))
}

#[test]
fn undamaged_lines_are_obeyed() {
    for letters in Letters::BOTH {
        let obeyed = |line: &Vec<u8>| {
            let mut rig = strict(letters);
            rig.receive(line);
            rig.pump();
            code(&rig.bytes()).is_none()
        };
        let lines = letters.sent(LINES);
        // But for the observations' ages: so long there is no past.
        assert_eq!(
            lines.iter().filter(|line| obeyed(line)).count(),
            lines.len() - 2
        );
        assert!(letters.sent(STOPS).iter().all(obeyed));
    }
}

/// Sends each line with each one and each two of its bits flipped; every other line as a client of lower case sends it.
fn all_one_and_two_flips(lines: &[&str]) -> Count {
    let mut count = Count::default();
    for (n, line) in lines.iter().enumerate() {
        let letters = Letters::BOTH[n % 2];
        let mut noise = Noise::new(letters);
        let line = &letters.sent(&[*line])[0];
        for first in 0..line.len() * 8 {
            for second in first..line.len() * 8 {
                let mut damaged = line.clone();
                flip(&mut damaged, first);
                if second > first {
                    flip(&mut damaged, second);
                }
                noise.send(line, &damaged);
            }
        }
        count.add(&noise.count);
    }
    println!("{count:?}");
    count
}

#[test]
fn every_one_and_every_two_flips_of_every_line_are_noticed() {
    let count = all_one_and_two_flips(LINES);
    assert_never(&count);
    assert!(count.sent > 400_000);
}

#[test]
fn a_damaged_stop_stops_or_does_nothing() {
    let count = all_one_and_two_flips(STOPS);
    assert_eq!(count.passed, 0, "{count:?}");
    assert!(count.stops > 0);
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
    // One or two in the check: each makes a digit wrong, or its letter of the other case, which is refused.
    assert_eq!(changes_of_a_digit(), [0, 1, 2, 3, 4, 6, 7, 8]);
}

fn storm(lines: &[&str], seed: u64, least: usize, most: usize) -> Count {
    let mut random = Random(seed);
    let mut clients = Letters::BOTH.map(|letters| (letters.sent(lines), Noise::new(letters)));
    let mut damaged = Vec::new();
    for n in 0..how_many(5_000_000) {
        let (lines, noise) = &mut clients[(n % 2) as usize];
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
    let [(_, upper), (_, lower)] = clients;
    let mut count = upper.count;
    count.add(&lower.count);
    println!("{count:?}");
    count
}

/// At most 1 in 30 000.
fn assert_seldom(count: &Count) {
    assert!(count.passed * 30_000 <= count.sent, "{count:?}");
}

/// None.
fn assert_never(count: &Count) {
    assert_eq!((count.passed, count.stops), (0, 0), "{count:?}");
}

#[test]
fn of_lines_with_one_flip_none_is_obeyed() {
    assert_never(&storm(LINES, 5, 1, 1));
}

#[test]
fn of_lines_with_two_flips_none_is_obeyed() {
    assert_never(&storm(LINES, 6, 2, 2));
}

#[test]
fn of_lines_with_three_to_eight_flips_hardly_any_is_obeyed() {
    assert_seldom(&storm(&[LINES, STOPS].concat(), 7, 3, 8));
}

#[test]
fn of_random_bytes_hardly_any_are_obeyed() {
    let mut random = Random(8);
    let mut noise = Noise::new(Letters::Upper);
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
    let mut noise = Noise::new(Letters::Upper);
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
