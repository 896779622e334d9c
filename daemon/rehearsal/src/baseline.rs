//! The baseline: the whole PNG is sent again after each change of the map.

use scenecast_config::{Config, MapStream};

/// The same mission with the whole map as a PNG object, newest first, in place of the delta stream.
///
/// Frames, acknowledgements, repair of lost parts, turns and budget are the same.
pub(super) fn whole_png(config: &Config) -> Config {
    let mut config = config.clone();
    config.map.stream = MapStream::WholePng;
    config
}
