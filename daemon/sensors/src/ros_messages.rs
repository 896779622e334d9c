//! Images and poses of ROS 2 messages.

use crate::{BitDepth, RawImage, RawImageError, Rotation, SensorPose, Stamp};
use image::RgbImage;
use scenecast_messages::nav_msgs::Odometry;
use scenecast_messages::sensor_msgs::Image;
use scenecast_messages::std_msgs::Header;

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
