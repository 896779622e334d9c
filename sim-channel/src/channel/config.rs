//! The conditions of a channel, and its scheduled silences.

use crate::loss::LossModel;
use crate::nodes::NodeId;
use std::time::Duration;

/// The conditions of a channel.
///
/// [`Channel::set_config`](super::Channel::set_config) changes them while the channel runs; [`presets`](super::presets)
/// has the conditions of common situations.
#[derive(Clone, PartialEq, Debug)]
pub struct ChannelConfig {
    /// Speed of sound, m/s; 1300..=1700 in water. Default 1500.
    pub sound_speed_m_s: f64,
    /// Whether a node cannot receive while it transmits. Default true.
    pub half_duplex: bool,
    /// Loss on each directed link without a model of its own. Default: no loss.
    pub loss: LossModel,
    /// Probability 0..=1 that a delivered frame arrives with flipped bits. Default 0.
    pub corruption: f64,
    /// Probability 0..=1 that a delivered frame is handed over twice. Default 0.
    pub duplication: f64,
    /// Probability 0..=1 that a copy is handed over late, so that later frames overtake it. Default 0.
    pub reordering: f64,
    /// Delay of such a late copy. Default 5 s.
    pub reorder_delay: Duration,
    /// Slant range beyond which no signal is detected, m. Default: no limit.
    pub max_range_m: f64,
    /// Scheduled silences of links, nodes or the channel. Default none.
    pub outages: Vec<Outage>,
}

impl Default for ChannelConfig {
    fn default() -> Self {
        Self {
            sound_speed_m_s: 1500.0,
            half_duplex: true,
            loss: LossModel::None,
            corruption: 0.0,
            duplication: 0.0,
            reordering: 0.0,
            reorder_delay: Duration::from_secs(5),
            max_range_m: f64::INFINITY,
            outages: Vec::new(),
        }
    }
}

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
