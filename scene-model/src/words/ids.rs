//! The ids of the words of each kind, one vocabulary after the other.

use super::config::WordConfig;
use super::{binary, colour, context, texture};

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
