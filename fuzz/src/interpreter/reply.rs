//! Replies as text: codes and checks.

use crate::grammar::Codes;
use crate::protocol;

/// The code of a refusal; a refusal without one is none.
pub(super) fn code(reply: &str) -> Option<Codes> {
    let refusal = reply.strip_prefix("ERR ")?;
    let (code, text) = refusal.split_once(' ').unwrap_or((refusal, ""));
    let code = Codes::named(code.as_bytes());
    assert!(!code.is_empty() && !text.is_empty(), "{reply}");
    Some(code)
}

/// A line without its check, which must be there and right; or must not be there.
pub(super) fn unchecked(line: &str, must: bool) -> &str {
    if !must {
        let checked = line.rsplit_once('*').is_some_and(|(content, check)| {
            protocol::is_right(content.as_bytes(), check.as_bytes())
        });
        assert!(!checked, "a check that nobody wants: {line}");
        return line;
    }
    let (content, check) = line.rsplit_once('*').unwrap_or((line, ""));
    assert!(
        protocol::is_right(content.as_bytes(), check.as_bytes()),
        "no right check: {line}"
    );
    content
}

/// A line without its check, if it has one.
pub(super) fn either(line: &str) -> &str {
    line.rsplit_once('*')
        .filter(|(content, check)| protocol::is_right(content.as_bytes(), check.as_bytes()))
        .map_or(line, |(content, _)| content)
}
