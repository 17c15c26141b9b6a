//! A coefficient whose products with small integers are exact.

use super::Sum;

/// A positive coefficient as head + tail: the head has 12 significant bits, so head × n is exact in f32 for |n| < 4096.
///
/// Metres per count is such a coefficient. Rounded to f32 it may be wrong by 6e-8, and each product is rounded once more: with unequal wheels
/// that is a heading drift of 3 mrad in 10 km, or 15 m. Head and tail together hold 36 bits.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Split {
    head: f32,
    tail: f32,
}

impl Split {
    /// Splits a coefficient.
    #[must_use]
    pub fn new(value: Sum) -> Self {
        // Rounded, not cut off: the tail is then below 2⁻¹² of the value.
        let head = f32::from_bits((value.get().to_bits().wrapping_add(0x800)) & 0xffff_f000);
        let mut tail = value;
        tail.add(-head);
        Self {
            head,
            tail: tail.get(),
        }
    }

    /// The product with an integer: a part that is exact for |n| < 4096, and a small rest.
    #[must_use]
    pub fn times(self, n: i32) -> (f32, f32) {
        let n = n as f32;
        (self.head * n, self.tail * n)
    }

    /// The coefficient, rounded to f32.
    #[must_use]
    pub fn get(self) -> f32 {
        self.head + self.tail
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn product_is_good_to_36_bits(value in 1e-7..1.0f64, n in -4095..4096i32) {
            let (exact, rest) = Split::new(Sum::from_f64(value)).times(n);
            let product = f64::from(exact) + f64::from(rest);
            prop_assert!((product - value * f64::from(n)).abs() <= value * f64::from(n.abs()) * f64::powi(2.0, -35));
        }
    }
}
