//! The receiving side of objects.

use super::{ObjectId, Part};
use std::collections::BTreeMap;

#[derive(Debug)]
struct Incoming {
    bytes: Vec<u8>,
    have: Vec<bool>,
    touched: u64,
}

/// What a received part led to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Received {
    /// More is to come: bytes held and bytes of the whole object.
    Progress(ObjectId, usize, usize),
    /// The object is complete.
    Complete(ObjectId, Vec<u8>),
}

/// Objects on their way from the peer.
#[derive(Debug, Default)]
pub struct ObjectReceiver {
    objects: BTreeMap<ObjectId, Incoming>,
    clock: u64,
}

impl ObjectReceiver {
    /// Most objects in reassembly at a time; a further one replaces the one that waited longest.
    const MAX_OBJECTS: usize = 16;

    /// Takes a part.
    pub fn handle_part(&mut self, part: &Part<'_>) -> Received {
        self.clock += 1;
        let total = usize::from(part.total);
        if self.objects.get(&part.id).is_none_or(|o| o.bytes.len() != total) {
            self.make_room();
            let fresh = Incoming { bytes: vec![0; total], have: vec![false; total], touched: 0 };
            self.objects.insert(part.id, fresh);
        }
        let Some(object) = self.objects.get_mut(&part.id) else {
            return Received::Progress(part.id, 0, total);
        };
        object.touched = self.clock;
        let range = usize::from(part.offset)..usize::from(part.offset) + part.data.len();
        if let (Some(bytes), Some(have)) = (object.bytes.get_mut(range.clone()), object.have.get_mut(range)) {
            bytes.copy_from_slice(part.data);
            have.fill(true);
        }
        let held = object.have.iter().filter(|&&h| h).count();
        if held < total {
            return Received::Progress(part.id, held, total);
        }
        let bytes = self.objects.remove(&part.id).map(|o| o.bytes).unwrap_or_default();
        Received::Complete(part.id, bytes)
    }

    /// The first `n` bytes of an unfinished object, once they are held.
    pub fn head(&self, id: ObjectId, n: usize) -> Option<&[u8]> {
        let object = self.objects.get(&id)?;
        object.have.get(..n)?.iter().all(|&h| h).then(|| object.bytes.get(..n)).flatten()
    }

    /// Forgets every unfinished object.
    pub fn clear(&mut self) {
        self.objects.clear();
    }

    fn make_room(&mut self) {
        while self.objects.len() >= Self::MAX_OBJECTS {
            let Some(oldest) = self.objects.iter().min_by_key(|(_, o)| o.touched).map(|(&id, _)| id) else { return };
            self.objects.remove(&oldest);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{MAX_OBJECT, ObjectSender};
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn an_object_arrives_whole_whatever_parts_are_lost(
            bytes in proptest::collection::vec(any::<u8>(), 1..2000),
            losses in proptest::collection::vec(any::<bool>(), 1..200),
            room in 6usize..300,
        ) {
            let (mut sender, mut receiver) = (ObjectSender::default(), ObjectReceiver::default());
            sender.push(bytes.clone()).unwrap();
            let mut lost = losses.into_iter();
            loop {
                let (id, range, part) = sender.next_part(room).expect("incomplete, so something is missing");
                sender.mark_in_flight(id, &range);
                let delivered = !lost.next().unwrap_or(false);
                let complete = delivered
                    && matches!(receiver.handle_part(&Part::decode(&part).unwrap()), Received::Complete(_, b) if b == bytes);
                if sender.handle_fate(id, &range, delivered) {
                    prop_assert!(complete);
                    break;
                }
            }
        }

        #[test]
        fn any_part_is_taken_or_refused_within_bounds(bytes in proptest::collection::vec(any::<u8>(), 0..64)) {
            if let Ok(part) = Part::decode(&bytes) {
                prop_assert!(usize::from(part.total) <= MAX_OBJECT);
                ObjectReceiver::default().handle_part(&part);
            }
        }
    }
}
