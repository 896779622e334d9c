//! The number of words of each kind, and their ids.

use serde::{Deserialize, Serialize};

use super::{binary, colour, context, texture};

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

impl WordConfig {
    /// Returns the number of different words (V); it does not depend on the configuration.
    #[must_use]
    pub fn vocabulary_size(&self) -> u32 {
        first_id(5)
    }
}

/// The first id of the `kind`-th vocabulary, from 0: colour, context, spread, texture, binary, end.
pub(super) fn first_id(kind: usize) -> u32 {
    let sizes = [colour::SIZE, context::SIZE, context::SPREAD_SIZE, texture::SIZE, binary::SIZE];
    sizes.iter().take(kind).sum()
}
