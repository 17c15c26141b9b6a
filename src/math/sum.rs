//! A running sum in two f32: 48 bits of it, at the cost of a few FPU instructions.

/// A sum of f32 terms that loses nothing to rounding until 48 bits are used up.
///
/// Increments of a third of a millimetre vanish in an f32 beyond 8 km, and long before that every one of them is rounded the same way.
/// Knuth's two-sum gives the rounding error of each addition exactly; it is kept in a second f32.
/// (An f64 would do the same, but in software on the Cortex-M4F.)
///
/// ```
/// let mut sum = vehicle_controller::math::Sum::default();
/// for _ in 0..10_000_000 { sum.add(3e-4); }
/// assert!((sum.to_f64() - 1e7 * f64::from(3e-4_f32)).abs() < 1e-6); // a plain f32 is off by 85 m
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Sum {
    high: f32,
    low: f32,
}

impl Sum {
    /// A sum that starts at `value`.
    #[must_use]
    pub const fn new(value: f32) -> Self {
        Self {
            high: value,
            low: 0.0,
        }
    }

    /// A sum that starts at `value`, to 48 bits.
    #[must_use]
    pub fn from_f64(value: f64) -> Self {
        let high = value as f32;
        let low = (value - f64::from(high)) as f32;
        Self { high, low }
    }

    /// Adds a finite term.
    pub fn add(&mut self, term: f32) {
        let high = self.high + term;
        let taken = high - self.high;
        let error = (self.high - (high - taken)) + (term - taken);
        let low = self.low + error;
        self.high = high + low;
        self.low = low - (self.high - high);
    }

    /// The sum, rounded to f32.
    #[must_use]
    pub const fn get(&self) -> f32 {
        self.high
    }

    /// The sum, whole.
    #[must_use]
    pub fn to_f64(&self) -> f64 {
        f64::from(self.high) + f64::from(self.low)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn agrees_with_f64(terms in proptest::collection::vec(-1e-2..1e-2f32, 1..2000), start in -1e4..1e4f32) {
            let mut sum = Sum::new(start);
            let mut exact = f64::from(start);
            for term in terms {
                sum.add(term);
                exact += f64::from(term);
            }
            // 2000 additions, each within 2^-48 of the largest partial sum.
            prop_assert!((sum.to_f64() - exact).abs() <= 2000.0 * 1e4 * f64::powi(2.0, -48));
        }
    }
}
