//! Opens sessions as the default settings of rmw_zenoh do.

use scenecast_config::Ros2;
use zenoh::{Config, Session, Wait};

/// Bytes of a received message at most: an image of 20 megapixels.
const MAX_MESSAGE: usize = 64 << 20;

/// A session that connects to the router in the background, and again whenever the connection ends.
pub(super) fn open(settings: &Ros2) -> zenoh::Result<Session> {
    let router = format!("[\"{}\"]", settings.zenoh_router);
    let max_message = MAX_MESSAGE.to_string();
    let mut config = Config::default();
    for (key, value) in [
        ("mode", r#""peer""#),
        ("connect/endpoints", &router),
        ("connect/timeout_ms", "-1"),
        ("connect/exit_on_failure", "false"),
        // Peers on this machine send their samples without the router.
        ("listen/endpoints", r#"["tcp/localhost:0"]"#),
        ("open/return_conditions/connect_scouted", "false"),
        ("scouting/multicast/enabled", "false"),
        ("scouting/gossip/target", r#"{ router: ["router", "peer"], peer: ["router"] }"#),
        ("scouting/gossip/autoconnect_strategy", r#"{ peer: { to_router: "always", to_peer: "greater-zid" } }"#),
        // Samples that are kept for later subscribers are told apart by their times.
        ("timestamping/enabled", "true"),
        ("transport/link/rx/max_message_size", &max_message),
    ] {
        config.insert_json5(key, value)?;
    }
    zenoh::open(config).wait()
}
