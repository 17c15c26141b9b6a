//! A driver at work and two who watch, one of them too slowly: no line of telemetry is lost, and memory stays what it is.
//!
//! `WEB_SOAK_MINUTES=60` makes it long.

mod page;

use page::{Client, Heard, Server};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::time::{Duration, Instant};

const SEED: u64 = 1992;
/// What is looked at in each verification.
const USUAL: Duration = Duration::from_secs(15);
/// Sixteen fields, as the page has them; how many lines found no room on the serial line is the last one.
const STREAM: &str = "Stream 0.02 t x y theta v_s v_s_ref v_alpha v_alpha_ref move_state turn_state left_duty right_duty left_current right_current battery dropped";
/// From line to line, s.
const PERIOD: f64 = 0.02;
/// What the server may grow by once all are there, kB.
const MAX_GROWTH: u64 = 8_000;

/// What has come of telemetry and world.
#[derive(Debug, Default)]
struct Account {
    telemetry: u64,
    left_out: u64,
    worlds: u64,
    replies: u64,
    events: u64,
    last: Option<(f64, u64)>,
}

impl Account {
    fn note(&mut self, heard: &Heard) {
        match heard {
            Heard::Line(line) if line.starts_with("~ ") => self.note_telemetry(line),
            Heard::Line(line) if line.starts_with('!') => self.events += 1,
            Heard::Line(_) => self.replies += 1,
            Heard::World(word) => self.worlds += u64::from(word.get("world").is_some()),
            Heard::End(code, why) => panic!("it ended: {code} {why}; {self:?}"),
        }
    }

    fn note_telemetry(&mut self, line: &str) {
        let fields: Vec<&str> = line.split(' ').skip(1).collect();
        assert_eq!(fields.len(), 16, "{line}");
        let t: f64 = fields[0].parse().unwrap();
        let dropped: u64 = fields[15].parse().unwrap();
        self.telemetry += 1;
        if let Some((before, dropped_before)) = self.last.replace((t, dropped)) {
            let steps = (t - before) / PERIOD;
            // Times have three decimals.
            assert!(
                (steps - steps.round()).abs() < 0.06,
                "{before} s, then {line}"
            );
            // What is missing was left out by the base, which says so.
            let missing = steps.round() as u64 - 1;
            assert_eq!(missing, dropped - dropped_before, "{before} s, then {line}");
            self.left_out += missing;
        }
    }

    fn tell(&self, who: &str, seconds: f64) {
        println!(
            "{who}: telemetry at {:.2} Hz, {} lines left out by the base; the world at {:.2} Hz; {} replies, {} events",
            self.telemetry as f64 / seconds,
            self.left_out,
            self.worlds as f64 / seconds,
            self.replies,
            self.events
        );
    }
}

/// What somebody at the page would have the base do.
fn command(random: &mut ChaCha8Rng) -> String {
    match random.random_range(0..10) {
        0..4 => format!("m {:.3}", random.random_range(-0.5..0.5)),
        4..8 => format!("t {:.1}", random.random_range(-90.0..90.0)),
        8 => "GetPath".into(),
        _ => "Stop".into(),
    }
}

/// Drives until the end; nobody else reads for the driver meanwhile.
fn drive(mut driver: Client, end: Instant) -> Account {
    let mut random = ChaCha8Rng::seed_from_u64(SEED);
    let mut account = Account::default();
    let mut tag = 1_u16;
    let [mut poll, mut next] = [Instant::now(); 2];
    while Instant::now() < end {
        account.note(&driver.hear());
        let now = Instant::now();
        let mut say = |line: &str| {
            tag = tag.wrapping_add(1);
            driver.say(&format!("@{tag} {line}"));
        };
        // As the page polls.
        if now >= poll {
            poll = now + Duration::from_millis(200);
            say("GetEstPos");
            say("GetStatus");
        }
        if now >= next {
            next = now + Duration::from_millis(random.random_range(300..2000));
            say(&command(&mut random));
        }
    }
    account
}

fn watch(mut watcher: Client, end: Instant) -> Account {
    let mut account = Account::default();
    while Instant::now() < end {
        account.note(&watcher.hear());
    }
    account
}

/// Reads a fifteenth of what it is told; after how long it is sent away, s.
fn dawdle(mut watcher: Client) -> f64 {
    let began = Instant::now();
    while began.elapsed() < page::PATIENCE {
        if let Heard::End(..) = watcher.hear() {
            return began.elapsed().as_secs_f64();
        }
        // What it has not read is still there to be read when the server has given it up: then it hurries.
        if began.elapsed() < Duration::from_secs(10) {
            std::thread::sleep(Duration::from_millis(200));
        }
    }
    panic!("it is kept");
}

/// How long, and whether that is for the figures.
fn length() -> Duration {
    let minutes = std::env::var("WEB_SOAK_MINUTES").ok();
    minutes.map_or(USUAL, |minutes| {
        let minutes: f64 = minutes.parse().expect("WEB_SOAK_MINUTES is a number");
        Duration::from_secs_f64(minutes * 60.0)
    })
}

#[test]
fn no_line_is_lost_and_no_memory() {
    let length = length();
    let mut server = Server::start(&[]);
    let mut driver = server.drive();
    assert_eq!(driver.ask(1, STREAM), "OK");
    let (watcher, slow) = (server.watch(), server.watch());
    let began = Instant::now();
    let end = began + length;
    std::thread::scope(|scope| {
        let driver = scope.spawn(|| drive(driver, end));
        let watcher = scope.spawn(|| watch(watcher, end));
        let slow = scope.spawn(|| dawdle(slow));
        let mut memory = Vec::new();
        while Instant::now() < end {
            // The first seconds are for what is needed once.
            if began.elapsed() > Duration::from_secs(3) {
                memory.extend(server.memory());
            }
            std::thread::sleep(Duration::from_millis(500));
        }
        let seconds = length.as_secs_f64();
        let (driver, watcher) = (driver.join().unwrap(), watcher.join().unwrap());
        driver.tell("driver", seconds);
        watcher.tell("watcher", seconds);
        println!("the slow watcher ended after {:.1} s", slow.join().unwrap());
        for account in [&driver, &watcher] {
            let rate = (account.telemetry + account.left_out) as f64 * PERIOD / seconds;
            assert!((0.97..1.03).contains(&rate), "{rate} of what should come");
            let worlds = account.worlds as f64 / seconds;
            assert!((22.0..27.0).contains(&worlds), "{worlds} Hz");
        }
        let Some((first, last)) = memory.first().zip(memory.last()) else {
            println!("memory: not looked at, this system does not tell it");
            return;
        };
        let (least, most) = (memory.iter().min().unwrap(), memory.iter().max().unwrap());
        println!("memory: {least} to {most} kB, {last} kB at last");
        assert!(*most < first + MAX_GROWTH, "{first} kB, then {most} kB");
    });
    assert!(server.runs());
}
