//! Names and colours of labels that the vehicle did not learn: the classes of another program.
//!
//! The vehicle announces each once in a pair of runs. The map itself does not depend on them.

use crate::map::{MAX_LABEL, TextAssembly, TextPart, TextSender};
use std::collections::BTreeMap;

/// A part of the entry of a label.
///
/// ```text
///  0                   1                   2                   3
///  0 1 2 3 4 5 6 7 8 9 0 1 2 3 4 5 6 7 8 9 0 1 2 3 4 5 6 7 8 9 0 1
/// +---------------+-------------------------------+-+-+-----------+
/// | label         | digest of the entry           |L|W| first     | bytes ...
/// +---------------+-------------------------------+-+-+-----------+
/// ```
/// * label: 1 to 254.
/// * from the digest of the entry on: a part of it ([`TextPart`]).
///
/// Source: vehicle, for each label with a name, before or after the cells that have it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ClassChunk<'a> {
    /// The label of the entry.
    pub label: u8,
    /// A part of the entry, whose digest is [`TextPart::digest_of`].
    pub part: TextPart<'a>,
}

impl<'a> ClassChunk<'a> {
    /// Bytes before the part: the label of the entry.
    pub const HEAD: usize = 1;

    /// Reads a chunk; `None` if it makes no sense.
    pub fn decode(bytes: &'a [u8]) -> Option<Self> {
        let (&label, part) = bytes.split_first()?;
        let part = TextPart::decode(part)?;
        (1..=MAX_LABEL).contains(&label).then_some(Self { label, part })
    }

    /// The bytes of the chunk.
    pub fn encode(&self) -> Vec<u8> {
        [&[self.label], &self.part.encode()[..]].concat()
    }
}

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

/// Names and colours of labels. A label keeps its first name.
#[derive(Debug, Default)]
pub struct ClassReplica {
    entries: BTreeMap<u8, ClassEntry>,
    parts: BTreeMap<u8, TextAssembly>,
}

impl ClassReplica {
    /// The entry of a label.
    pub fn get(&self, label: u8) -> Option<&ClassEntry> {
        self.entries.get(&label)
    }

    /// The entries that are complete, in the order of their labels.
    pub fn iter(&self) -> impl Iterator<Item = &ClassEntry> {
        self.entries.values()
    }

    /// Takes a chunk. `None` if it makes no sense, or does not continue the parts that are here; else whether an entry is
    /// complete with it.
    pub fn handle_chunk(&mut self, chunk: &[u8]) -> Option<bool> {
        let ClassChunk { label, part } = ClassChunk::decode(chunk)?;
        if let Some(entry) = self.get(label) {
            return (TextPart::digest_of(&entry.to_bytes()) == part.digest).then_some(false);
        }
        let whole = self.parts.entry(label).or_default().take(&part, ClassEntry::MAX_BYTES)?;
        let Some(bytes) = whole else { return Some(false) };
        self.parts.remove(&label);
        self.entries.insert(label, ClassEntry::from_bytes(label, &bytes)?);
        Some(true)
    }
}

/// Names and colours of labels, each sent until it is known to have arrived. Of each label at most one part is on the air.
#[derive(Debug, Default)]
pub struct ClassSource(BTreeMap<u8, (ClassEntry, TextSender)>);

impl ClassSource {
    /// Adds an entry. A label keeps its first name, because it never changes its meaning: returns whether this entry is the
    /// one that is sent.
    pub fn add(&mut self, entry: &ClassEntry) -> bool {
        let label = entry.label();
        let (first, _) = self.0.entry(label).or_insert_with(|| (entry.clone(), TextSender::new(entry.to_bytes())));
        first == entry
    }

    /// The entries, sent or not, in the order of their labels.
    pub fn entries(&self) -> impl Iterator<Item = &ClassEntry> {
        self.0.values().map(|(entry, _)| entry)
    }

    /// Forgets all entries, because labels change their meaning.
    pub fn clear(&mut self) {
        self.0.clear();
    }

    /// The next chunk of at most `room` bytes, its label, and how many bytes of the entry it has.
    pub fn next_chunk(&mut self, room: usize) -> Option<(Vec<u8>, (u8, usize))> {
        let room = room.checked_sub(ClassChunk::HEAD)?;
        let (label, (part, n)) = self.0.iter_mut().find_map(|(&l, (_, sender))| Some((l, sender.next_part(room)?)))?;
        Some((ClassChunk { label, part: TextPart::decode(&part)? }.encode(), (label, n)))
    }

