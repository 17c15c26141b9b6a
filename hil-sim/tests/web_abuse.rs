//! Ten thousand malformed messages and more, at the driver's seat and beside it: the simulation goes on at full rate, and nothing moves.

mod page;

use page::{Client, Heard, Server};
use rand::seq::IndexedRandom;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::{Duration, Instant};
use tungstenite::Message;

const SEED: u64 = 1992;
/// Malformed messages, at least.
const MESSAGES: usize = 10_000;
/// And for so long: ten thousand take less than a second, in which no rate can be measured.
const LASTS: Duration = Duration::from_secs(8);
/// What the server may grow by, kB: sixteen clients with a queue of a thousand short messages, a message of 64 kB and its buffers each, twice over for
/// what the allocator keeps.
const MAX_GROWTH: u64 = 24_000;

/// A thousand of these may follow each other on one connection: the server takes no notice.
fn ignored(random: &mut ChaCha8Rng) -> Message {
    match random.random_range(0..4) {
        0 => Message::text(bad_line(random)),
        1 => Message::binary(noise(random, 300)),
        2 => Message::binary(bad_json(random)),
        _ => Message::Pong(noise(random, 125).into()),
    }
}

fn noise(random: &mut ChaCha8Rng, most: usize) -> Vec<u8> {
    let mut bytes = vec![0; random.random_range(0..=most)];
    random.fill_bytes(&mut bytes);
    bytes
}

/// A text that is no line of the protocol, though it would move the base if a part of it were taken for one.
fn bad_line(random: &mut ChaCha8Rng) -> String {
    match random.random_range(0..5) {
        0 => String::new(),
        1 => "m 1 0.3 ".repeat(random.random_range(32..400)),
        2 => {
            let end = ["\n", "\r", "\r\n", "\0", "\x1b", "\x7f", "\u{2028}", "é"];
            format!("m 1{}m 1", end.choose(random).unwrap())
        }
        3 => format!("m 1{}", ["\n", "\r\n"].choose(random).unwrap()),
        _ => (0..random.random_range(1..100))
            .map(|_| char::from_u32(random.random_range(0x80..0xD000)).unwrap_or('é'))
            .collect(),
    }
}

/// JSON that asks for nothing: it has no number by which it could be answered.
fn bad_json(random: &mut ChaCha8Rng) -> Vec<u8> {
    let texts = [
        "null",
        "[]",
        "{}",
        "1e999",
        "\"id\"",
        r#"{"push":[50,0,1]}"#,
        r#"{"id":"1","push":[50,0,1]}"#,
        r#"{"id":-1,"push":[50,0,1]}"#,
        r#"{"id":1.5,"clear":true}"#,
        r#"{"id":1e20,"clear":true}"#,
        r#"{"id":null,"power":"cycle"}"#,
        r#"{"id":[1],"estop":true}"#,
        r#"{"id":1,"push":[50,0,1]"#,
        r#"[{"id":1,"push":[50,0,1]}]"#,
    ];
    let text = *texts.choose(random).unwrap();
    match random.random_range(0..4) {
        0 => "[".repeat(random.random_range(1..4000)).into_bytes(),
        1 => format!("{{\"id\":{}", "{\"id\":".repeat(500)).into_bytes(),
        _ => text.as_bytes().to_vec(),
    }
}

/// JSON with a number, that cannot be done: each is refused.
fn refused(random: &mut ChaCha8Rng) -> &'static str {
    let texts = [
        r#""push":[1e308,0,1]"#,
        r#""push":[1,0,-1]"#,
        r#""push":["1","0","1"]"#,
        r#""push":{"0":1}"#,
        r#""fault":"left motor weak 2""#,
        r#""fault":"battery 1e300""#,
        r#""fault":["link cut"]"#,
        r#""fault":"""#,
        r#""estop":"true""#,
        r#""power":"off""#,
        r#""clear":true,"estop":false"#,
        r#""sudo":true"#,
    ];
    texts.choose(random).unwrap()
}

/// Bytes after which no WebSocket can go on.
fn fatal(random: &mut ChaCha8Rng) -> Vec<u8> {
    let masked = |first: u8, payload: &[u8]| {
        let mut frame = vec![first, 0x80 | payload.len() as u8, 1, 2, 3, 4];
        frame.extend(
            payload
                .iter()
                .zip([1, 2, 3, 4].iter().cycle())
                .map(|(b, m)| b ^ m),
        );
        frame
    };
    match random.random_range(0..9) {
        // Not masked.
        0 => vec![0x81, 3, b'm', b' ', b'1'],
        // A text that is not UTF-8.
        1 => masked(0x81, b"m 1 \xFF"),
        // An opcode that is none, and bits that mean nothing here.
        2 => masked(0x83, b"m 1"),
        3 => masked(0xF1, b"m 1"),
        // The end of a message that has not begun; a ping in pieces; one that is too long.
        4 => masked(0x80, b"m 1"),
        5 => masked(0x09, b"m 1"),
        6 => [&[0x89, 0xFE, 0, 200, 0, 0, 0, 0][..], &[b'm'; 200]].concat(),
        // More than there may be: said, and sent.
        7 => vec![
            0x82, 0xFF, 0x7F, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0, 0, 0, 0,
        ],
        _ => {
            let mut frame = vec![0x82, 0xFF, 0, 0, 0, 0, 0, 2, 0, 0, 0, 0, 0, 0];
            frame.extend(vec![0; 0x2_0000]);
            frame
        }
    }
}

