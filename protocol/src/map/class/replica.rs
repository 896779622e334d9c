//! The surface's side: the names that have arrived.

use super::{ClassChunk, ClassEntry};
use crate::map::{TextAssembly, TextPart};
use std::collections::BTreeMap;

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

#[cfg(test)]
mod tests {
    use super::super::ClassSource;
    use super::*;
    use proptest::prelude::*;

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
