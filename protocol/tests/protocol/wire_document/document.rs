//! Reads the examples of `WIRE.md`.

use std::collections::BTreeMap;

pub(crate) const DOCUMENT: &str = include_str!("../../../WIRE.md");

pub(crate) fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02X}")).collect::<Vec<_>>().join(" ")
}

/// Bytes from pairs of digits; `None` if the text has anything else.
pub(crate) fn pairs(text: &str) -> Option<Vec<u8>> {
    text.split_whitespace().map(|p| u8::from_str_radix(p, 16).ok().filter(|_| p.len() == 2)).collect()
}

pub(crate) fn section(from: &str, to: &str) -> &'static str {
    let at = DOCUMENT.find(from).expect(from);
    let rest = &DOCUMENT[at..];
    &rest[..rest.find(to).expect(to)]
}

/// The rows of a table: the first column, and the part in backticks of the second.
pub(crate) fn rows(section: &'static str) -> BTreeMap<&'static str, &'static str> {
    let row = |line: &'static str| {
        let (name, bytes) = line.strip_prefix("| ")?.strip_suffix("` |")?.rsplit_once(" | `")?;
        Some((name, bytes))
    };
    section.lines().filter_map(row).collect()
}

/// The frames of section 11: the bold name, and the lines of digits in the block after it.
pub(crate) fn frames(section: &'static str) -> BTreeMap<&'static str, Vec<u8>> {
    let mut frames = BTreeMap::new();
    let (mut name, mut is_open) = ("", false);
    for line in section.lines() {
        if let Some(rest) = line.strip_prefix("**") {
            name = rest.split("**").next().unwrap_or_default();
        } else if line.starts_with("```") {
            is_open = line != "```";
        } else if let Some(bytes) = pairs(line).filter(|_| is_open) {
            frames.entry(name).or_insert_with(Vec::new).extend(bytes);
        }
    }
    frames
}

/// Fails with all differences at once, so that a change of the wire can be copied into the document.
pub(crate) fn assert_same(found: BTreeMap<&str, Vec<u8>>, expected: Vec<(&str, Vec<u8>)>) {
    let mut differences: Vec<String> = expected
        .iter()
        .filter(|(name, bytes)| found.get(name) != Some(bytes))
        .map(|(name, bytes)| format!("{name}:\n{}", hex(bytes)))
        .collect();
    let checked = |name: &&&str| expected.iter().all(|(n, _)| n != *name);
    differences.extend(found.keys().filter(checked).map(|name| format!("no test has: {name}")));
    assert!(differences.is_empty(), "WIRE.md and the code differ:\n{}", differences.join("\n"));
}
