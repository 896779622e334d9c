//! Images of the sea floor and their annotations, from files.

use scenecast_config::read_regular;
use scenecast_core::UserError;
use scenecast_core::label_picture::{Indices, read_indices};
use scenecast_sensors::DecodeError;
use std::path::Path;

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
                    return Err(UserError::file(path, "annotations need a grey or indexed image: pixel value = class"));
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
