//! A serial port.

use super::{Door, Ends, READ_PATIENCE, WRITE_PATIENCE};
use serialport::{ClearBuffer, SerialPort, SerialPortBuilder};
use std::io::{Result, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

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
        let port = serialport::new(self.path.to_string_lossy(), self.baud).timeout(READ_PATIENCE);
        let reader = alone(port, &self.path).open()?;
        // What was written to a line that is gone must not come out of this one.
        reader.clear(ClearBuffer::All)?;
        let mut writer = reader.try_clone()?;
        writer.set_timeout(WRITE_PATIENCE)?;
        Ok(Ends {
            reader: Box::new(reader),
            writer: Box::new(Output(writer)),
        })
    }

    fn name(&self) -> String {
        self.path.display().to_string()
    }
}

/// Nobody else shall talk to the base. A real port forgets that when it is closed; a pseudo-terminal never does, and would stay taken when this process is
/// killed.
#[cfg(unix)]
fn alone(port: SerialPortBuilder, path: &Path) -> SerialPortBuilder {
    let is_pseudo_terminal = path
        .canonicalize()
        .is_ok_and(|real| real.starts_with("/dev/pts"));
    port.exclusive(!is_pseudo_terminal)
}

/// There a port is always its opener's.
#[cfg(not(unix))]
fn alone(port: SerialPortBuilder, _: &Path) -> SerialPortBuilder {
    port
}

/// A port that is not waited for: `flush` of a port waits until the last bit is out, and a line is 2 ms long.
struct Output(Box<dyn SerialPort>);

/// A line that is given up gets out what was written last, a Stop, in this time, if it gets anything out.
const DRAIN: Duration = Duration::from_millis(20);

impl Drop for Output {
    fn drop(&mut self) {
        let begin = Instant::now();
        while self.0.bytes_to_write().is_ok_and(|left| left > 0) && begin.elapsed() < DRAIN {
            std::thread::sleep(Duration::from_millis(1));
        }
        // What is stuck must not come out later. A port that is gone has nothing.
        let _ = self.0.clear(ClearBuffer::Output);
    }
}

impl Write for Output {
    fn write(&mut self, bytes: &[u8]) -> Result<usize> {
        self.0.write(bytes)
    }

    fn flush(&mut self) -> Result<()> {
        Ok(())
    }
}
