//! A log of what is published: an MCAP file that Foxglove and `ros2 bag` open.

use crate::aside::tell;
use crate::network::Network;
use crate::time::now;
use anyhow::{Context, Result};
use ros_messages::base::recorder::Recorder;
use ros_messages::base::{Names, Report};
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;
use std::time::{Duration, Instant};

/// What was published before this outlives the process, whatever becomes of it.
const FLUSH: Duration = Duration::from_secs(1);

/// Writes reports down as messages.
pub struct Log {
    /// None, when it could not be written any more.
    file: Option<Recorder<BufWriter<File>>>,
    flushed: Instant,
}

impl Log {
    /// A new file; one of that name is replaced.
    ///
    /// # Errors
    /// If it cannot be made.
    pub fn create(path: &Path, names: Names) -> Result<Self> {
        let make = || -> Result<_> {
            let file = BufWriter::new(File::create(path)?);
            let library = concat!("base-bridge ", env!("CARGO_PKG_VERSION"));
            Ok(Recorder::new(file, library, names)?)
        };
        let file = make().with_context(|| path.display().to_string())?;
        Ok(Self {
            file: Some(file),
            flushed: Instant::now(),
        })
    }

    fn write(&mut self, report: &Report) -> Result<()> {
        let Some(recorder) = &mut self.file else {
            return Ok(());
        };
        recorder.write(now(), report)?;
        if self.flushed.elapsed() >= FLUSH {
            self.flushed = Instant::now();
            recorder.log().flush()?;
        }
        Ok(())
    }
}

impl Network for Log {
    fn publish(&mut self, report: &Report) {
        if let Err(error) = self.write(report) {
            // A full disk must not stop a base that somebody drives.
            tell(&format!("the log ends here: {error:#}"));
            self.file = None;
        }
    }

    fn close(&mut self) {
        if let Some(mut recorder) = self.file.take()
            && let Err(error) = recorder.log().finish()
        {
            tell(&format!("the log has no end: {error:#}"));
        }
    }
}
