//! `drive`: the simulated base in real time, with a terminal, a pseudo-terminal, a TCP client or pages in browsers at its serial line.

mod line_editor;
#[cfg(unix)]
mod pty;
mod stdio;
mod tcp;

use crate::run::Watcher as _;
use crate::trace_file::TraceFile;
use crate::web::{self, Served};
use anyhow::{Context, Result};
use hil_sim::base::Base;
use hil_sim::rig::PERIOD;
use std::io::{IsTerminal, Write};
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::TryRecvError;
use std::time::{Duration, Instant};

/// The far end of the base's serial line.
pub struct Port {
    /// What the far end sends.
    pub input: Input,
    /// Takes what the base sends.
    pub output: Output,
    /// The far end does not wait for replies: lines are held back so that no more than the base can take are unanswered.
    pub impatient: bool,
    /// While more bytes than this are on their way to the base, no more are taken.
    pub max_on_the_way: usize,
    /// What goes on beside the serial line.
    pub beside: Option<Beside>,
}

/// The next bytes that have come, if any have; hung up when the far end has left for good.
pub type Input = Box<dyn FnMut() -> Result<Vec<u8>, TryRecvError>>;

/// Takes bytes that the base sends.
pub type Output = Box<dyn FnMut(&[u8]) -> Result<()>>;

/// Looks at the base between two ticks, and may meddle with it.
pub type Beside = Box<dyn FnMut(&mut dyn Base) -> Result<()>>;

/// Who is at the serial line.
pub enum Far {
    /// Standard input and output.
    Terminal,
    /// A new pseudo-terminal.
    Pty,
    /// A TCP client.
    Tcp(SocketAddr),
    /// Pages in browsers: where, and whether others than this computer may have them.
    Web(web::Address, bool),
}

/// How fast simulated time passes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Speed {
    /// So many times real time.
    Times(f64),
    /// As fast as it goes.
    Max,
}

impl std::str::FromStr for Speed {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.parse::<f64>() {
            _ if text == "max" => Ok(Self::Max),
            Ok(times) if times > 0.0 && times <= 1000.0 => Ok(Self::Times(times)),
            _ => Err("a factor above 0 and up to 1000, or max".into()),
        }
    }
}

/// The loop looks at its input this often …
const NAP: Duration = Duration::from_millis(2);
/// … or this often and after so many ticks, if the simulation has no time for a nap.
const STRETCH: Duration = Duration::from_millis(10);
const STRETCH_TICKS: u32 = 100;

/// Runs until the far end leaves, and the base then rests; or until the process is told to end.
pub fn drive(
    base: &mut dyn Base,
    served: &Served<'_>,
    far: &Far,
    mut trace: Option<TraceFile>,
) -> Result<()> {
    let told_to_end = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&told_to_end);
    ctrlc::set_handler(move || flag.store(true, Ordering::Relaxed))?;
    let mut port = match far {
        Far::Terminal if std::io::stdin().is_terminal() => {
            line_editor::open(served.robot.params.vehicle())?
        }
        Far::Terminal => stdio::open(),
        #[cfg(unix)]
        Far::Pty => pty::open()?,
        #[cfg(not(unix))]
        Far::Pty => anyhow::bail!("this system has no pseudo-terminals: use --tcp"),
        Far::Tcp(address) => tcp::open(*address)?,
        Far::Web(address, allow_remote) => web::open(address, *allow_remote, served)?,
    };
    let mut pace = Pace::new(served.speed);
    let mut leaving = Leaving::default();
    let mut flow = Flow::default();
    let origin = Instant::now();
    loop {
        // A base that takes longer than it should, such as an emulated board, must not keep the far end waiting: a Stop may be under way.
        let pause = origin.elapsed() + STRETCH;
        for _ in 0..STRETCH_TICKS {
            let now = origin.elapsed();
            if now >= pause || !pace.is_tick_due(now) {
                break;
            }
            base.tick()?;
            if let Some(trace) = &mut trace {
                trace.note(base)?;
            }
            let bytes = base.receive();
            if !bytes.is_empty() {
                leaving.postpone();
                flow.answered(&bytes);
                (port.output)(&bytes)?;
            }
            if leaving.is_over(base)? {
                return trace.map_or(Ok(()), TraceFile::finish);
            }
        }
        while (!port.impatient || flow.is_open()) && base.backlog() <= port.max_on_the_way {
            match (port.input)() {
                Ok(bytes) => {
                    flow.sent(&bytes);
                    base.send(&bytes)?;
                }
                Err(TryRecvError::Empty) => break,
                Err(TryRecvError::Disconnected) => {
                    leaving.begin();
                    break;
                }
            }
        }
        // What the far end could not take before, it may take now.
        (port.output)(&[])?;
        if let Some(beside) = &mut port.beside {
            beside(base)?;
        }
        if told_to_end.load(Ordering::Relaxed) {
            return trace.map_or(Ok(()), TraceFile::finish);
        }
        if !pace.is_behind(origin.elapsed()) {
            std::thread::sleep(NAP);
        }
    }
}

