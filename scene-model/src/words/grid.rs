//! Regular sample positions along an axis of a frame.

/// The centres of equal parts of about `spacing` pixels along an axis of `length` pixels.
pub(crate) fn centres(length: u32, spacing: f32) -> Vec<f32> {
    let count = parts(length, spacing);
    let step = length as f32 / count as f32;
    (0..count).map(|i| (i as f32 + 0.5) * step).collect()
}

/// The bounds of the same parts, from 0 to `length`: one more than there are parts.
pub(crate) fn bounds(length: u32, spacing: f32) -> Vec<u32> {
    let count = parts(length, spacing);
    (0..=count).map(|i| (u64::from(i) * u64::from(length) / u64::from(count)) as u32).collect()
}

fn parts(length: u32, spacing: f32) -> u32 {
    ((length as f32 / spacing.max(1.0)).round() as u32).clamp(1, length.max(1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_cover_the_axis_without_gaps() {
        let bounds = bounds(640, 4.2);
        assert_eq!((bounds[0], bounds[bounds.len() - 1]), (0, 640));
        assert!(bounds.windows(2).all(|pair| (4..=5).contains(&(pair[1] - pair[0]))));
        assert_eq!(centres(640, 4.2).len() + 1, bounds.len());
    }
}
