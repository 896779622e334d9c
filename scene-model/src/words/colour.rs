//! Colour words: z-scored CIE Lab on an 8 x 8 x 8 lattice.

use serde::{Deserialize, Serialize};

use super::colour_field::ColourField;
use super::moments::{Moments, standardised};
use super::word::Word;

/// The levels of L, of a and of b on the lattice of colour words: the first 8 x 8 x 8 ids are (L x 8 + a) x 8 + b.
pub(crate) const LEVELS: u32 = 8;
/// The lattice spans this many standard deviations on either side of the mean.
const REACH: f32 = 2.0;

/// The number of colour words.
pub(crate) const SIZE: u32 = LEVELS * LEVELS * LEVELS;

/// The moments of L, a and b.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct ColourWords {
    lab: [Moments; 3],
}

impl ColourWords {
    /// Appends one word for each point of the field: the lattice point of its colour.
    pub(crate) fn extract(&mut self, field: &ColourField, learn: bool, first_id: u32, words: &mut Vec<Word>) {
        if learn {
            Moments::learn(&mut self.lab, &field.colours);
        }
        let scales = self.lab.map(|moments| moments.scale());
        words.extend(field.colours.iter().zip(field.places()).map(|(colour, (u, v))| {
            let mut id = 0;
            for (value, (mean, gain)) in colour.iter().zip(scales) {
                id = id * LEVELS + level((value - mean) * gain, REACH, LEVELS);
            }
            Word { id: first_id + id, u, v }
        }));
    }

    /// Appends the positions about `spacing` pixels apart, and the z-scores of the field's colours there, to `kept`.
    pub(crate) fn scores(&self, field: &ColourField, spacing: f32, kept: &mut Vec<(f32, f32, [f32; 3])>) {
        let scales = self.lab.map(|moments| moments.scale());
        let scored = |(u, v, index): (f32, f32, usize)| (u, v, standardised(&field.colours[index], &scales));
        kept.extend(field.sample(spacing).into_iter().map(scored));
    }
}

/// The level of a z-score on `levels` equal steps from `-reach` to `reach`; values beyond take the outer levels.
pub(super) fn level(z: f32, reach: f32, levels: u32) -> u32 {
    let step = 2.0 * reach / levels as f32;
    ((z + reach) / step).clamp(0.0, levels as f32 - 1.0) as u32
}
