//! Random numbers for procedural maps.

/// A SplitMix64 generator (Steele, Lea and Flood 2014); the same seed gives the same numbers.
#[derive(Debug, Clone)]
pub struct MapRng(u64);

impl MapRng {
    /// A generator whose numbers depend on `seed` alone.
    pub fn new(seed: u64) -> Self {
        Self(seed ^ 0x5EED_0F5C_E9EC_A571)
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ self.0 >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ z >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ z >> 31
    }

    /// A number below `end`, which must be at least 1.
    pub fn below(&mut self, end: usize) -> usize {
        ((u128::from(self.next()) * end as u128) >> 64) as usize
    }

    /// A number in `start..end`, which must not be empty.
    pub fn within(&mut self, start: usize, end: usize) -> usize {
        start + self.below(end - start)
    }

    /// `true` with a probability of `per_million` in a million.
    pub fn happens(&mut self, per_million: usize) -> bool {
        self.below(1_000_000) < per_million
    }

    /// One of the entries; there must be at least one.
    pub fn pick<T: Copy>(&mut self, entries: &[T]) -> T {
        entries[self.below(entries.len())]
    }
}
