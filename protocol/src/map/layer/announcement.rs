//! How a layer's description reaches the surface before its levels.

use super::chunk::DescriptorPart;
use super::{LayerChunk, LayerDescriptor, LayerId};

/// The vehicle's side: sends the description in parts that fit the frames, each until it is known to have arrived, one at a
/// time. Levels follow once the surface is known to hold all of it, so that each chunk of them decodes on its own.
#[derive(Debug)]
pub(super) struct Announcement {
    bytes: Vec<u8>,
    digest: u16,
    /// Bytes that the surface is known to hold.
    held: usize,
    is_on_air: bool,
}

impl Announcement {
    /// Fewer bytes of a description are not worth the head of a chunk, unless they are the last ones.
    const MIN_PART: usize = 8;

    pub(super) fn new(descriptor: &LayerDescriptor) -> Self {
        Self { bytes: descriptor.to_bytes(), digest: descriptor.digest(), held: 0, is_on_air: false }
    }

    pub(super) fn digest(&self) -> u16 {
        self.digest
    }

    pub(super) fn is_complete(&self) -> bool {
        self.held == self.bytes.len()
    }

    /// Bytes of the chunk that may be sent now.
    pub(super) fn backlog_bytes(&self) -> usize {
        if self.is_on_air { 0 } else { self.bytes.len() - self.held + LayerChunk::DESCRIPTOR_HEAD }
    }

    /// The next chunk of at most `room` bytes, and how many of the description it has.
    pub(super) fn next_chunk(&mut self, id: LayerId, room: usize) -> Option<(Vec<u8>, usize)> {
        let rest = self.bytes.get(self.held..).filter(|rest| !rest.is_empty() && !self.is_on_air)?;
        let n = room.checked_sub(LayerChunk::DESCRIPTOR_HEAD)?.min(rest.len());
        let bytes = rest.get(..n).filter(|_| n >= Self::MIN_PART.min(rest.len()))?;
        let part = DescriptorPart { digest: self.digest, first: self.held as u8, is_last: n == rest.len(), bytes };
        self.is_on_air = true;
        Some((LayerChunk::Descriptor(id, part).encode(), n))
    }

    /// The fate of the chunk on the air, which has `bytes` of the description, is known.
    pub(super) fn handle_fate(&mut self, bytes: usize, delivered: bool) {
        self.is_on_air = false;
        self.held += if delivered { bytes } else { 0 };
    }

    pub(super) fn handle_peer_restart(&mut self) {
        (self.held, self.is_on_air) = (0, false);
    }
}

/// The surface's side: the parts that are here, from the first byte on.
#[derive(Debug, Default)]
pub struct Assembly {
    digest: u16,
    bytes: Vec<u8>,
}

impl Assembly {
    /// Takes a part. `None` if it does not continue the others, or if all of them together make no sound description; else
    /// the description, once it is whole.
    pub fn take(&mut self, part: &DescriptorPart<'_>) -> Option<Option<LayerDescriptor>> {
        if part.first == 0 {
            (self.digest, self.bytes) = (part.digest, Vec::new());
        }
        let fits = usize::from(part.first) == self.bytes.len() && part.digest == self.digest;
        if !fits || self.bytes.len() + part.bytes.len() > LayerDescriptor::MAX_BYTES {
            return None;
        }
        self.bytes.extend_from_slice(part.bytes);
        if !part.is_last {
            return Some(None);
        }
        let bytes = std::mem::take(&mut self.bytes);
        let descriptor = LayerDescriptor::from_bytes(&bytes);
        descriptor.filter(|_| LayerDescriptor::digest_of(&bytes) == self.digest).map(Some)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map::layer::BUILT_IN_LAYERS;

    fn take(assembly: &mut Assembly, chunk: &[u8]) -> Option<Option<LayerDescriptor>> {
        let Some(LayerChunk::Descriptor(_, part)) = LayerChunk::decode(chunk) else { panic!("no part") };
        assembly.take(&part)
    }

    #[test]
    fn a_description_arrives_in_frames_of_any_size() {
        let layer = &BUILT_IN_LAYERS[0];
        for room in 12..60 {
            let (mut announcement, mut assembly) = (Announcement::new(&layer.descriptor), Assembly::default());
            let mut whole = None;
            for turn in 0.. {
                let Some((chunk, n)) = announcement.next_chunk(layer.id, room) else { break };
                assert!(chunk.len() <= room && announcement.next_chunk(layer.id, room).is_none());
                let is_lost = turn % 3 == 1;
                if !is_lost {
                    whole = take(&mut assembly, &chunk).expect("it continues the others");
                }
                announcement.handle_fate(n, !is_lost);
            }
            assert_eq!((whole.as_ref(), announcement.is_complete()), (Some(&layer.descriptor), true), "{room}");
        }
        assert_eq!(Announcement::new(&layer.descriptor).next_chunk(layer.id, 11), None);
    }

    #[test]
    fn parts_that_do_not_belong_together_are_refused() {
        let layer = &BUILT_IN_LAYERS[1];
        let mut announcement = Announcement::new(&layer.descriptor);
        let (first, n) = announcement.next_chunk(layer.id, 14).unwrap();
        announcement.handle_fate(n, true);
        let (second, _) = announcement.next_chunk(layer.id, 60).unwrap();
        let mut assembly = Assembly::default();
        assert_eq!(take(&mut assembly, &second), None, "the first part is not here");
        assert_eq!(take(&mut assembly, &first), Some(None));
        let mut other = second.clone();
        other[2] ^= 1;
        assert_eq!(take(&mut assembly, &other), None, "of another description");
        assert_eq!(take(&mut assembly, &second), Some(Some(layer.descriptor.clone())));
        assert_eq!(take(&mut assembly, &first), Some(None));
        let mut damaged = second;
        *damaged.last_mut().unwrap() ^= 1;
        assert_eq!(take(&mut assembly, &damaged), None, "not what its digest stands for");
    }
}
