//! The vehicle's side: which names the surface is known to hold.

use super::{ClassChunk, ClassEntry};
use std::collections::BTreeMap;

/// An entry on its way.
#[derive(Debug)]
struct Announced {
    entry: ClassEntry,
    bytes: Vec<u8>,
    digest: u16,
    /// Bytes that the surface is known to hold.
    held: usize,
    is_on_air: bool,
}

impl Announced {
    fn missing(&self) -> usize {
        self.bytes.len() - self.held
    }
}

/// Names and colours of labels, each sent until it is known to have arrived. Of each label at most one part is on the air.
#[derive(Debug, Default)]
pub struct ClassSource(BTreeMap<u8, Announced>);

impl ClassSource {
    /// Fewer bytes of an entry are not worth the head of a chunk, unless they are the last ones.
    const MIN_PART: usize = 6;

    /// Adds an entry. A label keeps its first name, because it never changes its meaning: returns whether this entry is the
    /// one that is sent.
    pub fn add(&mut self, entry: &ClassEntry) -> bool {
        let announced = self.0.entry(entry.label()).or_insert_with(|| {
            let bytes = entry.to_bytes();
            let digest = ClassEntry::digest_of(entry.label(), &bytes);
            Announced { entry: entry.clone(), bytes, digest, held: 0, is_on_air: false }
        });
        announced.entry == *entry
    }

    /// The entries, by label.
    pub fn entries(&self) -> impl Iterator<Item = &ClassEntry> {
        self.0.values().map(|announced| &announced.entry)
    }

    /// Forgets all entries, because labels change their meaning.
    pub fn clear(&mut self) {
        self.0.clear();
    }

    /// The next chunk of at most `room` bytes, its label, and how many bytes of the entry it has.
    pub fn next_chunk(&mut self, room: usize) -> Option<(Vec<u8>, (u8, usize))> {
        let room = room.checked_sub(ClassChunk::HEAD)?;
        let fits = |a: &Announced| room >= a.missing() || room >= Self::MIN_PART;
        let waiting = self.0.iter_mut().filter(|(_, a)| a.missing() > 0 && !a.is_on_air);
        let (&label, announced) = waiting.into_iter().find(|(_, a)| fits(a))?;
        let (held, n) = (announced.held, room.min(announced.missing()));
        let bytes = announced.bytes.get(held..held + n).filter(|bytes| !bytes.is_empty())?;
        let (first, is_last) = (held as u8, n == announced.missing());
        let chunk = ClassChunk { label, digest: announced.digest, first, is_last, bytes }.encode();
        announced.is_on_air = true;
        Some((chunk, (label, n)))
    }

    /// The fate of the chunk of a label, which has `bytes` of the entry, is known.
    pub fn handle_fate(&mut self, (label, bytes): (u8, usize), delivered: bool) {
        if let Some(announced) = self.0.get_mut(&label).filter(|announced| announced.is_on_air) {
            announced.is_on_air = false;
            announced.held += if delivered { bytes.min(announced.missing()) } else { 0 };
        }
    }

    /// The surface holds none of the entries any more.
    pub fn handle_peer_restart(&mut self) {
        self.0.values_mut().for_each(|announced| (announced.held, announced.is_on_air) = (0, false));
    }

    /// Bytes that may be sent now.
    pub fn backlog_bytes(&self) -> usize {
        let waiting = self.0.values().filter(|a| !a.is_on_air && a.missing() > 0);
        waiting.map(|a| a.missing() + ClassChunk::HEAD).sum()
    }

    /// Whether the surface is known to hold every entry.
    pub fn is_converged(&self) -> bool {
        self.0.values().all(|announced| announced.missing() == 0)
    }
}
