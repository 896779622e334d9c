//! A camera frame: its image, where it was taken, and how its pixels lie on the sea floor.

use image::RgbImage;
use scene_model::project::{DownCamera, Floor, Observation, Pose, View};
use scene_model::words::Word;

/// A camera frame with its place on the sea floor.
#[derive(Debug, Clone, Copy)]
pub struct Frame<'a> {
    /// The image, without distortion if it has a view.
    pub image: &'a RgbImage,
    /// Place and direction. Without a view they are those of a camera straight above the middle of the frame.
    pub pose: Pose,
    /// The size of a pixel on the sea floor, divided by the configured size. Before registration, a view gives it.
    pub scale: f64,
    /// The camera as it is mounted and tilted, if it is known.
    pub view: Option<&'a View>,
}

impl<'a> Frame<'a> {
    /// A frame of a camera that looks straight down on a flat floor.
    pub fn flat(image: &'a RgbImage, pose: Pose, scale: f64) -> Self {
        Self { image, pose, scale, view: None }
    }

    /// A frame whose view gives the size of its pixels.
    pub fn viewed(image: &'a RgbImage, pose: Pose, view: &'a View) -> Self {
        Self { image, pose, scale: 1.0, view: Some(view) }
    }
}

/// The largest tilt of a frame that is compared with others, radians.
const MAX_TILT_RAD: f64 = 0.6;

/// A frame with a view, as a camera straight above its middle would see it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Nadir {
    /// From the camera to the middle, to the right and ahead, metres.
    middle_m: [f64; 2],
    pub(super) metres_per_pixel: f64,
    /// Whether distances were measured, so that they are not corrected by the size of other frames' pixels.
    is_measured: bool,
}

impl Nadir {
    /// `None` if the view shows no floor, or is tilted too much.
    pub(super) fn of(view: &View, size: (u32, u32)) -> Option<Self> {
        if view.off_vertical_rad() > MAX_TILT_RAD {
            return None;
        }
        let distance_m = view.distance_m(size)?;
        Some(Self {
            middle_m: view.middle_m(size, distance_m),
            metres_per_pixel: view.metres_per_pixel(distance_m),
            is_measured: matches!(view.floor, Floor::Depth(_)),
        })
    }

    /// The pose straight above the middle.
    pub(super) fn above(&self, camera: &Pose) -> Pose {
        self.moved(camera, 1.0)
    }

    /// The pose of the camera when the frame is placed at `above` with pixels that are larger by `scale`.
    pub(super) fn camera(&self, above: &Pose, scale: f64) -> Pose {
        self.moved(above, if self.is_measured { -1.0 } else { -scale })
    }

    fn moved(&self, pose: &Pose, times: f64) -> Pose {
        let ([right, ahead], (sin, cos)) = (self.middle_m.map(|metres| metres * times), pose.yaw_rad.sin_cos());
        Pose { x: pose.x + cos * right - sin * ahead, y: pose.y + sin * right + cos * ahead, ..*pose }
    }
}

/// How the words of a frame are placed.
pub(super) enum Projection<'a> {
    Flat(DownCamera),
    View(std::borrow::Cow<'a, View>, f64),
}

impl<'a> Projection<'a> {
    /// `usual` is the camera at the configured altitude.
    pub(super) fn of(frame: &Frame<'a>, usual: &DownCamera) -> Self {
        let metres_per_pixel = frame.scale * usual.metres_per_pixel;
        let Some(view) = frame.view else {
            return Self::Flat(DownCamera { metres_per_pixel, altitude_m: frame.scale * usual.altitude_m });
        };
        let Floor::Flat(height_m) = view.floor else {
            return Self::View(std::borrow::Cow::Borrowed(view), metres_per_pixel);
        };
        // The registration has seen how large the pixels are, and so how high the camera is.
        let distance_m = view.distance_m(frame.image.dimensions());
        let by = distance_m.map_or(1.0, |metres| metres_per_pixel / view.metres_per_pixel(metres));
        let corrected = View { floor: Floor::Flat(height_m * by), ..view.clone() };
        Self::View(std::borrow::Cow::Owned(corrected), metres_per_pixel)
    }

    /// Edge of a pixel in the middle of the frame, metres.
    pub(super) fn metres_per_pixel(&self) -> f64 {
        match self {
            Self::Flat(camera) => camera.metres_per_pixel,
            Self::View(_, metres_per_pixel) => *metres_per_pixel,
        }
    }

    /// The words at their places. Those that see no floor are left out.
    pub(super) fn project(&self, size: (u32, u32), pose: &Pose, words: &[Word]) -> Vec<Observation> {
        match self {
            Self::Flat(camera) => camera.project(size.0, size.1, pose, words),
            Self::View(view, _) => view.project(size, pose, words).observations,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use scene_model::project::{DepthImage, PinholeCamera};

    const CAMERA: PinholeCamera = PinholeCamera { fx: 300.0, fy: 300.0, cx: 160.0, cy: 120.0 };

    fn ahead(degrees: f64, floor: Floor) -> View {
        let half = degrees.to_radians() / 2.0;
        View { camera: CAMERA, tilt: [half.cos(), 0.0, 0.0, -half.sin()], floor }
    }

    #[test]
    fn a_pose_converts_to_above_the_middle_and_back() {
        let camera = Pose { x: 3.0, y: -2.0, z: -10.0, yaw_rad: 0.8 };
        for floor in [Floor::Flat(4.0), Floor::Depth(DepthImage { width: 1, height: 1, metres: vec![4.0] })] {
            let nadir = Nadir::of(&ahead(20.0, floor), (320, 240)).unwrap();
            let above = nadir.above(&camera);
            let back = nadir.camera(&above, 1.0);
            assert!((back.x - camera.x).abs() < 1e-12 && (back.y - camera.y).abs() < 1e-12);
            assert!((above.x - camera.x).hypot(above.y - camera.y) > 1.3);
        }
        assert_eq!(Nadir::of(&ahead(40.0, Floor::Flat(4.0)), (320, 240)), None);
    }

    #[test]
    fn a_registered_pixel_size_corrects_only_an_assumed_height() {
        let usual = DownCamera { metres_per_pixel: 0.01, altitude_m: 3.0 };
        let (image, word) = (RgbImage::new(320, 240), [Word { id: 0, u: 160.0, v: 120.0 }]);
        let height = |floor: Floor| {
            let view = ahead(0.0, floor);
            // The view gives pixels of 0.01 m; the registration finds them to be larger by a tenth.
            let frame = Frame { scale: 1.1, ..Frame::viewed(&image, Pose::default(), &view) };
            -Projection::of(&frame, &usual).project((320, 240), &Pose::default(), &word)[0].z
        };
        assert!((height(Floor::Flat(3.0)) - 3.3).abs() < 1e-9);
        assert_eq!(height(Floor::Depth(DepthImage { width: 1, height: 1, metres: vec![3.0] })), 3.0);
    }
}
