//! Where images and poses come from: a kind, a colon, and a folder, a command or an address.

use super::Setting;
use crate::rule::Rule;
use serde_json::json;
use std::path::PathBuf;
use toml::Value;

/// A setting of the form `KIND:REST`, a word, or an empty text for the default.
macro_rules! sources {
    ($($(#[$doc:meta])* $name:ident { $(#[$empty_doc:meta])* $empty:ident, $([$word:ident = $word_text:literal $word_doc:literal],)* $($(#[$kind_doc:meta])* $kind:ident($rest:ty) = $prefix:literal $place:literal,)* })*) => { $(
        $(#[$doc])*
        #[derive(Debug, Clone, PartialEq, Eq, Default)]
        pub enum $name {
            $(#[$empty_doc])*
            #[default]
            $empty,
            $(#[doc = $word_doc] $word,)*
            $($(#[$kind_doc])* $kind($rest),)*
        }

        impl Setting for $name {
            fn read(value: &Value, _: &Rule) -> Option<Self> {
                let text = value.as_str()?;
                if text.is_empty() {
                    return Some(Self::$empty);
                }
                $(if text == $word_text {
                    return Some(Self::$word);
                })*
                let (kind, rest) = text.split_once(':').filter(|(_, rest)| !rest.is_empty())?;
                match kind {
                    $($prefix => Some(Self::$kind(rest.into())),)*
                    _ => None,
                }
            }

            fn write(&self) -> Value {
                Value::String(match self {
                    Self::$empty => String::new(),
                    $(Self::$word => $word_text.to_owned(),)*
                    $(Self::$kind(rest) => format!(concat!($prefix, ":{}"), rest.place_text()),)*
                })
            }

            fn allowed(_: &Rule) -> String {
                [$(concat!("\"", $prefix, ":", $place, "\""),)* $(concat!("\"", $word_text, "\""),)* "or \"\""].join(", ")
            }

            fn schema(_: &Rule) -> serde_json::Value {
                let kinds = [$($prefix),*].join("|");
                json!({ "type": "string", "pattern": format!(concat!("^(({kinds}):.+", $("|", $word_text,)* ")?$"), kinds = kinds) })
            }
        }
    )* };
}

/// The text of a folder or of another place.
trait PlaceText {
    fn place_text(&self) -> String;
}

impl PlaceText for PathBuf {
    fn place_text(&self) -> String {
        self.to_string_lossy().into_owned()
    }
}

impl PlaceText for String {
    fn place_text(&self) -> String {
        self.clone()
    }
}

sources! {
    /// Where the camera's frames come from.
    CameraSource {
        /// The image of the rehearsal; at sea no camera.
        Rehearsal,
        /// A folder of images with `poses.csv`.
        Frames(PathBuf) = "frames" "DIR",
        /// A folder of an RGB-D sequence in the layout of the TUM benchmark.
        Tum(PathBuf) = "tum" "DIR",
        /// A folder into which a program writes images.
        Watch(PathBuf) = "watch" "DIR",
        /// A shell command that writes images to its standard output.
        Command(String) = "command" "SHELL COMMAND",
        /// A camera of the system, read by ffmpeg.
        V4l2(PathBuf) = "v4l2" "DEVICE",
        /// A recording of ROS 2 in the format MCAP, with the topic of the images if there are several.
        Bag(String) = "bag" "FILE#TOPIC",
        /// A topic of images in ROS 2.
        Ros2(String) = "ros2" "TOPIC",
    }

    /// Where the distances of a live camera's pixels come from.
    DepthSource {
        /// Nothing measures them; the sea floor counts as flat.
        None,
        /// A topic of depth images in ROS 2.
        Ros2(String) = "ros2" "TOPIC",
        /// A topic of point clouds in ROS 2.
        Cloud(String) = "cloud" "TOPIC",
    }

    /// Where the calibration of the camera comes from.
    CalibrationSource {
        /// The topic beside that of the images, if there is one.
        Beside,
        [None = "none" "There is none."],
        /// A file that ROS wrote.
        File(PathBuf) = "file" "FILE",
        /// A topic of ROS 2.
        Ros2(String) = "ros2" "TOPIC",
    }

    /// Where the vehicle's pose comes from.
    NavigationSource {
        /// The autopilot, or the recording of the camera.
        Autopilot,
        /// A file of poses in the format of the TUM benchmark.
        Tum(PathBuf) = "tum" "FILE",
        /// A Doppler velocity log of Water Linked.
        Dvl(String) = "dvl" "HOST:PORT",
        /// A topic of odometry in ROS 2.
        Ros2(String) = "ros2" "TOPIC",
        /// The transforms of ROS 2 between two frames.
        Tf(String) = "tf" "WORLD#VEHICLE",
    }
}

impl NavigationSource {
    /// The frame of east, north, up and that of the vehicle between which transforms give the pose; `None` for other
    /// sources, and if there are not two names.
    pub fn frames(&self) -> Option<(&str, &str)> {
        let Self::Tf(frames) = self else { return None };
        frames.split_once('#').filter(|(world, vehicle)| !world.is_empty() && !vehicle.is_empty())
    }

    /// Whether poses come in while the vehicle dives, and not from its autopilot.
    pub fn is_live(&self) -> bool {
        matches!(self, Self::Dvl(_) | Self::Ros2(_) | Self::Tf(_))
    }
}

impl CameraSource {
    /// Whether the images come in while the vehicle dives, so that their poses must be measured at the same time.
    pub fn is_live(&self) -> bool {
        matches!(self, Self::Watch(_) | Self::Command(_) | Self::V4l2(_) | Self::Ros2(_))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rule::ANY;

    #[test]
    fn a_source_is_a_kind_and_a_place() {
        for text in ["", "frames:a", "command:ffmpeg -i rtsp://x:1/y -", "watch:/a b", "ros2:/camera/image_raw"] {
            let value = Value::String(text.to_owned());
            assert_eq!(CameraSource::read(&value, &ANY).unwrap().write(), value);
        }
        for wrong in ["frames", "frames:", "video:x", ":x"] {
            assert_eq!(CameraSource::read(&Value::String(wrong.to_owned()), &ANY), None, "{wrong}");
        }
        let none = Value::String("none".to_owned());
        assert_eq!(CalibrationSource::read(&none, &ANY), Some(CalibrationSource::None));
        assert_eq!(CalibrationSource::None.write(), none);
        assert_eq!(CalibrationSource::allowed(&ANY), "\"file:FILE\", \"ros2:TOPIC\", \"none\", or \"\"");
        assert_eq!(CalibrationSource::schema(&ANY)["pattern"], "^((file|ros2):.+|none)?$");
        assert_eq!(
            NavigationSource::allowed(&ANY),
            "\"tum:FILE\", \"dvl:HOST:PORT\", \"ros2:TOPIC\", \"tf:WORLD#VEHICLE\", or \"\""
        );
    }
}
