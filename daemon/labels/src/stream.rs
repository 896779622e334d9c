//! Items on a stream of bytes: a header line, then the picture: values in rows, as PNG or as they are.

use crate::header::Header;
use crate::{Item, Refusal};
use std::io::Cursor;

/// Most bytes of a header.
pub const MAX_HEADER_BYTES: usize = 1 << 16;

/// Takes the bytes of a connection and yields its items.
///
/// Each item is a JSON object on one line, and after its line feed exactly as many bytes of a picture as its member `bytes`
/// names. Empty lines are skipped. A header that cannot be read leaves no way to know where the next item begins, so
/// the stream ends with it; a picture that is refused does not.
#[derive(Debug, Default)]
pub struct Stream {
    /// Bytes of the header, or of the picture after it.
    bytes: Vec<u8>,
    header: Option<(Header, usize)>,
    is_over: bool,
}

impl Stream {
    /// Whether a header was refused, so that no further byte is read.
    pub fn is_over(&self) -> bool {
        self.is_over
    }

    /// Takes bytes; calls `each` for every item that is complete with them, or for its refusal.
    pub fn push(&mut self, mut bytes: &[u8], mut each: impl FnMut(Result<Item, Refusal>)) {
        while !self.is_over && !bytes.is_empty() {
            let done = match &self.header {
                None => self.take_header(&mut bytes),
                Some((_, length)) => {
                    let missing = length - self.bytes.len();
                    let (now, rest) = bytes.split_at(missing.min(bytes.len()));
                    self.bytes.extend_from_slice(now);
                    bytes = rest;
                    Ok(now.len() == missing)
                }
            };
            match done {
                Ok(false) => {}
                Ok(true) => {
                    let picture = std::mem::take(&mut self.bytes);
                    if let Some((header, _)) = self.header.take() {
                        each(header.into_item(&picture));
                    }
                }
                Err(why) => {
                    self.is_over = true;
                    each(Err(why));
                }
            }
        }
    }

    /// The connection has ended; the refusal of an item that is not complete.
    pub fn finish(self) -> Option<Refusal> {
        let length = match &self.header {
            _ if self.is_over => return None,
            Some((_, length)) => *length,
            None => self.bytes.len(),
        };
        let is_cut = self.header.is_some() || !self.bytes.trim_ascii().is_empty();
        is_cut.then_some(Refusal::CutOff(self.bytes.len(), length))
    }

    /// Takes bytes up to the end of the header's line; returns whether the item is complete with it.
    fn take_header(&mut self, bytes: &mut &[u8]) -> Result<bool, Refusal> {
        let end = bytes.iter().position(|&b| b == b'\n');
        let (line, rest) = bytes.split_at(end.unwrap_or(bytes.len()));
        if self.bytes.len() + line.len() > MAX_HEADER_BYTES {
            return Err(Refusal::LongHeader);
        }
        self.bytes.extend_from_slice(line);
        *bytes = rest.get(1..).unwrap_or(&[]);
        if end.is_none() {
            return Ok(false);
        }
        let line = std::mem::take(&mut self.bytes);
        if line.trim_ascii().is_empty() {
            return Ok(false);
        }
        let header = Header::read(line.trim_ascii())?;
        let length = header.picture_bytes()?;
        self.header = Some((header, length));
        Ok(length == 0)
    }
}

/// Most bytes of a picture.
pub const MAX_PICTURE_BYTES: usize = 1 << 25;
/// Most pixels of a picture.
pub const MAX_PIXELS: u64 = 1 << 24;

/// Values in rows from the top.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Raster<T = u8> {
    pub width: u32,
    pub height: u32,
    /// `width` x `height` values, row by row from the top.
    pub values: Vec<T>,
}

/// The values of a picture of a band.
pub(crate) enum Values {
    Bytes(Raster),
    /// Pixels of 16 bits, two bytes each.
    Words(Raster<u16>),
}

impl<T: Copy> Raster<T> {
    /// The value in a column of a row, counted from the top; `None` outside.
    pub fn get(&self, column: u32, row: u32) -> Option<T> {
        let inside = column < self.width && row < self.height;
        let at = row as usize * self.width as usize + column as usize;
        self.values.get(at).copied().filter(|_| inside)
    }

    /// The same pixels with other values.
    pub fn map<U>(&self, value: impl Fn(T) -> U) -> Raster<U> {
        let Self { width, height, .. } = *self;
        Raster { width, height, values: self.values.iter().map(|&v| value(v)).collect() }
    }

    pub(crate) fn check(width: u32, height: u32) -> Result<(), Refusal> {
        match u64::from(width) * u64::from(height) {
            1..=MAX_PIXELS => Ok(()),
            _ => Err(Refusal::Pixels(width, height)),
        }
    }

