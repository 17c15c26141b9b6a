//! Numbers as text, both ways, without `core::fmt` and `core::str::parse`: those link panics and 20 kB of tables.

/// Takes text, byte by byte.
pub trait Sink {
    /// Takes a byte.
    fn byte(&mut self, byte: u8);
}

/// What a word is, read as a number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Number {
    /// A decimal number.
    Finite(f64),
    /// `inf` or `-inf`.
    Infinite(f64),
    /// Decimal, but more than an f32 can hold.
    TooLarge,
}

/// Reads a decimal number: optional sign, digits with an optional point, optional exponent; or `inf`. `None` if the word is anything else.
///
/// The first 18 digits count; the error is below 1e-15 of the value.
#[must_use]
pub fn parse(word: &[u8]) -> Option<Number> {
    let (sign, mut rest) = match word {
        [b'-', rest @ ..] => (-1.0, rest),
        [b'+', rest @ ..] => (1.0, rest),
        _ => (1.0, word),
    };
    if rest.eq_ignore_ascii_case(b"inf") {
        return Some(Number::Infinite(sign * f64::INFINITY));
    }
    let mut mantissa = 0_u64;
    let mut exponent = 0_i32;
    let mut digits = false;
    let mut point = false;
    while let [byte, tail @ ..] = rest {
        match byte {
            b'0'..=b'9' => {
                digits = true;
                if mantissa < 100_000_000_000_000_000 {
                    mantissa = mantissa * 10 + u64::from(byte - b'0');
                    exponent -= i32::from(point);
                } else {
                    exponent += i32::from(!point);
                }
            }
            b'.' if !point => point = true,
            b'e' | b'E' if digits => {
                exponent += parse_exponent(tail)?;
                break;
            }
            _ => return None,
        }
        rest = tail;
    }
    if !digits {
        return None;
    }
    let value = sign * scale(mantissa as f64, exponent);
    Some(if value.abs() <= f64::from(f32::MAX) {
        Number::Finite(value)
    } else {
        Number::TooLarge
    })
}

fn parse_exponent(word: &[u8]) -> Option<i32> {
    let (sign, digits) = match word {
        [b'-', rest @ ..] => (-1, rest),
        [b'+', rest @ ..] => (1, rest),
        _ => (1, word),
    };
    if digits.is_empty() {
        return None;
    }
    let mut value = 0_i32;
    for byte in digits {
        if !byte.is_ascii_digit() {
            return None;
        }
        // Beyond a thousand every number is 0 or too large, even with 250 digits before.
        value = (value * 10 + i32::from(byte - b'0')).min(1000);
    }
    Some(sign * value)
}

/// `x` · 10^`exponent`, by powers that an f64 holds exactly.
fn scale(mut x: f64, mut exponent: i32) -> f64 {
    if x == 0.0 {
        return 0.0;
    }
    while exponent > 0 && x.is_finite() {
        let step = exponent.min(22);
        x *= power_of_ten(step);
        exponent -= step;
    }
    while exponent < 0 && x != 0.0 {
        let step = (-exponent).min(22);
        x /= power_of_ten(step);
        exponent += step;
    }
    x
}

/// 10^n for n from 0 to 22: exact.
fn power_of_ten(n: i32) -> f64 {
    (0..n.min(22)).fold(1.0, |power, _| power * 10.0)
}

/// Writes `x` with a fixed number of decimals (at most 9). Never `-0`. Values that do not fit saturate at 1e18 / 10^decimals.
pub fn fixed(text: &mut impl Sink, x: f64, decimals: u8) {
    let unit = power_of_ten(i32::from(decimals.min(9)));
    // The cast saturates, and takes NaN to 0.
    let scaled = ((x.abs() * unit + 0.5) as u64).min(1_000_000_000_000_000_000);
    if x < 0.0 && scaled > 0 {
        text.byte(b'-');
    }
    scaled_integer(text, scaled, decimals);
}

/// Writes `scaled` / 10^`decimals`.
fn scaled_integer(text: &mut impl Sink, scaled: u64, decimals: u8) {
    let mut digits = [b'0'; 20];
    let mut rest = scaled;
    for digit in digits.iter_mut().rev() {
        *digit = b'0' + (rest % 10) as u8;
        rest /= 10;
    }
    let mut started = false;
    for (place, digit) in (0..20_u8).rev().zip(digits) {
        started |= digit != b'0' || place <= decimals;
        if started {
            text.byte(digit);
            if place == decimals && decimals > 0 {
                text.byte(b'.');
            }
        }
    }
}

/// Writes an integer.
pub fn integer(text: &mut impl Sink, n: i64) {
    if n < 0 {
        text.byte(b'-');
    }
    scaled_integer(text, n.unsigned_abs(), 0);
}

/// Splits |x| into `digits` decimal digits as an integer, and the exponent of the first.
fn decompose(x: f64, digits: u8) -> (u64, i32) {
    let digits = i32::from(digits);
    let magnitude = x.abs();
    if magnitude.is_nan() || magnitude == 0.0 || magnitude.is_infinite() {
        return (0, 0);
    }
    let mut exponent = 0_i32;
    while scale(magnitude, -exponent) >= 10.0 {
        exponent += 1;
    }
    while scale(magnitude, -exponent) < 1.0 {
        exponent -= 1;
    }
    let limit = power_of_ten(digits) as u64;
    let mantissa = (scale(magnitude, digits - 1 - exponent) + 0.5) as u64;
    if mantissa >= limit {
        (mantissa / 10, exponent + 1)
    } else {
        (mantissa, exponent)
    }
}

