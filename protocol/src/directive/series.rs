//! The series that the versions of orders count in.

use serde::{Deserialize, Serialize};

/// The series of a surface: a random number of 48 bits, under which it counts the versions of its orders.
///
/// A surface that has forgotten its orders begins a new series. Among a thousand series of one mission, two are equal
/// with a probability of 2 in 10^9.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Series(u64);

impl Series {
    /// The series with the low 48 of these random bits.
    pub fn from_random(bits: u64) -> Self {
        Self(bits & 0xFFFF_FFFF_FFFF)
    }

    /// The number on the wire.
    pub fn get(self) -> u64 {
        self.0
    }
}
