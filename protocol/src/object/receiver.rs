//! The receiving side of objects, and an object during its reception.

use super::layout::{Placed, SymbolPlace, recover};
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

/// The received symbols of a block; repair symbols are kept only until the block is complete.
#[derive(Debug, Default)]
struct ReceivedBlock {
    sources: usize,
    repairs: Vec<Placed<Vec<u8>>>,
}

impl ReceivedBlock {
    fn held(&self) -> usize {
        self.sources + self.repairs.len()
    }
}

/// An object on its way from the peer. It holds each source symbol at most once, and at most as many repair symbols.
#[derive(Debug)]
pub(super) struct Reassembly {
    pub(super) layout: Layout,
    /// The receiver's counter when a part was last added.
    pub(super) touched: u64,
    bytes: Vec<u8>,
    /// Which source symbols are in `bytes`.
    have: Vec<bool>,
    blocks: Vec<ReceivedBlock>,
}

impl Reassembly {
    pub(super) fn new(layout: Layout) -> Self {
        Self {
            layout,
            touched: 0,
            bytes: vec![0; layout.bytes()],
            have: vec![false; layout.sources()],
            blocks: (0..layout.blocks()).map(|_| ReceivedBlock::default()).collect(),
        }
    }

    /// Adds a part with this layout.
    pub(super) fn add(&mut self, part: &Part<'_>) {
        for (symbol, data) in part.symbols() {
            let place = self.layout.place(symbol);
            let needed = self.layout.block_sources(place.block());
            let Some(block) = self.blocks.get_mut(place.block()).filter(|b| b.sources < needed) else { continue };
            match place {
                SymbolPlace::Source(..) => self.set_source(symbol, data),
                SymbolPlace::Repair(_, repair) if block.repairs.iter().all(|(r, _)| *r != repair) => {
                    block.repairs.push((repair, data.to_vec()));
                }
                SymbolPlace::Repair(..) => {}
            }
            self.complete(place.block(), needed);
        }
    }

    fn set_source(&mut self, symbol: usize, data: &[u8]) {
        let blocks = self.blocks.len();
        let at = symbol * self.layout.symbol();
        let Some(block) = self.blocks.get_mut(symbol % blocks) else { return };
        let Some(have) = self.have.get_mut(symbol).filter(|have| !**have) else { return };
        let Some(bytes) = self.bytes.get_mut(at..at + data.len()) else { return };
        bytes.copy_from_slice(data);
        *have = true;
        block.sources += 1;
    }

    /// Recovers the missing symbols of a block as soon as enough others are held.
    fn complete(&mut self, number: usize, needed: usize) {
        let blocks = self.blocks.len();
        let Some(block) = self.blocks.get_mut(number).filter(|b| b.held() >= needed) else { return };
        let repairs = std::mem::take(&mut block.repairs);
        if repairs.is_empty() {
            return;
        }
        let held = |place: u8| self.have.get(number + usize::from(place) * blocks).is_some_and(|h| *h);
        let missing: Vec<u8> = (0..needed).map(|place| place as u8).filter(|&place| !held(place)).collect();
        let known = self.layout.sources_of(number, &self.bytes).filter(|(place, _)| held(*place));
        let recovered = recover(&missing, repairs, known);
        for (place, data) in missing.into_iter().zip(recovered) {
            self.set_source(number + usize::from(place) * blocks, &data);
        }
    }

    /// Whether every source symbol is held.
    pub(super) fn is_whole(&self) -> bool {
        self.blocks.iter().enumerate().all(|(b, block)| block.sources == self.layout.block_sources(b))
    }

    /// Bytes held in source and repair symbols, at most those of the object.
    pub(super) fn held(&self) -> usize {
        let held: usize = self.blocks.iter().map(ReceivedBlock::held).sum();
        (held * self.layout.symbol()).min(self.layout.most_len())
    }

    /// The first `n` bytes, once they are held and certainly belong to the object.
    pub(super) fn head(&self, n: usize) -> Option<&[u8]> {
        let held = self.have.get(..n.div_ceil(self.layout.symbol()))?.iter().all(|&h| h);
        self.bytes.get(..n).filter(|_| held && n <= self.layout.least_len())
    }

    /// The whole object; `None` if its CRC does not match.
    pub(super) fn open(self) -> Option<Vec<u8>> {
        self.layout.open(self.bytes)
    }
}
