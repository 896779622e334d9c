//! Pictures: values in rows, from PNG or as they are.

use crate::refusal::{MAX_PIXELS, Refusal};
use std::io::Cursor;

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
