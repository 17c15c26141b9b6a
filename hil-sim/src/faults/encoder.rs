//! An encoder between the plant and a counter: sound, or with a fault.

use super::EncoderFault;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Turns what a true encoder counts into what a quadrature decoder makes of the channels that reach it.
///
/// Between the two is a *disc*, the position that the channels tell of. A loose or a wrong disc moves in another way than the true one; a broken wire
/// hides one of its channels. The decoder counts the edges that are left, whatever the disc does. So its low two bits are always the levels of its
/// inputs, and what it has counted is never taken back: when a fault goes, it counts on from where it is.
#[derive(Clone, Debug)]
pub struct FaultyEncoder {
    fault: Option<EncoderFault>,
    /// The true count that has been taken in.
    count: i64,
    disc: i64,
    shown: i64,
    /// Part of a count that a scaled disc has moved on by, 0..1.
    remainder: f64,
    /// What a jump still has to add.
    jump: i64,
    random: ChaCha8Rng,
}

/// Levels of A and B at a position. A leads B when it turns forward.
pub(crate) fn levels(position: i64) -> [bool; 2] {
    let phase = position & 3;
    [phase == 1 || phase == 2, phase >= 2]
}

impl FaultyEncoder {
    /// The sound encoder of a wheel whose true count is this. The seed and the wheel determine which counts get lost, if any ever do.
    pub fn new(count: i64, seed: u64, wheel: usize) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        // The plant draws from stream 0 of the same seed.
        random.set_stream(1 + wheel as u64);
        Self {
            fault: None,
            count,
            disc: count,
            shown: count,
            remainder: 0.0,
            jump: 0,
            random,
        }
    }

    /// A fault begins, in place of any other.
    pub fn inject(&mut self, fault: EncoderFault) {
        self.clear();
        if let EncoderFault::Jump(counts) = fault {
            self.jump += counts;
        } else {
            self.fault = Some(fault);
        }
    }

    /// The encoder is sound from here on.
    pub fn clear(&mut self) {
        self.fault = None;
        self.remainder = 0.0;
    }

    /// What the decoder counts when the true count gets to `count`.
    #[inline]
    pub fn show(&mut self, count: i64) -> i64 {
        if self.is_in_step() {
            // Edge after edge comes to the same.
            let moved = count - self.count;
            self.count = count;
            self.disc += moved;
            self.shown += moved;
        } else {
            self.follow(count, |_| ());
        }
        self.shown
    }

    /// True if the decoder counts whatever the true encoder does.
    fn is_in_step(&self) -> bool {
        self.fault.is_none() && self.jump == 0 && levels(self.disc) == levels(self.shown)
    }

    /// The same, and each position that the decoder gets to on the way: its inputs have the levels of these positions, one edge after the other.
    #[inline]
    pub fn follow(&mut self, count: i64, mut edge: impl FnMut(i64)) {
        // A wire that broke or was mended makes an edge at once.
        self.decode(&mut edge);
        let jump = std::mem::take(&mut self.jump);
        self.turn(jump, &mut edge);
        let step = (count - self.count).signum();
        while self.count != count {
            self.count += step;
            let moved = self.moved(step);
            self.turn(moved, &mut edge);
        }
    }

    /// Turns the disc by so many counts.
    #[inline]
    fn turn(&mut self, counts: i64, edge: &mut impl FnMut(i64)) {
        for _ in 0..counts.abs() {
            self.disc += counts.signum();
            self.decode(edge);
        }
    }

    /// Counts the edges that bring the decoder's inputs to the present levels.
    #[inline]
    fn decode(&mut self, edge: &mut impl FnMut(i64)) {
        let [a, b] = levels(self.disc);
        let inputs = match self.fault {
            Some(EncoderFault::OpenA) => [true, b],
            Some(EncoderFault::OpenB) => [a, true],
            _ => [a, b],
        };
        for channel in [0, 1] {
            if levels(self.shown)[channel] == inputs[channel] {
                continue;
            }
            // Forward and backward are an edge of one channel each: the other one's is the other way.
            let forward = levels(self.shown + 1)[channel] == inputs[channel];
            self.shown += if forward { 1 } else { -1 };
            edge(self.shown);
        }
    }

    /// How far the disc moves when the true one moves by a count.
    fn moved(&mut self, step: i64) -> i64 {
        match self.fault {
            None | Some(EncoderFault::OpenA | EncoderFault::OpenB | EncoderFault::Jump(_)) => step,
            Some(EncoderFault::Stuck) => 0,
            Some(EncoderFault::Swapped) => -step,
            Some(EncoderFault::Scale(factor)) => {
                let moved = factor * step as f64 + self.remainder;
                self.remainder = moved - moved.floor();
                moved.floor() as i64
            }
            Some(EncoderFault::Drop(probability)) => {
                if self.random.random::<f64>() < probability {
                    0
                } else {
                    step
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The encoders of a few seeds, which begin at each phase.
    fn encoders() -> impl Iterator<Item = (i64, FaultyEncoder)> {
        (-5..5).map(|start| (start, FaultyEncoder::new(start, 7, 0)))
    }

    /// There and back, and far past what a counter of 16 bits holds.
    const PLACES: [i64; 7] = [1, 3, 100, -40, 70_000, 69_999, -70_000];

    #[test]
    fn a_sound_encoder_shows_what_is_true() {
        for (start, mut encoder) in encoders() {
            for place in PLACES {
                assert_eq!(encoder.show(start + place), start + place);
            }
        }
    }

    #[test]
    fn a_stuck_encoder_stands_and_goes_on_from_there() {
        for (start, mut encoder) in encoders() {
            encoder.show(start + 10);
            encoder.inject(EncoderFault::Stuck);
            for place in PLACES {
                assert_eq!(encoder.show(start + place), start + 10);
            }
            encoder.clear();
            assert_eq!(encoder.show(start - 70_000), start + 10);
            assert_eq!(encoder.show(start - 70_000 + 5), start + 15);
        }
    }

    #[test]
    fn an_open_channel_flickers_by_one_and_its_mending_moves_by_one_at_most() {
        for fault in [EncoderFault::OpenA, EncoderFault::OpenB] {
            for (start, mut encoder) in encoders() {
                encoder.inject(fault);
                // The break itself is an edge, if the channel was low.
                let broken = encoder.show(start);
                assert!((broken - start).abs() <= 1);
                let mut seen = Vec::new();
                for count in start..start + 100 {
                    seen.push(encoder.show(count));
                }
                for count in (start - 100..start + 100).rev() {
                    seen.push(encoder.show(count));
                }
                let (low, high) = (*seen.iter().min().unwrap(), *seen.iter().max().unwrap());
                assert_eq!(high - low, 1, "{fault}");
                assert!(low == broken || high == broken, "{low} {high} {broken}");
                // Each level of the sound channel lasts for two counts.
                let changes = seen.windows(2).filter(|pair| pair[0] != pair[1]).count();
                assert!((148..=151).contains(&changes), "{changes}");
                let last = *seen.last().unwrap();
                encoder.clear();
                let mended = encoder.show(start - 100);
                assert!((mended - last).abs() <= 1, "{last} {mended}");
                assert_eq!(encoder.show(start - 70_000), mended - 69_900);
            }
        }
    }

    #[test]
    fn exchanged_channels_count_backward() {
        for (start, mut encoder) in encoders() {
            encoder.inject(EncoderFault::Swapped);
            for place in PLACES {
                assert_eq!(encoder.show(start + place), start - place);
            }
            encoder.clear();
            assert_eq!(encoder.show(start - 70_000), start + 70_000);
            assert_eq!(encoder.show(start - 70_001), start + 69_999);
        }
    }

    #[test]
    fn a_scale_carries_its_remainder() {
        for factor in [2.0, 0.5, -0.25, 0.0, 1.375, -2.0, 0.3] {
            for (start, mut encoder) in encoders() {
                encoder.inject(EncoderFault::Scale(factor));
                for place in PLACES {
                    let shown = encoder.show(start + place) - start;
                    let exact = factor * place as f64;
                    // Below a count, and what 140 000 sums of a remainder are rounded by.
                    assert!(shown as f64 <= exact + 1e-6, "{factor}: {shown} {exact}");
                    assert!(
                        shown as f64 > exact - 1.0 - 1e-6,
                        "{factor}: {shown} {exact}"
                    );
                }
            }
        }
    }

    #[test]
    fn counts_are_lost_with_the_probability_and_by_the_seed() {
        let lose = |probability: f64, seed: u64, wheel: usize| {
            let mut encoder = FaultyEncoder::new(0, seed, wheel);
            encoder.inject(EncoderFault::Drop(probability));
            (1..=40_000)
                .map(|count| encoder.show(count))
                .collect::<Vec<_>>()
        };
        for (probability, seed) in [(0.5, 1), (0.5, 2), (0.1, 3), (0.9, 4)] {
            let kept = *lose(probability, seed, 0).last().unwrap() as f64;
            let mean = 40_000.0 * (1.0 - probability);
            // Binomial: four standard deviations.
            let deviation = (mean * probability).sqrt();
            assert!(
                (kept - mean).abs() < 4.0 * deviation,
                "{probability}: {kept}"
            );
        }
        assert_eq!(lose(0.5, 1, 0), lose(0.5, 1, 0));
        assert_ne!(lose(0.5, 1, 0), lose(0.5, 2, 0));
        assert_ne!(lose(0.5, 1, 0), lose(0.5, 1, 1), "the wheels lose others");
        assert_eq!(lose(0.0, 1, 0).last(), Some(&40_000));
        assert_eq!(lose(1.0, 1, 0).last(), Some(&0));
    }

    #[test]
    fn a_jump_happens_once_and_stays() {
        for jump in [500, -500, 1, -65_536, 1_000_000] {
            for (start, mut encoder) in encoders() {
                encoder.inject(EncoderFault::Jump(jump));
                assert_eq!(encoder.show(start), start + jump);
                assert_eq!(encoder.show(start + 3), start + jump + 3);
                encoder.clear();
                assert_eq!(encoder.show(start - 3), start + jump - 3);
            }
        }
    }

    #[test]
    fn every_position_is_one_edge_from_the_last_whatever_fails() {
        let faults = [
            EncoderFault::OpenA,
            EncoderFault::Jump(37),
            EncoderFault::OpenB,
            EncoderFault::OpenA,
            EncoderFault::Scale(-1.7),
            EncoderFault::Drop(0.3),
            EncoderFault::Stuck,
            EncoderFault::Swapped,
            EncoderFault::OpenB,
        ];
        for (start, mut encoder) in encoders() {
            let (mut last, mut count) = (start, start);
            for (nth, fault) in faults.into_iter().cycle().take(200).enumerate() {
                encoder.inject(fault);
                count += [13, -6, 1, 0, -22][nth % 5];
                encoder.follow(count, |position| {
                    assert_eq!((position - last).abs(), 1);
                    last = position;
                });
                assert_eq!(encoder.show(count), last);
            }
        }
    }
}
