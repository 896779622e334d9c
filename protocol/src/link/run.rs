//! A run of this end with a run of the peer.

use super::{Flight, FrameNumber, LinkWindow};
use crate::seal::{Direction, HeldKey, LinkKey, SessionKey};
use crate::wire::{Address, Envelope, Frame, Introduction, MissionId, Seal, SessionId, unwrap_number};
use std::sync::Arc;

/// The key and the scope of authentication.
#[derive(Debug, Clone)]
pub struct Authenticity {
    /// The mission key, or the keys of one vehicle that are derived from it.
    pub key: Arc<HeldKey>,
    /// Whether frames of the vehicle are authenticated too, and not only those of the surface.
    pub all: bool,
    /// Whether the content of authenticated frames is encrypted.
    pub encrypt: bool,
}

impl Authenticity {
    /// That of the link with a vehicle.
    pub(super) fn link(&self, vehicle: Address) -> LinkAuthenticity {
        LinkAuthenticity { key: self.key.link(vehicle.number()), all: self.all, encrypt: self.encrypt }
    }
}

/// The key of a link, and the scope of authentication.
#[derive(Debug, Clone)]
pub(super) struct LinkAuthenticity {
    pub(super) key: LinkKey,
    pub(super) all: bool,
    pub(super) encrypt: bool,
}

/// The identity of a run of one end: the session on the wire, and a nonce that no other run has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Identity {
    /// The session number in the frame header.
    pub session: SessionId,
    /// The random number that the hello carries; 0 without a key.
    pub nonce: u64,
}

/// Draws the identities of the runs of this end.
#[derive(Debug)]
pub(super) struct Identities {
    random: u64,
    /// The nonces are drawn under it, so that a listener foresees none. Without a key there is nothing to foresee.
    key: Option<LinkKey>,
}

impl Identities {
    /// `seed` must be random for each start of the program.
    pub(super) fn new(seed: u64, key: Option<LinkKey>) -> Self {
        Self { random: seed, key }
    }

    pub(super) fn draw(&mut self) -> Identity {
        let session = SessionId::from_random(crate::random::next(&mut self.random) as u16);
        let drawn = crate::random::next(&mut self.random);
        Identity { session, nonce: self.key.as_ref().map_or(drawn, |key| key.nonce(drawn)) }
    }
}

/// A run of the peer that has ended.
#[derive(Debug)]
pub(super) struct EndedPeer {
    /// Our run that it communicated with.
    pub(super) own: Identity,
    pub(super) identity: Identity,
    pub(super) introduction: Introduction,
    /// The key of its frames to a run of ours, if there is one.
    key: Option<SessionKey>,
    highest: FrameNumber,
}

impl EndedPeer {
    /// Whether it sent this frame, by a valid tag, after all of its frames that came in before.
    pub(super) fn accept(&mut self, envelope: &Envelope<'_>, direction: Direction) -> bool {
        let number = unwrap_number(envelope.header.number, self.highest);
        let is_open = |key| envelope.open(&Seal::Session(key, direction, number)).is_some();
        let is_new = envelope.header.session == self.identity.session
            && number > self.highest
            && self.key.as_ref().is_some_and(is_open);
        if is_new {
            self.highest = number;
        }
        is_new
    }
}

/// The state of a pair of runs; frame numbers begin at 1.
#[derive(Debug)]
pub(super) struct LinkRun<T> {
    pub(super) own: Identity,
    pub(super) peer: Identity,
    /// The introduction in the peer's hello.
    pub(super) introduction: Introduction,
    /// Whether the hello had this version of the wire. Without, no frame of the run is read.
    is_readable: bool,
    pub(super) key: Option<SessionKey>,
    pub(super) flight: Flight<T>,
    pub(super) window: LinkWindow,
}

impl<T> LinkRun<T> {
    pub(super) fn new(own: Identity, peer: Identity, introduction: Introduction, key: Option<SessionKey>) -> Self {
        let (flight, window) = (Flight::default(), LinkWindow::default());
        Self { own, peer, introduction, is_readable: true, key, flight, window }
    }

    /// A run of which the hello may have another version of the wire, so that its introduction is not known.
    pub(super) fn of_any_version(
        own: Identity,
        peer: Identity,
        introduction: Option<Introduction>,
        key: Option<SessionKey>,
    ) -> Self {
        let is_readable = introduction.is_some();
        Self { is_readable, ..Self::new(own, peer, introduction.unwrap_or_default(), key) }
    }

    /// Takes the introduction of another hello of this run, if none was read before.
    pub(super) fn introduce(&mut self, introduction: Option<Introduction>) {
        if let Some(introduction) = introduction.filter(|_| !self.is_readable) {
            (self.introduction, self.is_readable) = (introduction, true);
        }
    }

    pub(super) fn end(self) -> EndedPeer {
        let (own, identity, introduction) = (self.own, self.peer, self.introduction);
        EndedPeer { own, identity, introduction, key: self.key, highest: self.window.highest() }
    }

    /// The frame, if the peer's run sealed it to ours. If `keyed`, it must have a tag.
    pub(super) fn open<'a>(
        &self,
        envelope: &Envelope<'a>,
        mission: MissionId,
        direction: Direction,
        keyed: bool,
    ) -> Option<Frame<'a>> {
        if envelope.header.session != self.peer.session || !self.is_readable {
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
