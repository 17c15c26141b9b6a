//! What a sample of a known distribution may be, and what it is.

/// The normal quantile that leaves 2.5 % on either side.
pub const NORMAL_95: f64 = 1.959_963_984_540_054;
/// The same for 0.5 %.
pub const NORMAL_99: f64 = 2.575_829_303_548_901;
/// The 95 % quantile of χ² with three degrees of freedom.
pub const CHI_SQUARE_3_95: f64 = 7.814_727_903_251_178;
/// The same for 99 %.
pub const CHI_SQUARE_3_99: f64 = 11.344_866_730_144_37;

/// Where χ²/n lies with the probability to which `quantile` belongs, for n degrees of freedom: by Wilson and Hilferty's cube root, to 0.1 % from n = 50 on.
#[must_use]
pub fn chi_square_band(degrees: f64, quantile: f64) -> [f64; 2] {
    let variance = 2.0 / (9.0 * degrees);
    [-quantile, quantile].map(|z| (1.0 - variance + z * variance.sqrt()).powi(3))
}

/// Mean and the standard deviation of the mean, of values that know nothing of each other. No value: not a number.
#[must_use]
pub fn mean(values: impl Iterator<Item = f64> + Clone) -> (f64, f64) {
    let (mut count, mut sum) = (0.0, 0.0);
    for value in values.clone() {
        count += 1.0;
        sum += value;
    }
    let mean = sum / count;
    let squares: f64 = values.map(|value| (value - mean).powi(2)).sum();
    (mean, (squares / (count - 1.0) / count).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bands_of_the_table() {
        // χ² with 60 degrees: 40.482 and 83.298; with 1200, by bisection of the incomplete gamma function: 1105.890 and 1297.898.
        for (degrees, low, high) in [(60.0, 40.482, 83.298), (1200.0, 1105.890, 1297.898)] {
            let [a, b] = chi_square_band(degrees, NORMAL_95);
            assert!((a * degrees / low - 1.0).abs() < 1e-3, "{degrees}: {a}");
            assert!((b * degrees / high - 1.0).abs() < 1e-3, "{degrees}: {b}");
        }
    }

    #[test]
    fn mean_of_a_few() {
        let (mean, deviation) = mean([1.0, 2.0, 3.0, 6.0].into_iter());
        assert!((mean - 3.0).abs() < 1e-15);
        // Squares 4 + 1 + 0 + 9 over 3, over 4.
        assert!((deviation - (14.0_f64 / 12.0).sqrt()).abs() < 1e-15);
    }
}
