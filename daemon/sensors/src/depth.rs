//! Depth images and clouds of ROS 2 as depth images of a camera, and the bounds that measured distances are checked against.

use crate::MAX_PIXELS;
use scene_model::project::{DepthImage, PinholeCamera};
use scenecast_messages::sensor_msgs::{Image, PointCloud2, PointField};
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

/// A measurement of distances that cannot be used, as one line for people.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum DepthError {
    #[error(
        "the depth image has the encoding {0:?}; allowed are 16UC1, mono16 (units of a millimetre) and 32FC1 (metres)"
    )]
    Encoding(String),
    #[error("there are {width} x {height} distances; allowed are 1 to {MAX_PIXELS}")]
    Size { width: u32, height: u32 },
    #[error("{held} bytes are too few for {height} rows of {step} bytes")]
    Short { held: usize, height: u32, step: u32 },
    #[error("a row of {step} bytes is too short for {width} {of}")]
    Step { step: u32, width: u32, of: &'static str },
    #[error("the cloud has no field {0} of the type float32 within its points")]
    Field(&'static str),
    #[error("the fields x, y and z of the cloud overlap")]
    Overlap,
}

/// Checks the bounds of `height` rows of `step` bytes, of which the last may end with its last element.
pub(crate) fn check_rows(
    (width, height): (u32, u32),
    step: u32,
    row_bytes: u64,
    held: usize,
    of: &'static str,
) -> Result<(), DepthError> {
    let count = u64::from(width) * u64::from(height);
    if count == 0 || count > u64::from(MAX_PIXELS) {
        return Err(DepthError::Size { width, height });
    }
    if height > 1 && u64::from(step) < row_bytes {
        return Err(DepthError::Step { step, width, of });
    }
    if (held as u64) < (u64::from(height) - 1) * u64::from(step) + row_bytes {
        return Err(DepthError::Short { held, height, step });
    }
    Ok(())
}

/// The points of a cloud whose bounds are checked.
pub(crate) struct CloudPoints<'a> {
    cloud: &'a PointCloud2,
    /// Bytes from the start of a point to its x, y and z.
    offsets: [usize; 3],
}

/// Points that each pixel of the depth image gets in the mean, so that few are left empty.
const POINTS_PER_PIXEL: f64 = 2.0;

impl<'a> CloudPoints<'a> {
    pub(crate) fn check(cloud: &'a PointCloud2) -> Result<Self, DepthError> {
        let mut offsets = [0; 3];
        for (to, name) in offsets.iter_mut().zip(["x", "y", "z"]) {
            let is_whole = |field: &&PointField| {
                let is_within = u64::from(field.offset) + 4 <= u64::from(cloud.point_step);
                field.name == name && field.datatype == PointField::FLOAT32 && field.count <= 1 && is_within
            };
            *to = cloud.fields.iter().find(is_whole).ok_or(DepthError::Field(name))?.offset as usize;
        }
        let apart = |a: usize, b: usize| offsets[a].abs_diff(offsets[b]) >= 4;
        if !(apart(0, 1) && apart(0, 2) && apart(1, 2)) {
            return Err(DepthError::Overlap);
        }
        let row_bytes = u64::from(cloud.width) * u64::from(cloud.point_step);
        check_rows((cloud.width, cloud.height), cloud.row_step, row_bytes, cloud.data.len(), "points")?;
        Ok(Self { cloud, offsets })
    }

    /// The points ahead of the camera.
    fn points(&self) -> impl Iterator<Item = [f32; 3]> + '_ {
        let PointCloud2 { width, height, row_step, point_step, ref data, is_bigendian, .. } = *self.cloud;
        let (width, step) = (width as usize, point_step as usize);
        let starts =
            (0..height as usize).flat_map(move |row| (0..width).map(move |i| row * row_step as usize + i * step));
        let points = starts.filter_map(move |start| {
            let mut point = [0.0; 3];
            for (to, offset) in point.iter_mut().zip(self.offsets) {
                let four = *data.get(start + offset..)?.first_chunk()?;
                *to = if is_bigendian { f32::from_be_bytes(four) } else { f32::from_le_bytes(four) };
            }
            Some(point)
        });
        points.filter(|point| point.iter().all(|part| part.is_finite()) && point[2] > 0.0)
    }

    /// The nearest point in each pixel of a depth image, whose pixels are large enough that most have a point.
    pub(crate) fn seen_by(&self, camera: &PinholeCamera, (width, height): (u32, u32)) -> DepthImage {
        let (width, height) = (width.max(1), height.max(1));
        // The points are gone through twice, as a list of them would be several times as large as the cloud.
        let shares = || {
            self.points().filter_map(|point| {
                let [x, y, z] = point.map(f64::from);
                let across = (camera.fx * x / z + camera.cx) / f64::from(width);
                let down = (camera.fy * y / z + camera.cy) / f64::from(height);
                ((0.0..1.0).contains(&across) && (0.0..1.0).contains(&down)).then_some((across, down, point[2]))
            })
        };
        let all = f64::from(width) * f64::from(height);
        let edge = (POINTS_PER_PIXEL * all / shares().count().max(1) as f64).sqrt().clamp(1.0, 64.0);
        let part = |length: u32| (f64::from(length) / edge).ceil().max(1.0) as u32;
        let (columns, rows) = (part(width), part(height));
        let mut metres = vec![0.0; columns as usize * rows as usize];
        for (across, down, z) in shares() {
            let (column, row) = ((across * f64::from(columns)) as usize, (down * f64::from(rows)) as usize);
            if let Some(nearest) = metres.get_mut(row * columns as usize + column)
                && (*nearest == 0.0 || z < *nearest)
            {
                *nearest = z;
            }
        }
        DepthImage { width: columns, height: rows, metres }
    }
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

