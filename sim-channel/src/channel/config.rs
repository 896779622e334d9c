//! The conditions of a channel.

use super::Outage;
use crate::loss::LossModel;
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
