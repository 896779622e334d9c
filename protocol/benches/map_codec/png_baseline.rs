//! The smallest PNG files of a label map: filter None, the depths that hold it, zopfli.

use scenecast_protocol::map_codec::Plane;
use std::collections::BTreeMap;

/// Bytes of the whole map as an indexed PNG.
pub(crate) fn full_png(map: &Plane) -> usize {
    smallest_file(map)
}

/// Bytes of the smaller of delta image and its dirty box; pixel 0 = untouched.
pub(crate) fn delta_png(before: &Plane, after: &Plane) -> usize {
    let delta = after.delta_from(before);
    smallest_file(&delta).min(smallest_file(&delta.trimmed()))
}

/// The palette holds the values in use only, by value or by frequency; the first is that of pixel 0.
fn smallest_file(map: &Plane) -> usize {
    let mut counts: BTreeMap<u8, usize> = BTreeMap::new();
    map.labels.iter().for_each(|&label| *counts.entry(label).or_default() += 1);
    let by_value: Vec<u8> = counts.keys().copied().collect();
    let mut by_count = by_value.clone();
    by_count.sort_by_key(|value| std::cmp::Reverse(counts[value]));
    let orders = if by_value == by_count { vec![by_value] } else { vec![by_value, by_count] };
    orders.iter().map(|order| file_with_palette(map, order)).min().unwrap_or(0)
}

fn file_with_palette(map: &Plane, order: &[u8]) -> usize {
    let place = |value: &u8| order.iter().position(|o| o == value).expect("in the palette") as u8;
    let map = Plane { labels: map.labels.iter().map(place).collect(), ..*map };
    let depths = [1, 2, 4, 8].into_iter().filter(|&depth| order.len() <= 1 << depth);
    let data = depths.map(|depth| zopfli_bytes(&scanlines(&map, depth))).min().unwrap_or(0);
    // Signature, IHDR, PLTE, IDAT with zlib head and Adler-32, IEND.
    8 + 25 + (12 + 3 * order.len()) + (12 + 6 + data) + 12
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