/// Writes a line to standard output.
pub fn say(line: std::fmt::Arguments<'_>) -> Result<()> {
    writeln!(std::io::stdout(), "{line}").context("standard output")
}

/// Counts the lines that are not answered yet.
#[derive(Default)]
struct Flow {
    unanswered: usize,
    line: Vec<u8>,
}

impl Flow {
    /// What the protocol allows.
    const MAX_UNANSWERED: usize = 4;

    fn sent(&mut self, bytes: &[u8]) {
        let is_blank = |line: &&[u8]| line.iter().all(u8::is_ascii_whitespace);
        let lines = bytes.split(|b| *b == b'\n').filter(|line| !is_blank(line));
        self.unanswered += lines.count();
    }

    fn answered(&mut self, bytes: &[u8]) {
        for byte in bytes {
            if *byte != b'\n' {
                self.line.push(*byte);
                continue;
            }
            if !matches!(self.line.first(), Some(b'!' | b'~')) {
                self.unanswered = self.unanswered.saturating_sub(1);
            }
            self.line.clear();
        }
    }

    fn is_open(&self) -> bool {
        self.unanswered < Self::MAX_UNANSWERED
    }
}

/// Keeps simulated time in step with the clock.
struct Pace {
    /// Ticks in a second; none if as many as there can be.
    per_second: Option<f64>,
    done: u64,
    /// Time lost beyond so many ticks (the computer slept, or is too slow) is not made up for.
    max_lag: u64,
}

impl Pace {
    /// What is made up for, ticks at real time.
    const MAX_LAG: f64 = 250.0;

    fn new(speed: Speed) -> Self {
        let (per_second, max_lag) = match speed {
            Speed::Times(times) => (
                Some(1e6 / PERIOD.ticks() as f64 * times),
                Self::MAX_LAG * times.max(1.0),
            ),
            Speed::Max => (None, 0.0),
        };
        Self {
            per_second,
            done: 0,
            max_lag: max_lag as u64,
        }
    }

    /// So many ticks are due after this time that have not been taken.
    fn behind(&self, elapsed: Duration) -> u64 {
        let Some(per_second) = self.per_second else {
            return 1;
        };
        let due = (elapsed.as_secs_f64() * per_second) as u64;
        due.saturating_sub(self.done)
    }

    fn is_behind(&self, elapsed: Duration) -> bool {
        self.behind(elapsed) > 0
    }

    /// Takes a tick, if one is due.
    fn is_tick_due(&mut self, elapsed: Duration) -> bool {
        let behind = self.behind(elapsed);
        if behind == 0 {
            return false;
        }
        self.done += 1 + behind.saturating_sub(self.max_lag.max(1));
        true
    }
}

/// When the far end has left, the base is simulated until it rests and has said all.
#[derive(Default)]
struct Leaving {
    begun: bool,
    ticks: u32,
    quiet_ticks: u32,
}

impl Leaving {
    /// A base that holds and says nothing for this long is done.
    const QUIET_TICKS: u32 = 1000;
    /// A motion without an end is not waited for longer than this.
    const PATIENCE_TICKS: u32 = 60_000;

    fn begin(&mut self) {
        self.begun = true;
    }

    fn postpone(&mut self) {
        self.quiet_ticks = 0;
    }

    fn is_over(&mut self, base: &dyn Base) -> Result<bool> {
        if !self.begun || base.backlog() > 0 || !base.holds()? {
            self.quiet_ticks = 0;
        }
        self.quiet_ticks += 1;
        self.ticks += u32::from(self.begun);
        Ok(self.quiet_ticks > Self::QUIET_TICKS || self.ticks > Self::PATIENCE_TICKS)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Takes all ticks that are due.
    fn ticks(pace: &mut Pace, milliseconds: u64) -> u64 {
        let elapsed = Duration::from_millis(milliseconds);
        (0..10_000)
            .take_while(|_| pace.is_tick_due(elapsed))
            .count() as u64
    }

    #[test]
    fn ticks_are_due_as_fast_as_wished() {
        let mut pace = Pace::new(Speed::Times(2.0));
        assert_eq!(ticks(&mut pace, 0), 0);
        assert_eq!(ticks(&mut pace, 5), 10);
        assert!(!pace.is_behind(Duration::from_millis(5)));
        assert_eq!(ticks(&mut pace, 105), 200);
        let mut slow = Pace::new(Speed::Times(0.1));
        assert_eq!(ticks(&mut slow, 1000), 100);
        let mut most = Pace::new(Speed::Max);
        assert_eq!(ticks(&mut most, 0), 10_000);
    }

    #[test]
    fn a_quarter_of_a_second_is_made_up_for_and_no_more() {
        let mut pace = Pace::new(Speed::Times(1.0));
        assert_eq!(ticks(&mut pace, 200), 200);
        assert_eq!(ticks(&mut pace, 60_000), 250);
        assert_eq!(ticks(&mut pace, 60_010), 10);
    }
}
