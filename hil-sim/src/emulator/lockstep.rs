//! The emulated core in step with whoever simulates the world.
//!
//! The emulator runs on a thread of its own and calls a driver at each instant that it was asked to reach. The driver here waits there for orders: run
//! on to another instant while the encoders turn, or do something with the core held. As the one waits whenever the other works, every run is the same.

use super::board::{Bridge, Nucleo};
use super::observer::Observer;
use super::strict;
use anyhow::{Result, anyhow};
use rigless::emulator::{self, Driver, Host, Settled, Start, Stop};
use rigless::image::Image;
use rigless::session::Session;
use rigless::soc::Width;
use rigless::time::VirtualNanos;
use std::collections::VecDeque;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::JoinHandle;

/// An encoder reaches a position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Edge {
    /// When.
    pub at: VirtualNanos,
    /// Which encoder: the left one, the right one, or that of a car's steering.
    pub encoder: usize,
    /// Where it is then, in counts.
    pub count: i64,
}

/// What happens until the next meeting.
#[derive(Debug)]
pub struct Stretch {
    /// When to meet.
    pub until: VirtualNanos,
    /// What the encoders do until then, in the order of their times.
    pub edges: VecDeque<Edge>,
}

impl Stretch {
    /// Nothing happens until then.
    pub fn to(until: VirtualNanos) -> Self {
        Self {
            until,
            edges: VecDeque::new(),
        }
    }
}

/// What the core has done when the two meet.
#[derive(Debug, Default)]
pub struct Meeting {
    /// Bytes that came on the serial line.
    pub bytes: Vec<u8>,
    /// Bytes that wait to go there.
    pub backlog: usize,
    /// What the drivers of the motors are told.
    pub bridges: [Bridge; 2],
    /// What the steering's servo is told: the width of its pulses, s.
    pub servo: Option<f64>,
    /// Why the run is not valid.
    pub problem: Option<String>,
}

/// The core, held between two instructions.
pub struct Held<'a> {
    /// The emulated board, and the reports about it.
    pub session: &'a mut Session<Nucleo>,
    /// Its memory.
    pub host: &'a mut dyn Host,
    /// What is watched.
    pub observer: &'a mut Observer,
    /// Where the run stands.
    pub stop: Stop,
}

impl Held<'_> {
    /// Bytes of the image's memory.
    pub fn read(&mut self, address: u64, length: u64) -> Result<Vec<u8>> {
        let bytes = (address..address + length).map(|at| self.host.read(at, Width::W8));
        bytes.map(|byte| Ok(byte? as u8)).collect()
    }
}

