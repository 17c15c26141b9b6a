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
