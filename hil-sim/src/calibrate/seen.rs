//! Logs as a sensor of the pose sees them: fixes are taken from a log's truth, so its errors belong there.

use super::Fixes;
use crate::random::Random;
use crate::replay::{Log, Row};
use anyhow::Result;

/// The stream of a seed's random numbers that is the sensor's.
const STREAM: u64 = 0x5ee;

impl Log {
    /// The log with the truth as such fixes have it: with random errors of their deviations, in each row others.
    ///
    /// # Errors
    /// None: its rows stay in their order.
    pub fn seen(&self, fixes: &Fixes, seed: u64) -> Result<Self> {
        let mut random = Random::new(seed, STREAM);
        let seen = |row: &Row| Row {
            truth: row.truth.map(|[x, y, theta]| {
                [
                    x + fixes.position * random.normal(),
                    y + fixes.position * random.normal(),
                    theta + fixes.heading * random.normal(),
                ]
            }),
            ..*row
        };
        Self::new(self.name.clone(), self.rows().iter().map(seen).collect())
    }
}
