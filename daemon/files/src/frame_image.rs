//! Where the pixels of a recorded frame are.

use crate::bag::Bag;
use image::RgbImage;
use scenecast_core::UserError;
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

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
