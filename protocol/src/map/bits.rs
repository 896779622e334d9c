//! A set of cells of one tile.

use crate::grid::TILE_CELLS;
use crate::map_codec::Stride;

/// Cells of a tile by index, one bit each.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct TileSet([u64; TILE_CELLS / 64]);

impl TileSet {
    pub(super) fn contains(&self, cell: u8) -> bool {
        self.word(cell).is_some_and(|word| word >> (cell % 64) & 1 == 1)
    }

    /// Adds a cell or removes it.
    pub(super) fn set(&mut self, cell: u8, inside: bool) {
        if let Some(word) = self.0.get_mut(usize::from(cell / 64)) {
            *word = *word & !(1 << (cell % 64)) | u64::from(inside) << (cell % 64);
        }
    }

    pub(super) fn len(&self) -> usize {
        self.0.iter().map(|word| word.count_ones() as usize).sum()
    }

    pub(super) fn is_empty(&self) -> bool {
        self.0 == [0; TILE_CELLS / 64]
    }

    /// The cells of `self` that are in neither of the other sets.
    pub(super) fn without(&self, one: &Self, other: &Self) -> Self {
        let mut left = *self;
        for ((word, one), other) in left.0.iter_mut().zip(one.0).zip(other.0) {
            *word &= !(one | other);
        }
        left
    }

    /// The cells on a lattice. Four rows of a tile share a word, and the rows of the lattice begin with the tile's.
    pub(super) fn on(&self, stride: Stride) -> Self {
        let mask = match stride {
            Stride::One => u64::MAX,
            Stride::Four => 0x1111,
        };
        Self(self.0.map(|word| word & mask))
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = u8> + use<> {
        [0u8, 64, 128, 192].into_iter().zip(self.0).flat_map(|(first, word)| {
            let mut left = word;
            std::iter::from_fn(move || {
                let bit = left.trailing_zeros() as u8;
                (left != 0).then(|| {
                    left &= left - 1;
                    first + bit
                })
            })
        })
    }

    fn word(&self, cell: u8) -> Option<&u64> {
        self.0.get(usize::from(cell / 64))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_are_listed_in_order_until_removed() {
        let mut set = TileSet::default();
        for cell in [255, 0, 64, 63, 7] {
            set.set(cell, true);
        }
        assert_eq!(set.iter().collect::<Vec<_>>(), [0, 7, 63, 64, 255]);
        set.set(63, false);
        assert!(set.len() == 4 && !set.contains(63) && set.contains(64));
        assert_eq!(set.on(Stride::Four).iter().collect::<Vec<_>>(), [0, 64]);
        assert!(set.without(&set, &TileSet::default()).is_empty());
    }
}
