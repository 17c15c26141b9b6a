//! A log of what is published: an MCAP file that Foxglove and `ros2 bag` open.

use crate::aside::tell;
use crate::network::Network;
use crate::time::now;
use anyhow::{Context, Result};
use ros_messages::base::recorder::Recorder;
use ros_messages::base::{Names, Report};
use std::fs::File;
use std::io::{BufWriter, ErrorKind};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// What was published before this outlives the process, whatever becomes of it.
const FLUSH: Duration = Duration::from_secs(1);

/// Writes reports down as messages.
pub struct Log {
    /// None, when it could not be written any more.
    file: Option<Recorder<BufWriter<File>>>,
    path: PathBuf,
    flushed: Instant,
}

impl Log {
    /// A new file of this name, or of the next that is free: `drive-2.mcap` beside `drive.mcap`. A bridge that is started anew must not destroy the log of
    /// what has ended it.
    ///
    /// # Errors
    /// If it cannot be made.
    pub fn create(path: &Path, names: Names) -> Result<Self> {
        let make = || -> Result<_> {
            let (file, path) = free(path)?;
            let library = concat!("base-bridge ", env!("CARGO_PKG_VERSION"));
            let recorder = Recorder::new(BufWriter::new(file), library, names)?;
            Ok((recorder, path))
        };
        let (recorder, path) = make().with_context(|| path.display().to_string())?;
        Ok(Self {
            file: Some(recorder),
            path,
            flushed: Instant::now(),
        })
    }

    /// The file's name.
    pub fn path(&self) -> &Path {
        &self.path
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

/// A file that was not there before, and its name. What is no file, a pipe, say, is written to.
fn free(path: &Path) -> std::io::Result<(File, PathBuf)> {
    if path.exists() && !path.is_file() {
        return Ok((File::create(path)?, path.to_owned()));
    }
    let (mut path, mut number) = (path.to_owned(), 1);
    let stem = path.file_stem().unwrap_or_default().to_owned();
    let extension = path.extension().map(ToOwned::to_owned);
    loop {
        match File::create_new(&path) {
            Err(error) if error.kind() == ErrorKind::AlreadyExists => {
                number += 1;
                let mut name = stem.clone();
                name.push(format!("-{number}"));
                if let Some(extension) = &extension {
                    name.push(".");
                    name.push(extension);
                }
                path.set_file_name(name);
            }
            made => return Ok((made?, path)),
        }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_there_is_kept() {
        let folder = tempfile::tempdir().unwrap();
        for names in [
            ["a.mcap", "a-2.mcap", "a-3.mcap"],
            ["11.23.mcap", "11.23-2.mcap", "11.23-3.mcap"],
            ["log", "log-2", "log-3"],
        ] {
            for expected in names {
                let (_, path) = free(&folder.path().join(names[0])).unwrap();
                assert_eq!(path, folder.path().join(expected));
            }
        }
        assert!(free(folder.path()).is_err(), "a folder is no file");
        assert!(free(&folder.path().join("none/a.mcap")).is_err());
    }

    #[test]
    #[cfg(unix)]
    fn what_is_no_file_is_written_to() {
        let nowhere = Path::new("/dev/null");
        assert_eq!(free(nowhere).unwrap().1, nowhere);
    }
}
