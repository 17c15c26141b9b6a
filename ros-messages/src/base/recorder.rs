//! A log of reports.

use super::messages::{Message, footprint, messages, with};
use super::names::Names;
use super::report::Report;
use crate::log::McapLog;
use mcap::McapError;
use std::io::{Seek, Write};

/// Writes reports down as messages.
pub struct Recorder<W: Write + Seek> {
    log: McapLog<W>,
    names: Names,
    begun: bool,
}

impl<W: Write + Seek> Recorder<W> {
    /// An empty log. `library` is who writes it.
    ///
    /// # Errors
    /// If nothing can be written there.
    pub fn new(output: W, library: &str, names: Names) -> Result<Self, McapError> {
        Ok(Self {
            log: McapLog::new(output, library)?,
            names,
            begun: false,
        })
    }

    /// Writes a report down that is told at `now`, ns since 1970: the stamps in it are those of its measurement.
    ///
    /// # Errors
    /// If it cannot be written.
    ///
    /// # Panics
    /// After its log has been finished.
    pub fn write(&mut self, now: i64, report: &Report) -> Result<(), McapError> {
        if !self.begun {
            self.begun = true;
            if let Some(transforms) = footprint(&self.names) {
                self.put(now, &Message::Kept(transforms))?;
            }
        }
        for message in messages(&self.names, report) {
            self.put(now, &message)?;
        }
        Ok(())
    }

    fn put(&mut self, now: i64, message: &Message) -> Result<(), McapError> {
        let topic = message.topic(&self.names.topics);
        if let Message::Kept(transforms) = message {
            return self.log.write_kept(topic, now, transforms.as_ref());
        }
        with!(message, inner => self.log.write(topic, now, inner.as_ref()))
    }

    /// The log itself, for what else is to be in it.
    pub fn log(&mut self) -> &mut McapLog<W> {
        &mut self.log
    }
}
