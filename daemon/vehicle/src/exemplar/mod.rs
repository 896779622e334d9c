//! Representative images on the wire.

mod codec;
mod ssim;

pub use codec::{Compressed, compress, compress_to, decode as decode_webp};
pub use ssim::Luma;

use image::{RgbImage, imageops};
use scenecast_protocol::directive::Request;

/// Bytes before the image.
pub const HEAD: usize = 4;
/// Structural similarity that is worth bytes.
pub const GOOD_SSIM: f64 = 0.9;

/// The edge of an image: 64 << `size` pixels.
pub fn edge_px(size: u8) -> u32 {
    64 << size.min(3)
}

/// Most bytes of an image of this size as it travels: 700 for the smallest, as much a pixel for larger ones.
pub fn most_bytes(size: u8) -> usize {
    (700 << (2 * size.min(2))) - HEAD
}

/// A representative image as an object on the link.
///
/// ```text
/// byte  field
///  0    label epoch
///  1    label, 1..=254
///  2    serial number of the request it answers; 0: nobody asked
///  3    bits 7-6 size: an edge of 64 << size pixels; bits 5-0 number of the picture, 0: there is none
///  4..  VP8 key frame without start code and size
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Exemplar {
    /// Label epoch.
    pub epoch: u8,
    /// Label.
    pub label: u8,
    /// Serial number of the request; 0: nobody asked.
    pub serial: u8,
    /// Size, 0..=3.
    pub size: u8,
    /// Number of the picture among those of the label, 1..=63.
    pub picture: u8,
    /// The image as it travels; empty if the vehicle has none that is asked for.
    pub bytes: Vec<u8>,
}

impl Exemplar {
    /// The object's bytes.
    pub fn encode(&self) -> Vec<u8> {
        let what = self.size << 6 | self.picture & Request::MOST_PICTURE;
        [&[self.epoch, self.label, self.serial, what][..], &self.bytes].concat()
    }

    /// Reads an object; `None` if it names no label, or a picture that is not there.
    pub fn decode(object: &[u8]) -> Option<Self> {
        let (&[epoch, label, serial, what], bytes) = object.split_first_chunk::<HEAD>()?;
        let (size, picture) = (what >> 6, what & Request::MOST_PICTURE);
        let is_sound = label != 0 && label != 255 && (picture == 0) == bytes.is_empty();
        is_sound.then(|| Self { epoch, label, serial, size, picture, bytes: bytes.to_vec() })
    }

    /// The WebP file; `None` if there is no picture, or what came cannot be one. It is left to whoever shows it to decode it.
    pub fn webp(&self) -> Option<Vec<u8>> {
        codec::unstrip(&self.bytes, edge_px(self.size) as u16)
    }
}

/// The middle of a patch in a size, and which size that is: at most `size`, less if the patch is smaller.
pub fn middle(patch: &RgbImage, size: u8) -> Option<(u8, RgbImage)> {
    let least = patch.width().min(patch.height());
    let size = (0..=size.min(3)).rev().find(|&s| edge_px(s) <= least)?;
    let edge = edge_px(size);
    let (x, y) = ((patch.width() - edge) / 2, (patch.height() - edge) / 2);
    Some((size, imageops::crop_imm(patch, x, y, edge, edge).to_image()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn golden_bytes_of_an_exemplar() {
        let sent = Exemplar { epoch: 1, label: 5, serial: 2, size: 1, picture: 9, bytes: vec![7, 8] };
        assert_eq!(sent.encode(), [1, 5, 2, 0x49, 7, 8]);
        assert_eq!(Exemplar::decode(&sent.encode()), Some(sent));
        let none = Exemplar { epoch: 1, label: 5, serial: 2, size: 0, picture: 0, bytes: Vec::new() };
        assert_eq!(Exemplar::decode(&[1, 5, 2, 0]), Some(none));
        for wrong in [&[1, 5, 2][..], &[1, 0, 2, 0], &[1, 255, 2, 0], &[1, 5, 2, 9], &[1, 5, 2, 0, 7]] {
            assert_eq!(Exemplar::decode(wrong), None, "{wrong:?}");
        }
    }

    #[test]
    fn an_image_fits_its_budget_and_is_a_file_again_at_the_other_end() {
        let patch = RgbImage::from_fn(128, 128, |x, y| image::Rgb([(x * 2) as u8, (y * 2) as u8, ((x ^ y) * 2) as u8]));
        for size in [0, 1, 2] {
            let (cut, small) = middle(&patch, size).unwrap();
            assert_eq!((u32::from(cut), small.width()), (u32::from(size.min(1)), edge_px(cut)));
            let bytes = compress_to(&small, GOOD_SSIM, most_bytes(cut)).unwrap().bytes;
            let sent = Exemplar { epoch: 1, label: 5, serial: 2, size: cut, picture: 1, bytes };
            assert!(sent.encode().len() <= 700 << (2 * cut));
            let file = Exemplar::decode(&sent.encode()).unwrap().webp().unwrap();
            assert_eq!(decode_webp(&file).unwrap().width(), edge_px(cut));
        }
        assert_eq!(middle(&RgbImage::new(63, 80), 0), None);
    }
}
