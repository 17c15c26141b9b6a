//! A ring of past poses with their covariances, for observations that arrive late.
//!
//! A correction changes all of them, which takes a small processor some 30 ms. It is done entry by entry, whenever there is time; until then no other
//! correction can be made.

use super::belief::{Belief, Leverage};
use super::correction::Update;
use super::estimator::{Pose, transport};
use crate::math::{product, scaled, sum, transported, upper_triangle};
use crate::time::{self, Duration, Instant};
use crate::vehicle::{GAINS, Spread};
use heapless::Deque;
use nalgebra::Matrix3;

/// What was known at some instant, corrections since included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Past {
    /// When.
    pub time: Instant,
    /// Of the pose.
    pub belief: Belief,
}

/// The same, as small as it goes.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Entry {
    time: Instant,
    pose: Pose,
    /// Cxx Cxy Cxθ Cyy Cyθ Cθθ.
    own: [f64; 6],
    leverage: [f32; 3 * GAINS],
}

impl From<&Past> for Entry {
    fn from(past: &Past) -> Self {
        let mut leverage = [0.0; 3 * GAINS];
        for (small, wide) in leverage.iter_mut().zip(&past.belief.leverage) {
            *small = *wide as f32;
        }
        Self {
            time: past.time,
            pose: past.belief.pose,
            own: upper_triangle(&past.belief.own),
            leverage,
        }
    }
}

impl From<&Entry> for Past {
    fn from(entry: &Entry) -> Self {
        let [xx, xy, xt, yy, yt, tt] = entry.own;
        Self {
            time: entry.time,
            belief: Belief {
                pose: entry.pose,
                own: Matrix3::new(xx, xy, xt, xy, yy, yt, xt, yt, tt),
                leverage: leverage_of(entry),
            },
        }
    }
}

impl Entry {
    #[inline(never)]
    fn correct(&mut self, update: &Update, at: Instant) {
        let mut past = Past::from(&*self);
        past.correct(update, at);
        *self = Self::from(&past);
    }
}

fn leverage_of(entry: &Entry) -> Leverage {
    let mut leverage = Leverage::zeros();
    for (wide, small) in leverage.iter_mut().zip(entry.leverage) {
        *wide = f64::from(small);
    }
    leverage
}

/// The oldest observation that is taken.
pub const MAX_AGE: Duration = Duration::millis(1500);
/// Distance of the entries.
const SPACING: Duration = Duration::millis(32);
/// Enough for 1.5 s, and one to spare on either side.
const LENGTH: usize = 49;

/// Past poses, at least 1.5 s of them.
#[derive(Clone, Debug, Default)]
pub struct History {
    ring: Deque<Entry, LENGTH>,
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
    #[inline]
    pub fn record(&mut self, now: Instant, present: impl FnOnce() -> Belief) {
        let due = self
            .ring
            .back()
            .is_none_or(|newest| time::since(now, newest.time) >= SPACING);
        if due {
            self.push(now, present);
        }
    }

    #[cold]
    #[inline(never)]
    fn push(&mut self, now: Instant, present: impl FnOnce() -> Belief) {
        if self.ring.is_full() {
            self.ring.pop_front();
        }
        // There is room: one was just made.
        let past = Past {
            time: now,
            belief: present(),
        };
        let _ = self.ring.push_back(Entry::from(&past));
    }

    /// The gains, known as well as this so far, are others from here on.
    pub fn absorb(&mut self, spread: &Spread) {
        if !self.is_consistent() {
            // There is no time to carry the correction through first.
            self.clear();
        }
        for entry in &mut self.ring {
            let mut past = Past::from(&*entry);
            past.belief.absorb(spread);
            *entry = Entry::from(&past);
        }
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

    /// What was known at `time`, between entries by interpolation; none if the ring does not reach back so far.
    #[must_use]
    #[inline(never)]
    pub fn at(&self, time: Instant, now: &Past) -> Option<Past> {
        let mut later = None;
        for entry in self.ring.iter().rev() {
            if entry.time <= time {
                let after = later.map_or(*now, Past::from);
                return Some(interpolate(&Past::from(entry), &after, time));
            }
            later = Some(entry);
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
        let due = |past: &&mut Entry| {
            past.time <= revision.last && revision.done.is_none_or(|done| past.time > done)
        };
        match self.ring.iter_mut().find(due) {
            Some(entry) => {
                entry.correct(&revision.update, revision.at);
                revision.done = Some(entry.time);
            }
            None => self.revision = None,
        }
        self.revision.is_some()
    }
}

impl Past {
    /// Takes in a correction that was made to the estimate of the instant `at`.
    pub fn correct(&mut self, update: &Update, at: Instant) {
        if self.time >= at {
            update.carry_to_later(&mut self.belief);
        } else {
            update.carry_to_earlier(&mut self.belief);
        }
    }
}

/// The pose goes straight: over 32 ms an arc differs from its chord by 0.2 mm at 1 m/s and 90 °/s. θ is unwrapped, so it goes along. C and Γ are the mean of
/// what the motion makes of the entry before and of the one after, each weighted by how near it is: so noise comes evenly, and C is positive semi-definite
/// whatever corrections have made of the two.
fn interpolate(before: &Past, after: &Past, time: Instant) -> Past {
    let whole = time::seconds(time::since(after.time, before.time));
    let part = time::seconds(time::since(time, before.time));
    let w = if whole > 0.0 {
        f64::from((part / whole).min(1.0))
    } else {
        0.0
    };
    let (a, b) = (&before.belief, &after.belief);
    let dx = b.pose.x - a.pose.x;
    let dy = b.pose.y - a.pose.y;
    let here = |of: &Belief, share: f64, way: f64| {
        let (dx, dy) = (way * dx, way * dy);
        (
            scaled(share, &transported(&of.own, dx, dy)),
            scaled(share, &product(&transport(dx, dy), &of.leverage)),
        )
    };
    let (own_before, leverage_before) = here(a, 1.0 - w, w);
    let (own_after, leverage_after) = here(b, w, w - 1.0);
    Past {
        time,
        belief: Belief {
            pose: Pose {
                x: a.pose.x + w * dx,
                y: a.pose.y + w * dy,
                theta: a.pose.theta + w * (b.pose.theta - a.pose.theta),
            },
            own: sum(&own_before, 1.0, &own_after),
            leverage: sum(&leverage_before, 1.0, &leverage_after),
        },
    }
}
