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

    /// Adds another sum.
    #[must_use]
    pub fn plus(self, other: Self) -> Self {
        let (high, error) = two_sum(self.high, other.high);
        let (low, rest) = two_sum(self.low, other.low);
        let (high, error) = fast_two_sum(high, error + low);
        let (high, low) = fast_two_sum(high, error + rest);
        Self { high, low }
    }

    /// The negative of it.
    #[must_use]
    pub const fn negative(self) -> Self {
        Self {
            high: -self.high,
            low: -self.low,
        }
    }

    /// Subtracts another sum.
    #[must_use]
    pub fn minus(self, other: Self) -> Self {
        self.plus(other.negative())
    }

    /// The product with a factor, good to 46 bits.
    #[must_use]
    pub fn times(self, factor: Factor) -> Self {
        let product = self.high * factor.value;
        let head = head(self.high);
        let tail = self.high - head;
        // What rounding took from the product: exact, as no partial product has more than 24 bits.
        let error = ((head * factor.head - product) + head * factor.tail + tail * factor.head)
            + tail * factor.tail;
        let (high, low) = fast_two_sum(product, error + self.low * factor.value);
        Self { high, low }
    }

    /// The quotient, good to 46 bits, by another sum that is not zero.
    #[must_use]
    pub fn over(self, divisor: Self) -> Self {
        let quotient = self.high / divisor.high;
        let rest = self.minus(divisor.times(Factor::new(quotient)));
        let (high, low) = fast_two_sum(quotient, rest.high / divisor.high);
        Self { high, low }
    }

    /// The magnitude.
    #[must_use]
    pub fn abs(self) -> Self {
        if self.high < 0.0 {
            self.negative()
        } else {
            self
        }
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

/// An f32 to multiply sums with, split once for several products.
#[derive(Clone, Copy, Debug)]
pub struct Factor {
    value: f32,
    head: f32,
    tail: f32,
}

impl Factor {
    /// Splits a factor.
    #[must_use]
    pub fn new(value: f32) -> Self {
        let head = head(value);
        Self {
            value,
            head,
            tail: value - head,
        }
    }
}

/// The leading 12 bits of a number's 24: what is left of it has 12 too. Nothing is lost, and the product of two such parts is exact.
fn head(value: f32) -> f32 {
    f32::from_bits(value.to_bits() & 0xffff_f000)
}

/// Knuth's sum: a + b, and what rounding took from it.
fn two_sum(a: f32, b: f32) -> (f32, f32) {
    let sum = a + b;
    let taken = sum - a;
    (sum, (a - (sum - taken)) + (b - taken))
}

/// The same for |a| ≥ |b|.
fn fast_two_sum(a: f32, b: f32) -> (f32, f32) {
    let sum = a + b;
    (sum, b - (sum - a))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn arithmetic_is_good_to_44_bits(a in -1e4..1e4f64, b in -1e4..1e4f64, factor in -1e2..1e2f32) {
            let (x, y) = (Sum::from_f64(a), Sum::from_f64(b));
            let (a, b) = (x.to_f64(), y.to_f64());
            let close = |is: Sum, wanted: f64, scale: f64| (is.to_f64() - wanted).abs() <= scale * f64::powi(2.0, -44);
            prop_assert!(close(x.plus(y), a + b, a.abs() + b.abs()));
            prop_assert!(close(x.minus(y), a - b, a.abs() + b.abs()));
            let product = a * f64::from(factor);
            prop_assert!(close(x.times(Factor::new(factor)), product, product.abs()));
            if b.abs() > 1e-3 {
                prop_assert!(close(x.over(y), a / b, (a / b).abs()));
            }
        }

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
