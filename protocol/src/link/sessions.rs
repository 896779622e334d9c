//! Who speaks to whom in which run.

use crate::wire::SessionId;
use std::collections::VecDeque;

/// What a frame's session says about its sender.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sighting {
    /// The run we know.
    Known,
    /// A new run: everything it had acknowledged is void.
    New,
    /// A run that ended: an old frame.
    Retired,
}

/// Our session toward a peer, and the peer's.
#[derive(Debug)]
pub struct Sessions {
    own: SessionId,
    peer: Option<SessionId>,
    retired: VecDeque<SessionId>,
}

impl Sessions {
    /// Ended runs to remember.
    const MEMORY: usize = 16;

    /// A session of ours toward a peer that we know nothing of.
    pub fn new(own: SessionId) -> Self {
        Self { own, peer: None, retired: VecDeque::new() }
    }

    /// Our own session.
    pub fn own(&self) -> SessionId {
        self.own
    }

    /// The peer's session, once heard.
    pub fn peer(&self) -> Option<SessionId> {
        self.peer
    }

    /// Begins a new run of ours, so that the peer starts afresh with us.
    pub fn renew(&mut self, own: SessionId) {
        self.own = own;
    }

    /// Takes note of the session in a verified frame.
    pub fn observe(&mut self, session: SessionId) -> Sighting {
        if self.peer == Some(session) {
            return Sighting::Known;
        }
        if self.retired.contains(&session) {
            return Sighting::Retired;
        }
        if let Some(old) = self.peer.replace(session) {
            self.retired.push_back(old);
            if self.retired.len() > Self::MEMORY {
                self.retired.pop_front();
            }
        }
        Sighting::New
    }
}
