//! What is read from ROS 2 messages: times, pixels, poses, and the pose of a vehicle from a tree of transforms (REP 105).

use crate::{BitDepth, RawImage, RawImageError, Rotation, SensorPose, Stamp};
use image::RgbImage;
use scenecast_messages::geometry_msgs::TransformStamped;
use scenecast_messages::nav_msgs::Odometry;
use scenecast_messages::sensor_msgs::Image;
use scenecast_messages::std_msgs::Header;
use std::collections::{BTreeMap, BTreeSet};

/// Most frames of reference that are kept; a robot has some dozens.
const MAX_FRAMES: usize = 1000;
/// Most links between the two frames.
const MAX_LINKS: usize = 32;
/// Oldest transform of another link that still belongs to a new one, seconds: localisations publish more often.
const MAX_LAG_S: f64 = 5.0;

/// Why a transform gives no pose.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TransformError {
    #[error("the transform from {parent:?} to {child:?} has no time, or its quaternion has not the length 1")]
    Unusable { parent: String, child: String },
    #[error("there are more than {MAX_FRAMES} frames; {0:?} is not kept")]
    TooMany(String),
    #[error("the transform to {child:?} is {lag_s:.1} s older than the newest one; at most {MAX_LAG_S} s are allowed")]
    Lags { child: String, lag_s: f64 },
    #[error("the transform to {child:?} is of {stamp_s:.3} s, and one of {newest_s:.3} s came before")]
    GoesBack { child: String, stamp_s: f64, newest_s: f64 },
}

/// The place and the rotation of a frame in its parent.
#[derive(Debug, Clone)]
struct Link {
    parent: String,
    place: [f64; 3],
    rotation: Rotation,
    /// `None` for a transform that stays.
    stamp: Option<Stamp>,
}

/// The tree of transforms, and the two frames between which it gives the pose: one of east, north, up, and that of the
/// vehicle (x to the bow, y to port, z up).
#[derive(Debug, Clone)]
pub struct TransformTree {
    world: String,
    vehicle: String,
    links: BTreeMap<String, Link>,
}

/// Names of older systems begin with a slash.
fn name(frame: &str) -> &str {
    frame.trim_start_matches('/')
}

impl TransformTree {
    pub fn new(world: &str, vehicle: &str) -> Self {
        Self { world: name(world).to_owned(), vehicle: name(vehicle).to_owned(), links: BTreeMap::new() }
    }

    /// Takes a transform of `/tf`, or one of `/tf_static`, which stays. Returns the pose of the vehicle and its time if the
    /// transform is the one of those between the two frames that is next to the vehicle and changes.
    ///
    /// # Errors
    ///
    /// The transform belongs to the pose and cannot be used, or another one that does. Transforms of other frames, such as those
    /// of another robot on the same topic, are nobody's fault.
    pub fn handle(
        &mut self,
        transform: &TransformStamped,
        is_static: bool,
    ) -> Result<Option<(Stamp, SensorPose)>, TransformError> {
        let (parent, child) = (name(&transform.header.frame_id), name(&transform.child_frame_id));
        let stamp = stamp_of(&transform.header);
        let (at, turn) = (&transform.transform.translation, &transform.transform.rotation);
        let place = [at.x, at.y, at.z];
        let rotation = Rotation::from_quaternion([turn.x, turn.y, turn.z, turn.w]);
        let rotation = rotation.filter(|_| place.iter().all(|m| m.is_finite()) && (is_static || stamp.is_some()));
        let Some(rotation) = rotation else {
            let error = TransformError::Unusable { parent: parent.to_owned(), child: child.to_owned() };
            return if self.belongs_to_pose(parent, child) { Err(error) } else { Ok(None) };
        };
        if self.links.len() >= MAX_FRAMES && !self.links.contains_key(child) {
            let is_needed = self.belongs_to_pose(parent, child);
            return if is_needed { Err(TransformError::TooMany(child.to_owned())) } else { Ok(None) };
        }
        let link = Link { parent: parent.to_owned(), place, rotation, stamp: stamp.filter(|_| !is_static) };
        let newest = self.links.insert(child.to_owned(), link).and_then(|before| before.stamp);
        if is_static {
            return Ok(None);
        }
        let pose = self.pose(child)?;
        // Several publishers of one transform would move the vehicle to and fro.
        match (pose, newest) {
            (Some((stamp, _)), Some(newest)) if stamp < newest => Err(TransformError::GoesBack {
                child: child.to_owned(),
                stamp_s: stamp.seconds_since(Stamp::default()),
                newest_s: newest.seconds_since(Stamp::default()),
            }),
            _ => Ok(pose),
        }
    }

    /// Whether a transform is between the vehicle and the world, as far as the links between them are known.
    fn belongs_to_pose(&self, parent: &str, child: &str) -> bool {
        let mut frame = self.vehicle.as_str();
        for _ in 0..MAX_LINKS {
            if frame == child {
                return true;
            }
            let Some(link) = self.links.get(frame) else { break };
            frame = &link.parent;
        }
        parent == self.world && frame != self.world
    }

