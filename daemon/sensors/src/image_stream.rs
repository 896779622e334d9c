//! Images one after the other in a stream of bytes, as a program writes them to its standard output.

/// Size of the largest image in a stream, bytes.
pub const MAX_IMAGE_BYTES: usize = 256 << 20;

/// Longest header of a PPM, bytes.
const MAX_PPM_HEADER: usize = 4096;

/// Cuts JPEG, PNG, PPM and PGM images out of a stream. Bytes between images are skipped and counted.
#[derive(Debug, Default)]
pub struct ImageStream {
    buffer: Vec<u8>,
    /// Bytes of the buffer that are known not to end the image.
    searched: usize,
    skipped: u64,
    /// Images in which another one began.
    cut_off: u64,
}

/// The state of the image at the start of some bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Extent {
    /// The image has this many bytes.
    Whole(usize),
    /// More bytes are needed; the image does not end within this many.
    Needs(usize),
    /// No image begins with these bytes.
    Nothing,
    /// The image has no end: another one begins after this many bytes.
    CutOff(usize),
}

impl ImageStream {
    /// Takes bytes of the stream, in pieces of any size.
    pub fn handle_bytes(&mut self, bytes: &[u8]) {
        self.buffer.extend_from_slice(bytes);
    }

    /// The next complete image, if there is one.
    pub fn poll_image(&mut self) -> Option<Vec<u8>> {
        loop {
            if self.buffer.is_empty() {
                return None;
            }
            match extent(&self.buffer, self.searched) {
                Extent::Whole(length) => {
                    let rest = self.buffer.split_off(length);
                    self.searched = 0;
                    return Some(std::mem::replace(&mut self.buffer, rest));
                }
                Extent::Needs(searched) if self.buffer.len() <= MAX_IMAGE_BYTES => {
                    self.searched = searched;
                    return None;
                }
                Extent::CutOff(length) => {
                    self.cut_off += 1;
                    self.skipped += length as u64;
                    self.buffer.drain(..length);
                    self.searched = 0;
                }
                Extent::Needs(_) | Extent::Nothing => self.skip_to_next_image(),
            }
        }
    }

    /// Bytes that belonged to no whole image.
    pub fn skipped(&self) -> u64 {
        self.skipped
    }

    /// Images that had no end before the next one began.
    pub fn cut_off(&self) -> u64 {
        self.cut_off
    }

    /// Whether an image has begun and is not complete.
    pub fn is_within_image(&self) -> bool {
        !self.buffer.is_empty()
    }

    /// The stream has ended or begins again: an incomplete image is dropped.
    pub fn reset(&mut self) {
        self.skipped += self.buffer.len() as u64;
        self.buffer.clear();
        self.searched = 0;
    }

    fn skip_to_next_image(&mut self) {
        let next = (1..self.buffer.len()).find(|&at| may_begin(&self.buffer[at..])).unwrap_or(self.buffer.len());
        self.skipped += next as u64;
        self.buffer.drain(..next);
        self.searched = 0;
    }
}

/// The length of the image with which the bytes begin, if it is complete.
pub fn complete_length(bytes: &[u8]) -> Option<usize> {
    match extent(bytes, 0) {
        Extent::Whole(length) => Some(length),
        Extent::Needs(_) | Extent::Nothing | Extent::CutOff(_) => None,
    }
}

/// Whether bytes begin as an image of a stream does: a JPEG, PNG or PPM, complete or not.
pub fn is_known_image(bytes: &[u8]) -> bool {
    may_begin(bytes)
}

const PNG: &[u8] = b"\x89PNG\r\n\x1A\n";

/// Whether an image may begin with these bytes, of which there may be too few to know.
fn may_begin(bytes: &[u8]) -> bool {
    let agrees = |magic: &[u8]| bytes.iter().zip(magic).all(|(a, b)| a == b);
    let ppm = (agrees(b"P6") || agrees(b"P5")) && bytes.get(2).is_none_or(u8::is_ascii_whitespace);
    agrees(PNG) || agrees(&[0xFF, 0xD8, 0xFF]) || ppm
}

