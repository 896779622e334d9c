//! Images on the wire: exemplars, each of which shows one label, and views of the sea floor.

use crate::bytes::{Reader, decimetres, put24};
use crate::directive::ExemplarRequest;
use crate::time::{ClockMap, Instant};
use std::time::Duration;

/// Length of the header before the image, in bytes: what it answers, then what it shows.
pub const HEAD: usize = 4 + ExemplarView::BYTES;
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
///  3    bits 7-6 size: an edge of 64 << size pixels; bits 5-0 number of the picture, 0: there is none, and the object ends here
///  4-14 what it shows ([`ExemplarView`])
/// 15..  VP8 key frame without start code and size
/// ```
///
/// ```
/// use scenecast_protocol::exemplar::{Exemplar, ExemplarView, edge_px};
///
/// let view = ExemplarView::default();
/// let empty = Exemplar { epoch: 0, label: 4, serial: 1, size: 1, picture: 0, view, bytes: Vec::new() };
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
    /// What it shows; unknown without an image.
    pub view: ExemplarView,
    /// The image without its constant bytes; empty if the vehicle has none that matches the request.
    pub bytes: Vec<u8>,
}

impl Exemplar {
    /// Encodes header and image for the sender of objects.
    pub fn encode(&self) -> Vec<u8> {
        let what = self.size << 6 | self.picture & ExemplarRequest::MAX_PICTURE;
        let mut object = vec![self.epoch, self.label, self.serial, what];
        if !self.bytes.is_empty() {
            self.view.encode(&mut object);
            object.extend_from_slice(&self.bytes);
        }
        object
    }

    /// Decodes an object; `None` if it names no label, or a picture without bytes.
    pub fn decode(object: &[u8]) -> Option<Self> {
        let (&[epoch, label, serial, what], rest) = object.split_first_chunk::<4>()?;
        let (size, picture) = (what >> 6, what & ExemplarRequest::MAX_PICTURE);
        let (view, bytes) = match rest.split_first_chunk() {
            Some((view, bytes)) if !bytes.is_empty() => (ExemplarView::decode(view), bytes),
            _ if rest.is_empty() => (ExemplarView::default(), rest),
            _ => return None,
        };
        let is_sound = label != 0 && label != 255 && (picture == 0) == bytes.is_empty();
        is_sound.then(|| Self { epoch, label, serial, size, picture, view, bytes: bytes.to_vec() })
    }

    /// The WebP file; `None` if there is no picture, or if the bytes cannot be one. The pixels are not decoded here.
    pub fn webp(&self) -> Option<Vec<u8>> {
        unstrip(&self.bytes, edge_px(self.size) as u16)
    }
}

/// A view of the sea floor as an object on the link: a square image with north up. It replaces one with the same middle.
///
/// ```text
/// byte  field
///  0    label epoch: the map that it lies on
///  1-2   0, which is no label
///  3    bits 7-6 size: an edge of 64 << size pixels; bits 5-0 the part of it that was seen, in 63rds
///  4-14 what it shows ([`ExemplarView`]), of a known width
/// 15..  VP8 key frame without start code and size
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FloorView {
    /// The epoch of the label ids.
    pub epoch: u8,
    /// The part of it that a camera frame has shown, in 63rds: 1..=63.
    pub seen: u8,
    /// The edge is 64 << `size` pixels; 0..=3.
    pub size: u8,
    /// Its width, at least 1 mm, and its middle. The clock is that of the latest camera frame in it.
    pub view: ExemplarView,
    /// The image without its constant bytes, at least one.
    pub bytes: Vec<u8>,
}

impl FloorView {
    /// The part that was seen of one that was seen whole.
    pub const WHOLE: u8 = 63;

    /// Encodes header and image for the sender of objects.
    pub fn encode(&self) -> Vec<u8> {
        let mut object = vec![self.epoch, 0, 0, self.size << 6 | self.seen & Self::WHOLE];
        self.view.encode(&mut object);
        object.extend_from_slice(&self.bytes);
        object
    }

    /// Decodes an object; `None` if it is another one, such as an exemplar.
    pub fn decode(object: &[u8]) -> Option<Self> {
        let (&[epoch, 0, 0, what], rest) = object.split_first_chunk::<4>()? else { return None };
        let (view, bytes) = rest.split_first_chunk()?;
        let view = ExemplarView::decode(view);
        let seen = what & Self::WHOLE;
        let is_sound = seen > 0 && view.width_mm > 0 && !bytes.is_empty();
        is_sound.then(|| Self { epoch, seen, size: what >> 6, view, bytes: bytes.to_vec() })
    }

    /// The WebP file; `None` if the bytes cannot be one. The pixels are not decoded here.
    pub fn webp(&self) -> Option<Vec<u8>> {
        unstrip(&self.bytes, edge_px(self.size) as u16)
    }
}

/// What an image shows: how wide it is, and where and when it was taken.
///
/// ```text
/// bytes  field
///  0-1   width on the sea floor in mm; 0: not known; 65 535: that or more
///  2-4   its middle, east of the origin of the vehicle's map in decimetres, two's complement
///  5-7   the same, north
///  8-10  the vehicle's clock when it was taken: milliseconds, low 24; FF FF FF: more than 4 h before it was sent
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ExemplarView {
    /// Width on the sea floor in mm; 0: not known.
    pub width_mm: u16,
    /// The middle of the image in the vehicle's map frame, decimetres east of its origin.
    pub east_dm: i32,
    /// The middle of the image in the vehicle's map frame, decimetres north of its origin.
    pub north_dm: i32,
    /// The vehicle's clock when it was taken: milliseconds, low 24; `None` if that is more than four hours
    /// ago, or in an earlier run of its program.
    pub clock_ms: Option<u32>,
}