/// Writes `x` with 6 significant digits as `1.00000e-2`: no plus sign, no leading zero in the exponent.
pub fn scientific(text: &mut impl Sink, x: f64) {
    let (mantissa, exponent) = decompose(x, 6);
    if x < 0.0 && mantissa > 0 {
        text.byte(b'-');
    }
    scaled_integer(text, mantissa, 5);
    text.byte(b'e');
    integer(text, i64::from(exponent));
}

/// Writes an f32 with as few digits as read back to it.
pub fn shortest(text: &mut impl Sink, x: f32) {
    for digits in 1..=9 {
        let (mantissa, exponent) = decompose(f64::from(x), digits);
        let last = exponent + 1 - i32::from(digits);
        if digits == 9 || scale(mantissa as f64, last) as f32 == x.abs() {
            if x < 0.0 {
                text.byte(b'-');
            }
            plain(text, mantissa, last);
            return;
        }
    }
}

/// Writes mantissa · 10^`last` without an exponent where that is readable.
fn plain(text: &mut impl Sink, mantissa: u64, last: i32) {
    match last {
        -9..=0 => scaled_integer(text, mantissa, last.unsigned_abs() as u8),
        1..=9 => {
            scaled_integer(text, mantissa, 0);
            for _ in 0..last {
                text.byte(b'0');
            }
        }
        _ => {
            scaled_integer(text, mantissa, 0);
            text.byte(b'e');
            integer(text, i64::from(last));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::interpreter::text::Text;
    use proptest::prelude::*;
    use std::format;
    use std::string::String;

    fn written(write: impl FnOnce(&mut Text)) -> String {
        let mut text = Text::default();
        write(&mut text);
        String::from_utf8(text.bytes().to_vec()).unwrap()
    }

    proptest! {
        #[test]
        fn reads_what_rust_writes(x in proptest::num::f32::NORMAL | proptest::num::f32::ZERO) {
            for word in [format!("{x}"), format!("{x:e}")] {
                let Some(Number::Finite(value)) = parse(word.as_bytes()) else { panic!("{word}") };
                prop_assert!((value - f64::from(x)).abs() <= 1e-7 * f64::from(x.abs()), "{word} {value}");
            }
        }

        #[test]
        fn fixed_agrees_with_rust(x in -1e6..1e6f64, decimals in 0..7u8) {
            let rust = format!("{x:.*}", usize::from(decimals));
            let ours = written(|t| fixed(t, x, decimals));
            let (rust, ours): (f64, f64) = (rust.parse().unwrap(), ours.parse().unwrap());
            // Rust rounds the exact decimal expansion, this the nearest f64 to it.
            prop_assert!((rust - ours).abs() <= 1.01 * f64::powi(10.0, -i32::from(decimals)));
            prop_assert!((ours - x).abs() <= 0.500_001 * f64::powi(10.0, -i32::from(decimals)));
        }

        #[test]
        fn scientific_is_good_to_six_digits(x in proptest::num::f32::NORMAL) {
            let word = written(|t| scientific(t, f64::from(x)));
            let back: f64 = word.parse().unwrap();
            prop_assert!((back - f64::from(x)).abs() <= 5.001e-6 * f64::from(x.abs()), "{word}");
        }

        #[test]
        fn shortest_reads_back(x in proptest::num::f32::NORMAL) {
            let word = written(|t| shortest(t, x));
            let Some(Number::Finite(value)) = parse(word.as_bytes()) else { panic!("{word}") };
            prop_assert_eq!(value as f32, x, "{}", word);
        }

        #[test]
        fn any_word_is_read_or_refused(word in proptest::collection::vec(any::<u8>(), 0..300)) {
            if let Some(Number::Finite(value)) = parse(&word) {
                prop_assert!(value.is_finite());
            }
        }
    }

    #[test]
    fn as_the_protocol_prints() {
        for (x, word) in [
            (0.01, "1.00000e-2"),
            (2.5, "2.50000e0"),
            (0.0, "0.00000e0"),
            (-1234.567, "-1.23457e3"),
            (9.999_999, "1.00000e1"),
            (1e-30, "1.00000e-30"),
        ] {
            assert_eq!(written(|t| scientific(t, x)), word);
        }
        for (x, decimals, word) in [
            (-0.000_000_4, 6, "0.000000"),
            (1.0, 6, "1.000000"),
            (-12.5, 1, "-12.5"),
            (0.999_999_9, 6, "1.000000"),
            (7.0, 0, "7"),
        ] {
            assert_eq!(written(|t| fixed(t, x, decimals)), word);
        }
        for (x, word) in [
            (0.084, "0.084"),
            (2796.8, "2796.8"),
            (1.93e-4, "0.000193"),
            (1e-5, "0.00001"),
            (1e7, "10000000"),
            (0.0, "0"),
            (-40.0, "-40"),
        ] {
            assert_eq!(written(|t| shortest(t, x)), word);
        }
    }

    #[test]
    fn odd_words() {
        for word in [
            "", "+", ".", "-.", "e5", "1e", "1e+", "0x10", "1.2.3", "1f", "nan", "infinity", "1 ",
            "--1", "١",
        ] {
            assert_eq!(parse(word.as_bytes()), None, "{word}");
        }
        assert_eq!(parse(b".5"), Some(Number::Finite(0.5)));
        assert_eq!(parse(b"5."), Some(Number::Finite(5.0)));
        assert_eq!(parse(b"-INF"), Some(Number::Infinite(f64::NEG_INFINITY)));
        assert_eq!(parse(b"1e39"), Some(Number::TooLarge));
        assert_eq!(parse(b"0e99999999999"), Some(Number::Finite(0.0)));
        assert_eq!(parse(b"1e-99999999999"), Some(Number::Finite(0.0)));
    }
}
