//! The page: one file, in this program, that may load nothing but itself.

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use sha2::{Digest, Sha256};

/// As it was built; `cargo xtask page` sees that it is what its sources make.
const FILE: &str = include_str!("../../../web/dist/index.html");

/// Says to the page where it comes from: a static one offers Web Serial, one that a simulator serves does not, so that two bases are never mixed.
const STATIC: &str = r#"<meta name="base" content="static">"#;
const SERVED: &str = r#"<meta name="base" content="served">"#;

/// The page as it is served.
#[derive(Debug)]
pub struct Page {
    /// The document.
    pub html: String,
    /// Its scripts, as the policy of its content names them.
    script_sources: String,
}

impl Page {
    /// Makes it from the file in this program.
    pub fn new() -> Self {
        Self::of(FILE)
    }

    fn of(file: &str) -> Self {
        let html = file.replacen(STATIC, SERVED, 1);
        let hashes = scripts(&html).map(|script| {
            let hash = BASE64_STANDARD.encode(Sha256::digest(script));
            format!(" 'sha256-{hash}'")
        });
        let sources: String = hashes.collect();
        Self {
            script_sources: if sources.is_empty() {
                " 'none'".into()
            } else {
                sources
            },
            html,
        }
    }

    /// The policy of its content, for who asked for it by this host's name: the scripts that are in it and no others, connections to this server only,
    /// and no other page around it. Pictures are its own drawings.
    pub fn policy(&self, host: &str) -> String {
        format!(
            "default-src 'none'; script-src{}; style-src 'unsafe-inline'; img-src data: blob:; connect-src 'self' ws://{host}; \
             base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
            self.script_sources
        )
    }
}

/// What stands between the tags of each script.
fn scripts(html: &str) -> impl Iterator<Item = &str> {
    let mut rest = html;
    std::iter::from_fn(move || {
        let tag = rest.find("<script")?;
        let begin = tag + rest[tag..].find('>')? + 1;
        let end = begin + rest[begin..].find("</script")?;
        let script = &rest[begin..end];
        rest = &rest[end..];
        Some(script)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_says_that_it_is_served() {
        assert_eq!(FILE.matches(STATIC).count(), 1);
        let html = Page::new().html;
        assert_eq!(html.matches(SERVED).count(), 1);
        assert!(!html.contains(STATIC));
    }

    #[test]
    fn scripts_are_allowed_by_what_they_are() {
        let page = Page::of("<script>1</script><b></b><script type=\"module\">let a = 2;</script>");
        // printf 1 | openssl dgst -sha256 -binary | base64
        let policy = page.policy("localhost:1");
        assert!(
            policy.contains("'sha256-a4ayc/80/OGda4BO/1o/V0etpOqiLx1JwB5S3beHW0s='"),
            "{policy}"
        );
        assert_eq!(policy.matches("'sha256-").count(), 2);
        assert!(!policy.contains("script-src 'unsafe"));
    }

    #[test]
    fn a_page_without_scripts_may_run_none() {
        let policy = Page::of("<p>").policy("localhost:1");
        assert!(policy.contains("script-src 'none';"), "{policy}");
    }
}
