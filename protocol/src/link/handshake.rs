//! The handshake: which run of the peer this end communicates with. A hello names a run, and
//! a numbered frame proves it.

use super::run::{EndedPeer, Identity, LinkRun};
use crate::seal::{Direction, SessionKey};
use crate::wire::{Envelope, Introduction, SessionId};
use std::collections::VecDeque;

/// The result of a hello.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HandshakeOutcome {
    /// It names the current run.
    Known,
    /// It names a new run. At the surface, the run is the current one now.
    New,
    /// At the surface: it names another run than the current one, which a numbered frame must prove.
    Offered,
    /// It names a run that has ended, so it is an old frame.
    Retired,
}

/// The purpose of a frame in the handshake.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum FramePurpose {
    /// Names the run of the sender.
    Hello,
    /// At the surface: an empty numbered frame in the offered run, which proves that run to the vehicle.
    Proof,
    /// A numbered frame in the current run.
    Content,
}

impl FramePurpose {
    pub(super) fn hello_if(is_hello: bool) -> Self {
        if is_hello { Self::Hello } else { Self::Content }
    }

    pub(super) fn is_hello(self) -> bool {
        self == Self::Hello
    }
}

/// The runs of both ends toward each other.
///
/// The surface begins: its hello names its run. The vehicle answers with a hello that is sealed to that run and names a
/// run of its own, a new one for each run of the surface. Therefore no frame to or from an earlier run of either end
/// verifies any more. Each end keeps its previous run until a numbered frame of the new one comes in: a hello alone,
/// which may be late or replayed, has no effect. The surface sends the first numbered frame, the proof.
#[derive(Debug)]
pub(super) struct Handshake<T> {
    own: Identity,
    run: Option<LinkRun<T>>,
    /// The run that a hello has offered, until a numbered frame proves that the peer has accepted it.
    offered: Option<LinkRun<T>>,
    /// At the vehicle: `run` serves only to receive grants, because this end has begun a new one.
    leaving: bool,
    retired: VecDeque<EndedPeer>,
    random: u64,
}

impl<T> Handshake<T> {
    /// Ended runs that are remembered.
    const MEMORY: usize = 32;

    /// A handshake that has not begun; `seed` must be random for each start of the program.
    pub(super) fn new(seed: u64) -> Self {
        let mut random = seed;
        let own = fresh(&mut random);
        Self { own, run: None, offered: None, leaving: false, retired: VecDeque::new(), random }
    }

    pub(super) fn own(&self) -> Identity {
        self.own
    }

    pub(super) fn run(&self) -> Option<&LinkRun<T>> {
        self.run.as_ref()
    }

    pub(super) fn run_mut(&mut self) -> Option<&mut LinkRun<T>> {
        self.run.as_mut()
    }

    pub(super) fn offered(&self) -> Option<&LinkRun<T>> {
        self.offered.as_ref()
    }

    pub(super) fn is_leaving(&self) -> bool {
        self.leaving
    }

    /// At the vehicle: handles a hello of the surface. A new run of the surface is offered a new run of ours.
    pub(super) fn handle_call(
        &mut self,
        peer: Identity,
        introduction: Introduction,
        key: impl Fn(Identity, Identity) -> Option<SessionKey>,
    ) -> HandshakeOutcome {
        if self.run.as_ref().is_some_and(|r| r.peer == peer) && !self.leaving {
            return HandshakeOutcome::Known;
        }
        if self.is_retired(peer) {
            return HandshakeOutcome::Retired;
        }
        if self.offered.as_ref().is_none_or(|r| r.peer != peer) {
            let own = fresh(&mut self.random);
            self.offered = Some(LinkRun::new(own, peer, introduction, key(own, peer)));
        }
        HandshakeOutcome::New
    }

    /// The run whose frames have this purpose; `None` for hellos.
    pub(super) fn run_for(&mut self, purpose: FramePurpose) -> Option<&mut LinkRun<T>> {
        match purpose {
            FramePurpose::Hello => None,
            FramePurpose::Proof => self.offered.as_mut(),
            FramePurpose::Content => self.run.as_mut(),
        }
    }

    /// At the surface: a frame of the current run came in, so the vehicle uses no other.
    pub(super) fn refuse_offered(&mut self) {
        self.offered = None;
    }

    /// Makes the offered run the current one, because a numbered frame of it came in.
    pub(super) fn accept_offered(&mut self) {
        if let Some(run) = self.offered.take() {
            self.own = run.own;
            self.leaving = false;
            self.replace(run);
        }
    }

    /// At the surface: handles a hello of the vehicle that is sealed to our run.
    pub(super) fn handle_answer(
        &mut self,
        peer: Identity,
        introduction: Introduction,
        key: impl Fn(Identity, Identity) -> Option<SessionKey>,
    ) -> HandshakeOutcome {
        if self.run.as_ref().is_some_and(|r| r.peer == peer) {
            return HandshakeOutcome::Known;
        }
        if self.is_retired(peer) {
            return HandshakeOutcome::Retired;
        }
        let new = || LinkRun::new(self.own, peer, introduction, key(self.own, peer));
        if self.run.is_none() {
            self.run = Some(new());
            return HandshakeOutcome::New;
        }
        if self.offered.as_ref().is_none_or(|r| r.peer != peer || r.flight.is_full()) {
            self.offered = Some(new());
        }
        HandshakeOutcome::Offered
    }

    /// At the vehicle: begins a new run toward the surface's current one.
    pub(super) fn renew_vehicle(&mut self, key: impl Fn(Identity, Identity) -> Option<SessionKey>) {
        let Some((peer, introduction)) = self.run.as_ref().map(|r| (r.peer, r.introduction)) else { return };
        let own = fresh(&mut self.random);
        self.offered = Some(LinkRun::new(own, peer, introduction, key(own, peer)));
        self.leaving = true;
    }

    /// At the surface: begins a new run, which a new handshake must introduce to the vehicle.
    pub(super) fn renew_surface(&mut self) {
        self.own = fresh(&mut self.random);
        self.offered = None;
        if let Some(old) = self.run.take() {
            self.retire(old);
        }
    }

    fn replace(&mut self, run: LinkRun<T>) {
        let peer = run.peer;
        if let Some(old) = self.run.replace(run)
            && old.peer != peer
        {
            self.retire(old);
        }
    }

    fn is_retired(&self, peer: Identity) -> bool {
        self.retired.iter().any(|r| r.identity == peer)
    }

    /// Whether a run of the peer that has ended sent this frame to a run of ours, and it came in for the first time.
    pub(super) fn is_new_of_ended(&mut self, envelope: &Envelope<'_>, direction: Direction) -> bool {
        self.retired.iter_mut().any(|r| r.accept(envelope, direction))
    }

    fn retire(&mut self, run: LinkRun<T>) {
        self.retired.push_back(run.end());
        if self.retired.len() > Self::MEMORY {
            self.retired.pop_front();
        }
    }
}

fn fresh(random: &mut u64) -> Identity {
    let session = SessionId::from_random(crate::random::next(random) as u16);
    Identity { session, nonce: crate::random::next(random) }
}
