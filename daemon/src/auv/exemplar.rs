//! Representative images on the wire.

use image::RgbImage;

/// Bytes before the image: label epoch, label, serial number of the request.
pub const EXEMPLAR_HEAD: usize = 3;

/// A representative image as an object on the link.
///
/// ```text
/// byte  field
///  0    label epoch
///  1    label, 1..=254
///  2    serial number of the request it answers
///  3..  WebP image
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Exemplar {
    /// Label epoch.
    pub epoch: u8,
    /// Label.
    pub label: u8,
    /// Serial number of the request.
    pub serial: u8,
    /// WebP file.
    pub webp: Vec<u8>,
}

impl Exemplar {
    /// The object's bytes.
    pub fn encode(&self) -> Vec<u8> {
        let mut out = vec![self.epoch, self.label, self.serial];
        out.extend_from_slice(&self.webp);
        out
    }

    /// Reads an object; `None` if it is no WebP file under a label.
    pub fn decode(bytes: &[u8]) -> Option<Self> {
        let (head, webp) = bytes.split_first_chunk::<EXEMPLAR_HEAD>()?;
        let [epoch, label, serial] = *head;
        let is_webp = webp.starts_with(b"RIFF") && webp.get(8..12) == Some(b"WEBP");
        (is_webp && label != 0 && label != 255).then(|| Self { epoch, label, serial, webp: webp.to_vec() })
    }
}

/// A lossy WebP file of at most `most` bytes if any quality gives one, else the smallest.
pub fn encode_webp(image: &RgbImage, most: usize) -> Vec<u8> {
    let encoder = webp::Encoder::from_rgb(image.as_raw(), image.width(), image.height());
    let mut best = Vec::new();
    for quality in [75.0, 55.0, 40.0, 25.0, 10.0, 0.0] {
        best = encoder.encode(quality).to_vec();
        if best.len() <= most {
            break;
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_image_fits_its_budget_and_comes_back_as_it_was_sent() {
        let image = RgbImage::from_fn(64, 64, |x, y| image::Rgb([(x * 4) as u8, (y * 4) as u8, ((x ^ y) * 3) as u8]));
        let webp = encode_webp(&image, 700);
        assert!(webp.len() <= 700, "{} bytes", webp.len());
        let sent = Exemplar { epoch: 1, label: 5, serial: 2, webp };
        assert_eq!(Exemplar::decode(&sent.encode()), Some(sent));
        assert_eq!(Exemplar::decode(b"\x01\x05\x02RIFF"), None);
    }
}