    /// The pose of the vehicle, if the changing link nearest to it is that of `changed`.
    fn pose(&self, changed: &str) -> Result<Option<(Stamp, SensorPose)>, TransformError> {
        let (mut frame, mut place) = (self.vehicle.as_str(), [0.0; 3]);
        let (mut rotation, mut newest) = (Rotation::IDENTITY, None);
        for _ in 0..MAX_LINKS {
            if frame == self.world {
                let pose = rotation.vehicle_pose(place);
                return Ok(newest.map(|stamp| (stamp, pose)).filter(|(_, pose)| pose.is_finite()));
            }
            let Some(link) = self.links.get(frame) else { return Ok(None) };
            if let Some(stamp) = link.stamp {
                if newest.is_none() && frame != changed {
                    return Ok(None);
                }
                let lag_s = newest.map_or(0.0, |newest: Stamp| newest.seconds_since(stamp));
                if lag_s > MAX_LAG_S {
                    return Err(TransformError::Lags { child: frame.to_owned(), lag_s });
                }
                newest = newest.or(Some(stamp));
            }
            let moved = link.rotation.apply(place);
            place = [0, 1, 2].map(|axis| link.place[axis] + moved[axis]);
            rotation = link.rotation.after(rotation);
            frame = &link.parent;
        }
        Ok(None)
    }

    /// A line for people about the two frames and those that the transforms have, when they give no pose.
    #[must_use]
    pub fn explain(&self) -> String {
        let all = self.links.iter().flat_map(|(child, link)| [link.parent.as_str(), child.as_str()]);
        let names: BTreeSet<&str> = all.collect();
        let (count, shown) = (names.len(), names.iter().take(20).copied().collect::<Vec<_>>().join(", "));
        let (world, vehicle) = (&self.world, &self.vehicle);
        format!("no transforms lead from {world:?} to {vehicle:?}; the {count} frames that came in: {shown}")
    }
}

/// The time of a header; `None` if it is zero, as drivers leave it that do not know the time.
pub fn stamp_of(header: &Header) -> Option<Stamp> {
    let stamp = Stamp::from_ros(header.stamp.sec, header.stamp.nanosec)?;
    (stamp != Stamp::default()).then_some(stamp)
}

/// The time of a message in CDR that begins with a header, without the rest of the message.
pub fn stamp_of_cdr(bytes: &[u8]) -> Option<Stamp> {
    let (head, time) = (bytes.first_chunk::<4>()?, bytes.get(4..12)?.first_chunk::<8>()?);
    let [a, b, c, d, e, f, g, h] = *time;
    let (sec, nanosec) = match head[1] {
        0 => (i32::from_be_bytes([a, b, c, d]), u32::from_be_bytes([e, f, g, h])),
        1 => (i32::from_le_bytes([a, b, c, d]), u32::from_le_bytes([e, f, g, h])),
        _ => return None,
    };
    Stamp::from_ros(sec, nanosec).filter(|stamp| *stamp != Stamp::default())
}

/// The pixels of a raw image; `bits` are those of 16-bit levels.
pub fn rgb_of(image: &Image, bits: &mut BitDepth) -> Result<RgbImage, RawImageError> {
    let Image { width, height, ref encoding, is_bigendian, step, ref data, .. } = *image;
    RawImage { width, height, encoding, is_bigendian: is_bigendian != 0, step, data }.to_rgb(bits)
}

