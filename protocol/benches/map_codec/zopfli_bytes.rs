//! Deflate streams of the reference PNG files.

/// Bytes of `data` as zopfli deflates it.
pub(crate) fn zopfli_bytes(data: &[u8]) -> usize {
    let mut out = Vec::new();
    zopfli::compress(zopfli::Options::default(), zopfli::Format::Deflate, data, &mut out).expect("memory");
    out.len()
}
