//! Poses from a file in the format of the TUM benchmark: lines `time tx ty tz qx qy qz qw`, seconds and metres.

use scenecast_core::UserError;
use scenecast_sensors::{Rotation, SensorPose, Stamp};
use std::path::Path;

/// Size of the largest file of poses, bytes.
const MAX_BYTES: u64 = 256 << 20;

/// Reads the poses of a camera that looks ahead along its z axis, x to the right and y down in the image, in a world of east,
/// north, up. Lines that begin with `#` are comments, also behind a byte order mark.
///
/// # Errors
/// A file that cannot be read, or a line that is not a time and seven finite numbers.
pub fn read_tum_poses(path: &Path) -> Result<Vec<(Stamp, SensorPose)>, UserError> {
    let text = scenecast_config::read_text(path, MAX_BYTES)?;
    let text = text.strip_prefix('\u{feff}').unwrap_or(&text);
    let mut poses = Vec::new();
    for (index, line) in text.lines().enumerate() {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let pose = pose(line).map_err(|cause| UserError::Input(format!("{}:{}: {cause}", path.display(), index + 1)));
        poses.push(pose?);
    }
    if poses.is_empty() {
        return Err(UserError::file(path, "there are no poses"));
    }
    Ok(poses)
}

/// A line that is no pose.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
enum PoseLineError {
    #[error("{name} is missing")]
    Missing { name: &'static str },
    #[error("{name} is {text:?}; expected {expected}")]
    NotAllowed { name: &'static str, text: String, expected: &'static str },
    #[error("the quaternion qx qy qz qw has not the length 1")]
    Rotation,
}

fn pose(line: &str) -> Result<(Stamp, SensorPose), PoseLineError> {
    let refused = |name, text: &str, expected| PoseLineError::NotAllowed { name, text: text.to_owned(), expected };
    let mut fields = line.split([' ', '\t', ',']).filter(|field| !field.is_empty());
    let time = fields.next().unwrap_or_default();
    let stamp = Stamp::parse(time).ok_or_else(|| refused("the time", time, "seconds or nanoseconds"))?;
    let names = ["tx", "ty", "tz", "qx", "qy", "qz", "qw"];
    let mut numbers = [0.0; 7];
    for (number, name) in numbers.iter_mut().zip(names) {
        let text = fields.next().ok_or(PoseLineError::Missing { name })?;
        let value = text.parse::<f64>().ok().filter(|value| value.is_finite());
        *number = value.ok_or_else(|| refused(name, text, "a finite number"))?;
    }
    let [x, y, z, rotation @ ..] = numbers;
    let body = Rotation::from_quaternion(rotation).ok_or(PoseLineError::Rotation)?;
    Ok((stamp, body.camera_pose([x, y, z])))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn poses_are_read_and_errors_name_the_line() {
        let read = |name: &str, text: &str| {
            let path = std::env::temp_dir().join(format!("scenecast-{}-poses-{name}.txt", std::process::id()));
            std::fs::write(&path, text).unwrap();
            read_tum_poses(&path).map_err(|error| error.to_string())
        };
        let poses =
            read("good", "\u{feff}# time\n1305031102.5 1 2 -3 1 0 0 0\n\n1305031103.5,2,2,-3,1,0,0,0\n").unwrap();
        assert_eq!(poses[1].0, Stamp::parse("1305031103.5").unwrap());
        assert_eq!((poses[1].1.x_m, poses[1].1.y_m, poses[1].1.depth_m), (2.0, 2.0, 3.0));
        assert!(poses[1].1.heading_rad.abs() < 1e-12);
        for (name, line, cause) in [
            ("time", "x 1 2 3 1 0 0 0", ":1: the time is \"x\"; expected seconds or nanoseconds"),
            ("few", "1 1 2 3 1 0 0", ":1: qw is missing"),
            ("nan", "1 1 nan 3 1 0 0 0", ":1: ty is \"nan\"; expected a finite number"),
            ("zero", "1 1 2 3 0 0 0 0", "has not the length 1"),
            ("none", "# nothing", "there are no poses"),
        ] {
            let error = read(name, line).unwrap_err();
            assert!(error.contains(cause), "{error}");
        }
    }
}
