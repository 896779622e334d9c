//! The visual word, the number of words of each kind, and where in a frame they are sampled.

use serde::{Deserialize, Serialize};

/// The number of words of each kind in a cell, and the length of the warm-up.
///
/// Counts are approximate, since words lie on a regular grid. A count of 0 switches a kind off; the ids of
/// the others stay the same.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct WordConfig {
    /// Colour words in a cell: CIE Lab on a lattice of 8 x 8 x 8 points.
    pub colour: u32,
    /// Context words in a cell: mean colour and contrast of a window of three cells.
    pub context: u32,
    /// Spread words in a cell: deviation of the colours in a window of two cells.
    pub spread: u32,
    /// Texture words in a cell: Gabor energy at three scales.
    pub texture: u32,
    /// Binary words in a cell: oriented brightness comparisons, as in ORB.
    pub binary: u32,
    /// The number of frames that tone stretch, means and deviations are estimated from; 0 counts as 1.
    pub warm_up_frames: u32,
}

impl Default for WordConfig {
    fn default() -> Self {
        Self { colour: 36, context: 9, spread: 9, texture: 9, binary: 4, warm_up_frames: 16 }
    }
}

/// A visual word and its position in the frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Word {
    /// The word's number, below [`WordExtractor::vocabulary_size`](super::WordExtractor::vocabulary_size).
    pub id: u32,
    /// Distance from the left edge of the frame, pixels.
    pub u: f32,
    /// Distance from the top edge of the frame, pixels.
    pub v: f32,
}

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
