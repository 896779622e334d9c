//! The text of a key file.

use super::ascon::{join, prf};
use super::key::{HeldKey, LinkKey, MissionKey, VehicleKey};
use zeroize::Zeroizing;

const VERSION: &str = "2";
/// The nonce of the check of a vehicle's line, under the key of its link.
const CHECK: &[u8; 16] = b"scenecast-check1";
const OF_MISSION: &str = "scenecast-key";
const OF_VEHICLE: &str = "scenecast-vehicle-key";
const NEXT: &str = "scenecast-next-key";

/// Why a text is not a key file.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum KeyError {
    /// There are only comments and empty lines.
    #[error("there is no key in it: one line is expected, {OF_MISSION} {VERSION} ... or {OF_VEHICLE} {VERSION} ...")]
    Missing,
    /// A line is neither a key nor a comment.
    #[error(
        "line {line}: this is no key: expected is {OF_MISSION} {VERSION} KEY CHECK, or \
         {OF_VEHICLE} {VERSION} ADDRESS KEY CALLS MISSION CHECK, or a comment after #"
    )]
    NotAKey {
        /// Number of the line, from 1.
        line: usize,
    },
    /// A key has another version of the format.
    #[error("line {line}: this is a key of another version; this is version {VERSION}; scenecast key new makes one")]
    Version {
        /// Number of the line, from 1.
        line: usize,
    },
    /// A key, its check or an address has another length or other characters than expected.
    #[error(
        "line {line}: a word is wrong: expected are 32 hexadecimal digits of each key, 8 of each check, and an address \
         from 1 to 14"
    )]
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
    /// The file has a second key, or a second next one.
    #[error("line {line}: this is a second key; one is allowed")]
    Second {
        /// Number of the line, from 1.
        line: usize,
    },
    /// The file has the key of a vehicle where that of the mission is needed.
    #[error("this is the key of a vehicle; the key of the mission is needed here")]
    OfVehicle,
}

/// What a key file holds.
#[derive(Debug, Clone)]
pub struct KeyFile {
    /// The key in use, of the mission or of one vehicle.
    pub key: HeldKey,
    /// The next key of the mission, which the surface offers to its vehicles.
    pub next: Option<MissionKey>,
}

impl KeyFile {
    /// Parses a key file: one line of a key, at a surface one of the next key after it, empty lines, and comments after `#`. The
    /// lines are
    ///
    /// ```text
    /// scenecast-key 2 KEY CHECK
    /// scenecast-next-key 2 KEY CHECK
    /// scenecast-vehicle-key 2 ADDRESS KEY CALLS MISSION CHECK
    /// ```
    ///
    /// KEY and CALLS have 32 hexadecimal digits, CHECK and MISSION 8: MISSION is the fingerprint of the mission key, CHECK that of
    /// the line's own keys. ADDRESS is decimal, 1 to 14.
    pub fn parse(text: &str) -> Result<Self, KeyError> {
        let (mut key, mut next) = (None, None);
        for (line, content) in text.trim_start_matches('\u{FEFF}').lines().enumerate() {
            let (line, content) = (line + 1, content.trim());
            if content.is_empty() || content.starts_with('#') {
                continue;
            }
            let is_next = content.split_whitespace().next() == Some(NEXT);
            if is_next && !matches!(key, Some(HeldKey::Mission(_))) {
                return Err(KeyError::NotAKey { line });
            }
            if if is_next { next.is_some() } else { key.is_some() } {
                return Err(KeyError::Second { line });
            }
            match parse_line(content, line)? {
                HeldKey::Mission(parsed) if is_next => next = Some(parsed),
                parsed => key = Some(parsed),
            }
        }
        Ok(Self { key: key.ok_or(KeyError::Missing)?, next })
    }
}

impl HeldKey {
    /// Parses a key file that has one key, see [`KeyFile::parse`].
    pub fn parse(text: &str) -> Result<Self, KeyError> {
        let file = KeyFile::parse(text)?;
        if file.next.is_some() {
            return Err(KeyError::Second { line: text.lines().count() });
        }
        Ok(file.key)
    }
}

impl MissionKey {
    /// Parses the key file of a mission, see [`KeyFile::parse`].
    pub fn parse(text: &str) -> Result<Self, KeyError> {
        match HeldKey::parse(text)? {
            HeldKey::Mission(key) => Ok(key),
            HeldKey::Vehicle(_) => Err(KeyError::OfVehicle),
        }
    }

    /// The text of a key file, one line. It holds the secret and is wiped from memory when dropped.
    pub fn to_text(&self) -> Zeroizing<String> {
        self.to_line(OF_MISSION)
    }

    /// The line of a key file that has this key as the next one.
    pub fn to_next_text(&self) -> Zeroizing<String> {
        self.to_line(NEXT)
    }

    fn to_line(&self, kind: &str) -> Zeroizing<String> {
        let key = u128::from_be_bytes(*self.bytes());
        Zeroizing::new(format!("{kind} {VERSION} {key:032x} {:08x}\n", self.fingerprint()))
    }
}

impl VehicleKey {
    /// The text of a key file, one line. It holds the secrets and is wiped from memory when dropped.
    pub fn to_text(&self) -> Zeroizing<String> {
        let [link, calls] = [&self.link, &self.calls].map(|key| u128::from_be_bytes(*key.bytes()));
        let (address, mission, check) = (self.address, self.mission, self.check());
        Zeroizing::new(format!("{OF_VEHICLE} {VERSION} {address} {link:032x} {calls:032x} {mission:08x} {check:08x}\n"))
    }

