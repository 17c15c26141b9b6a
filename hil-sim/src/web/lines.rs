//! What a line of the protocol may be, and bytes cut into such lines.

/// Longest line without its end, either way.
const MAX_LENGTH: usize = 255;

/// True of what may go over the serial line as one line: printable ASCII and tabs, not too long, and something.
pub fn is_line(text: &str) -> bool {
    let may_be = |byte: u8| byte == b'\t' || (b' '..=b'~').contains(&byte);
    (1..=MAX_LENGTH).contains(&text.len()) && text.bytes().all(may_be)
}

/// The tag of a line, if it has one that can be read, and what follows it.
pub fn untagged(line: &str) -> (Option<u16>, &str) {
    let line = line.trim_matches([' ', '\t']);
    let Some(tagged) = line.strip_prefix('@') else {
        return (None, line);
    };
    let end = tagged
        .find(|c: char| !c.is_ascii_digit())
        .unwrap_or(tagged.len());
    let (digits, body) = tagged.split_at(end);
    (digits.parse().ok(), body.trim_start_matches([' ', '\t']))
}

/// The command that a line is, as it was written.
pub fn keyword(line: &str) -> &str {
    let (_, body) = untagged(line);
    let mut words = body.split([' ', '\t', ',', '*']);
    words.next().unwrap_or_default()
}

/// True of a command that ends all motion.
pub fn is_stop(line: &str) -> bool {
    ["stop", "estop"]
        .iter()
        .any(|stop| keyword(line).eq_ignore_ascii_case(stop))
}

/// Puts the bytes that a base sends together to lines.
#[derive(Debug, Default)]
pub struct Lines {
    partial: Vec<u8>,
}

impl Lines {
    /// Calls back with each line that these bytes complete. What is no line, as a board in trouble may send it, is left out whole: half of it could pass
    /// for something that was never said.
    pub fn push(&mut self, bytes: &[u8], mut each: impl FnMut(&str)) {
        for byte in bytes {
            if !matches!(byte, b'\n' | b'\r') {
                // One too many is kept, so that it shows.
                if self.partial.len() <= MAX_LENGTH {
                    self.partial.push(*byte);
                }
                continue;
            }
            if let Ok(line) = std::str::from_utf8(&self.partial)
                && is_line(line)
            {
                each(line);
            }
            self.partial.clear();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_printable_and_of_some_length() {
        assert!(is_line("@17 m 1 0.3*1A2B"));
        assert!(is_line("\tm 1"));
        assert!(is_line(" "));
        assert!(is_line(&"x".repeat(255)));
        for wrong in ["", "m 1\n", "m 1\r", "m\x001", "m\x7f1", "m 1 °", "m\x1b[A"] {
            assert!(!is_line(wrong), "{wrong:?}");
        }
        assert!(!is_line(&"x".repeat(256)));
    }

    #[test]
    fn commands_are_told_by_their_first_word() {
        assert_eq!(untagged(" @17 \tm 1*1A2B"), (Some(17), "m 1*1A2B"));
        assert_eq!(untagged("@70000 m 1"), (None, "m 1"));
        assert_eq!(keyword("m,1"), "m");
        assert_eq!(keyword("@1"), "");
        for stop in ["Stop", "@3 STOP*1A2B", "\testop", "@4\tEStop "] {
            assert!(is_stop(stop), "{stop}");
        }
        for other in ["Stopp", "m 1 stop", "GetTime", "@5", ""] {
            assert!(!is_stop(other), "{other}");
        }
    }

    fn lines(pieces: &[&[u8]]) -> Vec<String> {
        let mut lines = Lines::default();
        let mut found = Vec::new();
        for piece in pieces {
            lines.push(piece, |line| found.push(line.to_owned()));
        }
        found
    }

    #[test]
    fn bytes_make_lines_however_they_are_cut() {
        assert_eq!(
            lines(&[b"OK\r\n~ 1", b" 2\r", b"\n! boot"]),
            ["OK", "~ 1 2"]
        );
        assert_eq!(lines(&[b"\n\n\r\nOK\n"]), ["OK"]);
    }

    #[test]
    fn what_is_no_line_is_left_out_whole() {
        let long = [b'x'; 300];
        assert_eq!(lines(&[b"a\n", &long, b"\nb\n"]), ["a", "b"]);
        assert_eq!(lines(&[b"O\xffK\nOK\nO\0K\n"]), ["OK"]);
        let most = [b'x'; 255];
        assert_eq!(lines(&[&most, b"\n"])[0].len(), 255);
    }
}
