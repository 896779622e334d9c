//! Where the labels of the map come from, how they vote, and how long values of cells are held back.

use super::{HostPort, RosName, Setting, different, one_of, read_different};
use crate::rule::Rule;
use scenecast_protocol::map::Hold;
use serde_json::json;
use std::path::PathBuf;
use std::time::Duration;
use toml::Value;

/// A source of labels or of bands.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum LabelSource {
    /// No other program: labels are those of the scene model, from camera frames.
    #[default]
    SceneModel,
    /// Files of another program in a folder.
    Folder(PathBuf),
    /// Other programs that connect to this address and port.
    Network(HostPort),
    /// Other programs of this machine that connect to this Unix socket.
    Local(PathBuf),
    /// A topic of ROS 2, with the type of its messages if it is not the usual one of the key.
    Ros2(RosName, Option<LabelMessage>),
}

/// A type of messages of ROS 2 with labels or bands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LabelMessage {
    /// `nav_msgs/msg/OccupancyGrid`: a grid of bytes.
    OccupancyGrid,
    /// `sensor_msgs/msg/Image`: a segmented image of a camera.
    Image,
    /// `grid_map_msgs/msg/GridMap`: a grid with named layers.
    GridMap,
}

impl LabelMessage {
    const ALL: [Self; 3] = [Self::OccupancyGrid, Self::Image, Self::GridMap];

    /// The name of the type behind `#` in the setting of a source.
    pub fn name(self) -> &'static str {
        match self {
            Self::OccupancyGrid => "OccupancyGrid",
            Self::Image => "Image",
            Self::GridMap => "GridMap",
        }
    }
}

/// A topic with the type of its messages, as in `/labels#Image`.
fn topic(text: &str) -> Option<LabelSource> {
    let Some((topic, name)) = text.split_once('#') else { return Some(LabelSource::Ros2(RosName::parse(text)?, None)) };
    let message = LabelMessage::ALL.into_iter().find(|message| message.name() == name)?;
    Some(LabelSource::Ros2(RosName::parse(topic)?, Some(message)))
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
            "ros2" => topic(place),
            _ => None,
        }
    }

    fn write(&self) -> Value {
        Value::String(match self {
            Self::SceneModel => String::new(),
            Self::Folder(dir) => format!("dir:{}", dir.display()),
            Self::Network(place) => format!("socket:{place}"),
            Self::Local(path) => format!("socket:{}", path.display()),
            Self::Ros2(topic, None) => format!("ros2:{topic}"),
            Self::Ros2(topic, Some(message)) => format!("ros2:{topic}#{}", message.name()),
        })
    }

    fn allowed(_: &Rule) -> String {
        "\"dir:FOLDER\", \"socket:HOST:PORT\", \"socket:/PATH\", \"ros2:/TOPIC\", \"ros2:/TOPIC#TYPE\" with a TYPE of OccupancyGrid, \
         Image and GridMap, or \"\""
            .to_owned()
    }

    fn schema(_: &Rule) -> serde_json::Value {
        json!({ "type": "string", "pattern": "^((dir|socket|ros2):.+)?$" })
    }
}

/// The quantities between which a band has its levels.
#[derive(Debug, Clone, PartialEq)]
pub struct BandRange {
    /// The name of the band.
    pub band: String,
    pub low: f64,
    pub high: f64,
}

impl BandRange {
    fn parse(text: &str) -> Option<Self> {
        let (band, range) = text.split_once('=')?;
        let (low, high) = range.split_once("..")?;
        let (low, high) = (low.parse::<f64>().ok()?, high.parse::<f64>().ok()?);
        let is_word = |b: u8| b.is_ascii_lowercase() || b.is_ascii_digit() || b == b'_';
        let is_named = (1..=16).contains(&band.len()) && band.bytes().all(is_word);
        let is_range = low >= -1e9 && high <= 1e9 && high - low >= 1e-6;
        (is_named && is_range).then(|| Self { band: band.to_owned(), low, high })
    }
}

impl Setting for Vec<BandRange> {
    fn read(value: &Value, _: &Rule) -> Option<Self> {
        let ranges = read_different(value, |v| BandRange::parse(v.as_str()?))?;
        let differ = (1..ranges.len()).all(|i| ranges[..i].iter().all(|range| range.band != ranges[i].band));
        differ.then_some(ranges)
    }

    fn write(&self) -> Value {
        let text = |BandRange { band, low, high }: &BandRange| Value::String(format!("{band}={low}..{high}"));
        Value::Array(self.iter().map(text).collect())
    }