    /// A check of the whole line.
    fn check(&self) -> u32 {
        let line = join(&[&[self.address], self.calls.bytes(), &self.mission.to_be_bytes()]);
        let [a, b, c, d, ..] = *prf(self.link.bytes(), CHECK, &line);
        u32::from_be_bytes([a, b, c, d])
    }
}

fn parse_line(content: &str, line: usize) -> Result<HeldKey, KeyError> {
    let mut words = content.split_whitespace();
    let kind =
        words.next().filter(|kind| [OF_MISSION, OF_VEHICLE, NEXT].contains(kind)).ok_or(KeyError::NotAKey { line })?;
    let version = words.next().ok_or(KeyError::NotAKey { line })?;
    if version != VERSION {
        return Err(KeyError::Version { line });
    }
    let words: Vec<&str> = words.take(6).collect();
    let (key, check, found) = match (kind, &words[..]) {
        (OF_MISSION | NEXT, [key, check]) => {
            let key = MissionKey::from_bytes(secret(key, line)?);
            let found = key.fingerprint();
            (HeldKey::Mission(key), check, found)
        }
        (OF_VEHICLE, [address, link, calls, mission, check]) => {
            let address = address.parse().ok().filter(|address| (1..=14).contains(address));
            let key = VehicleKey {
                address: address.ok_or(KeyError::Digits { line })?,
                mission: fingerprint(mission, line)?,
                link: LinkKey::from_bytes(secret(link, line)?),
                calls: LinkKey::from_bytes(secret(calls, line)?),
            };
            let found = key.check();
            (HeldKey::Vehicle(key), check, found)
        }
        _ => return Err(KeyError::Digits { line }),
    };
    if fingerprint(check, line)? != found { Err(KeyError::Check { line }) } else { Ok(key) }
}

fn secret(text: &str, line: usize) -> Result<[u8; 16], KeyError> {
    hex(text, 32).map(u128::to_be_bytes).ok_or(KeyError::Digits { line })
}

fn fingerprint(text: &str, line: usize) -> Result<u32, KeyError> {
    hex(text, 8).map(|value| value as u32).ok_or(KeyError::Digits { line })
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
        assert_eq!(error("scenecast-key 1 00 00"), Some(KeyError::Version { line: 1 }));
        assert_eq!(error("scenecast-key 2 00 00"), Some(KeyError::Digits { line: 1 }));
        assert_eq!(error("scenecast-key 2"), Some(KeyError::Digits { line: 1 }));
        assert_eq!(error(&format!("{} 00", line())), Some(KeyError::Digits { line: 1 }));
        assert_eq!(error(&line().replace("key 2 3", "key 2 +")), Some(KeyError::Digits { line: 1 }));
        assert_eq!(error(&format!("{}\n{}", line(), line())), Some(KeyError::Second { line: 2 }));
        let said = error(&line().replace("key 2 3", "key 2 4")).unwrap();
        assert_eq!(said.to_string(), "line 1: the check does not fit the key: a digit is wrong; copy the file again");
    }

    #[test]
    fn the_next_key_of_a_mission_follows_its_present_one() {
        let next = MissionKey::from_bytes([2; 16]);
        let both = format!("{}\n# since Monday\n{}", line(), *next.to_next_text());
        let file = KeyFile::parse(&both).unwrap();
        assert_eq!(file.next.map(|next| next.fingerprint()), Some(next.fingerprint()));
        let refused = |text: &str| KeyFile::parse(text).err();
        assert_eq!(refused(&next.to_next_text()), Some(KeyError::NotAKey { line: 1 }));
        assert_eq!(refused(&format!("{both}{}", *next.to_next_text())), Some(KeyError::Second { line: 4 }));
        let of_vehicle = VehicleKey::derive(&next, 1).to_text();
        assert_eq!(refused(&format!("{}{}", *of_vehicle, *next.to_next_text())), Some(KeyError::NotAKey { line: 2 }));
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
            let _ = HeldKey::parse(&format!("scenecast-key 2 {tail}"));
            let _ = HeldKey::parse(&format!("scenecast-vehicle-key 2 {tail}"));
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

        #[test]
        fn keys_of_a_vehicle_read_back_and_a_wrong_digit_is_noticed(
            bytes: [u8; 16], address in 1u8..=14, at in 22usize..108, digit in "[0-9a-f]",
        ) {
            let key = VehicleKey::derive(&MissionKey::from_bytes(bytes), address);
            let text = key.to_text();
            let HeldKey::Vehicle(read) = HeldKey::parse(&text).unwrap() else { panic!("{text:?}") };
            prop_assert_eq!((read.address, read.mission, read.link.bytes()), (address, key.mission, key.link.bytes()));
            prop_assert_eq!(read.calls.bytes(), key.calls.bytes());
            prop_assert_eq!(MissionKey::parse(&text).err(), Some(KeyError::OfVehicle));
            let mut wrong = text.to_string();
            let at = at.min(wrong.len() - 2);
            prop_assume!(&text[at..=at] != " " && text[at..=at] != digit);
            wrong.replace_range(at..=at, &digit);
            prop_assert!(HeldKey::parse(&wrong).is_err(), "{}", wrong);
        }
    }
}
