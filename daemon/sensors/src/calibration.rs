//! The calibration of a camera: its distorted and its rectified pinhole, checked.

use crate::MAX_PIXELS;
use crate::lens::{Lens, LensError, Remap};
use image::RgbImage;
use scene_model::project::PinholeCamera;
use scenecast_messages::sensor_msgs::CameraInfo;
use std::sync::OnceLock;

/// A calibration that cannot be used, as one line for people.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CalibrationError {
    /// Drivers send zeros until somebody has calibrated the camera.
    #[error("the camera is not calibrated: its matrix is 0")]
    Uncalibrated,
    #[error(
        "{name} has {fx}, {fy} pixels as focal lengths and {cx}, {cy} as centre; allowed are finite numbers, the focal lengths from 1 to 1e6"
    )]
    Matrix { name: &'static str, fx: f64, fy: f64, cx: f64, cy: f64 },
    #[error("the rectification matrix is no rotation")]
    Rotation,
    #[error(transparent)]
    Lens(#[from] LensError),
    #[error(
        "the region of interest of {width} x {height} pixels at {x}, {y} is not within the image of {full_width} x {full_height}"
    )]
    Region { width: u32, height: u32, x: u32, y: u32, full_width: u32, full_height: u32 },
    #[error("the calibration is of {width} x {height} pixels; allowed are 1 to {MAX_PIXELS}, at most 65535 a side")]
    Size { width: u32, height: u32 },
    #[error("the image has {width} x {height} pixels, its calibration {for_width} x {for_height}")]
    OtherSize { width: u32, height: u32, for_width: u32, for_height: u32 },
}

/// The checked calibration of a camera.
#[derive(Debug, Clone, PartialEq)]
pub struct Calibration {
    /// Columns and rows of the images that it is for; `None` for images of any size.
    size: Option<(u32, u32)>,
    /// The camera of the images as they come in.
    raw: PinholeCamera,
    lens: Lens,
    /// From the axes of the raw camera to those of the rectified one.
    rotation: [[f64; 3]; 3],
    /// The camera of the rectified images.
    rectified: PinholeCamera,
    remap: Cached,
}

/// The table of a calibration, computed with its first image. Calibrations are equal with and without it.
#[derive(Debug, Clone, Default)]
struct Cached(OnceLock<Remap>);

impl PartialEq for Cached {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

const IDENTITY: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

impl Calibration {
    /// A camera without distortion, from fx, fy, cx and cy.
    ///
    /// # Errors
    /// Numbers that are no camera matrix.
    pub fn of_matrix(matrix: [f64; 4]) -> Result<Self, CalibrationError> {
        let raw = pinhole("the camera matrix", matrix)?;
        let remap = Cached::default();
        Ok(Self { size: None, raw, lens: Lens::None, rotation: IDENTITY, rectified: raw, remap })
    }

    /// The calibration of a message or a file, with its binning and its region of interest (REP 104). Of `is_rectified`
    /// images the distortion was removed before.
    ///
    /// # Errors
    /// Numbers that are no calibration.
    pub fn of_info(info: &CameraInfo, is_rectified: bool) -> Result<Self, CalibrationError> {
        if info.k.iter().all(|&number| number == 0.0) {
            return Err(CalibrationError::Uncalibrated);
        }
        let crop = Crop::of(info)?;
        let [fx, _, cx, _, fy, cy, ..] = info.k;
        let raw = crop.camera(pinhole("the matrix K", [fx, fy, cx, cy])?);
        let [px, _, pcx, _, _, py, pcy, ..] = info.p;
        let has_projection = info.p.iter().any(|&number| number != 0.0);
        let rectified = match has_projection {
            true => crop.camera(pinhole("the matrix P", [px, py, pcx, pcy])?),
            false => raw,
        };
        let lens = Lens::new(&info.distortion_model, &info.d)?;
        let rotation = rotation(&info.r)?;
        let (size, remap) = (Some(crop.size), Cached::default());
        Ok(match is_rectified {
            true => Self { size, raw: rectified, lens: Lens::None, rotation: IDENTITY, rectified, remap },
            false => Self { size, raw, lens, rotation, rectified, remap },
        })
    }

    /// The camera of the rectified images.
    pub fn camera(&self) -> PinholeCamera {
        self.rectified
    }

    /// The image without distortion.
    ///
    /// # Errors
    /// The calibration is for images of another size.
    pub fn rectify(&self, image: RgbImage) -> Result<RgbImage, CalibrationError> {
        let (width, height) = image.dimensions();
        if let Some((for_width, for_height)) = self.size.filter(|size| *size != (width, height)) {
            return Err(CalibrationError::OtherSize { width, height, for_width, for_height });
        }
        if self.lens == Lens::None && self.rotation == IDENTITY && self.raw == self.rectified {
            return Ok(image);
        }
        let remap = self.remap.0.get_or_init(|| Remap::new((width, height), |u, v| self.raw_pixel(u, v)));
        Ok(remap.apply(&image))
    }

