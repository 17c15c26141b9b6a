//! The serial line: a port, a TCP connection or a simulated base, each behind the same door, and a thread that keeps it open.

pub mod keeper;
pub mod serial;
pub mod simulated;
pub mod splitter;
pub mod tcp;

use std::io::{Read, Result, Write};
use std::time::Duration;

/// A read that finds nothing comes back after this, with `TimedOut` or `WouldBlock`: whoever reads looks then whether it still should.
pub const READ_PATIENCE: Duration = Duration::from_millis(50);
/// A write that takes longer is a line that is stuck, and given up: behind it, a Stop would wait.
pub const WRITE_PATIENCE: Duration = Duration::from_millis(100);

/// Both ends of an open line.
pub struct Ends {
    /// What comes from the base. 0 bytes: the line has been closed.
    pub reader: Box<dyn Read + Send>,
    /// What goes to it.
    pub writer: Box<dyn Write + Send>,
}

/// Where a line can be opened, and opened again.
pub trait Door: Send {
    /// Opens it.
    ///
    /// # Errors
    /// If that cannot be done now; later it may.
    fn open(&mut self) -> Result<Ends>;

    /// What it is, for messages.
    fn name(&self) -> String;
}
