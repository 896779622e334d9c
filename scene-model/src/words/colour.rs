//! Colour words: z-scored CIE Lab on an 8 x 8 x 8 lattice.

use serde::{Deserialize, Serialize};

use super::field::Field;
use super::{Moments, Word};

/// The first words are points of a lattice of this many levels each of L, a and b: id = (L x levels + a) x levels + b.
pub const LEVELS: u32 = 8;
/// The lattice spans this many standard deviations either side of the mean.
const REACH: f32 = 2.0;

/// Number of colour words.
pub(crate) const SIZE: u32 = LEVELS * LEVELS * LEVELS;

/// Mean and spread of L, a and b in the frames learnt from.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Colour {
    lab: [Moments; 3],
}

impl Colour {
    /// One word for each point of the field: the lattice point of its colour.
    pub(crate) fn extract(&mut self, field: &Field, learn: bool, first_id: u32, words: &mut Vec<Word>) {
        if learn {
            Moments::learn(&mut self.lab, &field.lab);
        }
        let scales = self.lab.map(|moments| moments.scale());
        words.extend(field.lab.iter().zip(field.places()).map(|(colour, (u, v))| {
            let mut id = 0;
            for (value, (mean, gain)) in colour.iter().zip(scales) {
                id = id * LEVELS + level((value - mean) * gain, REACH, LEVELS);
            }
            Word { id: first_id + id, u, v }
        }));
    }
}

/// Level of a z-score on `levels` equal steps from -`reach` to `reach`, beyond that the outer ones.
pub(super) fn level(z: f32, reach: f32, levels: u32) -> u32 {
    let step = 2.0 * reach / levels as f32;
    ((z + reach) / step).clamp(0.0, levels as f32 - 1.0) as u32
}
