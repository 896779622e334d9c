//! The name and the colour of a class.

use crate::map::MAX_LABEL;

/// The highest number of a class. Its label is one more, because label 0 means "unexplored".
pub const MAX_CLASS: u8 = MAX_LABEL - 1;

/// The name and the colour of a label.
///
/// ```text
///  0                   1                   2                   3
///  0 1 2 3 4 5 6 7 8 9 0 1 2 3 4 5 6 7 8 9 0 1 2 3 4 5 6 7 8 9 0 1
/// +-+-+-----------+---------------+---------------+---------------+
/// |C|0| n - 1     | red           | green         | blue          | name, n bytes
/// +-+-+-----------+---------------+---------------+---------------+
/// ```
/// * C: 1 = there is a colour; else the three bytes of it are left out.
/// * n: 1 to 60; the name is UTF-8 without control characters.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ClassEntry {
    label: u8,
    name: String,
    colour: Option<[u8; 3]>,
}

impl ClassEntry {
    /// Most bytes of a name.
    pub const MAX_NAME: usize = 60;
    /// Most bytes of an entry.
    pub const MAX_BYTES: usize = 4 + Self::MAX_NAME;

    /// The entry of a label from 1 to 254; `None` if label or name is out of range.
    pub fn new(label: u8, name: &str, colour: Option<[u8; 3]>) -> Option<Self> {
        let is_named = (1..=Self::MAX_NAME).contains(&name.len()) && !name.chars().any(char::is_control);
        let is_sound = is_named && (1..=MAX_LABEL).contains(&label);
        is_sound.then(|| Self { label, name: name.to_owned(), colour })
    }

    /// The label of a class, which is one more; `None` above [`MAX_CLASS`].
    pub fn label_of(class: u8) -> Option<u8> {
        (class <= MAX_CLASS).then(|| class + 1)
    }

    /// The label that it names.
    pub fn label(&self) -> u8 {
        self.label
    }

    /// Its name for people: 1 to 60 bytes of UTF-8 without control characters.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Its colour as red, green and blue, if it has one.
    pub fn colour(&self) -> Option<[u8; 3]> {
        self.colour
    }

    /// Its bytes without the label.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut out = vec![u8::from(self.colour.is_some()) << 7 | (self.name.len() as u8 - 1)];
        out.extend(self.colour.into_iter().flatten());
        out.extend(self.name.bytes());
        out
    }

    /// Reads [`Self::to_bytes`]; `None` if they make no sound entry.
    pub fn from_bytes(label: u8, bytes: &[u8]) -> Option<Self> {
        let (&head, rest) = bytes.split_first()?;
        let (colour, name) = match head & 0x80 != 0 {
            true => rest.split_first_chunk::<3>().map(|(&colour, name)| (Some(colour), name))?,
            false => (None, rest),
        };
        let is_whole = head & 0x40 == 0 && name.len() == usize::from(head & 0x3F) + 1;
        Self::new(label, std::str::from_utf8(name).ok().filter(|_| is_whole)?, colour)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn golden_bytes_of_class_entries() {
        for (entry, bytes) in [
            (
                ClassEntry::new(3, "sand", Some([0xE0, 0xC0, 0x80])).unwrap(),
                &[0x83, 0xE0, 0xC0, 0x80, b's', b'a', b'n', b'd'][..],
            ),
            (ClassEntry::new(254, "é", None).unwrap(), &[0x01, 0xC3, 0xA9]),
        ] {
            assert_eq!(entry.to_bytes(), bytes);
            assert_eq!(ClassEntry::from_bytes(entry.label(), bytes), Some(entry));
        }
        assert!(ClassEntry::new(0, "x", None).is_none() && ClassEntry::new(255, "x", None).is_none());
        assert!(ClassEntry::new(1, "", None).is_none() && ClassEntry::new(1, "a\nb", None).is_none());
        assert!(
            ClassEntry::new(1, &"x".repeat(60), None).is_some() && ClassEntry::new(1, &"x".repeat(61), None).is_none()
        );
        assert_eq!(
            (ClassEntry::label_of(0), ClassEntry::label_of(253), ClassEntry::label_of(254)),
            (Some(1), Some(254), None)
        );
    }

    proptest! {
        #[test]
        fn any_bytes_are_an_entry_or_are_refused(label in any::<u8>(), bytes in proptest::collection::vec(any::<u8>(), 0..50)) {
            if let Some(entry) = ClassEntry::from_bytes(label, &bytes) {
                prop_assert_eq!(entry.to_bytes(), bytes);
            }
        }
    }
}
