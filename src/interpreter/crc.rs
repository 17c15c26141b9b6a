//! The line check: CRC-16/CCITT-FALSE in hex.

use crc::{CRC_16_IBM_3740, Crc, NoTable};

/// CRC-16/CCITT-FALSE goes by its catalogue's name, IBM-3740.
const CHECK: Crc<u16, NoTable> = Crc::<u16, NoTable>::new(&CRC_16_IBM_3740);

/// The check of some bytes.
pub fn of(bytes: &[u8]) -> u16 {
    CHECK.checksum(bytes)
}

/// Four upper-case hex digits.
pub fn hex(value: u16) -> [u8; 4] {
    [12, 8, 4, 0].map(|shift| {
        let digit = (value >> shift & 0xf) as u8;
        if digit < 10 {
            b'0' + digit
        } else {
            b'A' + digit - 10
        }
    })
}

/// Cases of the letters among hex digits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Letters(u8);

impl Letters {
    const UPPER: u8 = 1;
    const LOWER: u8 = 2;

    /// These and others; nothing if that is a mixture of cases.
    pub fn with(self, others: Self) -> Option<Self> {
        let cases = self.0 | others.0;
        (cases != Self::UPPER | Self::LOWER).then_some(Self(cases))
    }
}

/// Reads four hex digits.
pub fn parse(digits: &[u8]) -> Option<(u16, Letters)> {
    let [_, _, _, _] = digits else { return None };
    let (mut value, mut cases) = (0_u16, 0);
    for byte in digits {
        let (digit, case) = match byte {
            b'0'..=b'9' => (byte - b'0', 0),
            b'a'..=b'f' => (byte - b'a' + 10, Letters::LOWER),
            b'A'..=b'F' => (byte - b'A' + 10, Letters::UPPER),
            _ => return None,
        };
        value = value << 4 | u16::from(digit);
        cases |= case;
    }
    Some((value, Letters(cases)))
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_catalogues_check_value() {
        assert_eq!(super::of(b"123456789"), 0x29B1);
        assert_eq!(super::hex(0x29B1), *b"29B1");
        assert_eq!(super::parse(b"29b1").map(|(value, _)| value), Some(0x29B1));
        assert_eq!(super::parse(b"29b"), None);
        assert_eq!(super::parse(b"29bg"), None);
    }

    #[test]
    fn letters_of_one_case_go_together() {
        let letters = |digits: &[u8]| super::parse(digits).unwrap().1;
        let [none, upper, lower, mixed] = [b"0129", b"0A2B", b"c129", b"aF00"].map(|d| letters(d));
        for one in [none, upper, lower] {
            assert_eq!(one.with(one), Some(one));
            assert_eq!(none.with(one), Some(one));
            assert_eq!(one.with(none), Some(one));
            assert_eq!(one.with(mixed), None);
        }
        assert_eq!(upper.with(lower), None);
        assert_eq!(none.with(mixed), None);
    }
}
