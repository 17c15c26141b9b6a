//! From bytes to lines, and what is around a command: tag and check.

use super::crc::{self, Letters};
use super::error::Error;
use super::text::MAX_LINE;
use heapless::Vec;

/// Collects bytes into lines.
#[derive(Clone, Debug, Default)]
pub struct Reader {
    line: Vec<u8, MAX_LINE>,
    too_long: bool,
    bad_byte: bool,
}

/// A line without what is around it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame<'a> {
    /// `@17`.
    pub tag: Option<u16>,
    /// The line came with a check.
    pub has_check: bool,
    /// The letters of its check, if that can be read.
    pub letters: Letters,
    /// The command, or why it cannot be read.
    pub body: Result<&'a [u8], Error>,
}

impl Reader {
    /// Takes in a byte; true if it ends a line that is not empty. Then look at [`Reader::frame`], and [`Reader::clear`].
    pub fn push(&mut self, byte: u8) -> bool {
        match byte {
            b'\r' | b'\n' => {
                let blank = self.line.iter().all(|b| is_blank(*b));
                if blank && !self.bad_byte && !self.too_long {
                    self.clear();
                    return false;
                }
                return true;
            }
            b'\t' | b' '..=b'~' => self.too_long |= self.line.push(byte).is_err(),
            _ => {
                self.bad_byte = true;
                self.too_long |= self.line.push(b'?').is_err();
            }
        }
        false
    }

    /// The line that has just ended.
    pub fn frame(&self) -> Frame<'_> {
        let mut frame = open(&self.line);
        // What arrived damaged is refused as such; its tag, if it can be read, still says which it was.
        if self.too_long {
            frame.body = Err(Error::TooLong);
        } else if self.bad_byte {
            frame.body = Err(Error::BadByte);
        }
        frame
    }

    /// Gets ready for the next line.
    pub fn clear(&mut self) {
        self.line.clear();
        self.too_long = false;
        self.bad_byte = false;
    }
}

fn is_blank(byte: u8) -> bool {
    byte == b' ' || byte == b'\t'
}

/// Takes tag and check off a line.
fn open(line: &[u8]) -> Frame<'_> {
    let star = line.iter().rposition(|b| *b == b'*');
    let (content, check) = match star.and_then(|at| line.split_at_checked(at)) {
        Some((content, [_, check @ ..])) => (content, Some(check)),
        _ => (line, None),
    };
    let (tag, body) = take_tag(content);
    let (value, letters) = check.and_then(crc::parse).unzip();
    let body = match check {
        // Anything after a star is meant as a check; damaged, it proves nothing.
        Some(_) if value != Some(crc::of(content)) => Err(Error::Checksum),
        _ => body,
    };
    Frame {
        tag,
        has_check: check.is_some(),
        letters: letters.unwrap_or_default(),
        body,
    }
}

fn take_tag(content: &[u8]) -> (Option<u16>, Result<&[u8], Error>) {
    let content = content.trim_ascii();
    let [b'@', tagged @ ..] = content else {
        return (None, Ok(content));
    };
    let length = tagged
        .iter()
        .position(|b| is_blank(*b))
        .unwrap_or(tagged.len());
    let Some((digits, body)) = tagged.split_at_checked(length) else {
        return (None, Err(Error::Syntax("tag")));
    };
    match parse_tag(digits) {
        Some(tag) => (Some(tag), Ok(body.trim_ascii())),
        None => (None, Err(Error::Syntax("a tag is @0 to @65535"))),
    }
}

fn parse_tag(digits: &[u8]) -> Option<u16> {
    if digits.is_empty() || digits.len() > 5 {
        return None;
    }
    let mut value = 0_u32;
    for byte in digits {
        if !byte.is_ascii_digit() {
            return None;
        }
        value = value * 10 + u32::from(byte - b'0');
    }
    u16::try_from(value).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tags_and_checks() {
        let frame = open(b"@17 m 1");
        assert_eq!((frame.tag, frame.body), (Some(17), Ok(&b"m 1"[..])));
        assert_eq!(open(b"@17").body, Ok(&b""[..]));
        for bad in [&b"@ m"[..], b"@65536 m", b"@-1 m", b"@1x m", b"@000001 m"] {
            assert!(matches!(open(bad).body, Err(Error::Syntax(_))), "{bad:?}");
        }
        let checked = open(b"123456789*29b1");
        assert_eq!(
            (checked.has_check, checked.body),
            (true, Ok(&b"123456789"[..]))
        );
        for bad in [
            &b"123456789*29B2"[..],
            b"m 1*",
            b"m 1*29B1 ",
            b"m 1*29B",
            b"*",
        ] {
            let frame = open(bad);
            assert!(frame.has_check);
            assert_eq!(frame.body, Err(Error::Checksum), "{bad:?}");
        }
    }
}
