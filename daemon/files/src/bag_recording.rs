//! Bags as recordings: the images of one topic at the poses of their odometry.

use crate::bag::stream::{BagMessage, BagStream, BagTopic};
use crate::bag::{Bag, COMPRESSED, RAW};
use crate::frame_image::FrameImage;
use crate::recording::{RecordedFrame, Recording};
use scenecast_core::UserError;
use scenecast_messages::decode as decode_cdr;
use scenecast_messages::nav_msgs::Odometry;
use scenecast_sensors::{
    BitDepth, Calibration, CameraMounting, PoseMatch, PoseTrack, SensorPose, Sight, Stamp, pose_of, stamp_of_cdr,
};
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

const ODOMETRY: &str = "nav_msgs/msg/Odometry";

/// A bag's topics and times, before its frames are chosen.
#[derive(Default)]
struct Contents {
    topics: BTreeSet<BagTopic>,
    /// The topic and time of each image; `None` without a time.
    images: Vec<(BagTopic, Option<Stamp>)>,
    poses: Vec<(BagTopic, Stamp, scenecast_sensors::SensorPose)>,
    /// Where the file breaks off.
    damage: Option<String>,
}

impl Contents {
    fn read(path: &Path) -> Result<Self, UserError> {
        let mut stream = BagStream::open(path)?;
        let mut contents = Self::default();
        let is_wanted = |topic: &BagTopic| [RAW, COMPRESSED, ODOMETRY].contains(&topic.kind.as_str());
        loop {
            match stream.next(is_wanted) {
                Ok(Some(BagMessage { topic, bytes })) => {
                    contents.topics.insert(topic.clone());
                    if topic.kind != ODOMETRY {
                        contents.images.push((topic, stamp_of_cdr(&bytes)));
                    } else if let Some((stamp, pose)) = decode_cdr::<Odometry>(&bytes).ok().as_ref().and_then(pose_of) {
                        contents.poses.push((topic, stamp, pose));
                    }
                }
                Ok(None) => return Ok(contents),
                Err(error) if contents.topics.is_empty() => return Err(UserError::file(path, error)),
                Err(error) => {
                    contents.damage = Some(error);
                    return Ok(contents);
                }
            }
        }
    }

    /// The topic of that name, or the only one of these types.
    fn choose(&self, path: &Path, name: Option<&str>, kinds: &[&str], key: &str) -> Result<BagTopic, UserError> {
        let all: Vec<&BagTopic> = self.topics.iter().filter(|topic| kinds.contains(&topic.kind.as_str())).collect();
        let names = || all.iter().map(|topic| topic.name.as_str()).collect::<Vec<_>>().join(", ");
        let kinds = kinds.join(" or ");
        match (name, all.as_slice()) {
            (_, []) => Err(UserError::file(path, format!("there are no messages of {kinds}"))),
            (None, [only]) => Ok((*only).clone()),
            (None, _) => Err(UserError::file(path, format!("which topic of {kinds}, {}? set it by {key}", names()))),
            (Some(name), all) => {
                all.iter().find(|topic| topic.name == name).map(|topic| (*topic).clone()).ok_or_else(|| {
                    UserError::file(path, format!("there is no topic {name} of {kinds}; there is {}", names()))
                })
            }
        }
    }
}

/// Names of topics, where a bag has several of a kind.
#[derive(Debug, Clone, Copy, Default)]
pub struct BagTopics<'a> {
    pub images: Option<&'a str>,
    pub odometry: Option<&'a str>,
}

/// How poses and images of a bag belong together.
#[derive(Debug, Clone)]
pub struct BagTiming {
    /// Longest time between two poses within which the pose of an image is interpolated.
    pub max_gap: Duration,
    /// Added to the times of images, seconds.
    pub clock_offset_s: f64,
    pub mounting: CameraMounting,
    /// Height of the camera above the sea floor, metres.
    pub altitude_m: f64,
    /// The calibration of the camera, if it is known.
    pub calibration: Option<Arc<Calibration>>,
    /// The bits of levels in 16-bit images.
    pub bits: BitDepth,
}

impl BagTiming {
    /// The image of a camera on the vehicle at a pose; `None` if it is tilted too much.
    fn frame(&self, vehicle: &SensorPose, image: FrameImage) -> Option<RecordedFrame> {
        let (pose, sight) = match &self.calibration {
            None => (self.mounting.camera_pose(vehicle, self.altitude_m)?, None),
            Some(calibration) => {
                let camera = self.mounting.mounted_camera(vehicle, self.altitude_m)?;
                let sight = Sight { calibration: calibration.clone(), tilt: camera.tilt, height_m: camera.height_m };
                (camera.pose, Some(sight))
            }
        };
        let SensorPose { x_m, y_m, depth_m, heading_rad, .. } = pose;
        Some(RecordedFrame { t_s: 0.0, image, x_m, y_m, depth_m, heading_rad, scale: 1.0, sight, depth: None })
    }
}

impl Recording {
    /// The images of a bag at the poses of its odometry.
    ///
    /// # Errors
    /// No images or odometry, topics that are not clear, or no image with a pose.
    pub fn open_bag(path: &Path, topics: BagTopics<'_>, timing: &BagTiming) -> Result<Self, UserError> {
        let contents = Contents::read(path)?;
        let images = contents.choose(path, topics.images, &[RAW, COMPRESSED], "bag:FILE#TOPIC")?;
        let odometry = contents.choose(path, topics.odometry, &[ODOMETRY], "navigation.source = \"ros2:TOPIC\"")?;
        let mut poses: Vec<_> = contents.poses.iter().filter(|(topic, ..)| *topic == odometry).collect();
        poses.sort_by_key(|(_, stamp, _)| *stamp);
        let track = PoseTrack::of(poses.iter().map(|(_, stamp, pose)| (*stamp, *pose)), timing.max_gap);
        let bag = Arc::new(Bag::new(path, images, timing.bits));
        let mut frames: Vec<(Stamp, RecordedFrame)> = Vec::new();
        let of_topic = contents.images.iter().filter(|(topic, _)| *topic == *bag.topic());
        let (mut all, mut without_time) = (0, 0);
        for (number, (_, stamp)) in (0..).zip(of_topic) {
            all += 1;
            let Some(stamp) = stamp.filter(|stamp| frames.last().is_none_or(|(last, _)| last < stamp)) else {
                without_time += 1;
                continue;
            };
            let PoseMatch::Found(pose) = track.at(stamp.shifted(timing.clock_offset_s)) else { continue };
            let Some(frame) = timing.frame(&pose, FrameImage::Bag(bag.clone(), number)) else { continue };
            frames.push((stamp, frame));
        }
        let Some(&(first, _)) = frames.first() else {
            let cause = format!("none of its {all} images has a pose at its time; {without_time} have no later time");
            return Err(UserError::file(path, cause));
        };
        let dropped = all - frames.len() as u64;
        let mut notes = Vec::new();
        if dropped > 0 {
            notes.push(format!(
                "{dropped} of {all} images have no time or no pose at their time, or were tilted too much"
            ));
        }
        notes.extend(contents.damage.map(|damage| format!("the file breaks off: {damage}")));
        let frames =
            frames.into_iter().map(|(stamp, frame)| RecordedFrame { t_s: stamp.seconds_since(first), ..frame });
        Ok(Self { frames: frames.collect(), notes })
    }
}
