//! The table of faults in `docs/safety.md` is that of the code.

use std::path::Path;
use vehicle_controller::supervisor::Fault;

const HEAD: &str = "| fault | cause | reaction | clearing |";

#[test]
fn the_page_has_a_row_for_each_fault_that_says_what_the_code_says() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/safety.md");
    let page = std::fs::read_to_string(path).expect("docs/safety.md is there");
    let mut lines = page.lines().map(str::trim_end);
    assert!(lines.any(|line| line == HEAD), "no table {HEAD}");
    let rule = lines.next().unwrap_or_default();
    assert!(rule.starts_with("|--") || rule.starts_with("|:-"), "{rule}");
    let rows: Vec<&str> = lines.take_while(|line| line.starts_with('|')).collect();
    let row = |fault: &Fault| {
        let (name, cause) = (fault.name(), fault.cause());
        let (reaction, clears) = (fault.reaction().name(), fault.clears());
        format!("| `{name}` | {cause} | {reaction} | {clears} |")
    };
    let expected: Vec<String> = Fault::ALL.iter().map(row).collect();
    assert_eq!(rows, expected);
}

#[test]
fn names_are_words_of_the_protocol_and_texts_fit_a_table() {
    let mut names = std::collections::BTreeSet::new();
    for fault in Fault::ALL {
        let name = fault.name();
        assert!(names.insert(name), "{name} twice");
        assert!(
            name.bytes().all(|b| b.is_ascii_lowercase() || b == b'-') && name != "none",
            "{name}"
        );
        for text in [fault.cause(), fault.clears()] {
            assert!(!text.is_empty() && !text.contains(['|', '\n']), "{text}");
        }
    }
}