fn extent(bytes: &[u8], searched: usize) -> Extent {
    if !may_begin(bytes) {
        return Extent::Nothing;
    }
    match bytes {
        [0xFF, 0xD8, ..] => jpeg(bytes, searched),
        [0x89, ..] => png(bytes, searched),
        [b'P', ..] => ppm(bytes),
        _ => Extent::Needs(0),
    }
}

/// Segments of a JPEG up to the marker EOI (ITU-T T.81, annex B). A search resumes at `searched`, a place between segments or
/// within entropy-coded data.
fn jpeg(bytes: &[u8], searched: usize) -> Extent {
    let mut at = searched.max(2);
    loop {
        // Entropy-coded data is skipped: in it, 0xFF is followed by 0 or by a restart marker.
        let Some(ahead) = bytes.get(at..).and_then(|rest| rest.iter().position(|&b| b == 0xFF)) else {
            return Extent::Needs(bytes.len());
        };
        at += ahead;
        match bytes.get(at + 1) {
            None => return Extent::Needs(at),
            Some(0xD9) => return Extent::Whole(at + 2),
            Some(0xD8) => return Extent::CutOff(at),
            // Fill bytes.
            Some(0xFF) => at += 1,
            Some(0x00 | 0x01 | 0xD0..=0xD7) => at += 2,
            Some(_) => {
                let (Some(&high), Some(&low)) = (bytes.get(at + 2), bytes.get(at + 3)) else {
                    return Extent::Needs(at);
                };
                let length = usize::from(u16::from_be_bytes([high, low]));
                if length < 2 {
                    return Extent::Nothing;
                }
                if bytes.len() < at + 2 + length {
                    return Extent::Needs(at);
                }
                at += 2 + length;
            }
        }
    }
}

/// Chunks of a PNG up to IEND (W3C PNG, section 5.3).
fn png(bytes: &[u8], searched: usize) -> Extent {
    let mut at = searched.max(PNG.len());
    loop {
        let Some(head) = bytes.get(at..).and_then(|rest| rest.first_chunk::<8>()) else { return Extent::Needs(at) };
        let [a, b, c, d, kind @ ..] = *head;
        let length = u32::from_be_bytes([a, b, c, d]) as usize;
        if length > MAX_IMAGE_BYTES || !kind.iter().all(u8::is_ascii_alphabetic) {
            return Extent::Nothing;
        }
        let end = at + 12 + length;
        if bytes.len() < end {
            return Extent::Needs(at);
        }
        if kind == *b"IEND" {
            return Extent::Whole(end);
        }
        at = end;
    }
}

