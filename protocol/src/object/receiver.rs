//! The receiving side of objects.

use super::reassembly::Reassembly;
use super::{Layout, ObjectId, Part};
use std::collections::{BTreeMap, VecDeque};

/// The result of a received part.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Received {
    /// More parts are needed: bytes held, and bytes of the whole object, counted in whole symbols.
    Progress(ObjectId, usize, usize),
    /// The part completes the object.
    Complete(ObjectId, Vec<u8>),
    /// The part adds no information: its object is complete, or its CRC did not match.
    Nothing,
}

/// The objects on their way from the peer, by serial number.
#[derive(Debug, Default)]
pub struct ObjectReceiver {
    objects: BTreeMap<u64, Reassembly>,
    /// Complete or cancelled objects of which parts may still come in; oldest first.
    done: VecDeque<(u64, Layout)>,
    newest: Option<u64>,
    clock: u64,
}

impl ObjectReceiver {
    /// The most objects in reassembly; a further one replaces the one that waited longest.
    const MAX_OBJECTS: usize = 16;
    /// The most complete or cancelled objects that are remembered.
    const MAX_DONE: usize = 64;

    /// Handles a part and returns the state of its object.
    pub fn handle_part(&mut self, part: &Part<'_>) -> Received {
        let serial = self.serial(part.id);
        self.forget_old(serial);
        if self.done.contains(&(serial, part.layout)) {
            return Received::Nothing;
        }
        if self.objects.get(&serial).is_none_or(|o| o.layout != part.layout) {
            self.make_room();
            self.objects.insert(serial, Reassembly::new(part.layout));
        }
        let Some(object) = self.objects.get_mut(&serial) else { return Received::Nothing };
        self.clock += 1;
        object.touched = self.clock;
        object.add(part);
        if !object.is_whole() {
            return Received::Progress(part.id, object.held(), part.layout.most_len());
        }
        match self.objects.remove(&serial).and_then(Reassembly::open) {
            Some(bytes) => {
                self.mark_done(serial, part.layout);
                Received::Complete(part.id, bytes)
            }
            None => Received::Nothing,
        }
    }

    /// The first `n` bytes of an incomplete object, once they are held.
    pub fn head(&self, id: ObjectId, n: usize) -> Option<&[u8]> {
        self.objects.get(&self.serial(id))?.head(n)
    }

    /// Discards an incomplete object and all parts that still come in of it.
    pub fn cancel(&mut self, id: ObjectId) {
        let serial = self.serial(id);
        if let Some(object) = self.objects.remove(&serial) {
            self.mark_done(serial, object.layout);
        }
    }

    /// Discards all objects, because the peer has begun a new run.
    pub fn clear(&mut self) {
        *self = Self::default();
    }

    fn serial(&self, id: ObjectId) -> u64 {
        id.serial(self.newest.unwrap_or(ObjectId::COUNT))
    }

    /// Discards objects whose names may have been used again up to `serial`.
    fn forget_old(&mut self, serial: u64) {
        let newest = self.newest.map_or(serial, |n| n.max(serial));
        if self.newest != Some(newest) {
            self.newest = Some(newest);
            let oldest = (newest + 1).saturating_sub(ObjectId::COUNT / 2);
            self.objects = self.objects.split_off(&oldest);
            self.done.retain(|(serial, _)| *serial >= oldest);
        }
    }

    fn mark_done(&mut self, serial: u64, layout: Layout) {
        self.done.retain(|(s, _)| *s != serial);
        self.done.push_back((serial, layout));
        if self.done.len() > Self::MAX_DONE {
            self.done.pop_front();
        }
    }

    fn make_room(&mut self) {
        while self.objects.len() >= Self::MAX_OBJECTS {
            let Some(oldest) = self.objects.iter().min_by_key(|(_, o)| o.touched).map(|(&serial, _)| serial) else {
                return;
            };
            self.objects.remove(&oldest);
        }
    }
}
