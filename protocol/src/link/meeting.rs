//! Which run of the peer we speak with: told by a hello, believed once a numbered frame proves it.

use super::run::{Identity, Run};
use crate::seal::SessionKey;
use crate::wire::SessionId;
use std::collections::VecDeque;

/// What a hello leads to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Greeting {
    /// The run we know.
    Known,
    /// A run that we did not know.
    New,
    /// A run that has ended: an old frame.
    Retired,
}

/// Runs toward one peer.
///
/// The surface begins: its hello names its run. The vehicle answers with a hello that is sealed to that run and names a
/// run of its own that is new for each run of the surface. So nothing that was sent to or by an earlier run of either end
/// verifies any more. The vehicle keeps the run that it had until a numbered frame of the new one comes in: a hello alone,
/// which may be late or replayed, changes nothing.
#[derive(Debug)]
pub(super) struct Meeting<T> {
    own: Identity,
    run: Option<Run<T>>,
    /// At the vehicle: what was answered to a hello, until a numbered frame proves that the surface means it.
    offered: Option<Run<T>>,
    /// At the vehicle: `run` is only good for hearing grants, since we have begun a new one.
    leaving: bool,
    retired: VecDeque<Identity>,
    random: u64,
}

impl<T> Meeting<T> {
    /// Ended runs to remember.
    const MEMORY: usize = 32;

    /// Nobody was met; `seed` is random for each start of the program.
    pub(super) fn new(seed: u64) -> Self {
        let mut random = seed;
        let own = fresh(&mut random);
        Self { own, run: None, offered: None, leaving: false, retired: VecDeque::new(), random }
    }

    pub(super) fn own(&self) -> Identity {
        self.own
    }

    pub(super) fn run(&self) -> Option<&Run<T>> {
        self.run.as_ref()
    }

    pub(super) fn run_mut(&mut self) -> Option<&mut Run<T>> {
        self.run.as_mut()
    }

    pub(super) fn offered(&self) -> Option<&Run<T>> {
        self.offered.as_ref()
    }

    pub(super) fn is_leaving(&self) -> bool {
        self.leaving
    }

    /// At the vehicle: a hello of the surface. A new run is offered one of ours.
    pub(super) fn handle_call(
        &mut self,
        peer: Identity,
        key: impl Fn(Identity, Identity) -> Option<SessionKey>,
    ) -> Greeting {
        if self.run.as_ref().is_some_and(|r| r.peer == peer) && !self.leaving {
            return Greeting::Known;
        }
        if self.retired.contains(&peer) {
            return Greeting::Retired;
        }
        if self.offered.as_ref().is_none_or(|r| r.peer != peer) {
            let own = fresh(&mut self.random);
            self.offered = Some(Run::new(own, peer, key(own, peer)));
        }
        Greeting::New
    }

    /// At the vehicle: a numbered frame has come in the run that was offered.
    pub(super) fn accept_offered(&mut self) {
        if let Some(run) = self.offered.take() {
            self.own = run.own;
            self.leaving = false;
            self.replace(run);
        }
    }

    /// At the surface: a hello of the vehicle that is sealed to our run.
    pub(super) fn handle_answer(
        &mut self,
        peer: Identity,
        key: impl Fn(Identity, Identity) -> Option<SessionKey>,
    ) -> Greeting {
        if self.run.as_ref().is_some_and(|r| r.peer == peer) {
            return Greeting::Known;
        }
        if self.retired.contains(&peer) {
            return Greeting::Retired;
        }
        self.replace(Run::new(self.own, peer, key(self.own, peer)));
        Greeting::New
    }

    /// At the vehicle: begins a new run toward the run of the surface that we know.
    pub(super) fn renew_vehicle(&mut self, key: impl Fn(Identity, Identity) -> Option<SessionKey>) {
        let Some(peer) = self.run.as_ref().map(|r| r.peer) else { return };
        let own = fresh(&mut self.random);
        self.offered = Some(Run::new(own, peer, key(own, peer)));
        self.leaving = true;
    }

    /// At the surface: begins a new run; the vehicle is to be greeted again.
    pub(super) fn renew_surface(&mut self) {
        self.own = fresh(&mut self.random);
        if let Some(old) = self.run.take() {
            self.retire(old.peer);
        }
    }

    fn replace(&mut self, run: Run<T>) {
        let peer = run.peer;
        if let Some(old) = self.run.replace(run)
            && old.peer != peer
        {
            self.retire(old.peer);
        }
    }

    fn retire(&mut self, peer: Identity) {
        self.retired.push_back(peer);
        if self.retired.len() > Self::MEMORY {
            self.retired.pop_front();
        }
    }
}

fn fresh(random: &mut u64) -> Identity {
    let session = SessionId::from_random(crate::random::next(random) as u16);
    Identity { session, nonce: crate::random::next(random) }
}
