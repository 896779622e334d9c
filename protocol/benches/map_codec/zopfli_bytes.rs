//! Deflate streams of the reference PNG files.

/// Length of `data` as deflated by zopfli.
pub(crate) fn zopfli_bytes(data: &[u8]) -> usize {
    let mut out = Vec::new();
    zopfli::compress(zopfli::Options::default(), zopfli::Format::Deflate, data, &mut out).expect("memory");
    out.len()
}
