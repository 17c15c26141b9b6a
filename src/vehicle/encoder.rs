//! Quadrature encoders on modular counters.

use embedded_hal_02::Qei;

/// A counter that wraps.
pub trait Counter: Copy + core::fmt::Debug {
    /// The signed difference `self − earlier`, modulo the counter's width: 65530 is 11 before 5, not 65525 after it.
    fn since(self, earlier: Self) -> i32;
}

impl Counter for u16 {
    fn since(self, earlier: Self) -> i32 {
        i32::from(self.wrapping_sub(earlier).cast_signed())
    }
}

impl Counter for u32 {
    fn since(self, earlier: Self) -> i32 {
        self.wrapping_sub(earlier).cast_signed()
    }
}

/// A quadrature encoder: any `Qei` whose count is 16 or 32 bits wide.
///
/// A difference is right as long as the wheel turns by less than half the counter's range between two readings: 11 turns of the
/// default robot's wheel for 16 bits.
#[derive(Debug)]
pub struct Encoder<Q: Qei>
where
    Q::Count: Counter,
{
    counter: Q,
    last: Q::Count,
    total: i64,
    /// 1, or −1 if counts fall when the wheel rolls forward.
    direction: i32,
}

impl<Q: Qei> Encoder<Q>
where
    Q::Count: Counter,
{
    /// Takes an encoder over; its present count is the zero.
    pub fn new(counter: Q) -> Self {
        let last = counter.count();
        Self {
            counter,
            last,
            total: 0,
            direction: 1,
        }
    }

    /// Says whether counts fall when the wheel rolls forward.
    pub fn set_reversed(&mut self, reversed: bool) {
        self.direction = if reversed { -1 } else { 1 };
    }

    /// Counts since the last reading, positive forward.
    pub fn read(&mut self) -> i32 {
        let count = self.counter.count();
        let difference = count.since(self.last);
        self.last = count;
        let difference = difference.wrapping_mul(self.direction);
        self.total = self.total.wrapping_add(i64::from(difference));
        difference
    }

    /// Counts since start-up, positive forward.
    pub fn total(&self) -> i64 {
        self.total
    }
}

#[cfg(test)]
mod tests {
    use super::Counter;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn differences_survive_the_wrap(start: u32, step in -30_000..30_000i32) {
            prop_assert_eq!(start.wrapping_add_signed(step).since(start), step);
            let narrow = start as u16;
            prop_assert_eq!(narrow.wrapping_add_signed(step as i16).since(narrow), step);
        }
    }

    #[test]
    fn the_peers_mistake() {
        assert_eq!(65530_u16.since(5), -11);
        assert_eq!(5_u16.since(65530), 11);
    }
}
