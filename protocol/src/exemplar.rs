//! Exemplars on the wire: a small image that shows one label.

use crate::directive::ExemplarRequest;

/// Length of the header before the image, in bytes.
pub const HEAD: usize = 4;
/// Bytes of a VP8 key frame before its size: frame tag and start code.
const TAG: usize = 3;
const START_CODE: [u8; 3] = [0x9D, 0x01, 0x2A];
/// Bytes that every square image of a known edge has: start code and size.
const CONSTANT: usize = 7;

/// The edge of an image in pixels: 64 << `size`.
pub fn edge_px(size: u8) -> u32 {
    64 << size.min(3)
}

/// The most bytes of an image of this size: 700 for the smallest, and as many for each pixel of larger ones.
pub fn max_bytes(size: u8) -> usize {
    (700 << (2 * size.min(2))) - HEAD
}

/// An exemplar as an object on the link.
///
/// ```text
/// byte  field
///  0    label epoch
///  1    label, 1..=254
///  2    serial number of the request that it answers; 0: it was not requested
///  3    bits 7-6 size: an edge of 64 << size pixels; bits 5-0 number of the picture, 0: there is none
///  4..  VP8 key frame without start code and size
/// ```
///
/// ```
/// use scenecast_protocol::exemplar::{Exemplar, edge_px};
///
/// let empty = Exemplar { epoch: 0, label: 4, serial: 1, size: 1, picture: 0, bytes: Vec::new() };
/// assert_eq!(edge_px(empty.size), 128);
/// assert_eq!(Exemplar::decode(&empty.encode()).as_ref(), Some(&empty));
/// assert_eq!(empty.webp(), None, "the vehicle has no image of label 4 yet");
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Exemplar {
    /// The epoch of the label ids.
    pub epoch: u8,
    /// The label that it shows, 1..=254.
    pub label: u8,
    /// Serial number of the request that it answers; 0 if it was not requested.
    pub serial: u8,
    /// The edge is 64 << `size` pixels; 0..=3.
    pub size: u8,
    /// Its number among the exemplars of the label, 1..=63.
    pub picture: u8,
    /// The image without its constant bytes; empty if the vehicle has none that matches the request.
    pub bytes: Vec<u8>,
}

impl Exemplar {
    /// Encodes header and image for the sender of objects.
    pub fn encode(&self) -> Vec<u8> {
        let what = self.size << 6 | self.picture & ExemplarRequest::MAX_PICTURE;
        [&[self.epoch, self.label, self.serial, what][..], &self.bytes].concat()
    }

    /// Decodes an object; `None` if it names no label, or a picture without bytes.
    pub fn decode(object: &[u8]) -> Option<Self> {
        let (&[epoch, label, serial, what], bytes) = object.split_first_chunk::<HEAD>()?;
        let (size, picture) = (what >> 6, what & ExemplarRequest::MAX_PICTURE);
        let is_sound = label != 0 && label != 255 && (picture == 0) == bytes.is_empty();
        is_sound.then(|| Self { epoch, label, serial, size, picture, bytes: bytes.to_vec() })
    }

    /// The WebP file; `None` if there is no picture, or if the bytes cannot be one. The pixels are not decoded here.
    pub fn webp(&self) -> Option<Vec<u8>> {
        unstrip(&self.bytes, edge_px(self.size) as u16)
    }
}

/// The frame of a WebP file without its constant bytes; `None` if it is not a single lossy frame.
pub fn strip(file: &[u8]) -> Option<Vec<u8>> {
    let frame = file.strip_prefix(b"RIFF")?.get(4..)?.strip_prefix(b"WEBPVP8 ")?;
    let (length, frame) = frame.split_first_chunk::<4>()?;
    let frame = frame.get(..u32::from_le_bytes(*length) as usize)?;
    let (tag, rest) = frame.split_first_chunk::<TAG>()?;
    rest.starts_with(&START_CODE).then(|| [&tag[..], rest.get(CONSTANT..).unwrap_or_default()].concat())
}

/// The WebP file of a square image of `edge` pixels; `None` if the bytes cannot be a visible key frame.
pub fn unstrip(bytes: &[u8], edge: u16) -> Option<Vec<u8>> {
    let (tag, rest) = bytes.split_first_chunk::<TAG>()?;
    let bits = u32::from_le_bytes([tag[0], tag[1], tag[2], 0]);
    let (is_other, version, is_shown, first_part) = (bits & 1 != 0, bits >> 1 & 7, bits >> 4 & 1 != 0, bits >> 5);
    if is_other || version > 3 || !is_shown || first_part as usize > rest.len() {
        return None;
    }
    let edge = edge.to_le_bytes();
    let frame = [&tag[..], &START_CODE[..], &edge[..], &edge[..], rest].concat();
    let length = u32::try_from(frame.len()).ok().filter(|&n| n < 1 << 24)?;
    let padding = frame.len() % 2;
    let mut file = b"RIFF".to_vec();
    file.extend((length + 12 + padding as u32).to_le_bytes());
    file.extend(b"WEBPVP8 ");
    file.extend(length.to_le_bytes());
    file.extend(&frame);
    if padding == 1 {
        file.push(0);
    }
    Some(file)
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
}