/// A binary PPM or PGM: `P6` or `P5`, width, height and largest value as decimal numbers, one white space, the pixels.
fn ppm(bytes: &[u8]) -> Extent {
    let head = &bytes[..bytes.len().min(MAX_PPM_HEADER)];
    let incomplete = if head.len() < MAX_PPM_HEADER { Extent::Needs(0) } else { Extent::Nothing };
    let (mut at, mut numbers) = (2, [0_usize; 3]);
    for number in &mut numbers {
        loop {
            match head.get(at) {
                Some(b'#') => match head[at..].iter().position(|&b| b == b'\n') {
                    Some(line) => at += line + 1,
                    None => return incomplete,
                },
                Some(b) if b.is_ascii_whitespace() => at += 1,
                Some(b) if b.is_ascii_digit() => break,
                Some(_) => return Extent::Nothing,
                None => return incomplete,
            }
        }
        let Some(digits) = head[at..].iter().position(|b| !b.is_ascii_digit()) else { return incomplete };
        let text = std::str::from_utf8(&head[at..at + digits]).unwrap_or_default();
        match text.parse::<usize>() {
            Ok(value) if (1..=65_535).contains(&value) => *number = value,
            _ => return Extent::Nothing,
        }
        at += digits;
    }
    let [width, height, largest] = numbers;
    let channels = if bytes[1] == b'6' { 3 } else { 1 };
    let length = at + 1 + width * height * channels * if largest > 255 { 2 } else { 1 };
    if length > MAX_IMAGE_BYTES {
        Extent::Nothing
    } else if bytes.len() < length {
        Extent::Needs(0)
    } else {
        Extent::Whole(length)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{ImageFormat, Rgb, RgbImage};
    use proptest::prelude::*;
    use std::io::Cursor;

    fn images() -> Vec<Vec<u8>> {
        let encode = |format, size: u32| {
            let mut bytes = Cursor::new(Vec::new());
            if format == ImageFormat::Pnm {
                return [b"P6\n# by hand\n8 8\n255\n".as_slice(), &[7; 192]].concat();
            }
            let image = RgbImage::from_fn(size, size, |x, y| Rgb([(x * y) as u8, (x * 97 % 251) as u8, y as u8]));
            image.write_to(&mut bytes, format).unwrap();
            bytes.into_inner()
        };
        let formats = [ImageFormat::Jpeg, ImageFormat::Png, ImageFormat::Pnm, ImageFormat::Jpeg];
        formats.into_iter().zip([33, 20, 8, 64]).map(|(format, size)| encode(format, size)).collect()
    }

    /// The indices of the images that are found in a stream, and the number of skipped bytes.
    fn cut(stream: &[u8], piece: usize) -> (Vec<Option<usize>>, u64) {
        let (mut cutter, mut found, all) = (ImageStream::default(), Vec::new(), images());
        for bytes in stream.chunks(piece) {
            cutter.handle_bytes(bytes);
            found.extend(std::iter::from_fn(|| cutter.poll_image()));
        }
        (found.iter().map(|image| all.iter().position(|known| known == image)).collect(), cutter.skipped())
    }

    #[test]
    fn images_are_cut_from_pieces_of_any_size() {
        for piece in [1, 2, 7, 1000, 1 << 20] {
            let expected = ([0, 1, 2, 3].map(Some).to_vec(), 0);
            assert_eq!(cut(&images().concat(), piece), expected, "pieces of {piece} bytes");
        }
    }

    #[test]
    fn bytes_between_images_are_skipped() {
        let all = images();
        let stream = [b"Setting pipeline to PLAYING\n", all[0].as_slice(), b"\n\n", &all[1], b"P4", &all[2]].concat();
        assert_eq!(cut(&stream, 11), ([0, 1, 2].map(Some).to_vec(), 32));
    }

    #[test]
    fn an_image_without_end_costs_only_itself() {
        let all = images();
        let stream = [&all[0][..all[0].len() - 2], &all[3], &all[2]].concat();
        assert_eq!(cut(&stream, 100).0, [Some(3), Some(2)]);
        assert_eq!(complete_length(&all[1][..all[1].len() - 1]), None);
        assert_eq!(complete_length(&all[1]), Some(all[1].len()));
    }

    proptest! {
        #[test]
        fn any_bytes_end_and_are_all_accounted_for(stream in prop::collection::vec(prop_oneof![
            Just(0xFF_u8), Just(0xD8), Just(0xD9), Just(b'P'), Just(b'6'), Just(b'1'), Just(b' '), any::<u8>()
        ], 0..600), piece in 1_usize..50) {
            let mut cutter = ImageStream::default();
            let mut taken = 0;
            for bytes in stream.chunks(piece) {
                cutter.handle_bytes(bytes);
                while let Some(image) = cutter.poll_image() {
                    taken += image.len();
                }
            }
            cutter.reset();
            prop_assert_eq!(taken as u64 + cutter.skipped(), stream.len() as u64);
        }
    }
}