#[cfg(test)]
mod point_cloud_tests {
    use super::*;
    use proptest::prelude::*;

    const CAMERA: PinholeCamera = PinholeCamera { fx: 100.0, fy: 100.0, cx: 50.0, cy: 40.0 };

    fn field(name: &str, offset: u32) -> PointField {
        PointField { name: name.to_owned(), offset, datatype: PointField::FLOAT32, count: 1 }
    }

    /// A cloud of points whose x, y and z stand behind four other bytes.
    fn cloud(points: &[[f32; 3]]) -> PointCloud2 {
        let mut data = Vec::new();
        for point in points {
            data.extend([9; 4]);
            [point[2], point[0], point[1]].iter().for_each(|part| data.extend(part.to_le_bytes()));
        }
        let fields = vec![field("rgb", 0), field("z", 4), field("x", 8), field("y", 12)];
        let (width, row_step) = (points.len() as u32, 16 * points.len() as u32);
        PointCloud2 { height: 1, width, fields, point_step: 16, row_step, data, ..PointCloud2::default() }
    }

    fn seen(cloud: &PointCloud2) -> DepthImage {
        CloudPoints::check(cloud).unwrap().seen_by(&CAMERA, (100, 80))
    }

    #[test]
    fn points_fall_on_the_pixels_that_see_them() {
        // One point for each pixel of a slope, as a stereo camera gives it.
        let slope = |u: f32, v: f32| {
            let z = 2.0 + 0.01 * u;
            [(u + 0.5 - 50.0) / 100.0 * z, (v + 0.5 - 40.0) / 100.0 * z, z]
        };
        let points: Vec<[f32; 3]> = (0..8000).map(|i| slope((i % 100) as f32, (i / 100) as f32)).collect();
        let depth = seen(&cloud(&points));
        assert_eq!((depth.width, depth.height), (71, 57));
        assert!(depth.metres.iter().all(|&metres| metres > 0.0));
        let at = |u: f32| depth.metres[28 * 71 + (u / 100.0 * 71.0) as usize];
        assert!((at(20.0) - 2.2).abs() < 0.03 && (at(80.0) - 2.8).abs() < 0.03, "{} {}", at(20.0), at(80.0));
    }

    #[test]
    fn the_nearest_point_hides_those_behind_it() {
        let far = [[0.0, 0.0, 3.0], [0.0, 0.0, 1.5], [0.0, 0.0, -1.0], [f32::NAN, 0.0, 1.0], [9.0, 0.0, 1.0]];
        assert_eq!(seen(&cloud(&far)).metres.iter().copied().fold(0.0, f32::max), 1.5);
        assert_eq!(seen(&cloud(&[[0.0; 3]])).median_m(), None);
    }

    #[test]
    fn clouds_that_do_not_fit_are_named() {
        let text = |change: &dyn Fn(&mut PointCloud2)| {
            let mut cloud = cloud(&[[0.0, 0.0, 1.0], [0.0, 0.0, 2.0]]);
            change(&mut cloud);
            CloudPoints::check(&cloud).err().unwrap().to_string()
        };
        assert!(
            text(&|cloud| cloud.fields[1].datatype = PointField::FLOAT64).contains("no field z of the type float32")
        );
        assert!(text(&|cloud| cloud.fields[2].offset = u32::MAX).contains("no field x"));
        let overlap =
            text(&|cloud| (cloud.point_step, cloud.fields) = (4, ["x", "y", "z"].map(|name| field(name, 0)).into()));
        assert_eq!(overlap, "the fields x, y and z of the cloud overlap");
        assert!(text(&|cloud| cloud.width = 3).contains("32 bytes are too few for 1 rows"));
        assert!(text(&|cloud| cloud.height = 2).contains("32 bytes are too few for 2 rows"));
        assert!(text(&|cloud| (cloud.height, cloud.row_step) = (2, 8)).contains("8 bytes is too short for 2 points"));
        assert!(text(&|cloud| cloud.width = 0).contains("0 x 1 distances"));
    }

    proptest! {
        #[test]
        fn any_cloud_gives_depth_or_an_error(width in 0_u32..30, height in 0_u32..9, row_step in 0_u32..300, big in any::<bool>(),
            point_step in 0_u32..40, offsets in any::<[u8; 3]>(), data in prop::collection::vec(any::<u8>(), 0..2000)) {
            let fields = ["x", "y", "z"].iter().zip(offsets).map(|(name, at)| field(name, u32::from(at % 24))).collect();
            let cloud = PointCloud2 { width, height, row_step, point_step, fields, data, is_bigendian: big, ..Default::default() };
            if let Ok(points) = CloudPoints::check(&cloud) {
                prop_assert!(points.seen_by(&CAMERA, (64, 48)).metres.len() <= 64 * 48);
            }
        }
    }
}
