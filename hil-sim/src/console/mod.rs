//! `drive`: the simulated base in real time, with a terminal, a pseudo-terminal, a TCP client or pages in browsers at its serial line.

mod line_editor;
#[cfg(unix)]
mod pty;
mod stdio;
mod tcp;

use crate::trace_file::TraceFile;
use crate::web::{self, Served};
use anyhow::{Context, Result};
use hil_sim::base::Base;
use hil_sim::rig::PERIOD;
use std::io::{IsTerminal, Write};
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, TryRecvError};
use std::time::{Duration, Instant};

/// The far end of the base's serial line.
pub struct Port {
    /// What the far end sends; hung up when it has left for good.
    pub input: Receiver<Vec<u8>>,
    /// Takes what the base sends.
    pub output: Output,
    /// The far end does not wait for replies: lines are held back so that no more than the base can take are unanswered.
    pub impatient: bool,
    /// While more bytes than this are on their way to the base, no more are taken.
    pub max_on_the_way: usize,
    /// What goes on beside the serial line.
    pub beside: Option<Beside>,
}

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
    loop {
        for _ in 0..pace.ticks_due() {
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
            match port.input.try_recv() {
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
        pace.rest();
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
    speed: Speed,
    origin: Instant,
    done: u64,
}

impl Pace {
    /// The loop looks at its input this often.
    const NAP: Duration = Duration::from_millis(2);
    /// Time lost beyond this (the computer slept) is not made up for.
    const MAX_LAG: u64 = 250;

    fn new(speed: Speed) -> Self {
        Self {
            speed,
            origin: Instant::now(),
            done: 0,
        }
    }

    fn ticks_due(&mut self) -> u64 {
        let Speed::Times(times) = self.speed else {
            return 100;
        };
        let per_second = 1e6 / PERIOD.ticks() as f64 * times;
        let due = (self.origin.elapsed().as_secs_f64() * per_second) as u64;
        let behind = due.saturating_sub(self.done);
        self.done = due;
        behind.min((Self::MAX_LAG as f64 * times.max(1.0)) as u64)
    }

    fn rest(&self) {
        if self.speed != Speed::Max {
            std::thread::sleep(Self::NAP);
        }
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
