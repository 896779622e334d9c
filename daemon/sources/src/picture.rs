//! The pixels of an image, as they came in.

use image::RgbImage;
use scenecast_sensors::{BitDepth, DecodeError, decode};

/// An image that is decoded where it is mapped, so that a slow decoder does not hold up its source.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Picture {
    /// A JPEG, PNG, PPM or TIFF.
    Compressed(Vec<u8>),
    Rgb(RgbImage),
}

impl Picture {
    /// The image with 8 bits a channel; `bits` are those of the levels of a compressed image with 16.
    pub fn into_rgb(self, bits: BitDepth) -> Result<RgbImage, DecodeError> {
        match self {
            Self::Compressed(bytes) => decode(&bytes, bits),
            Self::Rgb(image) => Ok(image),
        }
    }
}
