//! Quality of service in the terms of DDS.

use crate::transport::Qos;
use ros2_client::qos::{Durability, History, QosProfile, Reliability, WhenFull};
use rustdds::policy::ResourceLimits;
use rustdds::{QosPolicies, QosPolicyBuilder};

/// Bound of what RustDDS keeps of a topic of sensors: by its default, 64 images of 1360 x 1024 would take 270 MB.
const SENSOR_SAMPLES: i32 = 8;

/// The policies of a topic.
pub(super) fn policies(qos: Qos) -> QosPolicies {
    let policies = QosPolicies::from(&profile(qos));
    let Qos::Sensor(depth) = qos else { return policies };
    let max_samples = i32::try_from(depth).unwrap_or(i32::MAX).max(SENSOR_SAMPLES);
    let limits = ResourceLimits { max_samples, max_instances: 1, max_samples_per_instance: max_samples };
    policies.modify_by(&QosPolicyBuilder::new().resource_limits(limits).build())
}

fn profile(qos: Qos) -> QosProfile {
    // A publisher with a full window drops: its thread must not wait for a peer.
    let reliable = Reliability::Reliable { when_full: WhenFull::Fail };
    let (reliability, durability, depth) = match qos {
        Qos::Sensor(depth) => (Reliability::BestEffort, Durability::Volatile, depth),
        Qos::Reliable(depth) => (reliable, Durability::Volatile, depth),
        Qos::Latched(depth) => (reliable, Durability::TransientLocal, depth),
    };
    let profile = QosProfile::subscription_default().reliability(reliability).durability(durability);
    profile.history(History::KeepLast { depth })
}