    /// The pixel of the raw image that a pixel of the rectified one shows, as OpenCV's `initUndistortRectifyMap` has it.
    pub(crate) fn raw_pixel(&self, u: f64, v: f64) -> (f64, f64) {
        let (x, y) = ((u - self.rectified.cx) / self.rectified.fx, (v - self.rectified.cy) / self.rectified.fy);
        // The inverse of a rotation is its transpose.
        let back: [f64; 3] =
            std::array::from_fn(|i| self.rotation[0][i] * x + self.rotation[1][i] * y + self.rotation[2][i]);
        let (x, y) = self.lens.distort(back[0] / back[2], back[1] / back[2]);
        (self.raw.fx * x + self.raw.cx, self.raw.fy * y + self.raw.cy)
    }
}

/// The part of the sensor that an image shows, and its binning.
struct Crop {
    offset: (f64, f64),
    binning: (f64, f64),
    size: (u32, u32),
}

impl Crop {
    fn of(info: &CameraInfo) -> Result<Self, CalibrationError> {
        let (full_width, full_height, roi) = (info.width, info.height, &info.roi);
        let (x, y) = (roi.x_offset, roi.y_offset);
        let part = |length: u32, full: u32| if length == 0 { full } else { length };
        let (width, height) = (part(roi.width, full_width), part(roi.height, full_height));
        let is_inside = |offset: u32, length: u32, full: u32| u64::from(offset) + u64::from(length) <= u64::from(full);
        if !is_inside(x, width, full_width) || !is_inside(y, height, full_height) {
            return Err(CalibrationError::Region { width, height, x, y, full_width, full_height });
        }
        let (bin_x, bin_y) = (info.binning_x.max(1), info.binning_y.max(1));
        let (width, height) = (width / bin_x, height / bin_y);
        let pixels = u64::from(width) * u64::from(height);
        if pixels == 0 || pixels > u64::from(MAX_PIXELS) || width.max(height) > 65_535 {
            return Err(CalibrationError::Size { width, height });
        }
        Ok(Self { offset: (x.into(), y.into()), binning: (bin_x.into(), bin_y.into()), size: (width, height) })
    }

