//! A run of this end with a run of the peer.

use super::{Flight, FrameNumber, LinkWindow};
use crate::seal::{Direction, HeldKey, LinkKey, SessionKey, VehicleKey};
use crate::wire::{Address, Envelope, Frame, Introduction, MissionId, Seal, SessionId};
use std::sync::Arc;

/// The key and the scope of authentication.
#[derive(Debug, Clone)]
pub struct Authenticity {
    /// The mission key, or the keys of one vehicle that are derived from it.
    pub key: Arc<HeldKey>,
    /// The next one, while the ends change over to it: this end accepts both.
    pub next: Option<Arc<HeldKey>>,
    /// Whether frames of the vehicle are authenticated too, and not only those of the surface.
    pub all: bool,
    /// Whether the content of authenticated frames is encrypted.
    pub encrypt: bool,
}

impl Authenticity {
    /// Authentication by one key, without a next one to change over to.
    #[must_use]
    pub fn new(key: HeldKey, all: bool, encrypt: bool) -> Self {
        Self { key: Arc::new(key), next: None, all, encrypt }
    }

    /// That of the link with a vehicle.
    pub(super) fn link(&self, vehicle: Address) -> LinkAuthenticity {
        let number = vehicle.number();
        LinkAuthenticity {
            key: self.key.vehicle(number),
            next: self.next.as_ref().map(|next| next.vehicle(number)),
            all: self.all,
            encrypt: self.encrypt,
        }
    }

    /// The key of calls of this generation, if it is held.
    pub(super) fn calls(&self, generation: Generation) -> Option<LinkKey> {
        self.held(generation).map(HeldKey::calls)
    }

    fn held(&self, generation: Generation) -> Option<&HeldKey> {
        match generation {
            Generation::Present => Some(&self.key),
            Generation::Next => self.next.as_deref(),
        }
    }
}

/// Which of the two keys of a link: both are in use while the ends change over.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum Generation {
    #[default]
    Present,
    Next,
}

impl Generation {
    pub(super) const ALL: [Self; 2] = [Self::Present, Self::Next];

    pub(super) fn other(self) -> Self {
        if self == Self::Present { Self::Next } else { Self::Present }
    }
}

/// The keys of a link, and the scope of authentication.
#[derive(Debug, Clone)]
pub(super) struct LinkAuthenticity {
    pub(super) key: VehicleKey,
    /// The next one: a surface offers it to the vehicle.
    pub(super) next: Option<VehicleKey>,
    pub(super) all: bool,
    pub(super) encrypt: bool,
}

impl LinkAuthenticity {
    /// The key of the link of this generation, or the present one if there is no next one.
    pub(super) fn key(&self, generation: Generation) -> &LinkKey {
        self.held(generation).unwrap_or(&self.key).link()
    }

    fn held(&self, generation: Generation) -> Option<&VehicleKey> {
        match generation {
            Generation::Present => Some(&self.key),
            Generation::Next => self.next.as_ref(),
        }
    }

    /// The hello in a frame, and the generation of the key that it is sealed with.
    pub(super) fn open_hello<'a>(
        &self,
        envelope: &Envelope<'a>,
        mission: MissionId,
        session: u16,
        nonce: u64,
    ) -> Option<(Generation, Frame<'a>)> {
        self.open(envelope, VehicleKey::link, mission, session, nonce)
    }

    /// The generation of the key that a call to all vehicles is sealed with.
    pub(super) fn open_call(&self, envelope: &Envelope<'_>, mission: MissionId) -> Option<Generation> {
        self.open(envelope, VehicleKey::calls, mission, 0, 0).map(|(generation, _)| generation)
    }

    fn open<'a>(
        &self,
        envelope: &Envelope<'a>,
        part: fn(&VehicleKey) -> &LinkKey,
        mission: MissionId,
        session: u16,
        nonce: u64,
    ) -> Option<(Generation, Frame<'a>)> {
        Generation::ALL.into_iter().find_map(|generation| {
            let seal = Seal::Hello(part(self.held(generation)?), mission, session, nonce);
            Some((generation, envelope.open(&seal)?))
        })
    }
}

