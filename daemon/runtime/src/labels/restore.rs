//! The labels of other programs at the start of a run: their checkpoint, and their source.

use super::feed::{Feed, Feeds};
use super::topic::TopicFeed;
use crate::checkpoint::CheckpointFile;
use crate::journal::Folder;
use scenecast_config::{Config, LabelMessage, LabelSource};
use scenecast_core::UserError;
use scenecast_files::LabelFolder;
use scenecast_vehicle::{ForeignMap, ForeignSource};

/// The map of the last checkpoint and the number of its mission; `None` without a usable one.
pub(crate) fn restore(config: &Config, file: &CheckpointFile<Folder>) -> Option<(ForeignMap, u64)> {
    let bytes = file.read().unwrap_or_else(|error| {
        tracing::error!("{error}; the labels start from scratch");
        None
    })?;
    let restored = ForeignMap::restore(config, &bytes);
    restored.inspect_err(|why| tracing::error!("{}: {why}; the labels start from scratch", file.path().display())).ok()
}

/// How a topic of ROS 2 is opened.
pub(crate) type OpenTopic<'a> = &'a dyn Fn(TopicFeed) -> Result<Feed, UserError>;

/// Opens the configured sources. Folders resume after the last items in `map`.
pub(crate) fn open(config: &Config, map: &ForeignMap, topic: OpenTopic<'_>) -> Result<Feeds, UserError> {
    let sources = [(ForeignSource::Labels, &config.labels.source), (ForeignSource::Bands, &config.bands.source)];
    let opened = sources.into_iter().filter(|(_, place)| **place != LabelSource::SceneModel);
    let opened = opened.map(|(source, place)| Ok((source, feed(config, source, place, map.mark(source), topic)?)));
    Ok(Feeds::new(opened.collect::<Result<_, UserError>>()?))
}

/// A source. A folder resumes after the item `mark`.
fn feed(
    config: &Config,
    source: ForeignSource,
    place: &LabelSource,
    mark: Option<&str>,
    open_topic: OpenTopic<'_>,
) -> Result<Feed, UserError> {
    let (key, usual) = match source {
        ForeignSource::Labels => ("labels.source", LabelMessage::OccupancyGrid),
        ForeignSource::Bands => ("bands.source", LabelMessage::GridMap),
    };
    match place {
        LabelSource::SceneModel => Err(UserError::Input(format!("{key} is empty"))),
        LabelSource::Folder(dir) if !dir.is_dir() => {
            Err(UserError::file(dir, format!("{key}: there is no such folder")))
        }
        LabelSource::Folder(dir) => Ok(Feed::folder(LabelFolder::new(dir, mark.map(str::to_owned)))),
        LabelSource::Network(place) => super::serve::network(place.as_str(), key),
        #[cfg(unix)]
        LabelSource::Local(path) => super::local::local(path, key),
        #[cfg(not(unix))]
        LabelSource::Local(_) => Err(UserError::Input(format!("{key}: this system has no Unix sockets"))),
        LabelSource::Ros2(topic, message) => {
            let (topic, message) = (topic.clone(), message.unwrap_or(usual));
            open_topic(TopicFeed { topic, message, source, frame: config.labels.frame.clone() })
        }
    }
}
