//! `run`: a script against the simulated base, as fast as it goes.

use anyhow::{Context, Result};
use hil_sim::base::Base;
use hil_sim::map::landmarks::Landmarks;
use hil_sim::rig::PERIOD;
use hil_sim::script::{Action, Script};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::Write;

/// Without `!end`, a run ends when the base has rested and said nothing for this long after the last line …
const QUIET_TICKS: u64 = 1000;
/// … or this long after it, if a motion has no end.
const PATIENCE_TICKS: u64 = 60_000;

/// Somebody who looks at the base after each tick.
pub trait Watcher {
    /// Notes what there is to note.
    ///
    /// # Errors
    /// If it cannot be noted.
    fn note(&mut self, base: &dyn Base) -> Result<()>;
}

/// Runs the script and writes what the base sends, each line with the time at which its end arrived. The seed is that of how landmarks are sighted.
pub fn run(
    base: &mut dyn Base,
    script: &Script,
    seed: u64,
    watchers: &mut [&mut dyn Watcher],
    out: &mut impl Write,
) -> Result<()> {
    let mut steps = script.steps.iter().peekable();
    let mut landmarks = Landmarks::new(seed);
    let last = script.steps.last().map_or(0.0, |step| step.time);
    let mut line = Vec::new();
    let (mut tick, mut quiet) = (0_u64, 0_u64);
    let last_tick = ticks(last);
    let progress = progress(last_tick);
    'run: loop {
        while let Some(step) = steps.next_if(|step| ticks(step.time) <= tick) {
            quiet = 0;
            match &step.action {
                Action::Send(text) => base.send(format!("{text}\n").as_bytes())?,
                Action::Push {
                    force,
                    torque,
                    seconds,
                } => base.push(*force, *torque, *seconds),
                Action::Fault(fault) => base.inject(*fault)?,
                Action::Clear => base.clear_faults()?,
                Action::Landmark(name, at) => landmarks.place(name, *at),
                Action::Sight(name, bearing, range) => {
                    let line = landmarks.sight(name, base.plant().pose(), *bearing, *range)?;
                    base.send(format!("{line}\n").as_bytes())?;
                }
                Action::End => break 'run,
            }
        }
        base.tick()?;
        tick += 1;
        for watcher in &mut *watchers {
            watcher.note(base)?;
        }
        quiet += 1;
        for byte in base.receive() {
            quiet = 0;
            match byte {
                b'\n' => {
                    let seconds = base.now().ticks() as f64 * 1e-6;
                    let text = String::from_utf8_lossy(&line);
                    writeln!(out, "{seconds:.3}\t{text}").context("standard output")?;
                    line.clear();
                }
                b'\r' => {}
                byte => line.push(byte),
            }
        }
        if tick.is_multiple_of(10_000) {
            progress.set_position(tick.min(last_tick));
        }
        if steps.peek().is_none() {
            if base.backlog() > 0 || !base.holds()? {
                quiet = 0;
            }
            if quiet > QUIET_TICKS || tick > last_tick + PATIENCE_TICKS {
                break;
            }
        }
    }
    progress.finish_and_clear();
    out.flush().context("standard output")
}

/// Passes on what is written, and keeps it.
pub struct Transcript<W> {
    out: W,
    kept: Vec<u8>,
}

impl<W: Write> Transcript<W> {
    /// Nothing has been written yet.
    pub fn new(out: W) -> Self {
        Self {
            out,
            kept: Vec::new(),
        }
    }

    /// What has been written.
    pub fn text(&self) -> String {
        String::from_utf8_lossy(&self.kept).into_owned()
    }
}

impl<W: Write> Write for Transcript<W> {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        let written = self.out.write(bytes)?;
        self.kept.extend(&bytes[..written]);
        Ok(written)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.out.flush()
    }
}

fn ticks(seconds: f64) -> u64 {
    (seconds * 1e6 / PERIOD.ticks() as f64).round() as u64
}

/// A bar on a terminal, for runs that are long enough to be waited for.
fn progress(ticks: u64) -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(ticks), ProgressDrawTarget::stderr());
    bar.set_style(
        ProgressStyle::with_template("{wide_bar} {percent} % of the script, {eta} left")
            .unwrap_or_else(|_| ProgressStyle::default_bar()),
    );
    bar
}