/// The pose of odometry in a frame of east, north, up, and its time; `None` unless it is a pose with a time.
pub fn pose_of(odometry: &Odometry) -> Option<(Stamp, SensorPose)> {
    let (place, turn) = (&odometry.pose.pose.position, &odometry.pose.pose.orientation);
    let rotation = Rotation::from_quaternion([turn.x, turn.y, turn.z, turn.w])?;
    let pose = rotation.vehicle_pose([place.x, place.y, place.z]);
    Some((stamp_of(&odometry.header)?, pose)).filter(|(_, pose)| pose.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A transform at `sec`, turned by `degrees` about the axis up.
    fn link(frames: [&str; 2], sec: i32, place: [f64; 3], degrees: f64) -> TransformStamped {
        let mut link = TransformStamped { child_frame_id: frames[1].to_owned(), ..TransformStamped::default() };
        (link.header.frame_id, link.header.stamp.sec) = (frames[0].to_owned(), sec);
        let translation = &mut link.transform.translation;
        (translation.x, translation.y, translation.z) = (place[0], place[1], place[2]);
        let half = degrees.to_radians() / 2.0;
        (link.transform.rotation.z, link.transform.rotation.w) = half.sin_cos();
        link
    }

    fn rounded(pose: SensorPose) -> [f64; 4] {
        [pose.x_m, pose.y_m, pose.depth_m, pose.heading_rad.to_degrees()].map(|v| (v * 1e6).round() / 1e6)
    }

    #[test]
    fn a_pose_is_the_product_of_its_transforms() {
        let mut tree = TransformTree::new("map", "base_link");
        let base = link(["imu", "base_link"], 0, [1.0, 0.0, 0.0], 0.0);
        assert_eq!(tree.handle(&base, true), Ok(None), "a static transform has no time");
        assert_eq!(tree.handle(&link(["/map", "/odom"], 9, [10.0, 20.0, 0.0], 90.0), false), Ok(None));
        let (stamp, pose) = tree.handle(&link(["odom", "imu"], 10, [3.0, 0.0, -5.0], 0.0), false).unwrap().unwrap();
        // To the north by odom's turn: 3 m of the sensor and 1 m to the bow.
        assert_eq!((stamp, rounded(pose)), (Stamp::parse("10").unwrap(), [10.0, 24.0, 5.0, 0.0]));
        assert_eq!(tree.handle(&link(["map", "odom"], 11, [0.0; 3], 0.0), false), Ok(None), "no new pose");
        let (_, pose) = tree.handle(&link(["odom", "imu"], 11, [3.0, 0.0, -5.0], 0.0), false).unwrap().unwrap();
        assert_eq!(rounded(pose), [4.0, 0.0, 5.0, 90.0]);
    }

    #[test]
    fn old_and_unusable_transforms_are_refused_by_name() {
        let mut tree = TransformTree::new("map", "base");
        let text = |result: Result<_, TransformError>| result.unwrap_err().to_string();
        let mut wrong = link(["map", "odom"], 1, [0.0; 3], 0.0);
        wrong.transform.rotation.w = 3.0;
        assert!(text(tree.handle(&wrong, false)).contains("\"map\" to \"odom\""));
        assert_eq!(tree.handle(&link(["map", "odom"], 1, [0.0; 3], 0.0), false), Ok(None));
        assert!(tree.handle(&link(["odom", "base"], 6, [0.0; 3], 0.0), false).unwrap().is_some());
        assert!(text(tree.handle(&link(["odom", "base"], 7, [0.0; 3], 0.0), false)).contains("6.0 s older"));
        assert_eq!(tree.handle(&link(["map", "odom"], 7, [0.0; 3], 0.0), false), Ok(None));
        assert!(text(tree.handle(&link(["odom", "base"], 5, [0.0; 3], 0.0), false)).contains("7.000 s came before"));
        assert!(text(tree.handle(&link(["odom", "base"], 0, [0.0; 3], 0.0), false)).contains("no time"));
        assert_eq!(tree.handle(&link(["a", "b"], 0, [0.0; 3], 0.0), false), Ok(None), "of no part of the pose");
    }

    #[test]
    fn a_circle_of_transforms_gives_no_pose() {
        let mut tree = TransformTree::new("map", "base");
        assert_eq!(tree.handle(&link(["odom", "base"], 1, [0.0; 3], 0.0), false), Ok(None));
        assert_eq!(tree.handle(&link(["base", "odom"], 1, [0.0; 3], 0.0), false), Ok(None));
        assert!(tree.explain().ends_with("\"map\" to \"base\"; the 2 frames that came in: base, odom"));
        assert_eq!(tree.handle(&link(["odom", "base"], 2, [0.0; 3], 0.0), false), Ok(None));
    }

    proptest! {
        #[test]
        fn frames_are_bounded_for_any_transforms(names in prop::collection::vec(any::<u16>(), 0..3000)) {
            let mut tree = TransformTree::new("0", "1");
            for number in names {
                let frames = [format!("{}", number / 7), format!("{number}")];
                let _ = tree.handle(&link([&frames[0], &frames[1]], 1, [0.0; 3], 0.0), number % 3 == 0);
            }
            prop_assert!(tree.links.len() <= MAX_FRAMES);
        }
    }

    #[test]
    fn odometry_of_an_unknown_time_or_turn_is_no_pose() {
        let mut odometry = Odometry::default();
        assert_eq!(pose_of(&odometry), None);
        odometry.header.stamp.sec = 5;
        assert_eq!(pose_of(&odometry), None, "the quaternion is zero");
        odometry.pose.pose.orientation.w = 1.0;
        odometry.pose.pose.position.z = -7.0;
        let (stamp, pose) = pose_of(&odometry).unwrap();
        assert_eq!((stamp, pose.depth_m, pose.heading_rad.to_degrees()), (Stamp::parse("5").unwrap(), 7.0, 90.0));
        assert_eq!(stamp_of_cdr(&scenecast_messages::encode(&odometry)), Some(stamp));
        odometry.pose.pose.position.x = f64::NAN;
        assert_eq!(pose_of(&odometry), None);
    }
}