    /// Takes bytes of `N` each that are the values themselves.
    pub(crate) fn raw<const N: usize>(
        width: u32,
        height: u32,
        bytes: &[u8],
        value: impl Fn([u8; N]) -> T,
    ) -> Result<Self, Refusal> {
        Self::check(width, height)?;
        if bytes.len() as u64 != u64::from(width) * u64::from(height) * N as u64 {
            return Err(Refusal::RawLength(bytes.len(), width, height));
        }
        let values = bytes.chunks_exact(N).filter_map(|chunk| chunk.try_into().ok()).map(value).collect();
        Ok(Self { width, height, values })
    }
}

impl Raster {
    /// Reads a PNG of grey or indexed pixels of at most eight bits.
    pub(crate) fn png(bytes: &[u8]) -> Result<Self, Refusal> {
        match Values::png(bytes)? {
            Values::Bytes(raster) => Ok(raster),
            Values::Words(_) => Err(Refusal::Depth("Grayscale of 16 bits".to_owned())),
        }
    }
}

impl Values {
    /// Reads a PNG of grey pixels, or of indexed ones. Grey pixels of fewer than eight bits have their plain numbers, not
    /// numbers that are stretched to eight bits.
    pub(crate) fn png(bytes: &[u8]) -> Result<Self, Refusal> {
        let failed = |e: png::DecodingError| Refusal::Picture(e.to_string());
        let limits = png::Limits { bytes: 1 << 26 };
        let mut decoder = png::Decoder::new_with_limits(Cursor::new(bytes), limits);
        decoder.set_transformations(png::Transformations::IDENTITY);
        let mut reader = decoder.read_info().map_err(failed)?;
        let (width, height) = (reader.info().width, reader.info().height);
        Raster::<u8>::check(width, height)?;
        let (colour, depth) = (reader.info().color_type, reader.info().bit_depth);
        if !matches!(colour, png::ColorType::Indexed | png::ColorType::Grayscale) {
            return Err(Refusal::Depth(format!("{colour:?} of {} bits", depth as u8)));
        }
        let mut packed = vec![0; reader.output_buffer_size().unwrap_or(0)];
        let frame = reader.next_frame(&mut packed).map_err(failed)?;
        // A file that is still being written lacks its end.
        reader.finish().map_err(failed)?;
        let lines = packed.chunks(frame.line_size.max(1)).take(height as usize);
        if depth == png::BitDepth::Sixteen {
            let words = lines.flat_map(|line| line.chunks_exact(2).take(width as usize));
            let values = words.map(|word| u16::from_be_bytes([word[0], word[1]])).collect();
            return Ok(Self::Words(Raster { width, height, values }));
        }
        let bits = depth as usize;
        let mut values = Vec::with_capacity(width as usize * height as usize);
        for line in lines {
            values.extend((0..width as usize).map(|column| unpack(line, column, bits)));
        }
        Ok(Self::Bytes(Raster { width, height, values }))
    }
}

