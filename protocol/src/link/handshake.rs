//! The handshake: which run of the peer this end communicates with. A hello names a run, and
//! a numbered frame proves it.

use super::FrameNumber;
use super::run::{EndedPeer, Identities, Identity, LinkRun, RunKey};
use crate::seal::Direction;
use crate::wire::{Envelope, Frame, Introduction, MissionId};
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
    /// It names a run that has ended, so it is an old frame or, without a key, a forged one.
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
    /// The runs that hellos have offered, the latest last, until a numbered frame proves that the peer has accepted one: at
    /// the vehicle at most one. At the surface, the hello of a run that the vehicle does not use may come in late, and must
    /// not displace the one that it uses.
    offered: Vec<LinkRun<T>>,
    /// At the surface: the offered run whose hello came in last, until a proof goes out.
    unproved: Option<Identity>,
    /// At the surface: the number in the current run of the next frame when an offer last came in or a proof went out.
    doubted_from: FrameNumber,
    /// At the vehicle: hellos of the current run before it has acknowledged any frame.
    doubts: u32,
    /// At the vehicle: `run` serves only to receive grants, because this end has begun a new one.
    leaving: bool,
    retired: VecDeque<EndedPeer>,
    /// At the surface: offers that were dropped, although the vehicle may use one of them.
    dropped: VecDeque<EndedPeer>,
    identities: Identities,
}

impl<T> Handshake<T> {
    /// Ended runs that are remembered.
    const MEMORY: usize = 32;
    /// Offered runs that the surface keeps.
    const OFFERS: usize = 4;
    /// Frames without any acknowledgement after which a vehicle doubts that the surface knows its run.
    const DOUBTFUL: u64 = 128;
    /// Hellos without any acknowledgement after which it does where a forged frame may have proven the run.
    const DOUBTS: u32 = 3;

    /// A handshake that has not begun.
    pub(super) fn new(mut identities: Identities) -> Self {
        Self {
            own: identities.draw(),
            run: None,
            offered: Vec::new(),
            unproved: None,
            doubted_from: 0,
            doubts: 0,
            leaving: false,
            retired: VecDeque::new(),
            dropped: VecDeque::new(),
            identities,
        }
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

    /// The run of the latest offer.
    pub(super) fn offered(&self) -> Option<&LinkRun<T>> {
        self.offered.last()
    }

    /// The offered run in which the next proof goes out: one whose hello has come in since the last proof, or the one with
    /// the fewest proofs, the latest of several.
    pub(super) fn provable(&self) -> Option<&LinkRun<T>> {
        let with_room = || self.offered.iter().rev().filter(|r| !r.flight.is_full());
        let waiting = with_room().find(|r| self.unproved == Some(r.peer));
        waiting.or_else(|| with_room().min_by_key(|r| r.flight.next_number()))
    }

    /// Whether the hello of an offered run has come in since the last proof: its sender still waits for one.
    pub(super) fn owes_proof(&self) -> bool {
        self.unproved.is_some() && self.provable().is_some_and(|r| self.unproved == Some(r.peer))
    }

    /// A proof was written: none is owed until the hello of an offered run comes in again.
    pub(super) fn note_proof(&mut self) {
        self.unproved = None;
        self.doubt();
    }

    /// Frames of ours from here on show that the vehicle uses the current run, if it acknowledges them.
    fn doubt(&mut self) {
        self.doubted_from = self.run.as_ref().map_or(0, |r| r.flight.next_number());
    }

    /// The number of proofs that were written in all offered runs.
    pub(super) fn proofs(&self) -> u64 {
        self.offered.iter().map(|r| r.flight.next_number() - 1).sum()
    }

    /// The frame, if it is sealed in an offered run, and the index of that run.
    pub(super) fn open_offered<'a>(
        &self,
        envelope: &Envelope<'a>,
        mission: MissionId,
        direction: Direction,
        keyed: bool,
    ) -> Option<(usize, Frame<'a>)> {
        let opened = |run: &LinkRun<T>| run.open(envelope, mission, direction, keyed);
        self.offered.iter().enumerate().find_map(|(index, run)| Some((index, opened(run)?)))
    }

    pub(super) fn is_leaving(&self) -> bool {
        self.leaving
    }

    /// At the vehicle: handles a hello of the surface. A new run of the surface is offered a new run of ours, and so is one
    /// that has ended here if `accepts_ended`, and the current one if it has acknowledged none of many frames of ours: it
    /// may have taken us for another run, or, where a frame `may_be_forged`, never have proven this one. A hello of another
    /// version has no introduction that can be read.
    pub(super) fn handle_call(
        &mut self,
        peer: Identity,
        introduction: Option<Introduction>,
        accepts_ended: bool,
        may_be_forged: bool,
        key: impl Fn(Identity, Identity) -> RunKey,
    ) -> HandshakeOutcome {
        let current = self.run.as_ref().filter(|r| r.peer == peer);
        let is_unacknowledged = current.is_some_and(|r| r.flight.horizon() == 0);
        self.doubts += u32::from(may_be_forged && is_unacknowledged);
        let is_long = current.is_some_and(|r| r.flight.next_number() > Self::DOUBTFUL);
        let is_doubtful = is_unacknowledged && (is_long || self.doubts >= Self::DOUBTS);
        if current.is_some() && !is_doubtful && !self.leaving {
            return HandshakeOutcome::Known;
        }
        if self.is_retired(peer) && !accepts_ended {
            return HandshakeOutcome::Retired;
        }
        match self.offered.last_mut().filter(|r| r.peer == peer) {
            Some(run) => run.introduce(introduction),
            None => {
                let own = self.identities.draw();
                self.offered = vec![LinkRun::of_any_version(own, peer, introduction, key(own, peer))];
            }
        }
        HandshakeOutcome::New
    }

