//! Value noise: random values on a lattice, smoothly interpolated.

use scene_model::random::mix;

const SIDE: usize = 256;

/// A lattice of 256 x 256 random values, repeated in both directions.
#[derive(Clone, Debug)]
pub(crate) struct Noise {
    lattice: Box<[f32; SIDE * SIDE]>,
}

impl Noise {
    pub(crate) fn new(key: u64) -> Self {
        let value = |i| (mix(key ^ mix(i)) >> 40) as f32 / 16_777_216.0;
        let mut lattice = vec![0.0; SIDE * SIDE];
        (0u64..).zip(&mut lattice).for_each(|(i, node)| *node = value(i));
        match lattice.into_boxed_slice().try_into() {
            Ok(lattice) => Self { lattice },
            Err(_) => unreachable!("the slice has as many values as the array"),
        }
    }

    /// The value at a position in lattice units, 0 to 1.
    #[inline]
    pub(crate) fn value(&self, x: f32, y: f32) -> f32 {
        let (left, top) = (floor(x), floor(y));
        let (fx, fy) = (smooth(x - left as f32), smooth(y - top as f32));
        let (left, top) = (left as usize, top as usize);
        let at = |x: usize, y: usize| self.lattice[(y % SIDE) * SIDE + x % SIDE];
        let (right, bottom) = (left.wrapping_add(1), top.wrapping_add(1));
        let upper = at(left, top) + fx * (at(right, top) - at(left, top));
        let lower = at(left, bottom) + fx * (at(right, bottom) - at(left, bottom));
        upper + fy * (lower - upper)
    }
}

/// The largest whole number that is not above the value. `f32::floor` is a call of a function on many processors.
#[inline]
pub(crate) fn floor(value: f32) -> i32 {
    let towards_zero = value as i32;
    towards_zero - i32::from((towards_zero as f32) > value)
}

#[inline]
fn smooth(t: f32) -> f32 {
    t * t * (3.0 - 2.0 * t)
}
