//! Bags as recordings: the images of one topic at the poses of their odometry.

use crate::bag::stream::{BagMessage, BagStream, BagTopic, Damage};
use crate::bag::{Bag, COMPRESSED, RAW};
use crate::images::FrameImage;
use crate::recording::{RecordedFrame, Recording};
use scenecast_core::UserError;
use scenecast_messages::decode as decode_cdr;
use scenecast_messages::nav_msgs::Odometry;
use scenecast_messages::sensor_msgs::CameraInfo;
use scenecast_sensors::{
    BitDepth, Calibration, CalibrationError, CameraMounting, PoseMatch, PoseTrack, SensorPose, Stamp, ViewGeometry,
    camera_info_beside, pose_of, stamp_of_cdr,
};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

const ODOMETRY: &str = "nav_msgs/msg/Odometry";
const CAMERA_INFO: &str = "sensor_msgs/msg/CameraInfo";

/// A bag's topics and times, before its frames are chosen.
#[derive(Default)]
struct Contents {
    topics: BTreeSet<BagTopic>,
    /// The topic and time of each image; `None` without a time.
    images: Vec<(BagTopic, Option<Stamp>)>,
    /// The topic and pose of each odometry; `None` without a time or a rotation.
    poses: Vec<(BagTopic, Option<(Stamp, SensorPose)>)>,
    /// The first calibration of each topic that can be used, or why the last one cannot.
    infos: BTreeMap<String, Result<CameraInfo, CalibrationError>>,
    /// The first damage, and how many there are.
    damage: Option<Damage>,
    damages: usize,
    /// Encodings of messages that are not read.
    encodings: BTreeSet<String>,
}

impl Contents {
    fn read(path: &Path) -> Result<Self, UserError> {
        let mut stream = BagStream::open(path)?;
        let mut contents = Self::default();
        let is_wanted = |topic: &BagTopic| [RAW, COMPRESSED, ODOMETRY, CAMERA_INFO].contains(&topic.kind.as_str());
        loop {
            match stream.next(is_wanted) {
                Ok(Some(BagMessage { topic, bytes, .. })) if topic.kind == CAMERA_INFO => {
                    contents.handle_info(topic.name, &bytes);
                }
                Ok(Some(BagMessage { topic, bytes, .. })) => {
                    contents.topics.insert(topic.clone());
                    if topic.kind != ODOMETRY {
                        contents.images.push((topic, stamp_of_cdr(&bytes)));
                    } else {
                        let pose = decode_cdr::<Odometry>(&bytes).ok().as_ref().and_then(pose_of);
                        contents.poses.push((topic, pose));
                    }
                }
                Ok(None) => break,
                Err(error) => {
                    contents.damages += 1;
                    contents.damage = contents.damage.or(Some(error));
                }
            }
        }
        contents.encodings.clone_from(stream.other_encodings());
        match contents.damage {
            Some(error) if contents.topics.is_empty() => Err(UserError::file(path, error)),
            _ => Ok(contents),
        }
    }

    fn handle_info(&mut self, topic: String, bytes: &[u8]) {
        if matches!(self.infos.get(&topic), Some(Ok(_))) {
            return;
        }
        if let Ok(info) = decode_cdr::<CameraInfo>(bytes) {
            let checked = Calibration::of_info(&info, false).map(|_| info);
            self.infos.insert(topic, checked);
        }
    }

    /// The calibration beside a topic of images, with a note for people if none of its messages can be used.
    fn calibration(&self, images: &str) -> (Option<Arc<Calibration>>, Option<String>) {
        let (beside, is_rectified) = camera_info_beside(images);
        let checked = self
            .infos
            .get(&beside)
            .map(|info| info.as_ref().map_err(Clone::clone).and_then(|info| Calibration::of_info(info, is_rectified)));
        match checked {
            Some(Ok(calibration)) => (Some(Arc::new(calibration)), None),
            None | Some(Err(CalibrationError::Uncalibrated)) => (None, None),
            Some(Err(error)) => (None, Some(format!("no message of {beside} can be used: {error}"))),
        }
    }