/// The value in a column of a line with `bits` bits a pixel.
fn unpack(line: &[u8], column: usize, bits: usize) -> u8 {
    let bit = column * bits;
    let byte = line.get(bit / 8).copied().unwrap_or(0);
    byte >> (8 - bits - bit % 8) & (0xFFu16 >> (8 - bits)) as u8
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Content;
    use proptest::prelude::*;

    const GRID: &str =
        r#"{"kind":"grid","west_m":0,"south_m":0,"cell_m":1,"encoding":"raw","width":3,"height":1,"bytes":3}"#;

    fn sent() -> Vec<u8> {
        let mut bytes = b"\n{\"kind\":\"classes\",\"classes\":[{\"class\":1,\"name\":\"rock\"}]}\r\n".to_vec();
        for value in [b'\n', 254, 7] {
            bytes.extend_from_slice(GRID.as_bytes());
            bytes.extend_from_slice(&[b'\n', value, 1, b'{']);
        }
        bytes
    }

    #[test]
    fn a_bad_header_ends_the_stream_and_is_named() {
        let mut stream = Stream::default();
        let mut found = Vec::new();
        stream.push(b"hello\n", |item| found.push(item));
        stream.push(&sent(), |item| found.push(item));
        assert!(stream.is_over() && found.len() == 1);
        assert!(found[0].as_ref().unwrap_err().to_string().starts_with("the header: expected value"));
        let mut long = Stream::default();
        long.push(&vec![b' '; MAX_HEADER_BYTES], |_| panic!("it may still end"));
        long.push(b" ", |item| found.push(item));
        assert_eq!(found[1], Err(Refusal::LongHeader));
        let mut claims = Stream::default();
        claims.push(br#"{"kind":"grid","bytes":99999999999}"#, |_| panic!("no line feed yet"));
        claims.push(b"\n", |item| found.push(item));
        assert_eq!(found[2], Err(Refusal::PictureBytes(99_999_999_999)));
    }

    #[test]
    fn a_connection_that_ends_inside_of_an_item_is_named() {
        let bytes = sent();
        let cut = |length: usize| {
            let mut stream = Stream::default();
            stream.push(&bytes[..length], |_| {});
            stream.finish()
        };
        assert_eq!((cut(bytes.len()), cut(bytes.len() - 1)), (None, Some(Refusal::CutOff(2, 3))));
        assert_eq!((cut(0), cut(1), cut(2)), (None, None, Some(Refusal::CutOff(1, 1))));
    }

    proptest! {
        #[test]
        fn items_come_back_from_pieces_of_any_size(pieces in proptest::collection::vec(1usize..50, 1..200)) {
            let bytes = sent();
            let (mut stream, mut found, mut at) = (Stream::default(), Vec::new(), 0);
            for piece in pieces.into_iter().chain([bytes.len()]) {
                let end = (at + piece).min(bytes.len());
                stream.push(&bytes[at..end], |item| found.push(item));
                at = end;
            }
            prop_assert_eq!(found.len(), 4);
            let is_named = matches!(found[0], Ok(Item { content: Content::Classes, .. }));
            prop_assert!(is_named);
            prop_assert_eq!(found[2].clone(), Err(Refusal::Class(254)));
            prop_assert!(found[1].is_ok() && found[3].is_ok());
        }

        #[test]
        fn any_bytes_are_accepted(bytes in proptest::collection::vec(any::<u8>(), 0..400)) {
            let mut stream = Stream::default();
            stream.push(&bytes, |_| {});
            let _ = stream.finish();
        }
    }

    fn png(colour: png::ColorType, depth: png::BitDepth, (width, height): (u32, u32), data: &[u8]) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, width, height);
        encoder.set_color(colour);
        encoder.set_depth(depth);
        if colour == png::ColorType::Indexed {
            encoder.set_palette(vec![7; 3 * 256]);
        }
        let mut writer = encoder.write_header().unwrap();
        writer.write_image_data(data).unwrap();
        writer.finish().unwrap();
        bytes
    }

    #[test]
    fn grey_and_indexed_pixels_are_their_plain_values() {
        use png::{BitDepth, ColorType};
        for colour in [ColorType::Grayscale, ColorType::Indexed] {
            let eight = Raster::png(&png(colour, BitDepth::Eight, (3, 2), &[0, 9, 255, 1, 2, 253])).unwrap();
            assert_eq!((eight.width, eight.height, &eight.values[..]), (3, 2, &[0, 9, 255, 1, 2, 253][..]));
            assert_eq!(
                (eight.get(2, 0), eight.get(0, 1), eight.get(3, 0), eight.get(0, 2)),
                (Some(255), Some(1), None, None)
            );
            let two = Raster::png(&png(colour, BitDepth::Two, (3, 2), &[0b01_11_10_00, 0b00_01_10_00])).unwrap();
            assert_eq!(two.values, [1, 3, 2, 0, 1, 2]);
        }
    }

    #[test]
    fn other_pictures_are_refused_by_name() {
        use png::{BitDepth, ColorType};
        let said = |bytes: &[u8]| Raster::png(bytes).unwrap_err().to_string();
        assert!(said(&png(ColorType::Rgb, BitDepth::Eight, (1, 1), &[1, 2, 3])).contains("Rgb of 8 bits"));
        assert!(said(&png(ColorType::Grayscale, BitDepth::Sixteen, (1, 1), &[1, 2])).contains("Grayscale of 16 bits"));
        let whole = png(ColorType::Grayscale, BitDepth::Eight, (40, 30), &[5; 1200]);
        assert!(Raster::png(&whole).is_ok());
        for length in 0..whole.len() {
            assert!(Raster::png(&whole[..length]).is_err(), "{length} of {} bytes", whole.len());
        }
        let raw = |width, height, bytes: &[u8]| Raster::raw(width, height, bytes, |[byte]| byte);
        assert_eq!(raw(4, 3, &[0; 11]), Err(Refusal::RawLength(11, 4, 3)));
        assert_eq!(raw(1 << 20, 1 << 20, &[]), Err(Refusal::Pixels(1 << 20, 1 << 20)));
        let words = Raster::raw(2, 1, &[1, 0, 0, 1], u16::from_le_bytes).unwrap();
        assert_eq!(words.values, [1, 256]);
        let deep = png(ColorType::Grayscale, BitDepth::Sixteen, (2, 1), &[1, 2, 255, 254]);
        assert!(matches!(Values::png(&deep), Ok(Values::Words(r)) if r.values == [0x0102, 0xFFFE]));
        let mut huge = png(ColorType::Grayscale, BitDepth::Eight, (1, 1), &[1]);
        huge[16..24].copy_from_slice(&[0x7F; 8]);
        assert!(Raster::png(&huge).is_err());
    }
}
