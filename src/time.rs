//! Instants and durations. Nothing in this crate reads a clock: time comes in as an argument.

/// An instant: microseconds since start-up, 64 bits, so that it never wraps.
pub type Instant = fugit::Instant<u64, 1, 1_000_000>;
/// A duration in microseconds.
pub type Duration = fugit::Duration<u64, 1, 1_000_000>;

/// `later − earlier`, zero if the clock went backwards.
#[must_use]
pub fn since(later: Instant, earlier: Instant) -> Duration {
    Duration::from_ticks(later.ticks().saturating_sub(earlier.ticks()))
}

/// A duration in seconds.
#[must_use]
pub fn seconds(duration: Duration) -> f32 {
    duration.ticks() as f32 * 1e-6
}

/// `instant + duration`, without the overflow panic of the operator (64 bits of microseconds last 584 000 years).
#[must_use]
pub fn after(instant: Instant, duration: Duration) -> Instant {
    Instant::from_ticks(instant.ticks().wrapping_add(duration.ticks()))
}

/// `instant − duration`, not before start-up.
#[must_use]
pub fn before(instant: Instant, duration: Duration) -> Instant {
    Instant::from_ticks(instant.ticks().saturating_sub(duration.ticks()))
}

/// Instants from a free-running 32-bit counter of processor cycles, such as the Cortex-M's CYCCNT.
///
/// Fractions of a microsecond are carried, so the clock neither gains nor loses on the counter.
#[derive(Clone, Copy, Debug)]
pub struct CycleClock<const PER_MICROSECOND: u32> {
    last: u32,
    /// Cycles that do not make a microsecond yet.
    rest: u32,
    now: Instant,
}

impl<const PER_MICROSECOND: u32> CycleClock<PER_MICROSECOND> {
    /// Starts at instant 0 when the counter shows `count`.
    #[must_use]
    pub const fn new(count: u32) -> Self {
        const { assert!(PER_MICROSECOND > 0, "a clock that stands") };
        Self {
            last: count,
            rest: 0,
            now: Instant::from_ticks(0),
        }
    }

    /// The instant at which the counter shows `count`. The counter may wrap once between two calls: 25 s at 168 MHz.
    pub fn at(&mut self, count: u32) -> Instant {
        let elapsed = count.wrapping_sub(self.last);
        self.last = count;
        // Apart, as the sum may have a 33rd bit.
        let rest = elapsed % PER_MICROSECOND + self.rest;
        let whole = elapsed / PER_MICROSECOND + rest / PER_MICROSECOND;
        self.rest = rest % PER_MICROSECOND;
        self.now = after(self.now, Duration::from_ticks(u64::from(whole)));
        self.now
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cycles_are_neither_lost_nor_gained() {
        // An odd period for a day: 168 000 ± 1 cycles, many wraps.
        let mut count = 0xFFFF_0000_u32;
        let mut clock = CycleClock::<168>::new(count);
        let mut cycles = 0_u64;
        for tick in 0..100_000_u64 {
            let step = 168_000 + (tick % 3) as u32 - 1;
            count = count.wrapping_add(step);
            cycles += u64::from(step);
            assert_eq!(clock.at(count).ticks(), cycles / 168);
        }
    }

    #[test]
    fn one_wrap_between_two_calls() {
        let mut clock = CycleClock::<168>::new(10);
        let almost = u64::from(u32::MAX);
        assert_eq!(clock.at(9).ticks(), almost / 168);
        // What was left over comes on top, beyond 32 bits.
        assert_eq!(clock.at(8).ticks(), 2 * almost / 168);
    }
}
