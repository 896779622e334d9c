//! Log lines about missing keys and frames that are not authentic.

use scenecast_config::Config;
use scenecast_protocol::link::{DropReason, LinkStats};

/// Warns of the risk of running without a key.
pub(super) fn warn_without_key(config: &Config) {
    if config.link.key_file.is_none() {
        tracing::warn!(
            "link.key_file is empty: whoever can transmit to the vehicle can give it orders and forge its map; \
             scenecast key new makes a key, and both ends need the same file"
        );
    }
}

/// Logs the first refusal of each kind; the others are only counted.
#[derive(Debug, Default)]
pub(super) struct Refusals {
    has_unauthenticated: bool,
    has_keyed: bool,
}

impl Refusals {
    /// Checks the counters of refused frames.
    pub(super) fn note(&mut self, stats: &LinkStats) {
        let is_there = |reason| stats.dropped.contains_key(&reason);
        if !self.has_unauthenticated && is_there(DropReason::Unauthenticated) {
            self.has_unauthenticated = true;
            tracing::warn!(
                "a frame was refused, for it is not under the key of link.key_file: it is forged, or the other end has \
                 another key or none; further ones are only counted"
            );
        }
        if !self.has_keyed && is_there(DropReason::Keyed) {
            self.has_keyed = true;
            tracing::warn!("a frame is under a key, and link.key_file is empty here; further ones are only counted");
        }
    }
}
