//! The change to the next key.
//!
//! The surface offers the next key in the run under the present one. The vehicle keeps it, and offers a run under it; the proof of
//! that run shows the vehicle that the surface has heard it, and the hello shows the surface that the vehicle holds the key. From
//! the proof on the vehicle knows the next key alone. The surface may have restarted meanwhile, so its hellos that remain unheard go
//! out under both keys in turn.

use super::LinkPair;
use crate::bytes::Truncated;
use crate::link::run::Generation;
use crate::seal::{KeyOffer, VehicleKey};

/// What an end remembers of a change to the next key.
#[derive(Debug, Default)]
pub(super) struct KeyRotation {
    /// At the surface: the generation of the key of the next hello.
    speaks: Generation,
    /// At the surface: the generation of the key of the last hello of the vehicle.
    answered_by: Option<Generation>,
    /// At the surface: hellos since the last accepted frame.
    unheard: u32,
    /// At the vehicle: the parts of the next key that were received.
    offer: KeyOffer,
    /// The ends have changed over to the next key, and that was not polled yet.
    has_changed: bool,
}

impl KeyRotation {
    /// Hellos under one key that remain unheard before the other one is tried.
    const TRIES: u32 = 2;

    /// The generation of the key that the vehicle answers by.
    pub(super) fn handle_voice(&mut self, generation: Generation) {
        self.has_changed |= generation == Generation::Next && self.answered_by != Some(generation);
        self.answered_by = Some(generation);
        self.speaks = generation;
    }

    /// A frame of the vehicle was accepted, so hellos keep their key.
    pub(super) fn handle_heard(&mut self) {
        self.unheard = 0;
    }

    /// The generation of the key of a hello that is written now.
    fn next_voice(&mut self, has_next: bool) -> Generation {
        if has_next && self.unheard > 0 && self.unheard.is_multiple_of(Self::TRIES) {
            self.speaks = self.speaks.other();
        }
        self.unheard += 1;
        self.speaks
    }
}

impl<T> LinkPair<T> {
    /// At the surface: whether there is a next key, and the vehicle uses the present one.
    pub fn offers_key(&self) -> bool {
        let is_present = || self.handshake.run().is_some_and(|run| run.generation == Generation::Present);
        self.authenticity.as_ref().is_some_and(|a| a.next.is_some()) && self.is_proven() && is_present()
    }

    /// At the surface: the parts of the next key, if [`Self::offers_key`].
    pub fn next_key_parts(&self) -> Option<[Vec<u8>; 2]> {
        let authenticity = self.authenticity.as_ref().filter(|_| self.offers_key())?;
        authenticity.next.as_ref().map(|next| next.offer(authenticity.key.link()))
    }

    /// At the surface: the generation of the key of a hello that is written now.
    pub(super) fn next_voice(&mut self) -> Generation {
        self.rotation.next_voice(self.authenticity.as_ref().is_some_and(|a| a.next.is_some()))
    }

    /// At the vehicle: takes a part of the next key; returns the key once it is complete and another than those that are held.
    ///
    /// # Errors
    ///
    /// It is malformed, or there is no present key.
    pub fn handle_key_part(&mut self, part: &[u8]) -> Result<Option<VehicleKey>, Truncated> {
        let authenticity = self.authenticity.as_ref().ok_or(Truncated)?;
        let key = self.rotation.offer.take(part, self.us.number(), authenticity.key.link())?;
        let is_kept = key.is_some() && key == authenticity.next;
        let new = key.filter(|key| !is_kept && *key != authenticity.key);
        if is_kept {
            // The surface has not heard the run that was offered under it.
            if self.handshake.offered().is_none_or(|run| run.generation == Generation::Present) {
                self.offer_run(Generation::Next);
            }
            self.repeat_hello();
        }
        Ok(new)
    }

    /// At the vehicle: the host keeps the next key, so that this end accepts it from now on, and offers a run under it.
    pub fn keep_next_key(&mut self, key: &VehicleKey) {
        let is_new = |next: &Option<VehicleKey>| next.as_ref() != Some(key);
        if let Some(authenticity) = self.authenticity.as_mut().filter(|a| is_new(&a.next)) {
            authenticity.next = Some(key.clone());
            self.offer_run(Generation::Next);
            self.repeat_hello();
        }
    }

    /// Whether the two ends have changed over to the next key since the last call.
    pub fn poll_key_change(&mut self) -> bool {
        std::mem::take(&mut self.rotation.has_changed)
    }

    /// At the vehicle: the surface has proven a run under the next key, which is the present one from now on.
    pub(super) fn handle_proven_key(&mut self) {
        let Some(run) = self.handshake.run_mut().filter(|run| run.generation == Generation::Next) else { return };
        run.generation = Generation::Present;
        let Some(authenticity) = self.authenticity.as_mut() else { return };
        if let Some(next) = authenticity.next.take() {
            authenticity.key = next;
            self.rotation.has_changed = true;
        }
    }
}
