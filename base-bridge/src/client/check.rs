//! The check of a line: `*` and four upper-case hex digits of the CRC-16/CCITT-FALSE of all before it.

use crc::{CRC_16_IBM_3740, Crc};

/// CRC-16/CCITT-FALSE goes by its catalogue's name, IBM-3740.
const CHECK: Crc<u16> = Crc::<u16>::new(&CRC_16_IBM_3740);
/// Of `*hhhh`.
const LENGTH: usize = 5;

/// The line with its check.
pub fn with(line: &str) -> String {
    format!("{line}*{:04X}", CHECK.checksum(line.as_bytes()))
}

/// What a line's check says of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Checked<'a> {
    /// It has none.
    None(&'a str),
    /// It has the right one; this is the line without.
    Right(&'a str),
    /// It has a wrong one.
    Wrong,
}

/// Looks at a line's check. A unit may have a `*` as well (`V*s/m`): what is not four digits is none. A reply must have one, so that a damaged check is
/// not taken for that.
pub fn of(line: &str) -> Checked<'_> {
    let Some(star) = line.len().checked_sub(LENGTH) else {
        return Checked::None(line);
    };
    let Some((text, check)) = line.split_at_checked(star) else {
        return Checked::None(line);
    };
    let is_digit = |c: char| matches!(c, '0'..='9' | 'A'..='F');
    let is_check = |check: &str| check.starts_with('*') && check[1..].chars().all(is_digit);
    if !is_check(check) {
        Checked::None(line)
    } else if with(text)[star..] == *check {
        Checked::Right(text)
    } else {
        Checked::Wrong
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_protocols_example_and_damage() {
        // From the protocol's page.
        assert_eq!(
            with("SetParam require_crc 0"),
            "SetParam require_crc 0*E50B"
        );
        assert_eq!(
            of("SetParam require_crc 0*E50B"),
            Checked::Right("SetParam require_crc 0")
        );
        assert_eq!(of("SetParam require_crc 1*E50B"), Checked::Wrong);
        for none in [
            "SetParam require_crc 0*e50b",
            "OK*",
            "~ servo_p 25 0 10000 V*s/m",
            "~ motor_accel_gain 0.5 0 1000 V*s2/m",
            "",
        ] {
            assert_eq!(of(none), Checked::None(none));
        }
        assert_eq!(of("OK"), Checked::None("OK"));
    }
}
