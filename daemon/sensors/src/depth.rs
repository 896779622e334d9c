//! Depth images and clouds of ROS 2 as depth images of a camera.

use crate::depth_rows::{DepthError, check_rows};
use crate::point_cloud::CloudPoints;
use scene_model::project::{DepthImage, PinholeCamera};
use scenecast_messages::sensor_msgs::{Image, PointCloud2};
use scenecast_messages::std_msgs::Header;

/// A measurement of distances, as it came in.
#[derive(Debug, Clone, PartialEq)]
pub enum DepthMessage {
    /// A depth image, registered to the rectified colour image.
    Image(Image),
    /// A cloud of points in the axes of the rectified camera: x to the right, y down, z ahead.
    Cloud(PointCloud2),
}

impl DepthMessage {
    pub fn header(&self) -> &Header {
        match self {
            Self::Image(image) => &image.header,
            Self::Cloud(cloud) => &cloud.header,
        }
    }

    /// Length of the data in bytes, as received.
    pub fn size(&self) -> usize {
        match self {
            Self::Image(image) => image.data.len(),
            Self::Cloud(cloud) => cloud.data.len(),
        }
    }

    /// The distances that `camera` sees in images of `size` (width, height). Whole numbers count `units_per_m`.
    ///
    /// # Errors
    /// Fields that contradict each other or the length of the data.
    pub fn read(&self, camera: &PinholeCamera, size: (u32, u32), units_per_m: f64) -> Result<DepthImage, DepthError> {
        match self {
            Self::Image(image) => depth_of(image, units_per_m),
            Self::Cloud(cloud) => Ok(CloudPoints::check(cloud)?.seen_by(camera, size)),
        }
    }
}

/// The distances of a depth image: 0 where there is none.
fn depth_of(image: &Image, units_per_m: f64) -> Result<DepthImage, DepthError> {
    let Image { width, height, step, ref encoding, is_bigendian, ref data, .. } = *image;
    let bytes: u32 = match encoding.as_str() {
        "16UC1" | "mono16" => 2,
        "32FC1" => 4,
        _ => return Err(DepthError::Encoding(encoding.chars().take(40).collect())),
    };
    let row_bytes = u64::from(width) * u64::from(bytes);
    check_rows((width, height), step, row_bytes, data.len(), "distances")?;
    let starts = (0..height as usize).map(|row| row * step as usize);
    let rows: Vec<u8> = starts.flat_map(|start| &data[start..start + row_bytes as usize]).copied().collect();
    let is_big = is_bigendian != 0;
    let metres = match bytes {
        2 => {
            let whole = |pair: &[u8; 2]| if is_big { u16::from_be_bytes(*pair) } else { u16::from_le_bytes(*pair) };
            rows.as_chunks().0.iter().map(|pair| (f64::from(whole(pair)) / units_per_m) as f32).collect()
        }
        _ => {
            let real = |four: &[u8; 4]| if is_big { f32::from_be_bytes(*four) } else { f32::from_le_bytes(*four) };
            rows.as_chunks().0.iter().map(real).collect()
        }
    };
    Ok(DepthImage { width, height, metres })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const CAMERA: PinholeCamera = PinholeCamera { fx: 100.0, fy: 100.0, cx: 2.0, cy: 1.0 };

    fn image(encoding: &str, width: u32, height: u32, step: u32, data: Vec<u8>) -> DepthMessage {
        DepthMessage::Image(Image { encoding: encoding.to_owned(), width, height, step, data, ..Image::default() })
    }

    fn read(message: &DepthMessage) -> Result<DepthImage, DepthError> {
        message.read(&CAMERA, (4, 2), 1000.0)
    }

    #[test]
    fn whole_numbers_are_millimetres_and_real_ones_metres() {
        let whole = read(&image("16UC1", 2, 2, 5, vec![0xB8, 0x0B, 0, 0, 9, 1, 0, 0xE8, 3])).unwrap();
        assert_eq!((whole.width, whole.metres), (2, vec![3.0, 0.0, 0.001, 1.0]));
        let real: Vec<u8> = [2.5f32, f32::NAN].iter().flat_map(|metres| metres.to_be_bytes()).collect();
        let DepthMessage::Image(mut message) = image("32FC1", 2, 1, 8, real) else { panic!() };
        message.is_bigendian = 1;
        let real = read(&DepthMessage::Image(message)).unwrap();
        assert_eq!((real.metres[0], real.median_m()), (2.5, Some(2.5)));
    }

    #[test]
    fn depth_that_does_not_fit_is_named() {
        let text = |message: DepthMessage| read(&message).unwrap_err().to_string();
        assert!(text(image("rgb8", 1, 1, 3, vec![0; 3])).contains("\"rgb8\"; allowed are 16UC1"));
        assert!(text(image("16UC1", 0, 1, 3, vec![0; 3])).contains("0 x 1 distances"));
        assert!(text(image("16UC1", u32::MAX, u32::MAX, 3, vec![0; 3])).contains("allowed are 1 to"));
        assert!(text(image("16UC1", 2, 2, 4, vec![0; 7])).contains("7 bytes are too few for 2 rows of 4 bytes"));
        assert!(text(image("32FC1", 2, 2, 7, vec![0; 99])).contains("7 bytes is too short for 2 distances"));
    }

    proptest! {
        #[test]
        fn any_header_gives_depth_or_an_error(width in 0_u32..40, height in 0_u32..40, step in 0_u32..200,
            encoding in prop::sample::select(vec!["16UC1", "32FC1", "mono16", "x"]), big in any::<u8>(),
            data in prop::collection::vec(any::<u8>(), 0..4000)) {
            let DepthMessage::Image(mut message) = image(encoding, width, height, step, data) else { unreachable!() };
            message.is_bigendian = big;
            if let Ok(depth) = read(&DepthMessage::Image(message)) {
                prop_assert_eq!(depth.metres.len(), (width * height) as usize);
                let _ = depth.median_m();
            }
        }
    }
}
