//! The protocol's framing, as its page says it: what each line is, and how it must be answered.

/// Longest line without its end.
pub const LONGEST: usize = 255;

/// What is wrong with a line before anybody reads its command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Damage {
    /// Longer than 255 bytes.
    TooLong,
    /// A byte outside printable ASCII and tab.
    BadByte,
    /// A wrong check.
    Checksum,
    /// An `@` without a number.
    Tag,
}

impl Damage {
    /// The code of its refusal.
    pub fn code(self) -> &'static str {
        match self {
            Self::TooLong => "too-long",
            Self::BadByte => "bad-byte",
            Self::Checksum => "checksum",
            Self::Tag => "syntax",
        }
    }
}

/// What a line is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Line<'a> {
    /// Its tag, if it can be read.
    pub tag: Option<u16>,
    /// It came with a check, right or wrong.
    pub has_check: bool,
    /// Its check has letters in upper case, and in lower case.
    pub letters: [bool; 2],
    /// What is left without both.
    pub body: Result<&'a [u8], Damage>,
}

/// Reads a line without its end; nothing if it is to be ignored.
pub fn read(line: &[u8]) -> Option<Line<'_>> {
    if line.iter().all(|b| b" \t".contains(b)) {
        return None;
    }
    let kept = line.get(..LONGEST).unwrap_or(line);
    let star = kept.iter().rposition(|b| *b == b'*');
    let content = trim(&kept[..star.unwrap_or(kept.len())]);
    let (tag, body) = match content.strip_prefix(b"@") {
        None => (None, Ok(content)),
        Some(rest) => {
            let end = rest.iter().position(|b| b" \t".contains(b));
            let (digits, body) = rest.split_at(end.unwrap_or(rest.len()));
            match tag(digits) {
                Some(tag) => (Some(tag), Ok(trim(body))),
                None => (None, Err(Damage::Tag)),
            }
        }
    };
    let printable = |b: &u8| matches!(b, b' '..=b'~' | b'\t');
    let body = if line.len() > LONGEST {
        Err(Damage::TooLong)
    } else if !line.iter().all(printable) {
        Err(Damage::BadByte)
    } else if star.is_some_and(|at| !is_right(&line[..at], &line[at + 1..])) {
        Err(Damage::Checksum)
    } else {
        body
    };
    let check = star.map_or(&[][..], |at| &kept[at + 1..]);
    Some(Line {
        tag,
        has_check: star.is_some(),
        letters: [
            check.iter().any(u8::is_ascii_uppercase),
            check.iter().any(u8::is_ascii_lowercase),
        ],
        body,
    })
}

fn trim(mut bytes: &[u8]) -> &[u8] {
    while let [b' ' | b'\t', rest @ ..] | [rest @ .., b' ' | b'\t'] = bytes {
        bytes = rest;
    }
    bytes
}

fn tag(digits: &[u8]) -> Option<u16> {
    let plain = matches!(digits.len(), 1..=5) && digits.iter().all(u8::is_ascii_digit);
    plain
        .then(|| str::from_utf8(digits).ok()?.parse().ok())
        .flatten()
}

/// True if `check` is that of `content`, in hex.
pub fn is_right(content: &[u8], check: &[u8]) -> bool {
    check.len() == 4
        && check.iter().all(u8::is_ascii_hexdigit)
        && str::from_utf8(check)
            .ok()
            .and_then(|hex| u16::from_str_radix(hex, 16).ok())
            == Some(crc(content))
}

/// CRC-16/CCITT-FALSE: polynomial 0x1021, from 0xFFFF, by table.
pub fn crc(bytes: &[u8]) -> u16 {
    const TABLE: [u16; 256] = {
        let mut table = [0; 256];
        let mut byte = 0;
        while byte < 256 {
            let mut crc = (byte as u16) << 8;
            let mut bit = 0;
            while bit < 8 {
                crc = (crc << 1) ^ if crc & 0x8000 == 0 { 0 } else { 0x1021 };
                bit += 1;
            }
            table[byte] = crc;
            byte += 1;
        }
        table
    };
    bytes.iter().fold(0xFFFF, |crc, byte| {
        (crc << 8) ^ TABLE[usize::from((crc >> 8) as u8 ^ byte)]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn as_the_page_says() {
        assert_eq!(crc(b"123456789"), 0x29B1);
        assert_eq!(read(b" \t"), None);
        let line = |tag, has_check, body| {
            Some(Line {
                tag,
                has_check,
                letters: [false, has_check],
                body,
            })
        };
        assert_eq!(read(b"m 1"), line(None, false, Ok(&b"m 1"[..])));
        assert_eq!(read(b"@17  m 1 "), line(Some(17), false, Ok(&b"m 1"[..])));
        assert_eq!(read(b"@17"), line(Some(17), false, Ok(&b""[..])));
        assert_eq!(read(b"@70000 m"), line(None, false, Err(Damage::Tag)));
        assert_eq!(
            read(b"123456789*29b1"),
            line(None, true, Ok(&b"123456789"[..]))
        );
        assert_eq!(
            read(b"@1 123456789*29b1"),
            line(Some(1), true, Err(Damage::Checksum))
        );
        assert_eq!(read(b"m\x80"), line(None, false, Err(Damage::BadByte)));
        assert_eq!(
            read(&[b'm'; 256]).map(|line| line.body),
            Some(Err(Damage::TooLong))
        );
        assert_eq!(
            read(&[b'm'; 255]).map(|line| line.body),
            Some(Ok(&[b'm'; 255][..]))
        );
    }
}
