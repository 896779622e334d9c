//! Quality of service in the terms of DDS.

use crate::node::Qos;
use ros2_client::qos::{Durability, History, QosProfile, Reliability, WhenFull};

pub(super) fn profile(qos: Qos) -> QosProfile {
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
