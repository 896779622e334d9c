//! The sending side of objects.

use super::{MAX_OBJECT, ObjectId, Part};
use std::collections::BTreeMap;
use std::ops::Range;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ByteState {
    Missing,
    InFlight,
    Delivered,
}

#[derive(Debug)]
struct Outgoing {
    bytes: Vec<u8>,
    state: Vec<ByteState>,
}

/// Objects on their way to the peer, oldest first.
#[derive(Debug, Default)]
pub struct ObjectSender {
    objects: BTreeMap<u64, Outgoing>,
    next: u64,
}

impl ObjectSender {
    /// Most objects at a time; a further one replaces the oldest.
    const MAX_OBJECTS: usize = 16;

    /// Takes an object to send; `None` if it is empty or larger than [`MAX_OBJECT`].
    pub fn push(&mut self, bytes: Vec<u8>) -> Option<ObjectId> {
        if bytes.is_empty() || bytes.len() > MAX_OBJECT {
            return None;
        }
        if self.objects.len() >= Self::MAX_OBJECTS {
            self.objects.pop_first();
        }
        let serial = self.next;
        self.next += 1;
        let state = vec![ByteState::Missing; bytes.len()];
        self.objects.insert(serial, Outgoing { bytes, state });
        Some(ObjectId(serial as u8))
    }

    /// Stops sending an object.
    pub fn cancel(&mut self, id: ObjectId) {
        self.objects.retain(|&serial, _| serial as u8 != id.0);
    }

    /// Whether the peer is known to have every object.
    pub fn is_empty(&self) -> bool {
        self.objects.is_empty()
    }

    /// Bytes that wait for their first or next transmission.
    pub fn backlog_bytes(&self) -> usize {
        self.objects.values().flat_map(|o| &o.state).filter(|&&s| s == ByteState::Missing).count()
    }

    /// The next part that fits `room` bytes, header included.
    pub fn next_part(&self, room: usize) -> Option<(ObjectId, Range<usize>, Vec<u8>)> {
        let most = room.checked_sub(Part::HEADER).filter(|&n| n > 0)?;
        self.objects.iter().find_map(|(&serial, object)| {
            let start = object.state.iter().position(|&s| s == ByteState::Missing)?;
            let run = object.state.iter().skip(start).take(most).take_while(|&&s| s == ByteState::Missing).count();
            let range = start..start + run;
            let data = object.bytes.get(range.clone())?;
            let id = ObjectId(serial as u8);
            let part = Part { id, total: object.bytes.len() as u16, offset: start as u16, data };
            Some((id, range, part.encode()))
        })
    }

    /// A frame with this part was written.
    pub fn set_loss(&mut self, _: f64) {}
    pub fn mark_in_flight(&mut self, id: ObjectId, range: &Range<usize>) {
        self.mark(id, range.clone(), |_| ByteState::InFlight);
    }

    /// The fate of a frame with this part is known; returns whether the object is now complete at the peer.
    pub fn handle_fate(&mut self, id: ObjectId, range: &Range<usize>, delivered: bool) -> bool {
        self.mark(id, range.clone(), |state| match state {
            ByteState::Delivered => ByteState::Delivered,
            _ if delivered => ByteState::Delivered,
            _ => ByteState::Missing,
        });
        let done = |o: &Outgoing| o.state.iter().all(|&s| s == ByteState::Delivered);
        let before = self.objects.len();
        self.objects.retain(|&serial, o| serial as u8 != id.0 || !done(o));
        self.objects.len() < before
    }

    /// The peer has lost what it had received.
    pub fn handle_peer_restart(&mut self) {
        for object in self.objects.values_mut() {
            object.state.fill(ByteState::Missing);
        }
    }

    fn mark(&mut self, id: ObjectId, range: Range<usize>, to: impl Fn(ByteState) -> ByteState) {
        let object = self.objects.iter_mut().find(|(serial, _)| **serial as u8 == id.0);
        for state in object.and_then(|(_, o)| o.state.get_mut(range)).into_iter().flatten() {
            *state = to(*state);
        }
    }
}
