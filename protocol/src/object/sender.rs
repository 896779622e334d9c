//! The sending side of objects.

use super::outgoing::{OutgoingObject, SymbolRun};
use super::{MAX_OBJECT, ObjectId};
use std::collections::VecDeque;

/// The objects on their way to the peer, oldest first.
#[derive(Debug, Default)]
pub struct ObjectSender {
    objects: VecDeque<OutgoingObject>,
    next: u64,
    /// Expected share of lost frames.
    loss: f64,
    /// Bytes that a part usually gets.
    usual_room: usize,
}

impl ObjectSender {
    /// The most objects at a time; a further one replaces the oldest.
    const MAX_OBJECTS: usize = 16;
    /// An object is replaced at the latest when this many later ones were pushed, so that its name stays unique.
    const MAX_AGE: u64 = ObjectId::COUNT / 2 - 1;
    /// The largest loss that the code is designed for.
    const MAX_LOSS: f64 = 0.95;

    /// Queues an object; `None` if it is empty or larger than [`MAX_OBJECT`].
    pub fn push(&mut self, bytes: Vec<u8>) -> Option<ObjectId> {
        self.add(bytes, false)
    }

    /// Queues an object that may use only spare capacity.
    pub fn push_background(&mut self, bytes: Vec<u8>) -> Option<ObjectId> {
        self.add(bytes, true)
    }

    fn add(&mut self, bytes: Vec<u8>, is_background: bool) -> Option<ObjectId> {
        if bytes.is_empty() || bytes.len() > MAX_OBJECT {
            return None;
        }
        let serial = self.next;
        self.next += 1;
        let too_old = |o: &OutgoingObject| serial - o.serial > Self::MAX_AGE;
        if self.objects.len() >= Self::MAX_OBJECTS || self.objects.front().is_some_and(too_old) {
            self.objects.pop_front();
        }
        self.objects.push_back(OutgoingObject::new(serial, bytes, is_background));
        Some(ObjectId::of(serial))
    }

    /// Stops sending an object; an unknown one is ignored.
    pub fn cancel(&mut self, id: ObjectId) {
        self.objects.retain(|o| ObjectId::of(o.serial) != id);
    }

    /// Stops sending every object. Names are not used again, because the peer remembers them.
    pub fn cancel_all(&mut self) {
        self.objects.clear();
    }

    /// Whether the peer is known to have every object.
    pub fn is_empty(&self) -> bool {
        self.objects.is_empty()
    }

    /// Whether the peer is known to have every object that has a share.
    pub fn has_only_background(&self) -> bool {
        self.objects.iter().all(|o| o.is_background)
    }

    /// Whether the peer is known to have every background object.
    pub fn has_no_background(&self) -> bool {
        self.objects.iter().all(|o| !o.is_background)
    }

    /// Bytes that wait for transmission, repair symbols included, without background objects.
    pub fn backlog_bytes(&self) -> usize {
        self.objects.iter().filter(|o| !o.is_background).map(OutgoingObject::backlog_bytes).sum()
    }

    /// Bytes of background objects that wait for transmission.
    pub fn background_backlog_bytes(&self) -> usize {
        self.objects.iter().filter(|o| o.is_background).map(OutgoingObject::backlog_bytes).sum()
    }

    /// Sets the expected share of lost frames, 0..=0.95; the number of repair symbols follows it, none at 0.
    pub fn set_loss(&mut self, loss: f64) {
        let loss = if loss.is_finite() { loss.clamp(0.0, Self::MAX_LOSS) } else { 0.0 };
        if loss != self.loss {
            self.loss = loss;
            self.objects.iter_mut().for_each(|o| o.set_loss(self.usual_room, loss));
        }
    }

    /// The next part of at most `room` bytes, header included, of an object with a share. It stays the same until
    /// it is marked in flight.
    pub fn next_part(&mut self, room: usize) -> Option<(ObjectId, SymbolRun, Vec<u8>)> {
        self.next_part_of(false, room)
    }

    /// The next part of a background object.
    pub fn next_background_part(&mut self, room: usize) -> Option<(ObjectId, SymbolRun, Vec<u8>)> {
        self.next_part_of(true, room)
    }

    fn next_part_of(&mut self, is_background: bool, room: usize) -> Option<(ObjectId, SymbolRun, Vec<u8>)> {
        // The room at the end of a frame is small; an object that begins there is still cut for whole frames.
        self.usual_room = room.max(self.usual_room - self.usual_room.div_ceil(128));
        let (usual, loss) = (self.usual_room, self.loss);
        let (run, part) = {
            let mut of_kind = self.objects.iter_mut().filter(|o| o.is_background == is_background);
            of_kind.find_map(|o| o.next_part(room, usual, loss))?
        };
        Some((ObjectId::of(run.serial), run, part))
    }

    /// Notes that a frame with this part was written.
    pub fn mark_in_flight(&mut self, _: ObjectId, run: &SymbolRun) {
        if let Some(object) = self.objects.iter_mut().find(|o| o.serial == run.serial) {
            object.mark_in_flight(run);
        }
    }

    /// Takes the fate of a frame with this part; returns whether its object is now complete at the peer.
    pub fn handle_fate(&mut self, _: ObjectId, run: &SymbolRun, delivered: bool) -> bool {
        let Some(at) = self.objects.iter().position(|o| o.serial == run.serial) else { return false };
        let complete = self.objects.get_mut(at).is_some_and(|o| o.handle_fate(run, delivered));
        if complete {
            self.objects.remove(at);
        }
        complete
    }

    /// Starts every object from the first symbol, because the peer has lost its copies.
    pub fn handle_peer_restart(&mut self) {
        self.objects.iter_mut().for_each(OutgoingObject::handle_peer_restart);
    }
}
