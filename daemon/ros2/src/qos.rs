//! Quality of service of the topics.

use ros2_client::qos::{Durability, History, QosProfile, Reliability, WhenFull};
use rustdds::policy::ResourceLimits;
use rustdds::{QosPolicies, QosPolicyBuilder};

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

/// Bound of what RustDDS keeps of a topic of sensors: its default of 64 images would be 270 MB.
const SENSOR_SAMPLES: i32 = 8;

impl Qos {
    pub(crate) fn policies(self) -> QosPolicies {
        let policies = QosPolicies::from(&self.profile());
        let Self::Sensor(depth) = self else { return policies };
        let max_samples = i32::try_from(depth).unwrap_or(i32::MAX).max(SENSOR_SAMPLES);
        let limits = ResourceLimits { max_samples, max_instances: 1, max_samples_per_instance: max_samples };
        policies.modify_by(&QosPolicyBuilder::new().resource_limits(limits).build())
    }

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
