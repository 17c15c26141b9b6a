//! The client's end of the serial line: tagged lines out, and what became of each.

use crate::base::Base;
use anyhow::Result;
use std::collections::VecDeque;

/// Lines of the conversation that are kept for a report.
const KEPT: usize = 24;
/// More may not be unanswered: the base would say `busy`.
const MAX_UNANSWERED: usize = 4;

/// What a line asks of the base, as far as that matters here.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Said {
    /// A motion of an axis, 0 or 1.
    Motion(usize, Motion),
    /// One beyond the base's limits.
    Beyond,
    /// Stop.
    Stop,
    /// An emergency stop.
    EStop,
    /// ClearFault.
    ClearFault,
    /// Motor power on.
    Enable,
    /// Motor power off.
    Disable,
    /// Another stop rate of an axis.
    StopRate(usize, f64),
    /// Another default of an axis: speed (0) or acceleration (1).
    Default(usize, usize, f64),
    /// Anything else: it moves nothing.
    Other,
}

/// A motion. Units are m or rad, and seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// It has no end.
    pub endless: bool,
    /// Its distance, if it has an end.
    pub distance: f64,
    /// Its speed; 0: to rest.
    pub speed: f64,
    /// Its acceleration.
    pub acceleration: f64,
    /// Whether the line says speed and acceleration, or leaves them out.
    pub gives: [bool; 2],
}

/// A line that was sent.
#[derive(Clone, Copy, Debug)]
pub struct Sent {
    /// Its tag.
    pub tag: u16,
    /// When, ms.
    pub at: u64,
    /// What it says.
    pub said: Said,
    /// A fault was latched when it was sent, and nothing under way that would clear it.
    pub while_latched: bool,
}

/// What a line was answered.
#[derive(Clone, Debug)]
pub struct Answer {
    /// The line.
    pub sent: Sent,
    /// The error's code, if it was refused.
    pub refusal: Option<String>,
}

/// The line.
#[derive(Debug, Default)]
pub struct Line {
    pending: VecDeque<Sent>,
    partial: Vec<u8>,
    tag: u16,
    /// Lines that were sent.
    pub sent: u64,
    /// What was said last, both ways.
    pub talk: VecDeque<String>,
    /// The line was cut: what is not about a tag of ours may be wreckage.
    pub wrecked: bool,
}

impl Line {
    /// There is room for another unanswered line, or for this many.
    pub fn has_room(&self, lines: usize) -> bool {
        self.pending.len() + lines <= MAX_UNANSWERED
    }

    /// Nothing is unanswered.
    pub fn is_idle(&self) -> bool {
        self.pending.is_empty()
    }

    /// The lines that are unanswered.
    pub fn pending(&self) -> impl Iterator<Item = &Sent> {
        self.pending.iter()
    }

    /// Sends a line.
    ///
    /// # Errors
    /// If the simulation cannot go on.
    pub fn send<B: Base + ?Sized>(
        &mut self,
        base: &mut B,
        at: u64,
        text: &str,
        said: Said,
        while_latched: bool,
    ) -> Result<Sent> {
        self.tag = self.tag.wrapping_add(1);
        let line = format!("@{} {text}", self.tag);
        base.send(format!("{line}\n").as_bytes())?;
        self.keep(at, &line, '>');
        self.sent += 1;
        let sent = Sent {
            tag: self.tag,
            at,
            said,
            while_latched,
        };
        self.pending.push_back(sent);
        Ok(sent)
    }

    /// The line was cut: nobody will answer what is unanswered. Those lines.
    pub fn lose(&mut self) -> Vec<Sent> {
        self.wrecked = true;
        self.partial.clear();
        self.pending.drain(..).collect()
    }

    /// Takes what has arrived: the answers.
    pub fn take(&mut self, at: u64, bytes: &[u8]) -> Vec<Answer> {
        let mut answers = Vec::new();
        for byte in bytes {
            match byte {
                b'\r' => {}
                b'\n' => {
                    let line = std::mem::take(&mut self.partial);
                    let line = String::from_utf8_lossy(&line);
                    answers.extend(self.understand(at, &line));
                }
                byte => self.partial.push(*byte),
            }
        }
        answers
    }

    fn understand(&mut self, at: u64, line: &str) -> Option<Answer> {
        self.keep(at, line, '<');
        let (tag, text) = line.strip_prefix('@')?.split_once(' ')?;
        let tag: u16 = tag.parse().ok()?;
        // Answers come in order; of one that is gone, nothing is expected any more.
        if self.pending.front()?.tag != tag {
            return None;
        }
        let sent = self.pending.pop_front()?;
        let refusal = text.strip_prefix("ERR ").map(|error| {
            let code = error.split(' ').next().unwrap_or_default();
            code.to_owned()
        });
        Some(Answer { sent, refusal })
    }

    /// Something happened that is no line.
    pub fn note(&mut self, at: u64, what: &str) {
        self.keep(at, what, ' ');
    }

    fn keep(&mut self, at: u64, line: &str, way: char) {
        if self.talk.len() == KEPT {
            self.talk.pop_front();
        }
        self.talk
            .push_back(format!("{:10.3} {way} {line}", at as f64 * 1e-3));
    }
}
