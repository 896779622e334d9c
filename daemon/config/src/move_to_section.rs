//! A key of a file that belongs to another section now.

use std::ops::Range;
use toml::de::DeTable;

/// A part of the text, and its replacement.
pub(crate) struct Edit {
    pub at: Range<usize>,
    pub by: String,
}

/// Moves the key at `at`, whose name takes `name_len` bytes, to a section under a new name, with the comments on its line and
/// above it. `None` if the key or the section is not written on lines of its own.
pub(crate) fn move_to_section(
    text: &str,
    table: &DeTable<'_>,
    at: &Range<usize>,
    name_len: usize,
    (section, name): (&str, &str),
) -> Option<[Edit; 2]> {
    let own = line_start(text, at.start);
    let indent = text.get(own..at.start).filter(|before| before.trim().is_empty())?;
    let mut begin = own;
    while begin > 0 {
        let above = line_start(text, begin - 1);
        if !text.get(above..begin)?.trim_start().starts_with('#') {
            break;
        }
        begin = above;
    }
    let end = line_end(text, at.end);
    let (comments, value) = (text.get(begin..own)?, text.get(at.start + name_len..end)?);
    let entry = format!("{comments}{indent}{name}{}\n", value.trim_end());
    let header = table.keys().find(|found| found.get_ref() == section).map(|found| found.span().start);
    let (place, entry) = match header {
        Some(header) if text.get(line_start(text, header)..header)?.trim() == "[" => (line_end(text, header), entry),
        Some(_) => return None,
        None => (text.len(), format!("{}\n[{section}]\n{entry}", if text.ends_with('\n') { "" } else { "\n" })),
    };
    Some([Edit { at: begin..end, by: String::new() }, Edit { at: place..place, by: entry }])
}

fn line_start(text: &str, at: usize) -> usize {
    text.get(..at).and_then(|before| before.rfind('\n')).map_or(0, |at| at + 1)
}

/// The place after the end of the line.
fn line_end(text: &str, at: usize) -> usize {
    text.get(at..).and_then(|rest| rest.find('\n')).map_or(text.len(), |end| at + end + 1)
}
