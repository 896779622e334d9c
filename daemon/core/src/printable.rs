//! Texts from outside, made safe for a terminal.

use std::borrow::Cow;
use std::fmt::Write;

/// The text with each control character but line feed and tab, and each character that changes the direction of writing, as
/// `\uXXXX`. A name could otherwise move the cursor, or show one word in place of another. In JSON the text stays the same value.
pub fn printable(text: &str) -> Cow<'_, str> {
    if !text.chars().any(is_unsafe) {
        return Cow::Borrowed(text);
    }
    let mut out = String::with_capacity(text.len());
    for character in text.chars() {
        match is_unsafe(character) {
            // All of them have four digits.
            true => drop(write!(out, "\\u{:04x}", u32::from(character))),
            false => out.push(character),
        }
    }
    Cow::Owned(out)
}

fn is_unsafe(character: char) -> bool {
    let turns =
        matches!(character, '\u{61C}' | '\u{200E}' | '\u{200F}' | '\u{202A}'..='\u{202E}' | '\u{2066}'..='\u{2069}');
    turns || character.is_control() && !matches!(character, '\n' | '\t')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_moves_no_cursor_and_turns_no_line_around() {
        assert_eq!(printable("Plattfisch\n\tπλάτος"), "Plattfisch\n\tπλάτος");
        assert_eq!(printable("a\u{1b}[2Jb\u{9b}31m\r\u{7f}"), "a\\u001b[2Jb\\u009b31m\\u000d\\u007f");
        assert_eq!(printable("hold\u{202e}emuser\u{2069}"), "hold\\u202eemuser\\u2069");
    }
}
