//! Deflate streams of the PNG files that a codec is compared with.

use flate2::Compression;
use flate2::write::DeflateEncoder;
use scenecast_protocol::map_codec::Deflate;
use std::io::Write;
use std::num::NonZeroU64;

/// Iterations without a gain after which zopfli stops; more of them save less than 0.1 %.
const MAX_ITERATIONS_WITHOUT_GAIN: NonZeroU64 = NonZeroU64::new(3).expect("three is not zero");

/// zlib's best level first, then zopfli.
pub struct Zopfli;

impl Deflate for Zopfli {
    fn quick(&mut self, data: &[u8]) -> usize {
        let mut encoder = DeflateEncoder::new(Counted(0), Compression::best());
        // Neither memory nor counting fails.
        let _ = encoder.write_all(data);
        encoder.finish().map_or(usize::MAX, |counted| counted.0)
    }

    fn shortest(&mut self, data: &[u8]) -> usize {
        let mut counted = Counted(0);
        let options =
            zopfli::Options { iterations_without_improvement: MAX_ITERATIONS_WITHOUT_GAIN, ..Default::default() };
        // Neither memory nor counting fails.
        let _ = zopfli::compress(options, zopfli::Format::Deflate, data, &mut counted);
        counted.0
    }
}

struct Counted(usize);

impl Write for Counted {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0 += bytes.len();
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}
