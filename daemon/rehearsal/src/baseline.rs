//! The comparison: send the whole PNG again whenever the map has changed.

use scenecast_config::{Config, MapStream};

/// The same mission with the whole map as a PNG object, newest first, in place of the delta stream.
///
/// Everything else is the same: frames, acknowledgements, repair of lost parts, turns, budget.
pub(super) fn whole_png(config: &Config) -> Config {
    let mut config = config.clone();
    config.map.stream = MapStream::WholePng;
    config
}
