//! The labels of other programs at the start of a run: their checkpoint, and their source.

use super::feed::Feed;
use crate::checkpoint::CheckpointFile;
use crate::journal::Folder;
use scenecast_config::{Config, LabelSource};
use scenecast_core::UserError;
use scenecast_files::LabelFolder;
use scenecast_vehicle::ForeignMap;

/// The map of the last checkpoint and the number of its mission; `None` without a usable one.
pub(crate) fn restore(config: &Config, file: &CheckpointFile<Folder>) -> Option<(ForeignMap, u64)> {
    let bytes = file.read().unwrap_or_else(|error| {
        tracing::error!("{error}; the labels start from scratch");
        None
    })?;
    let restored = ForeignMap::restore(config, &bytes);
    restored.inspect_err(|why| tracing::error!("{}: {why}; the labels start from scratch", file.path().display())).ok()
}

impl Feed {
    /// The configured source. A folder resumes after the item `mark`.
    pub(crate) fn open(config: &Config, mark: Option<&str>) -> Result<Self, UserError> {
        match &config.labels.source {
            LabelSource::SceneModel => Err(UserError::Input("labels.source is empty".to_owned())),
            LabelSource::Folder(dir) if !dir.is_dir() => {
                Err(UserError::file(dir, "labels.source: there is no such folder"))
            }
            LabelSource::Folder(dir) => Ok(Self::folder(LabelFolder::new(dir, mark.map(str::to_owned)))),
            LabelSource::Network(place) => super::serve::network(place.as_str()),
            #[cfg(unix)]
            LabelSource::Local(path) => super::local::local(path),
            #[cfg(not(unix))]
            LabelSource::Local(_) => Err(UserError::Input("labels.source: this system has no Unix sockets".to_owned())),
            LabelSource::Ros2(topic) => {
                let without = format!("labels.source: this build has no ROS 2, so that {topic} cannot be read");
                Err(UserError::Input(without))
            }
        }
    }
}
