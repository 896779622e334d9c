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

    /// The series after this one of the same surface.
    #[must_use]
    pub fn next(self) -> Self {
        Self::from_random(self.0.wrapping_add(1))
    }

    /// Whether two series are of one surface, which counts them up; those of two surfaces are far apart.
    pub fn is_of_same_surface(self, other: Self) -> bool {
        const NEAR: u64 = 1 << 12;
        let apart = Self::from_random(self.0.wrapping_sub(other.0)).0;
        apart < NEAR || Self::from_random(apart.wrapping_neg()).0 < NEAR
    }

    /// The number on the wire.
    pub fn get(self) -> u64 {
        self.0
    }
}