    /// The fate of the chunk of a label, which has `bytes` of the entry, is known.
    pub fn handle_fate(&mut self, (label, bytes): (u8, usize), delivered: bool) {
        if let Some((_, sender)) = self.0.get_mut(&label) {
            sender.handle_fate(bytes, delivered);
        }
    }

    /// The surface holds none of the entries any more.
    pub fn handle_peer_restart(&mut self) {
        self.0.values_mut().for_each(|(_, sender)| sender.handle_peer_restart());
    }

    /// Bytes that may be sent now.
    pub fn backlog_bytes(&self) -> usize {
        let waiting = self.0.values().map(|(_, sender)| sender.backlog_bytes());
        waiting.filter(|&bytes| bytes > 0).map(|bytes| bytes + ClassChunk::HEAD).sum()
    }

    /// Whether the surface is known to hold every entry.
    pub fn is_converged(&self) -> bool {
        self.0.values().all(|(_, sender)| sender.is_complete())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn golden_bytes_of_a_class_chunk() {
        let part = TextPart { digest: 0xBEEF, first: 8, is_last: true, bytes: &[1, 2] };
        let chunk = ClassChunk { label: 3, part };
        assert_eq!(chunk.encode(), [3, 0xBE, 0xEF, 0x88, 1, 2]);
        assert_eq!(ClassChunk::decode(&chunk.encode()), Some(chunk));
        for bytes in [&[][..], &[3, 0xBE, 0xEF, 0x88], &[0, 0, 0, 0, 1], &[255, 0, 0, 0, 1], &[3, 0, 0, 0x40, 1]] {
            assert_eq!(ClassChunk::decode(bytes), None, "{bytes:02X?}");
        }
    }

    proptest! {
        #[test]
        fn a_class_chunk_reads_back(bytes in proptest::collection::vec(any::<u8>(), 0..12)) {
            if let Some(chunk) = ClassChunk::decode(&bytes) {
                prop_assert_eq!(chunk.encode(), bytes);
            }
        }
    }

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

    fn entry(label: u8, name: &str) -> ClassEntry {
        ClassEntry::new(label, name, Some([label, 2, 3])).unwrap()
    }

    proptest! {
        #[test]
        fn names_arrive_whatever_is_lost(rooms in proptest::collection::vec((10usize..60, any::<bool>()), 40..80)) {
            let (mut source, mut replica) = (ClassSource::default(), ClassReplica::default());
            let entries = [entry(1, "sand"), entry(9, &"x".repeat(60)), entry(254, "Posidonia oceanica")];
            entries.iter().for_each(|e| assert!(source.add(e)));
            for (room, is_delivered) in rooms.into_iter().chain([(60, true); 20]) {
                let Some((chunk, carried)) = source.next_chunk(room) else { continue };
                prop_assert!(chunk.len() <= room);
                if is_delivered {
                    prop_assert!(replica.handle_chunk(&chunk).is_some());
                }
                source.handle_fate(carried, is_delivered);
            }
            prop_assert!(source.is_converged() && source.backlog_bytes() == 0);
            prop_assert!(replica.iter().eq(&entries));
        }

        #[test]
        fn any_class_chunk_is_taken_or_refused(chunks in proptest::collection::vec(proptest::collection::vec(any::<u8>(), 0..60), 0..9)) {
            let mut replica = ClassReplica::default();
            for chunk in &chunks {
                let _ = replica.handle_chunk(chunk);
            }
        }
    }

    #[test]
    fn a_label_keeps_its_first_name() {
        let (mut source, mut replica) = (ClassSource::default(), ClassReplica::default());
        assert!(source.add(&entry(4, "rock")) && source.add(&entry(4, "rock")) && !source.add(&entry(4, "mud")));
        let (chunk, carried) = source.next_chunk(60).unwrap();
        assert!(source.next_chunk(60).is_none(), "one part at a time");
        assert_eq!((replica.handle_chunk(&chunk), replica.handle_chunk(&chunk)), (Some(true), Some(false)));
        source.handle_fate(carried, true);
        let mut other = ClassSource::default();
        other.add(&entry(4, "mud"));
        let (chunk, _) = other.next_chunk(60).unwrap();
        assert_eq!((replica.handle_chunk(&chunk), replica.get(4).map(ClassEntry::name)), (None, Some("rock")));
        source.handle_peer_restart();
        assert!(!source.is_converged());
        assert_eq!(source.next_chunk(60).map(|(_, carried)| carried), Some((4, 8)));
    }
}
