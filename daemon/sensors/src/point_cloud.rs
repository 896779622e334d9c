//! Clouds of points in the axes of a camera, seen as depth images.

use crate::depth_rows::{DepthError, check_rows};
use scene_model::project::{DepthImage, PinholeCamera};
use scenecast_messages::sensor_msgs::{PointCloud2, PointField};

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
