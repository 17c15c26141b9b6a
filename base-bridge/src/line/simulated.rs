//! A simulated base in this process, in real time.

use super::{Door, Ends, READ_PATIENCE};
use hil_sim::rig::{PERIOD, Rig};
use hil_sim::robot::Robot;
use std::collections::VecDeque;
use std::io::{Error, ErrorKind, Read, Result, Write};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, TryRecvError, channel};
use std::time::{Duration, Instant};

/// Simulated time that is lost beyond this (the computer slept) is not made up for.
const MAX_LAG: Duration = Duration::from_millis(250);

/// A robot that begins to be simulated when its line is opened. Opened again it is another one, switched on anew.
pub struct Simulated {
    name: String,
    robot: Robot,
    seed: u64,
}

impl Simulated {
    /// A robot by its name or the path of its file, as `cargo sim --robot` takes it.
    ///
    /// # Errors
    /// If there is no such robot.
    pub fn new(name: &str, seed: u64) -> anyhow::Result<Self> {
        Ok(Self {
            name: name.to_owned(),
            robot: Robot::load(name)?,
            seed,
        })
    }
}

impl Door for Simulated {
    fn open(&mut self) -> Result<Ends> {
        let (to_base, from_host) = channel();
        let (to_host, from_base) = channel();
        let (robot, seed) = (self.robot.clone(), self.seed);
        std::thread::spawn(move || simulate(&robot, seed, &from_host, &to_host));
        Ok(Ends {
            reader: Box::new(Reading {
                from_base,
                rest: VecDeque::new(),
            }),
            writer: Box::new(Writing(to_base)),
        })
    }

    fn name(&self) -> String {
        format!("simulated {}", self.name)
    }
}

/// Until the host has left.
fn simulate(robot: &Robot, seed: u64, input: &Receiver<Vec<u8>>, output: &Sender<Vec<u8>>) {
    // The fakes never refuse. If they did, the line would be found closed.
    let Ok(mut rig) = Rig::new(robot, seed) else {
        return;
    };
    let period = Duration::from_micros(PERIOD.ticks());
    let mut next = Instant::now();
    loop {
        loop {
            match input.try_recv() {
                Ok(bytes) => rig.send(&bytes),
                Err(TryRecvError::Empty) => break,
                Err(TryRecvError::Disconnected) => return,
            }
        }
        rig.tick();
        let bytes = rig.receive();
        if !bytes.is_empty() && output.send(bytes).is_err() {
            return;
        }
        next += period;
        let now = Instant::now();
        next = next.max(now.checked_sub(MAX_LAG).unwrap_or(now));
        std::thread::sleep(next.saturating_duration_since(now));
    }
}

struct Reading {
    from_base: Receiver<Vec<u8>>,
    rest: VecDeque<u8>,
}

impl Read for Reading {
    fn read(&mut self, bytes: &mut [u8]) -> Result<usize> {
        if self.rest.is_empty() {
            match self.from_base.recv_timeout(READ_PATIENCE) {
                Ok(bytes) => self.rest.extend(bytes),
                Err(RecvTimeoutError::Timeout) => return Err(ErrorKind::TimedOut.into()),
                Err(RecvTimeoutError::Disconnected) => return Ok(0),
            }
        }
        self.rest.read(bytes)
    }
}

struct Writing(Sender<Vec<u8>>);

impl Write for Writing {
    fn write(&mut self, bytes: &[u8]) -> Result<usize> {
        let sent = self.0.send(bytes.to_vec());
        sent.map_err(|_| Error::from(ErrorKind::BrokenPipe))?;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> Result<()> {
        Ok(())
    }
}