    /// The topic of that name, or the only one of these types.
    fn choose(&self, path: &Path, name: Option<&str>, kinds: &[&str], key: &str) -> Result<BagTopic, UserError> {
        let all: Vec<&BagTopic> = self.topics.iter().filter(|topic| kinds.contains(&topic.kind.as_str())).collect();
        let names = || all.iter().map(|topic| topic.name.as_str()).collect::<Vec<_>>().join(", ");
        let kinds = kinds.join(" or ");
        match (name, all.as_slice()) {
            (_, []) => {
                let encodings: Vec<&str> = self.encodings.iter().map(String::as_str).collect();
                let others = match encodings.as_slice() {
                    [] => String::new(),
                    found => format!("; CDR of ROS 2 is read, and some of its messages are in {}", found.join(", ")),
                };
                Err(UserError::file(path, format!("there are no messages of {kinds}{others}")))
            }
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
    /// Whether the first usable message of the topic `camera_info` beside the images is the calibration, if it is not known.
    pub reads_info: bool,
    /// The bits of levels in 16-bit images.
    pub bits: BitDepth,
}

impl BagTiming {
    /// The image of a camera on the vehicle at a pose; `None` if it is tilted too much.
    fn frame(&self, vehicle: &SensorPose, image: FrameImage) -> Option<RecordedFrame> {
        let (pose, geometry) = match &self.calibration {
            None => (self.mounting.camera_pose(vehicle, self.altitude_m)?, None),
            Some(calibration) => {
                let camera = self.mounting.mounted_camera(vehicle, self.altitude_m)?;
                let geometry =
                    ViewGeometry { calibration: calibration.clone(), tilt: camera.tilt, height_m: camera.height_m };
                (camera.pose, Some(geometry))
            }
        };
        let SensorPose { x_m, y_m, depth_m, heading_rad, .. } = pose;
        Some(RecordedFrame { t_s: 0.0, image, x_m, y_m, depth_m, heading_rad, scale: 1.0, geometry, depth: None })
    }
}

/// Images of a bag, and those that are left out by reason.
#[derive(Debug, Default)]
struct LeftOut {
    all: u64,
    without_time: u64,
    not_later: u64,
    without_pose: u64,
    tilted: u64,
}

impl fmt::Display for LeftOut {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let reasons = [
            (self.without_time, "have no time in their headers"),
            (self.not_later, "are not later than the image before"),
            (self.without_pose, "have no pose at their time"),
            (self.tilted, "are tilted too much"),
        ];
        let texts = reasons.iter().filter(|(count, _)| *count > 0).map(|(count, reason)| format!("{count} {reason}"));
        write!(f, "{}", texts.collect::<Vec<_>>().join(", "))
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
        let is_info_read = timing.reads_info && timing.calibration.is_none();
        let (info, note) = if is_info_read { contents.calibration(&images.name) } else { (None, None) };
        let timing = &BagTiming { calibration: timing.calibration.clone().or(info), ..timing.clone() };
        let odometry = contents.choose(path, topics.odometry, &[ODOMETRY], "navigation.source = \"ros2:TOPIC\"")?;
        let of_topic = || contents.poses.iter().filter(|(topic, _)| *topic == odometry);
        let mut poses: Vec<(Stamp, SensorPose)> = of_topic().filter_map(|(_, pose)| *pose).collect();
        poses.sort_by_key(|(stamp, _)| *stamp);
        let unusable = (of_topic().count() - poses.len(), of_topic().count());
        let unusable = (unusable.0 > 0).then(|| {
            let (unusable, all) = unusable;
            format!(
                "{unusable} of {all} messages of {} have no time, a position that is not finite, or a quaternion that has not the length 1",
                odometry.name
            )
        });
        let track = PoseTrack::of(poses, timing.max_gap);
        let unreachable = (track.unreachable() > 0).then(|| {
            format!(
                "{} messages of {} are left out, because no vehicle can reach their place from the one before",
                track.unreachable(),
                odometry.name
            )
        });
        let bag = Arc::new(Bag::new(path, images, timing.bits));
        let mut frames: Vec<(Stamp, RecordedFrame)> = Vec::new();
        let of_topic = contents.images.iter().filter(|(topic, _)| *topic == *bag.topic());
        let mut left_out = LeftOut::default();
        for (number, (_, stamp)) in (0..).zip(of_topic) {
            left_out.all += 1;
            let Some(stamp) = *stamp else {
                left_out.without_time += 1;
                continue;
            };
            if frames.last().is_some_and(|(last, _)| *last >= stamp) {
                left_out.not_later += 1;
                continue;
            }
            let PoseMatch::Found(pose) = track.at(stamp.shifted(timing.clock_offset_s)) else {
                left_out.without_pose += 1;
                continue;
            };
            match timing.frame(&pose, FrameImage::Bag(bag.clone(), number)) {
                Some(frame) => frames.push((stamp, frame)),
                None => left_out.tilted += 1,
            }
        }
        let Some(&(first, _)) = frames.first() else {
            let mut cause = format!("none of its {} images is used: {left_out}", left_out.all);
            cause.extend(unusable.map(|text| format!("; {text}")));
            return Err(UserError::file(path, cause));
        };
        let dropped = left_out.all - frames.len() as u64;
        let mut notes: Vec<String> = note.into_iter().chain(unusable).chain(unreachable).collect();
        if dropped > 0 {
            notes.push(format!("{dropped} of {} images are left out: {left_out}", left_out.all));
        }
        notes.extend(contents.damage.map(|damage| match contents.damages {
            0 | 1 => damage.to_string(),
            n => format!("{n} damages, the first: {damage}"),
        }));
        let frames =
            frames.into_iter().map(|(stamp, frame)| RecordedFrame { t_s: stamp.seconds_since(first), ..frame });
        Ok(Self { frames: frames.collect(), notes })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use scenecast_messages::Message;
    use scenecast_messages::sensor_msgs::Image;
    use std::path::PathBuf;

    /// A bag of two images of 4 x 2 pixels at the poses of their times, with these messages of `/camera/camera_info`.
    fn bag(name: &str, infos: &[CameraInfo]) -> PathBuf {
        bag_with(name, infos, &[1.0, 1.0])
    }

    /// The same with a pose for each of these w of its quaternion, whose other members are 0.
    fn bag_with(name: &str, infos: &[CameraInfo], turns: &[f64]) -> PathBuf {
        bag_at(name, infos, &turns.iter().map(|w| (0.0, *w)).collect::<Vec<_>>())
    }

    /// The same with a place east beside each w.
    fn bag_at(name: &str, infos: &[CameraInfo], poses_of: &[(f64, f64)]) -> PathBuf {
        let path = std::env::temp_dir().join(format!("scenecast-{}-{name}.mcap", std::process::id()));
        let mut writer = mcap::Writer::new(std::fs::File::create(&path).unwrap()).unwrap();
        let mut sequence = 0;
        write(&mut writer, "/camera/camera_info", infos, &mut sequence);
        let (mut images, mut poses) = (Vec::new(), Vec::new());
        for sec in 1..3 {
            let mut image = Image { width: 4, height: 2, step: 12, encoding: "rgb8".into(), ..Image::default() };
            (image.header.stamp.sec, image.data) = (sec, vec![50; 24]);
            images.push(image);
        }
        for (sec, (east, w)) in (1..).zip(poses_of) {
            let mut odometry = Odometry::default();
            odometry.pose.pose.position.x = *east;
            (odometry.header.stamp.sec, odometry.pose.pose.orientation.w) = (sec, *w);
            poses.push(odometry);
        }
        write(&mut writer, "/camera/image_raw", &images, &mut sequence);
        write(&mut writer, "/odometry", &poses, &mut sequence);
        writer.finish().unwrap();
        path
    }

    fn write<M: Message>(writer: &mut mcap::Writer<std::fs::File>, topic: &str, messages: &[M], sequence: &mut u32) {
        let schema = writer.add_schema(&M::DEFINITION.full_name(), "ros2msg", b"").unwrap();
        let channel = writer.add_channel(schema, topic, "cdr", &BTreeMap::new()).unwrap();
        for message in messages {
            *sequence += 1;
            let header =
                mcap::records::MessageHeader { channel_id: channel, sequence: *sequence, log_time: 0, publish_time: 0 };
            writer.write_to_known_channel(&header, &scenecast_messages::encode(message)).unwrap();
        }
    }

    fn info(focal: f64) -> CameraInfo {
        let k = [focal, 0.0, 2.0, 0.0, focal, 1.0, 0.0, 0.0, 1.0];
        CameraInfo { width: 4, height: 2, k, ..CameraInfo::default() }
    }

    fn open(path: &Path, change: impl Fn(&mut BagTiming)) -> Recording {
        let mut timing = BagTiming {
            max_gap: Duration::from_secs(2),
            clock_offset_s: 0.0,
            mounting: CameraMounting::default(),
            altitude_m: 3.0,
            calibration: None,
            reads_info: true,
            bits: BitDepth::default(),
        };
        change(&mut timing);
        Recording::open_bag(path, BagTopics::default(), &timing).unwrap()
    }

    #[test]
    fn the_first_usable_calibration_of_a_bag_is_used() {
        let path = bag("calibrated", &[info(0.0), info(-1.0), info(300.0), info(400.0)]);
        let recording = open(&path, |_| {});
        let focal = |frame: &RecordedFrame| frame.geometry.as_ref().map(|geometry| geometry.calibration.camera().fx);
        let focals: Vec<_> = recording.frames.iter().map(focal).collect();
        assert_eq!((focals, recording.notes.len()), (vec![Some(300.0); 2], 0));
        let of_settings = Arc::new(Calibration::of_matrix([500.0, 500.0, 2.0, 1.0]).unwrap());
        let recording = open(&path, |timing| timing.calibration = Some(of_settings.clone()));
        assert_eq!(focal(&recording.frames[0]), Some(500.0));
        let recording = open(&path, |timing| timing.reads_info = false);
        assert!(recording.frames[0].geometry.is_none());
    }

    #[test]
    fn what_lies_behind_damage_is_read() {
        let path = std::env::temp_dir().join(format!("scenecast-{}-damaged.mcap", std::process::id()));
        let file = std::fs::File::create(&path).unwrap();
        let options = mcap::WriteOptions::new().chunk_size(Some(200)).compression(None);
        let mut writer = options.create(file).unwrap();
        let images = (1..7).map(|sec| {
            let mut image = Image { width: 4, height: 2, step: 12, encoding: "rgb8".into(), ..Image::default() };
            (image.header.stamp.sec, image.data) = (sec, vec![50 + sec as u8; 24]);
            image
        });
        let poses = (1..7).map(|sec| {
            let mut odometry = Odometry::default();
            (odometry.header.stamp.sec, odometry.pose.pose.orientation.w) = (sec, 1.0);
            odometry
        });
        let mut sequence = 0;
        write(&mut writer, "/odometry", &poses.collect::<Vec<_>>(), &mut sequence);
        write(&mut writer, "/camera/image_raw", &images.collect::<Vec<_>>(), &mut sequence);
        writer.finish().unwrap();
        let mut bytes = std::fs::read(&path).unwrap();
        let third = bytes.windows(24).position(|pixels| pixels == [53; 24]).unwrap();
        bytes[third + 3] = 0;
        std::fs::write(&path, bytes).unwrap();
        let recording = open(&path, |_| {});
        assert!(recording.notes[0].starts_with("a chunk is damaged and left out"), "{:?}", recording.notes);
        let kept: Vec<u8> = recording.frames.iter().map(|frame| frame.image.read().unwrap().as_raw()[0]).collect();
        assert!(kept.len() < 6 && kept.contains(&51) && kept.contains(&56) && !kept.contains(&53), "{kept:?}");
    }

    #[test]
    fn poses_without_a_rotation_are_named() {
        let recording = open(&bag_with("turns", &[], &[1.0, 0.0]), |_| {});
        assert_eq!(recording.frames.len(), 1);
        assert!(
            recording.notes[0].starts_with(
                "1 of 2 messages of /odometry have no time, a position that is not finite, or a quaternion"
            )
        );
    }

    #[test]
    fn a_pose_that_no_vehicle_reaches_is_left_out_and_named() {
        let recording = open(&bag_at("spike", &[], &[(0.0, 1.0), (500.0, 1.0), (1.0, 1.0)]), |_| {});
        let places: Vec<f64> = recording.frames.iter().map(|frame| frame.x_m).collect();
        assert_eq!(places, [0.0, 0.5]);
        assert!(recording.notes[0].starts_with("1 messages of /odometry are left out, because no vehicle"));
    }

    #[test]
    fn a_bag_without_a_usable_calibration_is_read_without() {
        let recording = open(&bag("uncalibrated", &[CameraInfo::default()]), |_| {});
        assert!(recording.frames[0].geometry.is_none() && recording.notes.is_empty());
        let recording = open(&bag("wrong", &[info(-1.0)]), |_| {});
        assert!(recording.frames[0].geometry.is_none());
        assert!(recording.notes[0].contains("/camera/camera_info can be used: the matrix K"), "{:?}", recording.notes);
    }

    #[test]
    fn images_that_are_left_out_are_counted_by_their_reasons() {
        let left_out = LeftOut { all: 9, without_time: 2, tilted: 3, ..LeftOut::default() };
        assert_eq!(left_out.to_string(), "2 have no time in their headers, 3 are tilted too much");
    }
}
