//! Cables between a simulated base and a bridge: one in this process, and a pseudo-terminal that comes and goes.

use super::Base;
use base_bridge::line::{Door, Ends};
use nix::errno::Errno;
use nix::fcntl::{FcntlArg, OFlag, fcntl};
use nix::pty::openpty;
use nix::sys::termios::{SetArg, cfmakeraw, tcgetattr, tcsetattr};
use nix::unistd::{read, ttyname, write};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::VecDeque;
use std::io::{Error, ErrorKind, Read, Result, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::Duration;

/// A wire in this process.
pub struct Wire(pub Base);

impl Door for Wire {
    fn open(&mut self) -> Result<Ends> {
        let (to_host, from_base) = channel();
        *self.0.listener.lock().unwrap() = Some(to_host);
        Ok(Ends {
            reader: Box::new(Reading(from_base, VecDeque::new())),
            writer: Box::new(Writing(self.0.input.clone())),
        })
    }

    fn name(&self) -> String {
        "wire".into()
    }
}

/// A wire beside a motor: each byte, either way, is another one with this probability.
pub struct Noisy {
    pub base: Base,
    pub seed: u64,
    pub share: f64,
}

impl Door for Noisy {
    fn open(&mut self) -> Result<Ends> {
        let Ends { reader, writer } = Wire(self.base.clone()).open()?;
        self.seed += 2;
        let noise = |seed| Noise(ChaCha8Rng::seed_from_u64(seed), self.share);
        Ok(Ends {
            reader: Box::new(Disturbed(reader, noise(self.seed))),
            writer: Box::new(Disturbed(writer, noise(self.seed + 1))),
        })
    }

    fn name(&self) -> String {
        "noisy wire".into()
    }
}

struct Noise(ChaCha8Rng, f64);

impl Noise {
    fn disturb(&mut self, bytes: &mut [u8]) {
        for byte in bytes {
            if self.0.random_bool(self.1) {
                *byte ^= 1 << self.0.random_range(0..8);
            }
        }
    }
}

struct Disturbed<T>(T, Noise);

impl<T: Read> Read for Disturbed<T> {
    fn read(&mut self, bytes: &mut [u8]) -> Result<usize> {
        let count = self.0.read(bytes)?;
        self.1.disturb(&mut bytes[..count]);
        Ok(count)
    }
}

impl<T: Write> Write for Disturbed<T> {
    fn write(&mut self, bytes: &[u8]) -> Result<usize> {
        let mut bytes = bytes.to_vec();
        self.1.disturb(&mut bytes);
        self.0.write(&bytes)
    }

    fn flush(&mut self) -> Result<()> {
        self.0.flush()
    }
}

struct Reading(Receiver<Vec<u8>>, VecDeque<u8>);

impl Read for Reading {
    fn read(&mut self, bytes: &mut [u8]) -> Result<usize> {
        if self.1.is_empty() {
            match self.0.recv_timeout(Duration::from_millis(50)) {
                Ok(bytes) => self.1.extend(bytes),
                Err(RecvTimeoutError::Timeout) => return Err(ErrorKind::TimedOut.into()),
                Err(RecvTimeoutError::Disconnected) => return Ok(0),
            }
        }
        self.1.read(bytes)
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

/// A serial port that comes and goes, as that of a USB cable does: a pseudo-terminal behind a link that keeps its name.
pub struct Usb {
    base: Base,
    link: PathBuf,
    plugged: Option<(Arc<AtomicBool>, JoinHandle<()>)>,
}

impl Usb {
    /// A port with this name, not plugged in.
    pub fn new(base: &Base, link: &Path) -> Self {
        Self {
            base: base.clone(),
            link: link.to_owned(),
            plugged: None,
        }
    }

    /// Plugs it in.
    pub fn plug(&mut self) {
        let pty = openpty(None, None).unwrap();
        let mut settings = tcgetattr(&pty.slave).unwrap();
        cfmakeraw(&mut settings);
        tcsetattr(&pty.slave, SetArg::TCSANOW, &settings).unwrap();
        fcntl(&pty.master, FcntlArg::F_SETFL(OFlag::O_NONBLOCK)).unwrap();
        std::os::unix::fs::symlink(ttyname(&pty.slave).unwrap(), &self.link).unwrap();
        let (to_host, from_base) = channel();
        *self.base.listener.lock().unwrap() = Some(to_host);
        let pulled = Arc::new(AtomicBool::new(false));
        let (flag, to_base) = (Arc::clone(&pulled), self.base.input.clone());
        let thread = std::thread::spawn(move || {
            let (master, mut buffer) = (pty.master, [0; 1024]);
            // The slave's other end is the bridge's. When the master is closed, the bridge finds its port gone.
            drop(pty.slave);
            while !flag.load(Ordering::Relaxed) {
                match read(&master, &mut buffer) {
                    Ok(count) if count > 0 => to_base.send(buffer[..count].to_vec()).unwrap(),
                    // Nobody has opened it, or there is nothing.
                    Ok(_) | Err(Errno::EIO | Errno::EAGAIN | Errno::EINTR) => {}
                    Err(error) => panic!("{error}"),
                }
                match from_base.recv_timeout(Duration::from_millis(1)) {
                    // What nobody takes is lost, as on a wire.
                    Ok(bytes) => drop(write(&master, &bytes)),
                    Err(RecvTimeoutError::Timeout) => {}
                    Err(RecvTimeoutError::Disconnected) => return,
                }
            }
        });
        self.plugged = Some((pulled, thread));
    }

    /// Pulls it out.
    pub fn pull(&mut self) {
        if let Some((pulled, thread)) = self.plugged.take() {
            *self.base.listener.lock().unwrap() = None;
            pulled.store(true, Ordering::Relaxed);
            thread.join().unwrap();
            std::fs::remove_file(&self.link).unwrap();
        }
    }
}

impl Drop for Usb {
    fn drop(&mut self) {
        if !std::thread::panicking() {
            self.pull();
        }
    }
}
