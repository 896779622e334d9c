//! Exemplars: their size and their compression for the link.

mod codec;
mod ssim;

pub use codec::{Compressed, compress, compress_to, decode as decode_webp};
pub use ssim::Luma;

use image::{RgbImage, imageops};
use scenecast_protocol::exemplar::edge_px;

/// The structural similarity beyond which more bytes bring no visible gain.
pub const GOOD_SSIM: f64 = 0.9;

/// Crops the middle of a patch to at most the edge of `size`, and returns the size class that it has.
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
    use scenecast_protocol::exemplar::{Exemplar, max_bytes};

    #[test]
    fn an_image_fits_its_budget_and_decodes_at_the_other_end() {
        let patch = RgbImage::from_fn(128, 128, |x, y| image::Rgb([(x * 2) as u8, (y * 2) as u8, ((x ^ y) * 2) as u8]));
        for size in [0, 1, 2] {
            let (cut, small) = middle(&patch, size).unwrap();
            assert_eq!((u32::from(cut), small.width()), (u32::from(size.min(1)), edge_px(cut)));
            let bytes = compress_to(&small, GOOD_SSIM, max_bytes(cut)).unwrap().bytes;
            let sent = Exemplar { epoch: 1, label: 5, serial: 2, size: cut, picture: 1, bytes };
            assert!(sent.encode().len() <= 700 << (2 * cut));
            let file = Exemplar::decode(&sent.encode()).unwrap().webp().unwrap();
            assert_eq!(decode_webp(&file).unwrap().width(), edge_px(cut));
        }
        assert_eq!(middle(&RgbImage::new(63, 80), 0), None);
    }
}