type Job = Box<dyn FnOnce(&mut Held<'_>) + Send>;

enum Order {
    Run(Stretch),
    Do(Job),
}

struct Lockstep {
    orders: Receiver<Order>,
    meetings: Sender<Meeting>,
    stretch: Stretch,
    /// The first stop is before the first instruction: nobody waits for it.
    begun: bool,
    observer: Observer,
}

impl Lockstep {
    fn meet(&mut self, session: &mut Session<Nucleo>, stop: Stop) {
        let problem = strict::problem(session, &self.observer);
        let problem = problem.or_else(|| self.observer.failure.clone());
        let board = session.board_mut();
        let (bytes, backlog) = board
            .line()
            .map_or_else(Default::default, |line| (line.receive(), line.backlog()));
        let problem = problem.or_else(|| {
            let stray = !bytes.is_empty() && !board.is_serial_routed();
            stray.then(|| "USART3 sends, and is not at PD8 and PD9".to_owned())
        });
        let meeting = Meeting {
            bytes,
            backlog,
            bridges: board.bridges(stop.at),
            servo: board.servo(stop.at),
            problem,
        };
        // Whoever hung up will not give another order either.
        let _ = self.meetings.send(meeting);
    }
}

impl Driver<Nucleo> for Lockstep {
    fn on_settled(&mut self, session: &mut Session<Nucleo>, host: &mut dyn Host, settled: Settled) {
        self.observer.settled(session, host, settled);
    }

    fn on_stop(
        &mut self,
        session: &mut Session<Nucleo>,
        stop: Stop,
        host: &mut dyn Host,
    ) -> Option<VirtualNanos> {
        while let Some(edge) = self.stretch.edges.front() {
            if edge.at > stop.at {
                return Some(edge.at);
            }
            session.board_mut().turn(stop.at, edge.encoder, edge.count);
            self.stretch.edges.pop_front();
        }
        if stop.at < self.stretch.until {
            return Some(self.stretch.until);
        }
        if self.begun {
            self.meet(session, stop);
        } else {
            self.begun = true;
            session.board_mut().connect(stop.at);
        }
        loop {
            match self.orders.recv() {
                Ok(Order::Do(job)) => job(&mut Held {
                    session,
                    host,
                    observer: &mut self.observer,
                    stop,
                }),
                Ok(Order::Run(stretch)) => {
                    self.stretch = stretch;
                    let first = self.stretch.edges.front().map(|edge| edge.at);
                    return Some(first.unwrap_or(self.stretch.until));
                }
                Err(_) => return None,
            }
        }
    }
}

/// The emulated core, from the outside.
#[derive(Debug)]
pub struct Core {
    orders: Option<Sender<Order>>,
    meetings: Receiver<Meeting>,
    thread: Option<JoinHandle<Result<()>>>,
}

impl Core {
    /// Powers a board up, up to the instant before its first instruction.
    ///
    /// # Errors
    /// If the emulator refuses the board.
    pub fn power_up(board: Nucleo, images: Vec<Image>) -> Result<Self> {
        let session = Session::new(Box::new(board), 0, VirtualNanos(0))?;
        let (orders, received) = channel();
        let (sender, meetings) = channel();
        let driver = Lockstep {
            orders: received,
            meetings: sender,
            stretch: Stretch::to(VirtualNanos(0)),
            begun: false,
            observer: Observer::default(),
        };
        let run = move || {
            emulator::run(session, &Start::new(&images), driver)?;
            Ok(())
        };
        let thread = std::thread::Builder::new()
            .name("emulator".into())
            .spawn(run)?;
        Ok(Self {
            orders: Some(orders),
            meetings,
            thread: Some(thread),
        })
    }

    /// Runs on.
    ///
    /// # Errors
    /// If the emulator has given up.
    pub fn run(&mut self, stretch: Stretch) -> Result<Meeting> {
        self.give(Order::Run(stretch))
            .and_then(|()| self.meetings.recv().ok())
            .ok_or_else(|| self.obituary())
    }

    /// Does something with the core held where it stands.
    ///
    /// # Errors
    /// If the emulator has given up.
    pub fn hold<T: Send + 'static>(
        &self,
        job: impl FnOnce(&mut Held<'_>) -> T + Send + 'static,
    ) -> Result<T> {
        let (answer, answered) = channel();
        let job = move |held: &mut Held<'_>| {
            // The other end waits for it.
            let _ = answer.send(job(held));
        };
        self.give(Order::Do(Box::new(job)))
            .and_then(|()| answered.recv().ok())
            .ok_or_else(|| anyhow!("the emulator has ended"))
    }

    fn give(&self, order: Order) -> Option<()> {
        self.orders.as_ref()?.send(order).ok()
    }

    /// Why the emulator has ended.
    fn obituary(&mut self) -> anyhow::Error {
        match self.thread.take().map(JoinHandle::join) {
            Some(Ok(Err(error))) => error.context("the emulator has ended"),
            Some(Err(_)) => anyhow!("the emulator has panicked"),
            _ => anyhow!("the emulator has ended"),
        }
    }
}

impl Drop for Core {
    fn drop(&mut self) {
        self.orders = None;
        if let Some(thread) = self.thread.take() {
            // Nobody is left to hear how it ended.
            let _ = thread.join();
        }
    }
}
