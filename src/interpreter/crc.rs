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

/// Reads four hex digits.
pub fn parse(digits: &[u8]) -> Option<u16> {
    let [_, _, _, _] = digits else { return None };
    let mut value = 0_u16;
    for byte in digits {
        let digit = match byte {
            b'0'..=b'9' => byte - b'0',
            b'a'..=b'f' => byte - b'a' + 10,
            b'A'..=b'F' => byte - b'A' + 10,
            _ => return None,
        };
        value = value << 4 | u16::from(digit);
    }
    Some(value)
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_catalogues_check_value() {
        assert_eq!(super::of(b"123456789"), 0x29B1);
        assert_eq!(super::hex(0x29B1), *b"29B1");
        assert_eq!(super::parse(b"29b1"), Some(0x29B1));
        assert_eq!(super::parse(b"29b"), None);
        assert_eq!(super::parse(b"29bg"), None);
    }
}
