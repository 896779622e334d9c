//! Scheduled silences of a channel.

use crate::nodes::NodeId;
use std::time::Duration;

/// A scheduled silence of the whole channel, of a node, or of one direction of a link.
///
/// ```
/// use sim_channel::{Channel, ChannelConfig, Duration, LossReason, NodeId, Outage, ReceptionOutcome, NodePosition};
///
/// let outages = vec![Outage::all(Duration::ZERO, Duration::from_secs(60))];
/// let mut channel = Channel::new(ChannelConfig { outages, ..ChannelConfig::default() }, 1);
/// channel.place(NodeId(1), NodePosition::new(0.0, 0.0, 0.0));
/// channel.place(NodeId(2), NodePosition::new(300.0, 0.0, 0.0));
/// channel.transmit(NodeId(1), vec![0; 8], Duration::from_millis(100), Duration::from_secs(30));
///
/// let arrival = channel.poll_arrival(Duration::MAX).unwrap();
/// assert!(matches!(arrival.outcome, ReceptionOutcome::Lost { reason: LossReason::Outage, .. }));
/// ```
#[derive(Clone, PartialEq, Debug)]
pub struct Outage {
    /// Start, since the start of the run; inclusive.
    pub from: Duration,
    /// End, since the start of the run; exclusive. `Duration::MAX` for ever.
    pub until: Duration,
    /// The links that are silent.
    pub scope: OutageScope,
}

/// The links that an outage silences.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum OutageScope {
    /// Every link of the channel.
    All,
    /// Both directions of every link of one node.
    Node(NodeId),
    /// One direction of one link; for ever, it makes a one-way link.
    Link {
        /// The sender that does not get through.
        from: NodeId,
        /// The receiver that it does not reach.
        to: NodeId,
    },
}

impl Outage {
    /// Silence of the whole channel from `from` (inclusive) to `until` (exclusive).
    #[must_use]
    pub fn all(from: Duration, until: Duration) -> Self {
        Self { from, until, scope: OutageScope::All }
    }

    /// `to` never receives `from`, while the other direction works.
    #[must_use]
    pub fn one_way(from: NodeId, to: NodeId) -> Self {
        Self { from: Duration::ZERO, until: Duration::MAX, scope: OutageScope::Link { from, to } }
    }

    /// Whether the outage touches a reception over `start..end` on the link `from` -> `to`.
    pub(crate) fn covers(&self, from: NodeId, to: NodeId, start: Duration, end: Duration) -> bool {
        let concerned = match self.scope {
            OutageScope::All => true,
            OutageScope::Node(node) => node == from || node == to,
            OutageScope::Link { from: f, to: t } => f == from && t == to,
        };
        concerned && start < self.until && self.from < end.max(start.saturating_add(Duration::from_nanos(1)))
    }
}
