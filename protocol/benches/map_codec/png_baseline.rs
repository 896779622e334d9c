//! The smallest PNG files of a label map: filter None, the depths that hold it, zopfli.

use scenecast_protocol::map_codec::Plane;

/// Bytes of the whole map as an indexed PNG.
pub(crate) fn full_png(map: &Plane) -> usize {
    smallest_file(map)
}

/// Bytes of the smaller of delta image and its dirty box; pixel 0 = untouched.
pub(crate) fn delta_png(before: &Plane, after: &Plane) -> usize {
    let delta = after.delta_from(before);
    smallest_file(&delta).min(smallest_file(&delta.trimmed()))
}

fn smallest_file(map: &Plane) -> usize {
    let highest = usize::from(map.labels.iter().copied().max().unwrap_or(0));
    let depths = [1, 2, 4, 8].into_iter().filter(|&depth| highest < 1 << depth);
    let data = depths.map(|depth| zopfli_bytes(&scanlines(map, depth))).min().unwrap_or(0);
    // Signature, IHDR, PLTE, IDAT with zlib head and Adler-32, IEND.
    8 + 25 + (12 + 3 * (highest + 1)) + (12 + 6 + data) + 12
}

fn scanlines(map: &Plane, depth: usize) -> Vec<u8> {
    let mut out = Vec::new();
    for row in map.labels.chunks(map.width) {
        out.push(0);
        out.extend(
            row.chunks(8 / depth).map(|cells| {
                cells.iter().enumerate().fold(0, |byte, (i, &label)| byte | label << (8 - depth * (i + 1)))
            }),
        );
    }
    out
}

fn zopfli_bytes(data: &[u8]) -> usize {
    let mut out = Vec::new();
    zopfli::compress(zopfli::Options::default(), zopfli::Format::Deflate, data, &mut out).expect("memory");
    out.len()
}