/// The beginning of a frame.
fn half(random: &mut ChaCha8Rng) -> Vec<u8> {
    let frame = [0x81, 0x83, 0, 0, 0, 0, b'm', b' ', b'1'];
    frame[..random.random_range(1..frame.len())].to_vec()
}

/// Something else than a request.
fn no_http(random: &mut ChaCha8Rng, server: &Server) -> Vec<u8> {
    let host = &server.address;
    match random.random_range(0..6) {
        0 => noise(random, 2000),
        1 => b"GET / HTTP/9.9\r\n\r\n".to_vec(),
        2 => format!("GET /{} HTTP/1.1\r\nHost: {host}\r\n\r\n", "x".repeat(100_000)).into_bytes(),
        3 => {
            let header = "X: y\r\n".repeat(5000);
            format!("GET / HTTP/1.1\r\nHost: {host}\r\n{header}\r\n").into_bytes()
        }
        4 => format!("POST /base HTTP/1.1\r\nHost: {host}\r\nContent-Length: 99999999999\r\n\r\nm 1").into_bytes(),
        _ => format!(
            "GET /base HTTP/1.1\r\nHost: {host}\r\nOrigin: http://{host}\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n\
             Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: {}\r\nSec-WebSocket-Protocol: drive\r\n\r\n",
            "A".repeat(random.random_range(0..50))
        )
        .into_bytes(),
    }
}

/// Hears a connection out, but not for long.
fn hear_out(mut stream: &TcpStream) {
    // A setting of this side: it does not fail.
    let _ = stream.set_read_timeout(Some(Duration::from_millis(20)));
    let _ = stream.read(&mut [0; 256]);
}

/// What the attackers have in common.
struct Attack<'a> {
    server: &'a Server,
    sent: &'a AtomicUsize,
    began: Instant,
}

impl Attack<'_> {
    fn count(&self) {
        self.sent.fetch_add(1, Ordering::Relaxed);
    }

    fn goes_on(&self) -> bool {
        self.sent.load(Ordering::Relaxed) < MESSAGES || self.began.elapsed() < LASTS
    }

    /// From the driver's seat.
    fn drive(&self, seed: u64) {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut round = 0_u64;
        while self.goes_on() {
            let mut client = self.server.join("drive");
            if !matches!(client.hear(), Heard::World(word) if word.get("hello").is_some()) {
                // The one before has not been seen off yet.
                std::thread::sleep(Duration::from_millis(2));
                continue;
            }
            for _ in 0..random.random_range(1..300) {
                client.0.send(ignored(&mut random)).unwrap();
                self.count();
            }
            round += 1;
            let answer = client.ask_world(round, refused(&mut random));
            assert!(answer.is_err(), "it was done");
            self.count();
            // All of that was read, and the seat is still good.
            assert!(client.ask(round as u16, "GetTime").starts_with("Time "));
            self.part(client, &mut random);
        }
    }

    /// As one of many who should only watch.
    fn watch(&self, seed: u64) {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        while self.goes_on() {
            let Ok(mut client) = self.server.try_join(self.server.handshake("watch")) else {
                std::thread::sleep(Duration::from_millis(2));
                continue;
            };
            if random.random_bool(0.5) {
                // It may have been closed for the first one.
                let _ = client.0.send(ignored(&mut random));
                self.count();
            }
            self.part(client, &mut random);
        }
    }

    /// Ends a connection in a way in which none should end.
    fn part(&self, mut client: Client, random: &mut ChaCha8Rng) {
        let last = if random.random_bool(0.6) {
            fatal(random)
        } else {
            half(random)
        };
        // It may have been closed meanwhile.
        let _ = client.stream().write_all(&last);
        self.count();
        match random.random_range(0..3) {
            0 => client.reset(),
            1 => drop(client),
            _ => hear_out(client.stream()),
        }
    }

    /// Without a WebSocket.
    fn knock(&self, seed: u64) {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        while self.goes_on() {
            let mut stream = self.server.connect();
            let bytes = no_http(&mut random, self.server);
            // It may be closed before all is sent.
            let _ = stream.write_all(&bytes);
            self.count();
            if random.random_bool(0.5) {
                hear_out(&stream);
            }
        }
    }
}

/// What somebody sees who only looks on.
struct Seen {
    /// Simulated time over the clock's, in all.
    rate: f64,
    /// The least that the server itself has told over a second.
    least_pace: f64,
    /// How far the base was from its start, m.
    farthest: f64,
    /// The longest time without news, s.
    longest_gap: f64,
}

