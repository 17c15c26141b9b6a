//! Cables between a simulated base and a bridge: one in this process, and a pseudo-terminal that comes and goes.

use super::{Base, sleep};
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
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex};
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

/// A wire with a tap, whose base can be made mute or deaf, and which can hold up who writes.
#[derive(Clone)]
pub struct Tap {
    base: Base,
    /// What the base says is lost.
    pub mute: Arc<AtomicBool>,
    /// Lines with this in them are lost on their way to the base.
    pub lost: Arc<Mutex<Option<&'static str>>>,
    /// Behind this, in the next line that has it, the wire is torn.
    pub torn: Arc<Mutex<Option<&'static str>>>,
    /// Bytes are not taken.
    pub held: Arc<AtomicBool>,
    /// What the bridge has written.
    heard: Arc<Mutex<Vec<u8>>>,
}

impl Tap {
    pub fn new(base: &Base) -> Self {
        Self {
            base: base.clone(),
            mute: Arc::default(),
            lost: Arc::default(),
            torn: Arc::default(),
            held: Arc::default(),
            heard: Arc::default(),
        }
    }

    /// The lines that the bridge has written since the last call, without their tags and checks.
    pub fn lines(&self) -> Vec<String> {
        bare_lines(&self.heard)
    }
}

/// Takes what was heard, as lines without their tags and checks.
fn bare_lines(heard: &Mutex<Vec<u8>>) -> Vec<String> {
    let bytes = std::mem::take(&mut *heard.lock().unwrap());
    let text = String::from_utf8(bytes).unwrap();
    let bare = |line: &str| {
        let line = line.split_once('*').map_or(line, |(line, _)| line);
        let tagged = line.strip_prefix('@').and_then(|line| line.split_once(' '));
        tagged.map_or(line, |(_, line)| line).to_owned()
    };
    text.lines().map(bare).collect()
}

/// Could this line move a base, or set its place?
pub fn moves(line: &str) -> bool {
    let command = line.split(' ').next().unwrap();
    ["m", "t", "GoTo", "ResetPos", "ObservePos"].contains(&command)
}

struct Tapped<T>(T, Tap);

impl Door for Tap {
    fn open(&mut self) -> Result<Ends> {
        let Ends { reader, writer } = Wire(self.base.clone()).open()?;
        Ok(Ends {
            reader: Box::new(Tapped(reader, self.clone())),
            writer: Box::new(Tapped(writer, self.clone())),
        })
    }

    fn name(&self) -> String {
        "tapped wire".into()
    }
}

impl<T: Read> Read for Tapped<T> {
    fn read(&mut self, bytes: &mut [u8]) -> Result<usize> {
        let count = self.0.read(bytes)?;
        if count > 0 && self.1.mute.load(Ordering::Relaxed) {
            return Err(ErrorKind::TimedOut.into());
        }
        Ok(count)
    }
}

impl<T: Write> Write for Tapped<T> {
    fn write(&mut self, bytes: &[u8]) -> Result<usize> {
        while self.1.held.load(Ordering::Relaxed) {
            sleep(0.01);
        }
        self.1.heard.lock().unwrap().extend(bytes);
        let line = String::from_utf8_lossy(bytes);
        let lost = *self.1.lost.lock().unwrap();
        if lost.is_some_and(|lost| line.contains(lost)) {
            return Ok(bytes.len());
        }
        let torn = &mut *self.1.torn.lock().unwrap();
        if let Some(end) = torn.and_then(|last| Some(line.find(last)? + last.len())) {
            *torn = None;
            self.0.write_all(&bytes[..end])?;
            return Err(ErrorKind::BrokenPipe.into());
        }
        self.0.write(bytes)
    }

    fn flush(&mut self) -> Result<()> {
        self.0.flush()
    }
}

/// A serial port that comes and goes, as that of a USB cable does: a pseudo-terminal behind a link that keeps its name.
pub struct Usb {
    base: Base,
    link: PathBuf,
    /// What has come out of it at the base since it was plugged in.
    heard: Arc<Mutex<Vec<u8>>>,
    plugged: Option<(Arc<AtomicBool>, JoinHandle<()>)>,
}

impl Usb {
    /// A port with this name, not plugged in.
    pub fn new(base: &Base, link: &Path) -> Self {
        Self {
            base: base.clone(),
            link: link.to_owned(),
            heard: Arc::default(),
            plugged: None,
        }
    }

    /// The lines that have come out of it since it was plugged in, or since the last call, without their tags and checks.
    pub fn lines(&self) -> Vec<String> {
        bare_lines(&self.heard)
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
        self.heard.lock().unwrap().clear();
        let heard = Arc::clone(&self.heard);
        let thread = std::thread::spawn(move || {
            let (master, mut buffer) = (pty.master, [0; 1024]);
            // The slave's other end is the bridge's. When the master is closed, the bridge finds its port gone.
            drop(pty.slave);
            while !flag.load(Ordering::Relaxed) {
                match read(&master, &mut buffer) {
                    Ok(count) if count > 0 => {
                        heard.lock().unwrap().extend(&buffer[..count]);
                        to_base.send(buffer[..count].to_vec()).unwrap();
                    }
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