impl ExemplarView {
    const BYTES: usize = 11;
    const UNKNOWN_CLOCK: u32 = 0xFF_FFFF;
    /// The clock wraps after 4 h 39 min.
    const MAX_AGE_S: f64 = 4.0 * 3600.0;

    /// Of an image `width_m` wide around a place of the map, taken at `taken`, if that is known, and sent from `now` on.
    pub fn new(width_m: f64, (east_m, north_m): (f64, f64), taken: Option<Instant>, now: Instant) -> Self {
        let recent = taken.filter(|taken| now.since(*taken).as_secs_f64() < Self::MAX_AGE_S);
        let clock_ms = recent.map(|taken| (taken.as_micros() / 1000 % (1 << 24)) as u32);
        Self {
            width_mm: (width_m * 1000.0).round().clamp(0.0, 65535.0) as u16,
            east_dm: decimetres(east_m),
            north_dm: decimetres(north_m),
            clock_ms: clock_ms.filter(|clock_ms| *clock_ms != Self::UNKNOWN_CLOCK),
        }
    }

    /// Our time at which it was taken, by the map of the vehicle's clock; `None` if that is not known.
    pub fn taken(&self, clock: &ClockMap, now: Instant) -> Option<Instant> {
        let half_wrap = Duration::from_millis(1 << 23);
        self.clock_ms.map(|clock_ms| clock.to_ours(clock_ms, now - half_wrap))
    }

    /// The middle of the image in the vehicle's map frame, metres east and north.
    pub fn middle_m(&self) -> (f64, f64) {
        (f64::from(self.east_dm) / 10.0, f64::from(self.north_dm) / 10.0)
    }

    fn encode(&self, out: &mut Vec<u8>) {
        out.extend(self.width_mm.to_be_bytes());
        put24(out, self.east_dm as u32);
        put24(out, self.north_dm as u32);
        put24(out, self.clock_ms.unwrap_or(Self::UNKNOWN_CLOCK));
    }

    fn decode(bytes: &[u8; Self::BYTES]) -> Self {
        let mut reader = Reader::new(bytes);
        // The bytes are enough for all fields.
        let width_mm = reader.u16().unwrap_or_default();
        let [east_dm, north_dm] = [reader.i24(), reader.i24()].map(|dm| dm.unwrap_or_default());
        let clock_ms = reader.u24().ok().filter(|&clock| clock != Self::UNKNOWN_CLOCK);
        Self { width_mm, east_dm, north_dm, clock_ms }
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
        let view = ExemplarView { width_mm: 260, east_dm: -123, north_dm: 45, clock_ms: Some(0x01_0203) };
        let sent = Exemplar { epoch: 1, label: 5, serial: 2, size: 1, picture: 9, view, bytes: vec![7, 8] };
        assert_eq!(sent.encode(), [1, 5, 2, 0x49, 1, 4, 0xFF, 0xFF, 0x85, 0, 0, 0x2D, 1, 2, 3, 7, 8]);
        assert_eq!(Exemplar::decode(&sent.encode()), Some(sent));
        let view = ExemplarView::default();
        let none = Exemplar { epoch: 1, label: 5, serial: 2, size: 0, picture: 0, view, bytes: Vec::new() };
        assert_eq!(Exemplar::decode(&[1, 5, 2, 0]), Some(none));
        let without_image = [[1, 5, 2, 9].as_slice(), &[0; ExemplarView::BYTES]].concat();
        for wrong in [&without_image[..], &[1, 5, 2], &[1, 0, 2, 0], &[1, 255, 2, 0], &[1, 5, 2, 9], &[1, 5, 2, 0, 7]] {
            assert_eq!(Exemplar::decode(wrong), None, "{wrong:?}");
        }
    }

    #[test]
    fn golden_bytes_of_a_view_of_the_floor() {
        let view = ExemplarView { width_mm: 2000, east_dm: 310, north_dm: -10, clock_ms: Some(0x01_0203) };
        let sent = FloorView { epoch: 2, seen: 9, size: 1, view, bytes: vec![0x10, 0, 0, 9] };
        let object = [2, 0, 0, 0x49, 7, 0xD0, 0, 1, 0x36, 0xFF, 0xFF, 0xF6, 1, 2, 3, 0x10, 0, 0, 9];
        assert_eq!(sent.encode(), object);
        assert_eq!((FloorView::decode(&object), Exemplar::decode(&object)), (Some(sent), None));
        let with = |at: usize, byte: u8| {
            let mut wrong = object.to_vec();
            wrong[at] = byte;
            FloorView::decode(&wrong)
        };
        assert_eq!([with(1, 5), with(2, 1), with(3, 0x40)], [const { None }; 3]);
        let of_no_width = [&object[..4], &[0; 2], &object[6..]].concat();
        assert_eq!((FloorView::decode(&of_no_width), FloorView::decode(&object[..15])), (None, None));
    }
}
