//! The constant bytes of a PNG file, which are not transmitted.

use super::pixels::{Depth, Palette};
use crate::grid::Rect;
use crc::{CRC_32_ISO_HDLC, Crc};

const SIGNATURE: [u8; 8] = *b"\x89PNG\r\n\x1a\n";
const INDEXED: u8 = 3;

/// A PNG file around a raw deflate stream, with a grey palette whose level is the label.
pub(super) fn restore(rect: Rect, depth: Depth, palette: &Palette, stream: &[u8], scanlines: &[u8]) -> Vec<u8> {
    let mut head = Vec::from(rect.width.to_be_bytes());
    head.extend(rect.height.to_be_bytes());
    head.extend([depth.bits(), INDEXED, 0, 0, 0]);
    let pixels = (0..=255u8).take(1 << depth.bits());
    let colours: Vec<u8> = pixels.map_while(|pixel| palette.entry(pixel)).flat_map(|level| [level; 3]).collect();
    // Deflate with a 32 kB window at the highest level.
    let mut zlib = vec![0x78, 0xDA];
    zlib.extend(stream);
    zlib.extend(adler32(scanlines).to_be_bytes());

    let mut file = Vec::from(SIGNATURE);
    for (kind, data) in [(b"IHDR", head.as_slice()), (b"PLTE", &colours), (b"IDAT", &zlib), (b"IEND", &[])] {
        section(&mut file, *kind, data);
    }
    file
}

fn section(file: &mut Vec<u8>, kind: [u8; 4], data: &[u8]) {
    const CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);
    file.extend((data.len() as u32).to_be_bytes());
    let mut digest = CRC.digest();
    digest.update(&kind);
    digest.update(data);
    file.extend(kind);
    file.extend(data);
    file.extend(digest.finalize().to_be_bytes());
}

fn adler32(data: &[u8]) -> u32 {
    let (a, b) = data.iter().fold((1u32, 0u32), |(a, b), &byte| {
        let a = (a + u32::from(byte)) % 65_521;
        (a, (b + a) % 65_521)
    });
    b << 16 | a
}
