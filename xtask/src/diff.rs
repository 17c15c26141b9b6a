//! Comparing what a command printed with what a README says, where `...` is any lines and `…` any text.

/// Lists both texts line by line, `-` before what is missing and `+` before what is extra; none if they agree.
pub fn diff(expected: &[&str], actual: &[&str]) -> Option<String> {
    let edits = edits(expected, actual);
    if edits[0][0] == 0 {
        return None;
    }
    let (mut i, mut j) = (0, 0);
    let mut lines = Vec::new();
    while i < expected.len() || j < actual.len() {
        let here = edits[i][j];
        let gap = expected.get(i) == Some(&"...");
        if i < expected.len()
            && j < actual.len()
            && !gap
            && here == edits[i + 1][j + 1]
            && fits(expected[i], actual[j])
        {
            lines.push(format!("  {}", actual[j]));
            (i, j) = (i + 1, j + 1);
        } else if gap && here == edits[i + 1][j] {
            lines.push("  ...".into());
            i += 1;
        } else if gap {
            j += 1;
        } else if i < expected.len() && here == edits[i + 1][j] + 1 {
            lines.push(format!("- {}", expected[i]));
            i += 1;
        } else {
            lines.push(format!("+ {}", actual[j]));
            j += 1;
        }
    }
    Some(lines.join("\n"))
}

/// The fewest lines to take out or put in, from line `i` of `expected` and line `j` of `actual` to the ends.
fn edits(expected: &[&str], actual: &[&str]) -> Vec<Vec<usize>> {
    let (n, m) = (expected.len(), actual.len());
    let mut edits = vec![vec![0; m + 1]; n + 1];
    for i in (0..=n).rev() {
        for j in (0..=m).rev() {
            let gap = i < n && expected[i] == "...";
            let step = usize::from(!gap);
            let drop_expected = (i < n).then(|| edits[i + 1][j] + step);
            let drop_actual = (j < m).then(|| edits[i][j + 1] + step);
            let same = (i < n && j < m && !gap && fits(expected[i], actual[j]))
                .then(|| edits[i + 1][j + 1]);
            edits[i][j] = [drop_expected, drop_actual, same]
                .into_iter()
                .flatten()
                .min()
                .unwrap_or(0);
        }
    }
    edits
}

/// Whether a line is the expected one.
fn fits(expected: &str, actual: &str) -> bool {
    let mut parts = expected.split('…');
    let Some(mut rest) = parts.next().and_then(|start| actual.strip_prefix(start)) else {
        return false;
    };
    let Some(end) = parts.next_back() else {
        return rest.is_empty();
    };
    for part in parts {
        let Some((_, after)) = rest.split_once(part) else {
            return false;
        };
        rest = after;
    }
    rest.ends_with(end)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_gaps() {
        assert!(fits("done", "done"));
        assert!(!fits("done", "done!"));
        assert!(fits("took … s, … steps", "took 1.5 s, 300 steps"));
        assert!(fits("…", ""));
        assert!(!fits("a…a", "a"), "both ends need text of their own");
        assert!(!fits("took … s", "took 1.5 ms!"));
    }

    #[test]
    fn line_gaps() {
        assert_eq!(diff(&["a", "...", "d"], &["a", "b", "c", "d"]), None);
        assert_eq!(diff(&["a", "...", "d"], &["a", "d"]), None);
        assert_eq!(
            diff(&["...", "x", "...", "x"], &["x", "y", "x", "z", "x"]),
            None
        );
        assert_eq!(diff(&[], &[]), None);
        assert!(diff(&[], &["a"]).is_some());
        assert!(diff(&["a", "...", "d"], &["a", "b"]).is_some());
    }

    #[test]
    fn shows_what_differs() {
        let shown = diff(&["a", "b", "...", "e"], &["a", "B", "c", "d", "e", "f"]);
        assert_eq!(shown.as_deref(), Some("  a\n- b\n  ...\n  e\n+ f"));
    }
}
