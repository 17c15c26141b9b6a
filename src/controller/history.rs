//! A ring of past poses with their covariances, for observations that arrive late.
//!
//! A correction changes all of them, which takes a small processor some 20 ms. It is done entry by entry, whenever there is time; until then no other
//! correction can be made.

use super::correction::Update;
use super::estimator::{Estimate, Pose};
use crate::time::{self, Duration, Instant};
use heapless::Deque;

/// An estimate and the instant that it describes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Past {
    /// When.
    pub time: Instant,
    /// What was known of it then, corrections since included.
    pub estimate: Estimate,
}

/// The oldest observation that is taken.
pub const MAX_AGE: Duration = Duration::millis(1500);
/// Distance of the entries.
const SPACING: Duration = Duration::millis(25);
/// Enough for 1.5 s, and one to spare on either side.
const LENGTH: usize = 64;

/// Past poses, at least 1.5 s of them.
#[derive(Clone, Debug, Default)]
pub struct History {
    ring: Deque<Past, LENGTH>,
    revision: Option<Revision>,
}

/// A correction that is being carried through the ring.
#[derive(Clone, Debug)]
struct Revision {
    update: Update,
    /// The instant of the estimate that was corrected.
    at: Instant,
    /// The entries so far have been corrected …
    done: Option<Instant>,
    /// … and these are the last that need it: later ones know of it.
    last: Instant,
}

impl History {
    /// Adds the present, if enough time has passed since the last entry.
    pub fn record(&mut self, now: Instant, present: impl FnOnce() -> Estimate) {
        let due = self
            .ring
            .back()
            .is_none_or(|newest| time::since(now, newest.time) >= SPACING);
        if !due {
            return;
        }
        if self.ring.is_full() {
            self.ring.pop_front();
        }
        // There is room: one was just made.
        let _ = self.ring.push_back(Past {
            time: now,
            estimate: present(),
        });
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        self.ring.clear();
        self.revision = None;
    }

    /// True if every entry knows of every correction.
    #[must_use]
    pub fn is_consistent(&self) -> bool {
        self.revision.is_none()
    }

    /// The estimate at `time`, between entries by interpolation; none if the ring does not reach back so far.
    #[must_use]
    pub fn at(&self, time: Instant, now: Past) -> Option<Past> {
        let mut after = now;
        for past in self.ring.iter().rev() {
            if past.time <= time {
                return Some(interpolate(past, &after, time));
            }
            after = *past;
        }
        None
    }

    /// How far back it reaches.
    #[must_use]
    pub fn reach(&self, now: Instant) -> Duration {
        let oldest = self.ring.front().map_or(now, |past| past.time);
        time::since(now, oldest)
    }

    /// Begins to correct every entry: [`Self::work`] does it. The correction before must have gone through.
    pub fn correct(&mut self, update: &Update, at: Instant) {
        self.revision = self.ring.back().map(|newest| Revision {
            update: *update,
            at,
            done: None,
            last: newest.time,
        });
    }

    /// Corrects one entry; false if there is none left to correct.
    pub fn work(&mut self) -> bool {
        let Some(revision) = &mut self.revision else {
            return false;
        };
        let due = |past: &&mut Past| {
            past.time <= revision.last && revision.done.is_none_or(|done| past.time > done)
        };
        match self.ring.iter_mut().find(due) {
            Some(past) => {
                past.correct(&revision.update, revision.at);
                revision.done = Some(past.time);
            }
            None => self.revision = None,
        }
        self.revision.is_some()
    }
}

impl Past {
    /// Takes in a correction that was made to the estimate of the instant `at`.
    pub fn correct(&mut self, update: &Update, at: Instant) {
        self.estimate = if self.time >= at {
            update.carried_to_later(&self.estimate)
        } else {
            update.carried_to_earlier(&self.estimate)
        };
    }
}

/// Linear in pose and covariance: over 25 ms an arc differs from its chord by 0.1 mm at 1 m/s and 90 °/s. θ is unwrapped, so it interpolates too.
fn interpolate(before: &Past, after: &Past, time: Instant) -> Past {
    let whole = time::seconds(time::since(after.time, before.time));
    let part = time::seconds(time::since(time, before.time));
    let w = if whole > 0.0 {
        (part / whole).min(1.0)
    } else {
        0.0
    };
    let mix = |a: f64, b: f64| a + f64::from(w) * (b - a);
    let (a, b) = (&before.estimate, &after.estimate);
    Past {
        time,
        estimate: Estimate {
            pose: Pose {
                x: mix(a.pose.x, b.pose.x),
                y: mix(a.pose.y, b.pose.y),
                theta: mix(a.pose.theta, b.pose.theta),
            },
            covariance: a.covariance * f64::from(1.0 - w) + b.covariance * f64::from(w),
        },
    }
}
