//! Where the labels of the map come from, and how they vote.

use super::{HostPort, Setting, one_of};
use crate::rule::Rule;
use serde_json::json;
use std::path::PathBuf;
use toml::Value;

/// The producer of the label map.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum LabelSource {
    /// The scene model, from camera frames.
    #[default]
    SceneModel,
    /// Files of another program in a folder.
    Folder(PathBuf),
    /// Other programs that connect to this address and port.
    Network(HostPort),
    /// Other programs of this machine that connect to this Unix socket.
    Local(PathBuf),
    /// A topic of ROS 2.
    Ros2(String),
}

impl Setting for LabelSource {
    fn read(value: &Value, _: &Rule) -> Option<Self> {
        let text = value.as_str()?;
        if text.is_empty() {
            return Some(Self::SceneModel);
        }
        let (kind, place) = text.split_once(':').filter(|(_, place)| !place.is_empty())?;
        match kind {
            "dir" => Some(Self::Folder(place.into())),
            "socket" if place.contains('/') => Some(Self::Local(place.into())),
            "socket" => HostPort::parse(place).map(Self::Network),
            "ros2" => Some(Self::Ros2(place.to_owned())),
            _ => None,
        }
    }

    fn write(&self) -> Value {
        Value::String(match self {
            Self::SceneModel => String::new(),
            Self::Folder(dir) => format!("dir:{}", dir.display()),
            Self::Network(place) => format!("socket:{place}"),
            Self::Local(path) => format!("socket:{}", path.display()),
            Self::Ros2(topic) => format!("ros2:{topic}"),
        })
    }

    fn allowed(_: &Rule) -> String {
        "\"dir:FOLDER\", \"socket:HOST:PORT\", \"socket:/PATH\", \"ros2:TOPIC\", or \"\"".to_owned()
    }

    fn schema(_: &Rule) -> serde_json::Value {
        json!({ "type": "string", "pattern": "^((dir|socket|ros2):.+)?$" })
    }
}

/// Which images vote for the class of a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Votes {
    /// All that have shown the cell.
    #[default]
    All,
    /// The newest one that has shown the cell.
    Newest,
}

impl Setting for Votes {
    fn read(value: &Value, _: &Rule) -> Option<Self> {
        match value.as_str()? {
            "all" => Some(Self::All),
            "newest" => Some(Self::Newest),
            _ => None,
        }
    }

    fn write(&self) -> Value {
        Value::String(match self {
            Self::All => "all".to_owned(),
            Self::Newest => "newest".to_owned(),
        })
    }

    fn allowed(_: &Rule) -> String {
        "\"all\" or \"newest\"".to_owned()
    }

    fn schema(_: &Rule) -> serde_json::Value {
        one_of(&["all", "newest"])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rule::ANY;

    #[test]
    fn sources_of_labels_read_back() {
        let read = |text: &str| LabelSource::read(&Value::String(text.to_owned()), &ANY);
        for text in ["", "dir:/data/labels", "socket:127.0.0.1:9000", "socket:/run/labels", "ros2:/labels"] {
            assert_eq!(read(text).unwrap().write().as_str(), Some(text));
        }
        assert!(matches!(read("socket:[::1]:9000"), Some(LabelSource::Network(_))));
        for text in ["dir:", "socket:9000", "labels", "file:x", "ros2:"] {
            assert_eq!(read(text), None, "{text}");
        }
    }
}
