//! Value noise: random values on a lattice, smoothly interpolated.

use scene_model::random::mix;

const SIDE: usize = 256;

/// A lattice of 256 x 256 random values, repeated in both directions.
#[derive(Clone, Debug)]
pub(crate) struct Noise {
    lattice: Vec<f32>,
}

impl Noise {
    pub(crate) fn new(key: u64) -> Self {
        let value = |i| (mix(key ^ mix(i)) >> 40) as f32 / 16_777_216.0;
        Self { lattice: (0..(SIDE * SIDE) as u64).map(value).collect() }
    }

    /// The value at a position in lattice units, 0 to 1.
    #[inline]
    pub(crate) fn value(&self, x: f32, y: f32) -> f32 {
        let (left, top) = (x.floor(), y.floor());
        let (fx, fy) = (smooth(x - left), smooth(y - top));
        let (left, top) = (left as i32 as usize, top as i32 as usize);
        let at = |x: usize, y: usize| self.lattice[(y % SIDE) * SIDE + x % SIDE];
        let (right, bottom) = (left.wrapping_add(1), top.wrapping_add(1));
        let upper = at(left, top) + fx * (at(right, top) - at(left, top));
        let lower = at(left, bottom) + fx * (at(right, bottom) - at(left, bottom));
        upper + fy * (lower - upper)
    }
}

fn smooth(t: f32) -> f32 {
    t * t * (3.0 - 2.0 * t)
}
