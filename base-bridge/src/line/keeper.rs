//! A thread that opens the line, reads it, and opens it again when it is lost.

use super::Door;
use crate::time::Epoch;
use std::io::{ErrorKind, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// The first wait after a loss, …
const SHORTEST_WAIT: Duration = Duration::from_millis(500);
/// … doubled up to this.
const LONGEST_WAIT: Duration = Duration::from_secs(5);
/// The wait of who is in a hurry.
const HURRIED_WAIT: Duration = Duration::from_millis(50);

/// What happens to the line.
pub enum LineEvent {
    /// It is open: this is where to write to. It is closed when that is dropped.
    Up(Wire),
    /// Bytes, and when they were read, in the bridge's seconds.
    Bytes(Vec<u8>, f64),
    /// It is lost, or could not be opened, and why. Nothing that came before belongs to what comes after.
    Down(String),
}

/// The writing end of an open line.
pub struct Wire {
    writer: Box<dyn Write + Send>,
    given_up: Arc<AtomicBool>,
}

impl Wire {
    /// Writes a line with its end.
    ///
    /// # Errors
    /// If it could not be written whole, in time: give the line up.
    pub fn write(&mut self, line: &[u8]) -> std::io::Result<()> {
        self.writer.write_all(line)?;
        self.writer.flush()
    }
}

impl Drop for Wire {
    fn drop(&mut self) {
        self.given_up.store(true, Ordering::Relaxed);
    }
}

/// Makes the keeper open a lost line as soon as it can: there is little time left to say something.
pub struct Hurry(Arc<AtomicBool>);

impl Hurry {
    /// From now on.
    pub fn up(&self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// Waits, unless there is a hurry.
fn rest(mut wait: Duration, hurried: &AtomicBool) {
    while !wait.is_zero() {
        let part = wait.min(HURRIED_WAIT);
        std::thread::sleep(part);
        wait = if hurried.load(Ordering::Relaxed) {
            Duration::ZERO
        } else {
            wait.saturating_sub(part)
        };
    }
}

/// Keeps the line open, for as long as somebody listens: `tell` returns false when nobody does any more.
pub fn keep(
    mut door: Box<dyn Door>,
    epoch: Epoch,
    mut tell: impl FnMut(LineEvent) -> bool + Send + 'static,
) -> Hurry {
    let hurry = Hurry(Arc::default());
    let hurried = Arc::clone(&hurry.0);
    std::thread::spawn(move || {
        let mut wait = SHORTEST_WAIT;
        loop {
            let mut heard = false;
            let reason = match door.open() {
                Ok(mut ends) => {
                    let given_up = Arc::new(AtomicBool::new(false));
                    let wire = Wire {
                        writer: ends.writer,
                        given_up: Arc::clone(&given_up),
                    };
                    if !tell(LineEvent::Up(wire)) {
                        return;
                    }
                    let mut buffer = [0; 1024];
                    loop {
                        if given_up.load(Ordering::Relaxed) {
                            break None;
                        }
                        match ends.reader.read(&mut buffer) {
                            Ok(0) => break Some("closed".to_owned()),
                            Ok(count) => {
                                heard = true;
                                let bytes = buffer[..count].to_vec();
                                if !tell(LineEvent::Bytes(bytes, epoch.now())) {
                                    return;
                                }
                            }
                            Err(error) => match error.kind() {
                                ErrorKind::TimedOut
                                | ErrorKind::WouldBlock
                                | ErrorKind::Interrupted => {}
                                _ => break Some(error.to_string()),
                            },
                        }
                    }
                }
                Err(error) => Some(error.to_string()),
            };
            // Who has given it up knows why.
            if let Some(reason) = reason
                && !tell(LineEvent::Down(format!("{}: {reason}", door.name())))
            {
                return;
            }
            if heard {
                wait = SHORTEST_WAIT;
            }
            rest(wait, &hurried);
            wait = (wait * 2).min(LONGEST_WAIT);
        }
    });
    hurry
}
