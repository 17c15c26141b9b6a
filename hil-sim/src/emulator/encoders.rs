//! The plant's encoders, as the board's pins see them: one edge after the other.

use super::lockstep::Edge;
use super::wiring::Wiring;
use crate::faults::FaultSet;
use crate::plant::Plant;
use rigless::time::VirtualNanos;
use std::collections::VecDeque;

/// Edges of an encoder in a period. 1.5 µs lie between two of them then: a channel, which has every other one, is at half of the 800 kHz that its
/// filter lets pass.
const MAX_EDGES: usize = 600;

/// Positions that the encoders have gone through.
#[derive(Debug)]
pub(super) struct Encoders {
    wiring: Wiring,
    /// Those that they have yet to show.
    waiting: [VecDeque<i64>; 3],
    /// Where the steering's encoder is, in counts.
    steering: i64,
}

impl Encoders {
    /// Those of a robot that is wired so.
    pub(super) fn new(wiring: Wiring) -> Self {
        Self {
            wiring,
            waiting: Default::default(),
            steering: 0,
        }
    }

    /// Lets them go where the plant is. Only the wheels' encoders can fail.
    pub(super) fn follow(&mut self, plant: &Plant, faults: &mut FaultSet) {
        for (wheel, count) in plant.counts().into_iter().enumerate() {
            if self.wiring.steering_encoder != Some(wheel) {
                let waiting = &mut self.waiting[wheel];
                faults.encoders[wheel].follow(count, |position| waiting.push_back(position));
            }
        }
        if let Some(encoder) = self.wiring.steering_encoder {
            let count = plant.steering_counts();
            let step = (count - self.steering).signum();
            while self.steering != count {
                self.steering += step;
                self.waiting[encoder].push_back(self.steering);
            }
        }
    }

    /// The edges that lead there, spread evenly over a period. Those that the timers' filters could not tell apart wait for the next one.
    pub(super) fn edges(&mut self, from: VirtualNanos, period: u64) -> VecDeque<Edge> {
        let mut edges = Vec::new();
        for (encoder, waiting) in self.waiting.iter_mut().enumerate() {
            let number = waiting.len().min(MAX_EDGES);
            let positions = waiting.drain(..number).zip(0_u64..);
            edges.extend(positions.map(|(count, nth)| Edge {
                at: VirtualNanos(from.0 + (2 * nth + 1) * period / (2 * number as u64)),
                encoder,
                count,
            }));
        }
        edges.sort_by_key(|edge| edge.at);
        edges.into()
    }
}
