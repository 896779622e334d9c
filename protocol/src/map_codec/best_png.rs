//! The smallest PNG files of a label map, to compare the stream with.

use super::LabelRaster;
use std::collections::BTreeMap;

/// Length of the shortest raw deflate stream of some bytes.
pub type Deflated<'a> = &'a mut dyn FnMut(&[u8]) -> usize;

impl LabelRaster {
    /// Bytes of the map as an indexed PNG: filter None, and the best of every depth and palette order that may win.
    ///
    /// The palette holds the values in use only, by value or by frequency; filter None wins on label maps.
    pub fn smallest_png(&self, deflated: Deflated<'_>) -> usize {
        let mut counts: BTreeMap<u8, usize> = BTreeMap::new();
        self.labels.iter().for_each(|&label| *counts.entry(label).or_default() += 1);
        let by_value: Vec<u8> = counts.keys().copied().collect();
        let mut by_count = by_value.clone();
        by_count.sort_by_key(|value| std::cmp::Reverse(counts.get(value).copied()));
        let orders = if by_value == by_count { vec![by_value] } else { vec![by_value, by_count] };
        orders.iter().map(|order| with_palette(self, order, deflated)).min().unwrap_or(0)
    }

    /// Bytes of the change from `before` as an indexed PNG: the smaller of delta image and its dirty box.
    ///
    /// Pixel 0 = untouched; 0 bytes without a change.
    pub fn smallest_delta_png(&self, before: &Self, deflated: Deflated<'_>) -> usize {
        if self == before {
            return 0;
        }
        let delta = self.delta_from(before);
        let dirty_box = delta.trimmed();
        let whole = delta.smallest_png(deflated);
        if dirty_box == delta { whole } else { whole.min(dirty_box.smallest_png(deflated)) }
    }
}

fn with_palette(map: &LabelRaster, order: &[u8], deflated: Deflated<'_>) -> usize {
    let place = |value: &u8| order.iter().position(|o| o == value).unwrap_or_default() as u8;
    let map = LabelRaster { labels: map.labels.iter().map(place).collect(), ..*map };
    let depths = [1, 2, 4, 8].into_iter().filter(|&depth| order.len() <= 1 << depth);
    let data = depths.map(|depth| deflated(&scanlines(&map, depth))).min().unwrap_or(0);
    // Signature, IHDR, PLTE, IDAT with zlib head and Adler-32, IEND.
    8 + 25 + (12 + 3 * order.len()) + (12 + 6 + data) + 12
}

fn scanlines(map: &LabelRaster, depth: usize) -> Vec<u8> {
    let mut out = Vec::new();
    for row in map.labels.chunks(map.width.max(1)) {
        out.push(0);
        out.extend(
            row.chunks(8 / depth).map(|cells| {
                cells.iter().enumerate().fold(0, |byte, (i, &label)| byte | label << (8 - depth * (i + 1)))
            }),
        );
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stored(data: &[u8]) -> usize {
        data.len()
    }

    #[test]
    fn the_shallowest_depth_is_found_and_the_container_counted() {
        let map = LabelRaster { width: 8, height: 2, labels: [[0u8, 9]; 8].concat() };
        // Two rows of a filter byte and eight pixels of a bit; two colours.
        assert_eq!(map.smallest_png(&mut stored), 8 + 25 + 12 + 6 + 12 + 6 + 4 + 12);
    }

    #[test]
    fn the_smaller_of_box_and_delta_counts() {
        let before = LabelRaster::uniform(40, 40, 1);
        let mut after = before.clone();
        assert_eq!(after.smallest_delta_png(&before, &mut stored), 0);
        after.set(7, 9, 2);
        assert_eq!(after.smallest_delta_png(&before, &mut stored), 8 + 25 + 12 + 3 + 12 + 6 + 2 + 12);
    }
}
