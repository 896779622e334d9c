//! The size of a camera's images: the largest, and the one that all have where no calibration says it.

/// Pixels of the largest image that is decoded.
pub const MAX_PIXELS: u32 = 64 << 20;

/// The first image's size, which those after it have too: a pixel of another size would lie elsewhere on the sea floor.
#[derive(Debug, Default)]
pub struct ImageSize(Option<(u32, u32)>);

/// An image of another size than the first one.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "it has {} x {} pixels, and the first image has {} x {}: without a calibration all images of a camera need one size",
    size.0, size.1, first.0, first.1
)]
pub struct OtherSize {
    size: (u32, u32),
    first: (u32, u32),
}

impl ImageSize {
    /// Takes the size of an image without a calibration.
    pub fn check(&mut self, size: (u32, u32)) -> Result<(), OtherSize> {
        let first = *self.0.get_or_insert(size);
        if size == first { Ok(()) } else { Err(OtherSize { size, first }) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_image_of_another_size_is_refused_with_both() {
        let mut size = ImageSize::default();
        assert_eq!((size.check((640, 480)), size.check((640, 480))), (Ok(()), Ok(())));
        let text = size.check((320, 240)).unwrap_err().to_string();
        assert!(text.starts_with("it has 320 x 240 pixels, and the first image has 640 x 480"), "{text}");
        assert_eq!(size.check((640, 480)), Ok(()));
    }
}
