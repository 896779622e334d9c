//! Files of distances: grey PNG of 16 bits.

use crate::images::read_image;
use image::DynamicImage;
use scene_model::project::DepthImage;
use scenecast_core::UserError;
use std::path::{Path, PathBuf};

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
