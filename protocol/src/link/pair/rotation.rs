//! The change to the next key.
//!
//! The surface offers the next key in the run under the present one. The vehicle keeps it, and offers a run under it; the proof of
//! that run shows the vehicle that the surface has heard it, and the hello shows the surface that the vehicle holds the key. From
//! the proof on the vehicle knows the next key alone. The surface may have restarted meanwhile, so its hellos that remain unheard go
//! out under both keys in turn.

use super::LinkPair;
use crate::bytes::Truncated;
use crate::link::run::Generation;
use crate::seal::VehicleKey;

impl<T> LinkPair<T> {
    /// Hellos under one key that remain unheard before the other one is tried.
    const TRIES: u32 = 2;

    /// At the surface: whether there is a next key, and the vehicle uses the present one.
    pub fn offers_key(&self) -> bool {
        let is_present = || self.handshake.run().is_some_and(|run| run.generation == Generation::Present);
        self.authenticity.as_ref().is_some_and(|a| a.offer.is_some()) && self.is_proven() && is_present()
    }

    /// At the surface: the parts of the next key, if [`Self::offers_key`].
    pub fn next_key_parts(&self) -> Option<[Vec<u8>; 2]> {
        let authenticity = self.authenticity.as_ref().filter(|_| self.offers_key())?;
        authenticity.offer.as_ref().map(|next| next.offer(&authenticity.key))
    }

    /// At the vehicle: takes a part of the next key; returns the key once it is complete and another than those that are held.
    ///
    /// # Errors
    ///
    /// It is malformed, or there is no present key.
    pub fn handle_key_part(&mut self, part: &[u8]) -> Result<Option<VehicleKey>, Truncated> {
        let authenticity = self.authenticity.as_ref().ok_or(Truncated)?;
        let Some(key) = self.key_offer.take(part, self.us.number(), &authenticity.key)? else { return Ok(None) };
        if authenticity.next.as_ref() == Some(key.link()) {
            self.use_next_key(&key);
            return Ok(None);
        }
        Ok(Some(key).filter(|key| authenticity.key != *key.link()))
    }

    /// At the vehicle: the next key is kept, so that this end accepts it from now on, and offers a run under it.
    pub fn use_next_key(&mut self, key: &VehicleKey) {
        let Some(authenticity) = self.authenticity.as_mut() else { return };
        let is_new = authenticity.next.as_ref() != Some(key.link());
        authenticity.next = Some(key.link().clone());
        if is_new || self.handshake.offered().is_none_or(|run| run.generation == Generation::Present) {
            self.offer_run(Generation::Next);
        }
        self.repeat_hello();
    }

    /// Whether the two ends have changed over to the next key since the last call.
    pub fn poll_key_change(&mut self) -> bool {
        std::mem::take(&mut self.has_changed_key)
    }

    /// At the vehicle: the surface has proven a run under the next key, which is the present one from now on.
    pub(super) fn handle_proven_key(&mut self) {
        let is_next = self.handshake.run().is_some_and(|run| run.generation == Generation::Next);
        let Some(authenticity) = self.authenticity.as_mut() else { return };
        if let Some(next) = authenticity.next.take_if(|_| is_next) {
            authenticity.key = next;
            self.has_changed_key = true;
            self.handshake.run_mut().into_iter().for_each(|run| run.generation = Generation::Present);
        }
    }

    /// At the surface: the generation of the key that the vehicle answers by.
    pub(super) fn handle_voice(&mut self, generation: Generation) {
        self.has_changed_key |= generation == Generation::Next && self.answered_by != Some(generation);
        self.answered_by = Some(generation);
        self.speaks = generation;
    }

    /// At the surface: the generation of the key of a hello that is written now.
    pub(super) fn next_voice(&mut self) -> Generation {
        let has_next = self.authenticity.as_ref().is_some_and(|a| a.next.is_some());
        if has_next && self.unheard > 0 && self.unheard.is_multiple_of(Self::TRIES) {
            self.speaks = self.speaks.other();
        }
        self.unheard += 1;
        self.speaks
    }
}
