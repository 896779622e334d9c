//! The text of a key file.

use super::MissionKey;
use zeroize::Zeroizing;

const VERSION: &str = "1";

/// Why a text is not a key file.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum KeyError {
    /// There are only comments and empty lines.
    #[error("there is no key in it: one line is expected, scenecast-key 1 KEY CHECK")]
    Missing,
    /// A line is neither a key nor a comment.
    #[error("line {line}: this is no key: expected is scenecast-key 1 KEY CHECK, or a comment after #")]
    NotAKey {
        /// Number of the line, from 1.
        line: usize,
    },
    /// A key has another version of the format.
    #[error(
        "line {line}: this is a key of another version; this is version {VERSION}, written scenecast-key {VERSION}"
    )]
    Version {
        /// Number of the line, from 1.
        line: usize,
    },
    /// A key or its check has another length or other characters than hexadecimal digits.
    #[error("line {line}: expected are 32 hexadecimal digits of key and 8 of check")]
    Digits {
        /// Number of the line, from 1.
        line: usize,
    },
    /// The check belongs to another key.
    #[error("line {line}: the check does not fit the key: a digit is wrong; copy the file again")]
    Check {
        /// Number of the line, from 1.
        line: usize,
    },
    /// The file has a second key.
    #[error("line {line}: this is a second key; one is allowed")]
    Second {
        /// Number of the line, from 1.
        line: usize,
    },
}

impl MissionKey {
    /// Parses a key file: one line `scenecast-key 1 KEY CHECK`, empty lines, and comments after `#`.
    ///
    /// KEY has 32 hexadecimal digits. CHECK has 8, the key's fingerprint.
    pub fn parse(text: &str) -> Result<Self, KeyError> {
        let mut key = None;
        for (line, content) in text.trim_start_matches('\u{FEFF}').lines().enumerate() {
            let (line, content) = (line + 1, content.trim());
            if content.is_empty() || content.starts_with('#') {
                continue;
            }
            if key.is_some() {
                return Err(KeyError::Second { line });
            }
            key = Some(parse_line(content, line)?);
        }
        key.ok_or(KeyError::Missing)
    }

    /// The text of a key file, one line. It holds the secret and is wiped from memory when dropped.
    pub fn to_text(&self) -> Zeroizing<String> {
        let key = u128::from_be_bytes(*self.bytes());
        Zeroizing::new(format!("scenecast-key {VERSION} {key:032x} {:08x}\n", self.fingerprint()))
    }
}

fn parse_line(content: &str, line: usize) -> Result<MissionKey, KeyError> {
    let mut words = content.split_whitespace();
    if words.next() != Some("scenecast-key") {
        return Err(KeyError::NotAKey { line });
    }
    let version = words.next().ok_or(KeyError::NotAKey { line })?;
    if version != VERSION {
        return Err(KeyError::Version { line });
    }
    let (Some(key), Some(check), None) = (words.next(), words.next(), words.next()) else {
        return Err(KeyError::Digits { line });
    };
    let key = hex(key, 32).ok_or(KeyError::Digits { line })?;
    let check = hex(check, 8).ok_or(KeyError::Digits { line })?;
    let key = MissionKey::from_bytes(key.to_be_bytes());
    if u128::from(key.fingerprint()) != check {
        return Err(KeyError::Check { line });
    }
    Ok(key)
}

/// The value of exactly `digits` hexadecimal digits.
fn hex(text: &str, digits: usize) -> Option<u128> {
    let plain = text.len() == digits && text.bytes().all(|b| b.is_ascii_hexdigit());
    plain.then(|| u128::from_str_radix(text, 16).ok()).flatten()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn error(text: &str) -> Option<KeyError> {
        MissionKey::parse(text).err()
    }

    fn line() -> String {
        MissionKey::from_bytes(*b"0123456789abcdef").to_text().trim().to_owned()
    }

    #[test]
    fn comments_and_empty_lines_are_allowed() {
        let text = format!("# both ends of reef-3\r\n\r\n  {}\t\r\n# end", line().to_uppercase());
        let text = text.replace("SCENECAST-KEY", "scenecast-key");
        assert_eq!(MissionKey::parse(&text).unwrap().bytes(), b"0123456789abcdef");
    }

    #[test]
    fn every_error_names_its_line_and_the_allowed_form() {
        assert_eq!(error(""), Some(KeyError::Missing));
        assert_eq!(error("# a\n#b"), Some(KeyError::Missing));
        assert_eq!(error("\nhello"), Some(KeyError::NotAKey { line: 2 }));
        assert_eq!(error("scenecast-key"), Some(KeyError::NotAKey { line: 1 }));
        assert_eq!(error("scenecast-key 2 00 00"), Some(KeyError::Version { line: 1 }));
        assert_eq!(error("scenecast-key 1 00 00"), Some(KeyError::Digits { line: 1 }));
        assert_eq!(error("scenecast-key 1"), Some(KeyError::Digits { line: 1 }));
        assert_eq!(error(&format!("{} 00", line())), Some(KeyError::Digits { line: 1 }));
        assert_eq!(error(&line().replace("key 1 3", "key 1 +")), Some(KeyError::Digits { line: 1 }));
        assert_eq!(error(&format!("{}\n{}", line(), line())), Some(KeyError::Second { line: 2 }));
        let said = error(&line().replace("key 1 3", "key 1 4")).unwrap();
        assert_eq!(said.to_string(), "line 1: the check does not fit the key: a digit is wrong; copy the file again");
    }

    proptest! {
        #[test]
        fn a_key_comes_back_from_its_text(bytes: [u8; 16]) {
            let text = MissionKey::from_bytes(bytes).to_text();
            let key = MissionKey::parse(&text).unwrap();
            prop_assert_eq!(key.bytes(), &bytes);
        }

        #[test]
        fn any_text_is_read_or_refused(text in any::<String>(), tail in "[ 0-9a-f]{0,60}") {
            let _ = MissionKey::parse(&text);
            let _ = MissionKey::parse(&format!("scenecast-key 1 {tail}"));
        }

        #[test]
        fn a_wrong_digit_is_noticed(bytes: [u8; 16], at in 16usize..57, digit in "[0-9a-f]") {
            let text = MissionKey::from_bytes(bytes).to_text();
            let mut wrong = text.to_string();
            prop_assume!(&text[at..=at] != " " && text[at..=at] != digit);
            wrong.replace_range(at..=at, &digit);
            let line = 1;
            prop_assert_eq!(MissionKey::parse(&wrong).err(), Some(KeyError::Check { line }));
        }
    }
}
