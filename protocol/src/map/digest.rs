//! A fingerprint of a map that is updated cell by cell.

use super::Cell;

/// A 16-bit fingerprint of a set of labelled cells; it does not depend on the order in which they were set.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct MapDigest(u64);

impl MapDigest {
    /// Updates the fingerprint for a cell whose label changes from `old` to `new`.
    pub fn change(&mut self, cell: Cell, old: u8, new: u8) {
        self.0 ^= term(cell, old) ^ term(cell, new);
    }

    /// The low 16 bits of the sum over all cells.
    pub fn value(self) -> u16 {
        (self.0 ^ self.0 >> 16 ^ self.0 >> 32 ^ self.0 >> 48) as u16
    }
}

/// The mixing function of SplitMix64 over cell and label; 0 for an unexplored cell.
fn term(cell: Cell, label: u8) -> u64 {
    if label == 0 {
        return 0;
    }
    let place = u64::from(cell.x as u32) << 32 | u64::from(cell.y as u32);
    let mut z = place.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ u64::from(label).wrapping_mul(0xD6E8_FEB8_6659_FD93);
    z = (z ^ z >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ z >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ z >> 31
}
