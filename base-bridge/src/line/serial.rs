//! A serial port.

use super::{Door, Ends, READ_PATIENCE, WRITE_PATIENCE};
use serialport::{ClearBuffer, SerialPort, TTYPort};
use std::io::{Result, Write};
use std::path::{Path, PathBuf};

/// A serial port by its path.
pub struct Serial {
    path: PathBuf,
    baud: u32,
}

impl Serial {
    /// The port at a path, as /dev/ttyACM0; a link in /dev/serial/by-id keeps its name when the cable is replugged.
    pub fn new(path: PathBuf, baud: u32) -> Self {
        Self { path, baud }
    }
}

impl Door for Serial {
    fn open(&mut self) -> Result<Ends> {
        let path = self.path.to_string_lossy();
        let port = serialport::new(path, self.baud).timeout(READ_PATIENCE);
        let mut reader = TTYPort::open(&port)?;
        // Nobody else shall talk to the base. A real port forgets that when it is closed; a pseudo-terminal never does, and would stay taken when this process
        // is killed.
        reader.set_exclusive(!is_pseudo_terminal(&self.path))?;
        // What was written to a line that is gone must not come out of this one.
        reader.clear(ClearBuffer::All)?;
        let mut writer = reader.try_clone_native()?;
        writer.set_timeout(WRITE_PATIENCE)?;
        Ok(Ends {
            reader: Box::new(reader),
            writer: Box::new(Flushed(writer)),
        })
    }

    fn name(&self) -> String {
        self.path.display().to_string()
    }
}

fn is_pseudo_terminal(path: &Path) -> bool {
    path.canonicalize()
        .is_ok_and(|real| real.starts_with("/dev/pts"))
}

/// A port that is not waited for: `flush` of a port waits until the last bit is out, and a line is 2 ms long.
struct Flushed(TTYPort);

impl Write for Flushed {
    fn write(&mut self, bytes: &[u8]) -> Result<usize> {
        self.0.write(bytes)
    }

    fn flush(&mut self) -> Result<()> {
        Ok(())
    }
}
