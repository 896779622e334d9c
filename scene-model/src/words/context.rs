//! Context words: what the colours are like over a few cells around.
//!
//! Fine colour words say what a point looks like, these say what it is part of; on real reefs they lift the map more
//! than any finer vocabulary did (README).

use serde::{Deserialize, Serialize};

use super::colour::level;
use super::field::Field;
use super::texture::sextile;
use super::{Moments, Word};

const COLOUR_LEVELS: u32 = 6;
const CONTRAST_LEVELS: u32 = 4;
const REACH: f32 = 2.0;
/// Windows, in cells.
const CONTEXT_CELLS: f32 = 3.0;
const SPREAD_CELLS: f32 = 2.0;

/// Number of context words.
pub(crate) const SIZE: u32 = COLOUR_LEVELS * COLOUR_LEVELS * COLOUR_LEVELS * CONTRAST_LEVELS;
/// Number of spread words.
pub(crate) const SPREAD_SIZE: u32 = 216;

/// Mean L, a, b and the logarithm of the spread of L, around each point.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Context {
    measures: [Moments; 4],
}

impl Context {
    /// One word for each position of a grid of `spacing` pixels.
    pub(crate) fn extract(&mut self, field: &Field, spacing: f32, learn: bool, first_id: u32, words: &mut Vec<Word>) {
        let (means, spreads) = field.windows(CONTEXT_CELLS);
        let measure = |(mean, spread): (&[f32; 3], &[f32; 3])| [mean[0], mean[1], mean[2], (spread[0] + 1.0).ln()];
        let measures: Vec<[f32; 4]> = means.iter().zip(&spreads).map(measure).collect();
        if learn {
            Moments::learn(&mut self.measures, &measures);
        }
        let scales = self.measures.map(|moments| moments.scale());
        words.extend(field.sample(spacing).into_iter().map(|(u, v, index)| {
            let mut id = 0;
            for (i, (value, (mean, gain))) in measures[index].iter().zip(scales).enumerate() {
                let levels = if i < 3 { COLOUR_LEVELS } else { CONTRAST_LEVELS };
                id = id * levels + level((value - mean) * gain, REACH, levels);
            }
            Word { id: first_id + id, u, v }
        }));
    }
}

/// Logarithms of the spreads of L, a and b, around each point.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Spread {
    measures: [Moments; 3],
}

impl Spread {
    /// One word for each position of a grid of `spacing` pixels.
    pub(crate) fn extract(&mut self, field: &Field, spacing: f32, learn: bool, first_id: u32, words: &mut Vec<Word>) {
        let (_, spreads) = field.windows(SPREAD_CELLS);
        let measures: Vec<[f32; 3]> =
            spreads.into_iter().map(|spread| spread.map(|value| (value + 0.5).ln())).collect();
        if learn {
            Moments::learn(&mut self.measures, &measures);
        }
        let scales = self.measures.map(|moments| moments.scale());
        words.extend(field.sample(spacing).into_iter().map(|(u, v, index)| {
            let levels = measures[index].iter().zip(scales);
            let id = levels.fold(0, |id, (value, (mean, gain))| id * 6 + sextile((value - mean) * gain));
            Word { id: first_id + id, u, v }
        }));
    }
}
