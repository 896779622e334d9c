//! Which transports see peers, as a part of diagnostics.

use crate::transport::{Peers, Transport, counts};
use scenecast_messages::diagnostic_msgs::DiagnosticStatus;
use scenecast_outlets::Health;

/// `has_router` is `None` if rmw_zenoh is not used.
pub(super) fn health(by_transport: &[(Transport, Peers)], has_router: Option<bool>) -> Health {
    let level = if has_router == Some(false) { DiagnosticStatus::WARN } else { DiagnosticStatus::OK };
    let router = if has_router == Some(false) { "; no router of Zenoh" } else { "" };
    let message = format!("peers: {}{router}", counts(by_transport));
    let mut values: Vec<(&'static str, String)> =
        by_transport.iter().map(|(transport, peers)| (key(*transport), peers.participants.to_string())).collect();
    values.extend(has_router.map(|has| ("zenoh_router", has.to_string())));
    Health { level, part: "ros2", message, values }
}

fn key(transport: Transport) -> &'static str {
    match transport {
        Transport::Dds => "dds_peers",
        Transport::Zenoh => "zenoh_peers",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn diagnostics_name_the_transport_that_sees_peers() {
        let peers = |participants| Peers { participants, ..Peers::default() };
        let both = [(Transport::Dds, peers(0)), (Transport::Zenoh, peers(2))];
        let seen = health(&both, Some(true));
        assert_eq!((seen.level, seen.message.as_str()), (DiagnosticStatus::OK, "peers: 0 on DDS, 2 on rmw_zenoh"));
        assert!(seen.values.contains(&("zenoh_peers", "2".to_owned())));
        assert_eq!(health(&both, Some(false)).level, DiagnosticStatus::WARN);
        assert_eq!(health(&both[..1], None).message, "peers: 0 on DDS");
    }
}
