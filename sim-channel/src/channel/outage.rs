//! Times at which nothing gets through.

use crate::nodes::NodeId;
use std::time::Duration;

/// A scheduled silence of the whole channel, of a node, or of one direction of a link.
#[derive(Clone, PartialEq, Debug)]
pub struct Outage {
    /// Start, since the start of the run; inclusive.
    pub from: Duration,
    /// End, since the start of the run; exclusive. `Duration::MAX` for ever.
    pub until: Duration,
    /// Whom it concerns.
    pub scope: OutageScope,
}

/// What an outage silences.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum OutageScope {
    /// Everything.
    All,
    /// All that a node sends or should receive.
    Node(NodeId),
    /// One direction only; alone and for ever it makes a one-way link.
    Link {
        /// The sender that is not heard.
        from: NodeId,
        /// The receiver that does not hear it.
        to: NodeId,
    },
}

impl Outage {
    /// Silence of the whole channel between two times.
    pub fn all(from: Duration, until: Duration) -> Self {
        Self { from, until, scope: OutageScope::All }
    }

    /// `to` never hears `from`, while the other direction works.
    pub fn one_way(from: NodeId, to: NodeId) -> Self {
        Self { from: Duration::ZERO, until: Duration::MAX, scope: OutageScope::Link { from, to } }
    }

    /// Whether a reception over `start..end` on the link `from` -> `to` is touched.
    pub(crate) fn covers(&self, from: NodeId, to: NodeId, start: Duration, end: Duration) -> bool {
        let concerned = match self.scope {
            OutageScope::All => true,
            OutageScope::Node(node) => node == from || node == to,
            OutageScope::Link { from: f, to: t } => f == from && t == to,
        };
        concerned && start < self.until && self.from < end.max(start.saturating_add(Duration::from_nanos(1)))
    }
}
