//! Landmarks in the world, and how a base sights them.

use super::walker::wrap;
use crate::random::Random;
use crate::se2::Pose;
use anyhow::{Result, anyhow};
use std::collections::BTreeMap;

/// What stands where, and who looks.
#[derive(Clone, Debug)]
pub struct Landmarks {
    known: BTreeMap<String, [f64; 2]>,
    random: Random,
}

impl Landmarks {
    /// None yet.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self {
            known: BTreeMap::new(),
            random: Random::new(seed, 8),
        }
    }

    /// Puts one up, or puts it elsewhere.
    pub fn place(&mut self, name: &str, at: [f64; 2]) {
        self.known.insert(name.to_owned(), at);
    }

    /// The line that a sensor on a base at this pose sends for a landmark: its bearing, wrong by at most `bearing` degrees, and its range, by a share of `range`.
    ///
    /// # Errors
    /// If there is no such landmark.
    pub fn sight(&mut self, name: &str, pose: Pose, bearing: f64, range: f64) -> Result<String> {
        let [x, y] = *self
            .known
            .get(name)
            .ok_or_else(|| anyhow!("no landmark {name}: put one up with !landmark"))?;
        let (dx, dy) = (x - pose[0], y - pose[1]);
        let mut off = |most: f64| most * (2.0 * self.random.fraction() - 1.0);
        let seen = wrap(dy.atan2(dx) - pose[2]).to_degrees() + off(bearing);
        let far = dx.hypot(dy) * (1.0 + off(range));
        // What is told is rounded: half of its last digit belongs to the bounds. The range is d (1 ± s), so d lies within this of it.
        let (about, around) = (bearing + 0.01, far * range / (1.0 - range) + 0.001);
        Ok(format!(
            "Sight {name} {seen:.2} {about:.2} {far:.3} {around:.3}"
        ))
    }
}
