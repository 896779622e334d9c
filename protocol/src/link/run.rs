//! One run of ours with one run of the peer.

use super::{Flight, Window};
use crate::seal::{Direction, MissionKey, SessionKey};
use crate::wire::{Envelope, Frame, MissionId, Seal, SessionId, unwrap_number};
use std::sync::Arc;

/// How frames are made authentic.
#[derive(Debug, Clone)]
pub struct Authenticity {
    /// The key that both ends share.
    pub key: Arc<MissionKey>,
    /// Whether frames of the vehicle are authentic too, not only those of the surface.
    pub all: bool,
    /// Whether what authentic frames carry is encrypted.
    pub encrypt: bool,
}

/// Names a run of an end: the session on the wire, and a number that no other run has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Identity {
    /// Session on the wire.
    pub session: SessionId,
    /// Random number of the run; 0 where there is no key.
    pub nonce: u64,
}

/// The state between two runs: numbers begin at 1, nothing is known of either side.
#[derive(Debug)]
pub(super) struct Run<T> {
    pub(super) own: Identity,
    pub(super) peer: Identity,
    pub(super) key: Option<SessionKey>,
    pub(super) flight: Flight<T>,
    pub(super) window: Window,
}

impl<T> Run<T> {
    pub(super) fn new(own: Identity, peer: Identity, key: Option<SessionKey>) -> Self {
        Self { own, peer, key, flight: Flight::default(), window: Window::default() }
    }

    /// The frame, if the peer's run sealed it to ours; `keyed` says whether it must have a tag.
    pub(super) fn open<'a>(
        &self,
        envelope: &Envelope<'a>,
        mission: MissionId,
        direction: Direction,
        keyed: bool,
    ) -> Option<Frame<'a>> {
        if envelope.header.session != self.peer.session {
            return None;
        }
        match self.key.as_ref().filter(|_| keyed) {
            Some(key) => {
                let number = unwrap_number(envelope.header.number, self.window.highest());
                envelope.open(&Seal::Session(key, direction, number))
            }
            None => envelope.open(&Seal::Crc(mission, self.own.session.get())),
        }
    }
}
