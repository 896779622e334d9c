//! The log line about a missing key.

use scenecast_config::Config;

/// Warns of the risk of running without a key.
pub(super) fn warn_without_key(config: &Config) {
    if config.link.key_file.is_none() {
        tracing::warn!(
            "link.key_file is empty: whoever can transmit to the vehicle can give it orders and forge its map; \
             scenecast key new makes a key, and both ends need the same file"
        );
    }
}
