//! The vehicle's side: which names the surface is known to hold.

use super::{ClassChunk, ClassEntry};
use crate::map::{TextPart, TextSender};
use std::collections::BTreeMap;

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
