//! Names, files and the source of the camera's frames.

use super::Setting;
use crate::rule::Rule;
use serde_json::json;
use std::path::PathBuf;
use toml::Value;

impl Setting for String {
    fn read(value: &Value, _: &Rule) -> Option<Self> {
        value.as_str().map(str::to_owned)
    }

    fn write(&self) -> Value {
        Value::String(self.clone())
    }

    fn allowed(_: &Rule) -> String {
        "text in quotes".to_owned()
    }

    fn schema(_: &Rule) -> serde_json::Value {
        json!({ "type": "string" })
    }
}

impl Setting for PathBuf {
    fn read(value: &Value, _: &Rule) -> Option<Self> {
        value.as_str().map(Self::from)
    }

    fn write(&self) -> Value {
        Value::String(self.to_string_lossy().into_owned())
    }

    fn allowed(_: &Rule) -> String {
        "a path in quotes".to_owned()
    }

    fn schema(_: &Rule) -> serde_json::Value {
        json!({ "type": "string" })
    }
}

/// An empty text stands for none.
impl Setting for Option<PathBuf> {
    fn read(value: &Value, rule: &Rule) -> Option<Self> {
        let path = PathBuf::read(value, rule)?;
        Some((!path.as_os_str().is_empty()).then_some(path))
    }

    fn write(&self) -> Value {
        self.as_ref().map_or(Value::String(String::new()), PathBuf::write)
    }

    fn allowed(_: &Rule) -> String {
        "a path in quotes, or \"\"".to_owned()
    }

    fn schema(_: &Rule) -> serde_json::Value {
        json!({ "type": "string" })
    }
}

/// Where the camera's frames come from.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum CameraSource {
    /// The image of the rehearsal; at sea no camera.
    #[default]
    Rehearsal,
    /// A folder of images with `poses.csv`.
    Frames(PathBuf),
}

impl Setting for CameraSource {
    fn read(value: &Value, _: &Rule) -> Option<Self> {
        match value.as_str()? {
            "" => Some(Self::Rehearsal),
            text => text.strip_prefix("frames:").filter(|dir| !dir.is_empty()).map(|dir| Self::Frames(dir.into())),
        }
    }

    fn write(&self) -> Value {
        Value::String(match self {
            Self::Rehearsal => String::new(),
            Self::Frames(dir) => format!("frames:{}", dir.display()),
        })
    }

    fn allowed(_: &Rule) -> String {
        "\"frames:DIR\", or \"\"".to_owned()
    }

    fn schema(_: &Rule) -> serde_json::Value {
        json!({ "type": "string", "pattern": "^(frames:.+)?$" })
    }
}