    /// The run whose frames have this purpose; `None` for hellos.
    pub(super) fn run_for(&mut self, purpose: FramePurpose) -> Option<&mut LinkRun<T>> {
        match purpose {
            FramePurpose::Hello => None,
            FramePurpose::Proof => {
                let peer = self.provable().map(|r| r.peer);
                self.offered.iter_mut().find(|r| Some(r.peer) == peer)
            }
            FramePurpose::Content => self.run.as_mut(),
        }
    }

    /// At the surface: a frame of the current run came in. The vehicle uses no other run if it acknowledges a frame that went
    /// out after the last offer and the last proof; any other frame may be a late one, of before the vehicle took a proof.
    pub(super) fn handle_current(&mut self) {
        if self.run.as_ref().is_some_and(|r| r.flight.horizon() >= self.doubted_from) {
            while !self.offered.is_empty() {
                self.drop_oldest_offer();
            }
        }
    }

    /// Makes an offered run the current one, because a numbered frame of it came in. Later offers remain: the frame may be a
    /// late one, of before the vehicle took another proof.
    pub(super) fn accept_offered(&mut self, index: usize) {
        let mut runs = std::mem::take(&mut self.offered).into_iter().skip(index);
        if let Some(run) = runs.next() {
            self.offered = runs.collect();
            self.own = run.own;
            self.leaving = false;
            self.doubts = 0;
            self.replace(run);
            self.doubt();
        }
    }

    /// At the surface: handles a hello of the vehicle that is sealed to our run.
    pub(super) fn handle_answer(
        &mut self,
        peer: Identity,
        introduction: Introduction,
        key: impl Fn(Identity, Identity) -> RunKey,
    ) -> HandshakeOutcome {
        if self.run.as_ref().is_some_and(|r| r.peer == peer) {
            return HandshakeOutcome::Known;
        }
        // A hello that is sealed to a new run of ours cannot be of a run that ended before, although without a key it may have
        // the same number.
        if self.retired.iter().any(|r| r.identity == peer && r.own == self.own) {
            return HandshakeOutcome::Retired;
        }
        let new = || LinkRun::new(self.own, peer, introduction, key(self.own, peer));
        if self.run.is_none() {
            self.run = Some(new());
            return HandshakeOutcome::New;
        }
        let known = self.offered.iter().position(|r| r.peer == peer).map(|index| self.offered.remove(index));
        let offer = known.filter(|r| !r.flight.is_full()).unwrap_or_else(new);
        if self.offered.len() == Self::OFFERS {
            self.drop_oldest_offer();
        }
        self.offered.push(offer);
        self.unproved = Some(peer);
        self.doubt();
        HandshakeOutcome::Offered
    }

    /// At the vehicle: begins a new run toward the surface's current one.
    pub(super) fn renew_vehicle(&mut self, key: impl Fn(Identity, Identity) -> RunKey) {
        let Some((peer, introduction)) = self.run.as_ref().map(|r| (r.peer, r.introduction)) else { return };
        let own = self.identities.draw();
        self.offered = vec![LinkRun::new(own, peer, introduction, key(own, peer))];
        self.leaving = true;
    }

    /// At the surface: begins a new run, which a new handshake must introduce to the vehicle.
    pub(super) fn renew_surface(&mut self) {
        self.own = self.identities.draw();
        self.offered.clear();
        if let Some(old) = self.run.take() {
            self.retire(old);
        }
    }

    /// At the vehicle: forgets the run that it has offered to another run of a surface.
    pub(super) fn withdraw_offer(&mut self) {
        self.offered.clear();
    }

    fn drop_oldest_offer(&mut self) {
        self.dropped.push_back(self.offered.remove(0).end());
        if self.dropped.len() > Self::OFFERS {
            self.dropped.pop_front();
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

    /// The ended run of the peer, or the dropped offer, that sent this frame to a run of ours, if the frame came in for the first
    /// time.
    pub(super) fn ended_sender(
        &mut self,
        envelope: &Envelope<'_>,
        mission: MissionId,
        direction: Direction,
        keyed: bool,
    ) -> Option<&EndedPeer> {
        let ended = self.retired.iter_mut().chain(&mut self.dropped);
        ended.into_iter().find_map(|r| r.accept(envelope, mission, direction, keyed).then_some(&*r))
    }

    /// At the vehicle: the introduction of the surface that holds it, if that is another one than this.
    pub(super) fn other_holder(&self, caller: &Introduction) -> Option<&Introduction> {
        let (holder, calling) = (self.run.as_ref()?.introduction, caller.series?);
        let is_other = holder.series.is_some_and(|series| !series.is_of_same_surface(calling));
        self.run.as_ref().map(|run| &run.introduction).filter(|_| is_other)
    }

    fn retire(&mut self, run: LinkRun<T>) {
        self.retired.push_back(run.end());
        if self.retired.len() > Self::MEMORY {
            self.retired.pop_front();
        }
    }
}
