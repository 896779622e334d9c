//! What the water does.

use super::Outage;
use crate::loss::LossModel;
use std::time::Duration;

/// The conditions of a channel; may be changed while it runs with `set_config`.
#[derive(Clone, PartialEq, Debug)]
pub struct ChannelConfig {
    /// Speed of sound, m/s; 1300..=1700 in water. Default 1500.
    pub sound_speed_m_s: f64,
    /// Whether a node that transmits is deaf. Default true.
    pub half_duplex: bool,
    /// How frames are lost on each directed link. Default none.
    pub loss: LossModel,
    /// Probability 0..=1 that a delivered frame arrives with flipped bits. Default 0.
    pub corruption: f64,
    /// Probability 0..=1 that a delivered frame is handed over twice. Default 0.
    pub duplication: f64,
    /// Probability 0..=1 that a copy is handed over late, so that later frames overtake it. Default 0.
    pub reordering: f64,
    /// How late such a copy is. Default 5 s.
    pub reorder_delay: Duration,
    /// Beyond this slant range, in metres, nothing is noticed. Default: no limit.
    pub max_range_m: f64,
    /// When nothing gets through. Default never.
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
