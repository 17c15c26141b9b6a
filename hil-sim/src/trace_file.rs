//! The trace of a run: rows at a fixed period, into a file, into memory for a plot, or both.

use crate::run::Watcher;
use anyhow::{Context, Result};
use hil_sim::base::Base;
use hil_sim::rig::PERIOD;
use hil_sim::trace::{Row, Writer};
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

/// So many rows are written at once: a run that is broken off loses no more.
const FLUSH_ROWS: u64 = 100;

/// Collects rows.
pub struct TraceFile {
    writer: Option<Writer<BufWriter<File>>>,
    rows: Option<Vec<Row>>,
    every: u64,
    ticks: u64,
}

impl TraceFile {
    /// Collects a row every `period` seconds, into a file if there is one, and in memory if `keep`. None if neither is wanted.
    pub fn create(path: Option<&Path>, keep: bool, period: f64) -> Result<Option<Self>> {
        if path.is_none() && !keep {
            return Ok(None);
        }
        let writer = match path {
            Some(path) => {
                let file = File::create(path).with_context(|| path.display().to_string())?;
                Some(Writer::new(BufWriter::new(file)))
            }
            None => None,
        };
        let tick = PERIOD.ticks() as f64 * 1e-6;
        Ok(Some(Self {
            writer,
            rows: keep.then(Vec::new),
            every: ((period / tick).round() as u64).max(1),
            ticks: 0,
        }))
    }

    /// Writes what is left.
    pub fn finish(self) -> Result<()> {
        self.into_rows().map(drop)
    }

    /// Writes what is left, and gives the rows that were kept.
    pub fn into_rows(self) -> Result<Vec<Row>> {
        if let Some(writer) = self.writer {
            use std::io::Write;
            writer.finish()?.flush().context("trace")?;
        }
        Ok(self.rows.unwrap_or_default())
    }
}

impl Watcher for TraceFile {
    /// A row, if it is time for one.
    fn note(&mut self, base: &dyn Base) -> Result<()> {
        if self.ticks.is_multiple_of(self.every) {
            let row = base.row()?;
            if let Some(writer) = &mut self.writer {
                writer.write(&row)?;
                if (self.ticks / self.every).is_multiple_of(FLUSH_ROWS) {
                    writer.flush()?;
                }
            }
            if let Some(rows) = &mut self.rows {
                rows.push(row);
            }
        }
        self.ticks += 1;
        Ok(())
    }
}
