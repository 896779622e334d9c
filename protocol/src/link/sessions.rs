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
    /// A retired run that is heard while the known one is silent, and how often.
    returning: Option<(SessionId, u32)>,
}

impl Sessions {
    /// Ended runs to remember.
    const MEMORY: usize = 16;
    /// Frames of a retired run, with none of the known one between them, after which it counts as alive. A frame that was
    /// long under way can make an ended run look new and the living one retired; this undoes it.
    const RETURNS: u32 = 3;

    /// A session of ours toward a peer that we know nothing of.
    pub fn new(own: SessionId) -> Self {
        Self { own, peer: None, retired: VecDeque::new(), returning: None }
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
            self.returning = None;
            return Sighting::Known;
        }
        if self.retired.contains(&session) && !self.has_returned(session) {
            return Sighting::Retired;
        }
        self.returning = None;
        self.retired.retain(|&old| old != session);
        if let Some(old) = self.peer.replace(session) {
            self.retired.push_back(old);
            if self.retired.len() > Self::MEMORY {
                self.retired.pop_front();
            }
        }
        Sighting::New
    }

    fn has_returned(&mut self, session: SessionId) -> bool {
        let before = self.returning.filter(|(s, _)| *s == session).map_or(0, |(_, n)| n);
        self.returning = Some((session, before + 1));
        before + 1 >= Self::RETURNS
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_living_run_comes_back_after_a_late_frame_of_an_ended_one_displaced_it() {
        let [ended, living] = [1, 2].map(SessionId::from_random);
        let mut sessions = Sessions::new(SessionId::from_random(9));
        assert_eq!(sessions.observe(living), Sighting::New);
        assert_eq!(sessions.observe(ended), Sighting::New, "never heard before: it may be a restart");
        let seen: Vec<Sighting> = (0..4).map(|_| sessions.observe(living)).collect();
        assert_eq!(seen, [Sighting::Retired, Sighting::Retired, Sighting::New, Sighting::Known]);
        assert_eq!(sessions.observe(ended), Sighting::Retired);
    }
}
