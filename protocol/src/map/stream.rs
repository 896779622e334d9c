//! What the link asks of a state that it replicates; the label map is one.

use crate::time::Instant;
use std::fmt::Debug;

/// The sending side of a replicated state: knows what the peer is known to hold and what it ought to hold.
pub trait StateSource: Debug {
    /// What one chunk changes at the peer.
    type Carried: Debug;

    /// The most useful chunk of at most `room` bytes, if anything is left to say; from then on it is on its way.
    fn next_chunk(&mut self, room: usize, now: Instant) -> Option<(Vec<u8>, Self::Carried)>;

    /// The fate of a chunk is known. Fates must be told in the order of frame numbers.
    fn handle_fate(&mut self, carried: Self::Carried, delivered: bool, now: Instant);

    /// The peer has lost all that it held.
    fn handle_peer_restart(&mut self, now: Instant);

    /// Time has passed: changes that were held back may be due. Says whether any was.
    fn handle_timeout(&mut self, _now: Instant) -> bool {
        false
    }

    /// When changes that are held back become due, or a little earlier; `None` if none is held back.
    fn next_due(&self) -> Option<Instant> {
        None
    }

    /// About how many bytes wait for their first or next transmission, without what is held back.
    fn backlog_bytes(&self) -> usize;

    /// Whether what waits only refines a coarse picture of the whole that has been said, and there is much of it.
    fn is_refining(&self) -> bool {
        false
    }

    /// The same for people: a turn would rather be too long than too short, a person is told what is likely.
    fn told_backlog_bytes(&self) -> usize {
        self.backlog_bytes()
    }

    /// Whether nothing waits or is on its way, though something may be held back.
    fn is_quiet(&self) -> bool {
        self.is_settled()
    }

    /// Whether the peer is known to hold everything.
    fn is_settled(&self) -> bool;

    /// Fingerprint of what the peer is known to hold.
    fn digest(&self) -> u16;
}

/// The receiving side of a replicated state.
pub trait StateReplica: Debug + Default {
    /// Applies a chunk of frame `number`; frames may come in any order. `false` if it makes no sense here.
    fn apply(&mut self, number: u64, chunk: &[u8], now: Instant) -> bool;

    /// The sender now bases its chunks on every frame up to `horizon`.
    fn advance_base(&mut self, horizon: u64);

    /// Fingerprint of what the sender knows us to hold.
    fn base_digest(&self) -> u16;

    /// Counts changes of what is shown.
    fn version(&self) -> u64;

    /// Forgets everything: the sender began afresh.
    fn clear(&mut self);
}
