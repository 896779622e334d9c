//! Quality of service of the topics.

use ros2_client::qos::{Durability, History, QosProfile, Reliability, WhenFull};

/// The quality of service of a topic, by its use.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Qos {
    /// Sensors: best effort, with this depth. It matches every publisher.
    Sensor(usize),
    /// States and orders: reliable, not kept for later subscribers, with this depth.
    Reliable(usize),
    /// Latched: reliable, and the last ones are kept for later subscribers, with this depth.
    Latched(usize),
}

impl Qos {
    pub(crate) fn profile(self) -> QosProfile {
        // A publisher with a full window drops: its thread must not wait for a peer.
        let reliable = Reliability::Reliable { when_full: WhenFull::Fail };
        let (reliability, durability, depth) = match self {
            Self::Sensor(depth) => (Reliability::BestEffort, Durability::Volatile, depth),
            Self::Reliable(depth) => (reliable, Durability::Volatile, depth),
            Self::Latched(depth) => (reliable, Durability::TransientLocal, depth),
        };
        let profile = QosProfile::subscription_default().reliability(reliability).durability(durability);
        profile.history(History::KeepLast { depth })
    }
}