    fn allowed(_: &Rule) -> String {
        "a list of \"NAME=LOW..HIGH\", as in \"elevation=-40..-10\"; numbers from -1000000000 to 1000000000".to_owned()
    }

    fn schema(_: &Rule) -> serde_json::Value {
        different(json!({ "type": "string", "pattern": "^[a-z0-9_]{1,16}=[-+.0-9eE]+\\.\\.[-+.0-9eE]+$" }))
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

/// How long a new value of a cell must be stable before it is sent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Debounce {
    /// As long as the backlog takes.
    Automatic,
    Seconds(f64),
}

impl Debounce {
    const AUTOMATIC: &str = "auto";

    /// The rule for the labels at a budget of `bits_per_s`.
    pub fn hold(self, bits_per_s: u32) -> Hold {
        match self {
            Self::Automatic => Hold::Backlog(bits_per_s),
            Self::Seconds(s) => Hold::For(Duration::from_secs_f64(s)),
        }
    }

    /// The wait for a layer, which the automatic rule sends at once.
    pub fn of_layers(self) -> Duration {
        match self {
            Self::Automatic => Duration::ZERO,
            Self::Seconds(s) => Duration::from_secs_f64(s),
        }
    }
}

impl Setting for Debounce {
    fn read(value: &Value, rule: &Rule) -> Option<Self> {
        if value.as_str() == Some(Self::AUTOMATIC) {
            return Some(Self::Automatic);
        }
        f64::read(value, rule).map(Self::Seconds)
    }

    fn write(&self) -> Value {
        match self {
            Self::Automatic => Value::String(Self::AUTOMATIC.to_owned()),
            Self::Seconds(s) => s.write(),
        }
    }

    fn allowed(rule: &Rule) -> String {
        format!("{:?} or {}", Self::AUTOMATIC, f64::allowed(rule))
    }

    fn schema(rule: &Rule) -> serde_json::Value {
        json!({ "anyOf": [{ "const": Self::AUTOMATIC }, f64::schema(rule)] })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::load;
    use crate::rule::ANY;

    #[test]
    fn sources_of_labels_read_back() {
        let read = |text: &str| LabelSource::read(&Value::String(text.to_owned()), &ANY);
        let topics = ["ros2:/labels", "ros2:/seg/labels#Image", "ros2:/map#OccupancyGrid", "ros2:/layers#GridMap"];
        for text in ["", "dir:/data/labels", "socket:127.0.0.1:9000", "socket:/run/labels"].into_iter().chain(topics) {
            assert_eq!(read(text).unwrap().write().as_str(), Some(text));
        }
        assert!(matches!(read("socket:[::1]:9000"), Some(LabelSource::Network(_))));
        for text in ["dir:", "socket:9000", "labels", "file:x", "ros2:", "ros2:labels", "ros2:/a#image", "ros2:/a-b"] {
            assert_eq!(read(text), None, "{text}");
        }
    }

    #[test]
    fn ranges_of_bands_read_back() {
        let read = |texts: &[&str]| {
            Vec::<BandRange>::read(&Value::Array(texts.iter().map(|&t| Value::String(t.to_owned())).collect()), &ANY)
        };
        let ranges = read(&["elevation=-40..-10.5", "ph=7..9"]).unwrap();
        assert_eq!((ranges[0].low, ranges[0].high, &*ranges[1].band), (-40.0, -10.5, "ph"));
        assert_eq!(Vec::<BandRange>::read(&ranges.write(), &ANY), Some(ranges));
        for text in ["a=1..1", "a=1", "=1..2", "A=1..2", "a=x..2", "a=nan..2", "a=0..1e10", "abcdefghijklmnopq=0..1"] {
            assert_eq!(read(&[text]), None, "{text}");
        }
        assert_eq!(read(&["a=1..2", "a=1..3"]), None, "one range for a band");
    }

    #[test]
    fn a_debounce_is_automatic_or_a_number_of_seconds() {
        let read = |value: &str| load(None, &[format!("map.debounce_s={value}")]).map(|config| config.map.debounce_s);
        assert_eq!(load(None, &[]).unwrap().map.debounce_s, Debounce::Automatic);
        assert_eq!(read("auto").unwrap(), Debounce::Automatic);
        assert_eq!(read("2.5").unwrap(), Debounce::Seconds(2.5));
        let error = read("-1").unwrap_err().to_string();
        assert!(error.contains("\"auto\" or a number from 0 to 600 s"), "{error}");
        assert_eq!(Debounce::Automatic.hold(100), Hold::Backlog(100));
        assert_eq!(Debounce::Seconds(2.5).hold(100), Hold::For(Duration::from_millis(2500)));
    }
}
