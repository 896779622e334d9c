//! The images of a recording of ROS 2 in MCAP.

pub(crate) mod parts;
pub(crate) mod stream;

use image::RgbImage;
use scenecast_core::UserError;
use scenecast_messages::sensor_msgs::{CompressedImage, Image};
use scenecast_messages::{CdrError, decode as decode_cdr};
use scenecast_sensors::{BitDepth, DecodeError, RawImageError, rgb_of};
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use stream::{BagMessage, BagStream, BagTopic};

/// The ROS types of the images that are read.
pub(crate) const RAW: &str = "sensor_msgs/msg/Image";
pub(crate) const COMPRESSED: &str = "sensor_msgs/msg/CompressedImage";

/// The images of one topic of a bag. They are read in order; going back reads the file again from its beginning.
pub struct Bag {
    path: PathBuf,
    topic: BagTopic,
    bits: BitDepth,
    position: Mutex<Position>,
}

/// The number of images before the next one of the stream.
struct Position {
    stream: Option<BagStream>,
    next: u64,
}

/// Why a message is no image.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error(transparent)]
enum BagImageError {
    Message(#[from] CdrError),
    Compressed(#[from] DecodeError),
    Raw(#[from] RawImageError),
}

impl Bag {
    pub(crate) fn new(path: &Path, topic: BagTopic, bits: BitDepth) -> Self {
        Self { path: path.to_owned(), topic, bits, position: Mutex::new(Position { stream: None, next: 0 }) }
    }

    pub(crate) fn topic(&self) -> &BagTopic {
        &self.topic
    }

    /// The image with this number, counted from 0 over all images of the topic.
    pub(crate) fn read(&self, number: u64) -> Result<RgbImage, UserError> {
        let mut position = self.position.lock().unwrap_or_else(PoisonError::into_inner);
        if position.stream.is_none() || number < position.next {
            *position = Position { stream: Some(BagStream::open(&self.path)?), next: 0 };
        }
        let Position { stream: Some(stream), next } = &mut *position else {
            return Err(UserError::Failed(format!("{}: it is not open", self.path.display())));
        };
        loop {
            // What lies behind damage follows, as when the images were counted.
            let Ok(message) = stream.next(|topic| *topic == self.topic) else { continue };
            let message = message.ok_or_else(|| UserError::file(&self.path, "the image is not there any more"))?;
            *next += 1;
            if *next == number + 1 {
                return self.decode(&message).map_err(|e| UserError::file(&self.path, format!("image {number}: {e}")));
            }
        }
    }

    fn decode(&self, message: &BagMessage) -> Result<RgbImage, BagImageError> {
        if self.topic.kind == COMPRESSED {
            let image: CompressedImage = decode_cdr(&message.bytes)?;
            return Ok(scenecast_sensors::decode(&image.data, self.bits)?);
        }
        let image: Image = decode_cdr(&message.bytes)?;
        let mut bits = self.bits;
        Ok(rgb_of(&image, &mut bits)?)
    }
}

impl fmt::Debug for Bag {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}#{}", self.path.display(), self.topic.name)
    }
}

/// Two frames are of the same bag if they are of the same file and topic.
impl PartialEq for Bag {
    fn eq(&self, other: &Self) -> bool {
        (&self.path, &self.topic) == (&other.path, &other.topic)
    }
}