    fn camera(&self, full: PinholeCamera) -> PinholeCamera {
        PinholeCamera {
            fx: full.fx / self.binning.0,
            fy: full.fy / self.binning.1,
            cx: (full.cx - self.offset.0) / self.binning.0,
            cy: (full.cy - self.offset.1) / self.binning.1,
        }
    }
}

fn pinhole(name: &'static str, [fx, fy, cx, cy]: [f64; 4]) -> Result<PinholeCamera, CalibrationError> {
    let is_focal = |f: f64| (1.0..=1e6).contains(&f);
    let is_centre = |c: f64| (-1e6..=1e6).contains(&c);
    if is_focal(fx) && is_focal(fy) && is_centre(cx) && is_centre(cy) {
        return Ok(PinholeCamera { fx, fy, cx, cy });
    }
    Err(CalibrationError::Matrix { name, fx, fy, cx, cy })
}

/// A rotation of at most a quarter turn; zeros stand for none.
fn rotation(r: &[f64; 9]) -> Result<[[f64; 3]; 3], CalibrationError> {
    if r.iter().all(|&number| number == 0.0) {
        return Ok(IDENTITY);
    }
    let rows = [[r[0], r[1], r[2]], [r[3], r[4], r[5]], [r[6], r[7], r[8]]];
    let dot = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let near = |value: f64, to: f64| (value - to).abs() < 1e-3;
    let unit = rows.iter().all(|row| near(dot(*row, *row), 1.0));
    let across =
        near(dot(rows[0], rows[1]), 0.0) && near(dot(rows[0], rows[2]), 0.0) && near(dot(rows[1], rows[2]), 0.0);
    // Of a mirror image the third row points the other way.
    let third = rows[0][0] * rows[1][1] - rows[0][1] * rows[1][0];
    let is_right_handed = near(third, rows[2][2]);
    if unit && across && is_right_handed && rows[2][2] > 0.5 { Ok(rows) } else { Err(CalibrationError::Rotation) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn info(model: &str, d: &[f64]) -> CameraInfo {
        CameraInfo {
            width: 640,
            height: 480,
            distortion_model: model.to_owned(),
            d: d.to_vec(),
            k: [520.5, 0.0, 318.2, 0.0, 518.9, 243.7, 0.0, 0.0, 1.0],
            r: ROTATION,
            p: [480.0, 0.0, 325.0, 0.0, 0.0, 482.0, 238.0, 0.0, 0.0, 0.0, 1.0, 0.0],
            ..CameraInfo::default()
        }
    }

    /// A rotation by the vector 0.01, -0.02, 0.015.
    const ROTATION: [f64; 9] = [
        0.999687518879752,
        -0.015098181524181343,
        -0.01992258795207648,
        0.014898193607222644,
        0.9998375098174711,
        -0.010148782648187018,
        0.020072578889795502,
        0.009848800772748972,
        0.9997500151038017,
    ];

    /// Pixels of the rectified image with their places in the raw one.
    type Places = [(f64, f64, f64, f64); 4];

    /// `initUndistortRectifyMap` of OpenCV 4, and the same of `cv2.fisheye`, with the calibration of `info`.
    const GOLDEN: [(&str, &[f64], Places); 3] = [
        (
            "plumb_bob",
            &[-0.31, 0.12, 0.0012, -0.0008, -0.02],
            [
                (0.0, 0.0, 31.0191, 40.124),
                (320.0, 240.0, 323.2597, 251.0452),
                (639.0, 479.0, 617.1246, 462.9843),
                (100.0, 400.0, 108.1354, 410.4554),
            ],
        ),
        (
            "rational_polynomial",
            &[0.42, -0.35, 0.001, -0.0015, 0.08, 0.71, -0.28, 0.05],
            [
                (0.0, 0.0, 29.7777, 39.3411),
                (320.0, 240.0, 323.2595, 251.0451),
                (639.0, 479.0, 616.0026, 462.2844),
                (100.0, 400.0, 106.7445, 411.4342),
            ],
        ),
        (
            "equidistant",
            &[-0.03, 0.012, -0.004, 0.0015],
            [
                (0.0, 0.0, 35.2624, 42.5511),
                (320.0, 240.0, 323.2596, 251.0448),
                (639.0, 479.0, 612.7983, 459.1333),
                (100.0, 400.0, 110.6606, 408.3591),
            ],
        ),
    ];

    #[test]
    fn remaps_equal_those_of_opencv() {
        for (model, d, golden) in GOLDEN {
            let calibration = Calibration::of_info(&info(model, d), false).unwrap();
            for (u, v, x, y) in golden {
                let (a, b) = calibration.raw_pixel(u, v);
                assert!((a - x).abs() < 2e-3 && (b - y).abs() < 2e-3, "{model} at {u}, {v}: {a}, {b}");
            }
        }
    }

    #[test]
    fn binning_and_regions_move_the_camera() {
        let mut binned = info("plumb_bob", &[0.0; 5]);
        (binned.binning_x, binned.binning_y) = (2, 2);
        (binned.roi.x_offset, binned.roi.y_offset, binned.roi.width, binned.roi.height) = (100, 40, 400, 300);
        let calibration = Calibration::of_info(&binned, false).unwrap();
        let PinholeCamera { fx, fy, cx, cy } = calibration.camera();
        assert_eq!((fx, fy, cx, cy), (240.0, 241.0, 112.5, 99.0));
        assert!(calibration.rectify(RgbImage::new(200, 150)).is_ok());
        let error = calibration.rectify(RgbImage::new(640, 480)).unwrap_err().to_string();
        assert_eq!(error, "the image has 640 x 480 pixels, its calibration 200 x 150");
        binned.roi.x_offset = 300;
        assert!(Calibration::of_info(&binned, false).unwrap_err().to_string().contains("not within the image"));
    }

    #[test]
    fn a_rectified_image_stays_as_it_is() {
        let calibration = Calibration::of_info(&info("plumb_bob", &[-0.3, 0.1, 0.0, 0.0, 0.0]), true).unwrap();
        let image = RgbImage::from_fn(640, 480, |x, y| image::Rgb([x as u8, y as u8, 7]));
        assert_eq!((calibration.rectify(image.clone()).unwrap(), calibration.camera().fx), (image, 480.0));
    }

    #[test]
    fn numbers_that_are_no_calibration_are_named() {
        let text = |change: &dyn Fn(&mut CameraInfo)| {
            let mut info = info("plumb_bob", &[0.0; 5]);
            change(&mut info);
            Calibration::of_info(&info, false).unwrap_err().to_string()
        };
        assert!(text(&|info| info.k = [0.0; 9]).contains("not calibrated"));
        assert!(text(&|info| info.k[0] = f64::NAN).contains("the matrix K has NaN, 518.9 pixels"));
        assert!(text(&|info| info.p[5] = -3.0).contains("the matrix P has 480, -3 pixels"));
        assert!(text(&|info| info.r[0] = 5.0).contains("no rotation"));
        assert!(text(&|info| info.r = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, -1.0]).contains("no rotation"));
        assert!(text(&|info| info.width = 0).contains("0 x 480 pixels"));
        assert!(text(&|info| info.d = vec![0.0; 3]).contains("plumb_bob"));
        assert!(text(&|info| info.distortion_model = "omni".into()).contains("\"omni\""));
        assert!(text(&|info| info.d[1] = f64::INFINITY).contains("finite"));
    }

    proptest! {
        #[test]
        fn any_numbers_give_a_calibration_or_an_error(k in any::<[f64; 9]>(), r in any::<[f64; 9]>(), p in any::<[f64; 12]>(),
            d in prop::collection::vec(any::<f64>(), 0..10), near in any::<bool>(), size in any::<(u32, u32)>()) {
            let mut info = info("rational_polynomial", &d);
            if near {
                (info.k[0], info.d) = (k[0].abs() % 1000.0, d.iter().map(|d| d % 10.0).chain([0.0; 8]).take(8).collect());
            } else {
                (info.k, info.r, info.p, info.width, info.height) = (k, r, p, size.0, size.1);
            }
            if let Ok(calibration) = Calibration::of_info(&info, false) {
                let _ = calibration.raw_pixel(3.0, 4.0);
            }
        }
    }
}
