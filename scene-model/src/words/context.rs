//! Context and spread words: the mean and the deviation of the colours over a few cells.
//!
//! Colour words describe a point, context words its surroundings. On real reefs they improve the map more than any
//! finer vocabulary did (measured: `docs/explanation/scene-model.md`).

use serde::{Deserialize, Serialize};

use super::colour::{ColourField, level};
use super::config::Word;
use super::flat_field::{Moments, standardised};
use super::texture::sextiles;

const COLOUR_LEVELS: u32 = 6;
const CONTRAST_LEVELS: u32 = 4;
const REACH: f32 = 2.0;
/// Edges of the windows, in cells.
const CONTEXT_CELLS: f32 = 3.0;
const SPREAD_CELLS: f32 = 2.0;

/// The number of context words: levels of L, a and b and of the contrast.
pub(crate) const SIZE: u32 = COLOUR_LEVELS * COLOUR_LEVELS * COLOUR_LEVELS * CONTRAST_LEVELS;
/// The number of spread words: six levels each of L, a and b.
pub(crate) const SPREAD_SIZE: u32 = 216;

/// The moments of the windows' mean L, a and b, and of the logarithm of the deviation of L.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct ContextWords {
    measures: [Moments; 4],
}

impl ContextWords {
    /// Appends one word for each position on a grid of `spacing` pixels, and the z-scores behind each to `kept`.
    pub(crate) fn extract(
        &mut self,
        field: &ColourField,
        spacing: f32,
        learn: bool,
        first_id: u32,
        words: &mut Vec<Word>,
        mut kept: Option<&mut Vec<[f32; 4]>>,
    ) {
        let (means, spreads) = field.windows(CONTEXT_CELLS);
        let measure = |(mean, spread): (&[f32; 3], &[f32; 3])| [mean[0], mean[1], mean[2], (spread[0] + 1.0).ln()];
        let measures: Vec<[f32; 4]> = means.iter().zip(&spreads).map(measure).collect();
        if learn {
            Moments::learn(&mut self.measures, &measures);
        }
        let scales = self.measures.map(|moments| moments.scale());
        for (u, v, index) in field.sample(spacing) {
            let scores = standardised(&measures[index], &scales);
            let mut id = 0;
            for (i, score) in scores.into_iter().enumerate() {
                let levels = if i < 3 { COLOUR_LEVELS } else { CONTRAST_LEVELS };
                id = id * levels + level(score, REACH, levels);
            }
            words.push(Word { id: first_id + id, u, v });
            if let Some(kept) = &mut kept {
                kept.push(scores);
            }
        }
    }
}

/// The moments of the logarithms of the windows' deviations of L, a and b.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct SpreadWords {
    measures: [Moments; 3],
}

impl SpreadWords {
    /// Appends one word for each position on a grid of `spacing` pixels, and the z-scores behind each to `kept`.
    pub(crate) fn extract(
        &mut self,
        field: &ColourField,
        spacing: f32,
        learn: bool,
        first_id: u32,
        words: &mut Vec<Word>,
        mut kept: Option<&mut Vec<[f32; 3]>>,
    ) {
        let (_, spreads) = field.windows(SPREAD_CELLS);
        let measures: Vec<[f32; 3]> =
            spreads.into_iter().map(|spread| spread.map(|value| (value + 0.5).ln())).collect();
        if learn {
            Moments::learn(&mut self.measures, &measures);
        }
        let scales = self.measures.map(|moments| moments.scale());
        for (u, v, index) in field.sample(spacing) {
            let scores = standardised(&measures[index], &scales);
            words.push(Word { id: first_id + sextiles(&scores), u, v });
            if let Some(kept) = &mut kept {
                kept.push(scores);
            }
        }
    }
}
