//! Bytes to lines.

/// The longest line of the protocol, with its end.
const LONGEST: usize = 257;

/// A line, or what is none.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Piece {
    /// Printable ASCII, without its end.
    Line(String),
    /// Too long, or with a byte that no line has.
    Damaged,
}

/// Puts lines together.
#[derive(Clone, Debug, Default)]
pub struct Splitter {
    line: Vec<u8>,
    /// The line has been longer than any may be.
    overlong: bool,
}

impl Splitter {
    /// The lines that these bytes end.
    pub fn push(&mut self, bytes: &[u8]) -> Vec<Piece> {
        let mut pieces = Vec::new();
        for byte in bytes {
            if !matches!(byte, b'\n' | b'\r') {
                if self.line.len() < LONGEST {
                    self.line.push(*byte);
                } else {
                    self.overlong = true;
                }
                continue;
            }
            let line = std::mem::take(&mut self.line);
            if std::mem::take(&mut self.overlong) {
                pieces.push(Piece::Damaged);
            } else if !line.is_empty() {
                let printable = line.iter().all(|b| matches!(b, b'\t' | b' '..=b'~'));
                pieces.push(match String::from_utf8(line) {
                    Ok(line) if printable => Piece::Line(line),
                    _ => Piece::Damaged,
                });
            }
        }
        pieces
    }

    /// Half a line of a connection that is gone begins none of the next.
    pub fn clear(&mut self) {
        self.line.clear();
        self.overlong = false;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_come_whole_however_they_arrive() {
        let mut splitter = Splitter::default();
        assert_eq!(splitter.push(b"O"), []);
        let ok = || Piece::Line("OK".into());
        assert_eq!(splitter.push(b"K\r\n\r\nOK\nE"), [ok(), ok()]);
        splitter.clear();
        assert_eq!(splitter.push(b"OK\r"), [ok()]);
    }

    #[test]
    fn what_is_no_line_is_told() {
        let mut splitter = Splitter::default();
        assert_eq!(splitter.push(b"O\xffK\n"), [Piece::Damaged]);
        assert_eq!(splitter.push(&[b'x'; 5000]), []);
        assert_eq!(splitter.push(b"\nOK\n").len(), 2);
    }
}
