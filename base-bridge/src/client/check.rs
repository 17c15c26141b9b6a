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

/// Looks at a line's check. Anything after a `*` is meant as one.
pub fn of(line: &str) -> Checked<'_> {
    let Some(star) = line.rfind('*') else {
        return Checked::None(line);
    };
    let (text, check) = line.split_at(star);
    if check.len() == LENGTH && with(text)[star..] == *check {
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
        assert_eq!(of("SetParam require_crc 0*e50b"), Checked::Wrong);
        assert_eq!(of("OK*"), Checked::Wrong);
        assert_eq!(of("OK"), Checked::None("OK"));
    }
}
