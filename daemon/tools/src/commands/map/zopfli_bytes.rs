//! Deflate streams of the reference PNG files.

/// Bytes of `data` as zopfli deflates it.
pub fn zopfli_bytes(data: &[u8]) -> usize {
    let mut counted = Counted(0);
    // Neither memory nor counting fails.
    let _ = zopfli::compress(zopfli::Options::default(), zopfli::Format::Deflate, data, &mut counted);
    counted.0
}

struct Counted(usize);

impl std::io::Write for Counted {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0 += bytes.len();
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}