fn look_on(mut watcher: Client, over: &AtomicBool) -> Seen {
    let mut first = None;
    let mut last = Instant::now();
    let mut seen = Seen {
        rate: 0.0,
        least_pace: f64::INFINITY,
        farthest: 0.0,
        longest_gap: 0.0,
    };
    while !over.load(Ordering::Relaxed) {
        let world = watcher.wait_for_world("world");
        let field = |name: &str| world[name].as_f64().unwrap();
        let now = Instant::now();
        let (began, from) = *first.get_or_insert((now, field("t")));
        seen.longest_gap = seen.longest_gap.max((now - last).as_secs_f64());
        last = now;
        let took = (now - began).as_secs_f64();
        seen.rate = (field("t") - from) / took;
        if took > 1.0 {
            seen.least_pace = seen.least_pace.min(field("pace"));
        }
        seen.farthest = seen.farthest.max(field("x").hypot(field("y")));
    }
    seen
}

#[test]
fn ten_thousand_malformed_messages_change_nothing() {
    let mut server = Server::start(&[]);
    let watcher = server.watch();
    let before = server.memory();
    let (over, sent) = (AtomicBool::new(false), AtomicUsize::new(0));
    let attack = Attack {
        server: &server,
        sent: &sent,
        began: Instant::now(),
    };
    let (seen, most) = std::thread::scope(|scope| {
        let seen = scope.spawn(|| look_on(watcher, &over));
        let attackers = [
            scope.spawn(|| attack.drive(SEED)),
            scope.spawn(|| attack.watch(SEED + 1)),
            scope.spawn(|| attack.watch(SEED + 2)),
            scope.spawn(|| attack.knock(SEED + 3)),
        ];
        let mut most = before;
        while attackers.iter().any(|attacker| !attacker.is_finished()) {
            most = most.max(server.memory());
            std::thread::sleep(Duration::from_millis(20));
        }
        // A watcher that is late must not look at the calm after it.
        over.store(true, Ordering::Relaxed);
        for attacker in attackers {
            attacker.join().unwrap();
        }
        (seen.join().unwrap(), most)
    });
    let took = attack.began.elapsed().as_secs_f64();
    let sent = sent.load(Ordering::Relaxed);
    println!(
        "{sent} messages in {took:.1} s; simulated time went on at {:.4}, over a second {:.3} at least; {:.0} ms without news at most",
        seen.rate,
        seen.least_pace,
        seen.longest_gap * 1e3
    );
    assert!(sent >= MESSAGES);
    assert!(seen.rate > 0.95, "simulated time went on at {}", seen.rate);
    assert!(seen.farthest < 1e-4, "it moved by {} m", seen.farthest);
    match (before, most) {
        (Some(before), Some(most)) => {
            println!("memory: {before} kB before, {most} kB at most");
            assert!(most < before + MAX_GROWTH, "{before} kB, then {most} kB");
        }
        _ => println!("memory: not looked at, this system does not tell it"),
    }

    assert!(server.runs());
    let mut driver = loop {
        let mut driver = server.join("drive");
        if matches!(driver.hear(), Heard::World(word) if word.get("hello").is_some()) {
            break driver;
        }
        std::thread::sleep(Duration::from_millis(10));
    };
    assert_eq!(driver.ask(1, "m 0.1"), "OK");
    driver.wait_for("! move done ");
    let pose = driver.ask(2, "GetEstPos");
    let x: f64 = pose.split(' ').nth(1).unwrap().parse().unwrap();
    assert!((x - 0.1).abs() < 0.002, "{pose}");
}

/// A ping with as much in it as there may be, masked by nothing.
const PING: [u8; 131] = {
    let mut frame = [b'p'; 131];
    frame[0] = 0x89;
    frame[1] = 0x80 | 0x7D;
    (frame[2], frame[3], frame[4], frame[5]) = (0, 0, 0, 0);
    frame
};

#[test]
fn pings_of_who_never_reads_are_not_answered_for_ever() {
    let server = Server::start(&[]);
    let before = server.memory();
    let mut deaf = server.watch();
    let flood = PING.repeat(1000);
    let began = Instant::now();
    let stream = deaf.0.get_mut();
    stream
        .set_write_timeout(Some(Duration::from_secs(1)))
        .unwrap();
    let (mut most, mut sent) = (before, 0_usize);
    // Until it is thrown out, or nothing of it is read any more.
    while began.elapsed() < Duration::from_secs(6) && stream.write_all(&flood).is_ok() {
        sent += 1000;
        most = most.max(server.memory());
    }
    println!(
        "{sent} pings in {:.1} s, {before:?} kB before, {most:?} kB at most",
        began.elapsed().as_secs_f64()
    );
    assert!(sent >= 1000);
    if let (Some(before), Some(most)) = (before, most) {
        assert!(most < before + MAX_GROWTH, "{before} kB, then {most} kB");
    }
}
