//! Images of the sea floor, their annotations and their distances, from files, and where their pixels are.

use crate::bag::Bag;
use image::{DynamicImage, RgbImage};
use scene_model::project::DepthImage;
use scenecast_config::read_regular;
use scenecast_core::UserError;
use scenecast_core::label_picture::{Indices, read_indices};
use scenecast_sensors::DecodeError;
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Size of the largest image file that is read, bytes.
const MAX_BYTES: u64 = 4 << 30;

/// An image in any format that the program knows; a JPEG that is cut off is refused.
pub fn read_image(path: &Path) -> Result<image::DynamicImage, UserError> {
    let bytes = read_regular(path, MAX_BYTES)?;
    let refused = |e: DecodeError| match e {
        DecodeError::Broken(_) => UserError::file(path, e),
        e => UserError::file(path, format!("not an image that can be read: {e}")),
    };
    scenecast_sensors::decode_upright(&bytes, image::Limits::default()).map_err(refused)
}

/// Metres across a pixel of a file with a projection in metres, if it has one.
pub fn own_scale_m(path: &Path) -> Result<Option<f64>, UserError> {
    Ok(scenecast_sensors::geotiff_scale_m(&read_regular(path, MAX_BYTES)?))
}

/// What else than transparency says where an image has no data, for people.
pub fn unread_emptiness(path: &Path) -> Result<Option<String>, UserError> {
    Ok(scenecast_sensors::unread_emptiness(&read_regular(path, MAX_BYTES)?))
}

/// Classes from a grey or indexed image of `size` pixels: the pixel value is the class.
pub fn read_classes(path: &Path, size: (u32, u32)) -> Result<Vec<u8>, UserError> {
    let bytes = read_regular(path, MAX_BYTES)?;
    let unreadable = |e| UserError::file(path, format!("not an image that can be read: {e}"));
    let indices = read_indices(&bytes, u64::from(u32::MAX)).map_err(unreadable)?;
    let (classes, width, height) = match indices {
        Some(Indices { pixels, width, height }) => (pixels, width, height),
        None => {
            let grey = match read_image(path)? {
                image::DynamicImage::ImageLuma8(grey) => grey,
                _ => {
                    return Err(UserError::file(
                        path,
                        "annotations need a grey or indexed image of 8 bits: pixel value = class",
                    ));
                }
            };
            let (w, h) = grey.dimensions();
            (grey.into_raw(), w, h)
        }
    };
    if (width, height) != size {
        let what = format!("the annotations have {width} x {height} pixels, the image has {} x {}", size.0, size.1);
        return Err(UserError::file(path, what));
    }
    Ok(classes)
}

/// Where the pixels of a recorded frame are.
#[derive(Debug, Clone, PartialEq)]
pub enum FrameImage {
    File(PathBuf),
    /// The image with this number in a bag.
    Bag(Arc<Bag>, u64),
}

impl FrameImage {
    pub fn read(&self) -> Result<RgbImage, UserError> {
        match self {
            Self::File(path) => Ok(crate::read_image(path)?.to_rgb8()),
            Self::Bag(bag, number) => bag.read(*number),
        }
    }

    /// The file of the image; `None` within a bag.
    pub fn file(&self) -> Option<&Path> {
        match self {
            Self::File(path) => Some(path),
            Self::Bag(..) => None,
        }
    }
}

impl fmt::Display for FrameImage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File(path) => write!(f, "{}", path.display()),
            Self::Bag(bag, number) => write!(f, "{bag:?}, image {number}"),
        }
    }
}

/// A file of distances, and the units of its whole numbers in a metre.
#[derive(Debug, Clone, PartialEq)]
pub struct DepthFile {
    pub path: PathBuf,
    pub units_per_m: f64,
}

impl DepthFile {
    pub(crate) fn read(&self) -> Result<DepthImage, UserError> {
        read_depth(&self.path, self.units_per_m)
    }
}

/// Reads a depth image: a grey PNG of 16 bits with so many units a metre.
///
/// # Errors
/// The file cannot be read, or is another image.
pub fn read_depth(path: &Path, units_per_m: f64) -> Result<DepthImage, UserError> {
    match read_image(path)? {
        DynamicImage::ImageLuma16(depth) => {
            let (width, height) = depth.dimensions();
            let metres = depth.into_raw().into_iter().map(|units| (f64::from(units) / units_per_m) as f32).collect();
            Ok(DepthImage { width, height, metres })
        }
        _ => Err(UserError::file(path, "a depth image is a grey PNG of 16 bits")),
    }
}