/// The key of a pair of runs, `None` without authentication, and the generation that it is derived from.
#[derive(Debug)]
pub(super) struct RunKey {
    pub(super) session: Option<SessionKey>,
    pub(super) generation: Generation,
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
        let session = SessionId::from_random(next_random(&mut self.random) as u16);
        let drawn = next_random(&mut self.random);
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
    seals: RunSeals,
    highest: FrameNumber,
}

/// What seals the frames of a pair of runs.
#[derive(Debug)]
struct RunSeals {
    /// The sessions of our run and of the peer's.
    own: SessionId,
    peer: SessionId,
    key: Option<SessionKey>,
}

impl RunSeals {
    /// The frame, if the peer's run sealed it to ours. Its number is the one nearest to `highest`; if `keyed`, it must have a tag.
    fn open<'a>(
        &self,
        envelope: &Envelope<'a>,
        mission: MissionId,
        direction: Direction,
        keyed: bool,
        highest: FrameNumber,
    ) -> Option<Frame<'a>> {
        let near = envelope.header.number_near(highest);
        let Some(key) = self.key.as_ref().filter(|_| keyed) else {
            // A forged frame may have raised the highest number: the true ones are recognised, and come late.
            let all = std::iter::once(near).chain(envelope.header.numbers(highest));
            let crc = |number| Seal::Run { mission, to: self.own, from: self.peer, number };
            return all.into_iter().find_map(|number| envelope.open(&crc(number)));
        };
        envelope.open(&Seal::Session(key, direction, near))
    }
}

impl EndedPeer {
    /// Whether it sent this frame, by a valid seal, after all of its frames that came in before.
    pub(super) fn accept(
        &mut self,
        envelope: &Envelope<'_>,
        mission: MissionId,
        direction: Direction,
        keyed: bool,
    ) -> bool {
        let opened = self.seals.open(envelope, mission, direction, keyed, self.highest);
        // Without a tag, a forged frame may have raised the highest number.
        let is_new = opened.as_ref().is_some_and(|frame| frame.number > self.highest || !keyed);
        self.highest = self.highest.max(opened.map_or(0, |frame| frame.number));
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
    seals: RunSeals,
    /// The generation of the key.
    pub(super) generation: Generation,
    pub(super) flight: Flight<T>,
    pub(super) window: LinkWindow,
}

impl<T> LinkRun<T> {
    pub(super) fn new(own: Identity, peer: Identity, introduction: Introduction, key: RunKey) -> Self {
        let (flight, window) = (Flight::default(), LinkWindow::default());
        let seals = RunSeals { own: own.session, peer: peer.session, key: key.session };
        Self { own, peer, introduction, is_readable: true, seals, generation: key.generation, flight, window }
    }

    /// A run of which the hello may have another version of the wire, so that its introduction is not known.
    pub(super) fn of_any_version(
        own: Identity,
        peer: Identity,
        introduction: Option<Introduction>,
        key: RunKey,
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
        EndedPeer { own, identity, introduction, seals: self.seals, highest: self.window.highest() }
    }

    /// The seal of a frame of ours with this number. If `keyed`, it is a tag.
    pub(super) fn seal(&self, mission: MissionId, direction: Direction, keyed: bool, number: FrameNumber) -> Seal<'_> {
        match self.seals.key.as_ref().filter(|_| keyed) {
            Some(key) => Seal::Session(key, direction, number),
            None => Seal::Run { mission, to: self.peer.session, from: self.own.session, number },
        }
    }

    /// The frame, if the peer's run sealed it to ours. If `keyed`, it must have a tag.
    pub(super) fn open<'a>(
        &self,
        envelope: &Envelope<'a>,
        mission: MissionId,
        direction: Direction,
        keyed: bool,
    ) -> Option<Frame<'a>> {
        if !self.is_readable || envelope.header.kind().is_hello() {
            return None;
        }
        self.seals.open(envelope, mission, direction, keyed, self.window.highest())
    }
}

/// The next number of a SplitMix64 sequence (Steele, Lea and Flood 2014); `state` advances.
pub(super) fn next_random(state: &mut u64) -> u64 {
    *state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let mut z = *state;
    z = (z ^ z >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ z >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ z >> 31
}
