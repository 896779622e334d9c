//! Binary words: an oriented pattern of brightness comparisons, as in ORB (Rublee et al., ICCV 2011), quantised to
//! the nearest of random prototypes.

use super::config::{Word, centres};
use super::grey_plane::GreyPlane;
use crate::random::CounterRng;

const BITS: usize = 128;
const SIDE: usize = 21;
/// The maximum distance of a compared pixel from the centre, in pixels of half resolution.
const RADIUS: f64 = 9.0;
const ORIENTATIONS: usize = 32;
const SEED: u64 = 0x0b5e_55ed;

/// The number of binary words.
pub(crate) const SIZE: u32 = 64;

/// The indices of two pixels of a patch that are compared.
type PixelPair = [u16; 2];

/// The pattern in each orientation, and the prototypes of the words.
#[derive(Clone, Debug)]
pub(crate) struct BinaryWords {
    patterns: Vec<[PixelPair; BITS]>,
    prototypes: Vec<u128>,
}

impl Default for BinaryWords {
    fn default() -> Self {
        let mut rng = CounterRng::new(SEED);
        let points: Vec<[f64; 2]> = (0..2 * BITS).map(|_| pattern_point(&mut rng)).collect();
        let patterns = (0..ORIENTATIONS).map(|turn| rotated(&points, turn)).collect();
        let prototypes = (0..SIZE).map(|_| u128::from(rng.next_u64()) << 64 | u128::from(rng.next_u64())).collect();
        Self { patterns, prototypes }
    }
}

impl BinaryWords {
    /// Appends one word for each position on a grid of `spacing` pixels of the full frame;
    /// `half` has half the resolution.
    pub(crate) fn extract(&self, half: &GreyPlane, spacing: f32, first_id: u32, words: &mut Vec<Word>) {
        let across = centres(half.width as u32, spacing / 2.0);
        let down = centres(half.height as u32, spacing / 2.0);
        for &v in &down {
            for &u in &across {
                let code = self.code(&half.patch::<SIDE>(u, v));
                words.push(Word { id: first_id + self.nearest(code), u: 2.0 * u, v: 2.0 * v });
            }
        }
    }

    fn code(&self, patch: &[[f32; SIDE]; SIDE]) -> u128 {
        let flat = patch.as_flattened();
        let mut code = 0u128;
        for (bit, pair) in self.patterns[orientation(patch)].iter().enumerate() {
            let brighter = flat[pair[0] as usize] > flat[pair[1] as usize];
            code |= u128::from(brighter) << bit;
        }
        code
    }

    fn nearest(&self, code: u128) -> u32 {
        let distances = self.prototypes.iter().map(|prototype| (prototype ^ code).count_ones());
        distances.zip(0..).min().map_or(0, |(_, index)| index)
    }
}

/// The direction from the centre of a patch to its centroid of brightness, in steps of 1/32 of a turn.
fn orientation(patch: &[[f32; SIDE]; SIDE]) -> usize {
    let half = (SIDE / 2) as f32;
    let (mut right, mut down) = (0.0f32, 0.0f32);
    for (y, line) in patch.iter().enumerate() {
        for (x, &value) in line.iter().enumerate() {
            right += (x as f32 - half) * value;
            down += (y as f32 - half) * value;
        }
    }
    let turn = down.atan2(right) / std::f32::consts::TAU * ORIENTATIONS as f32;
    (turn.round() as i32).rem_euclid(ORIENTATIONS as i32) as usize
}

fn pattern_point(rng: &mut CounterRng) -> [f64; 2] {
    loop {
        let point = [rng.normal() * RADIUS / 2.0, rng.normal() * RADIUS / 2.0];
        if point[0].hypot(point[1]) <= RADIUS {
            return point;
        }
    }
}

fn rotated(points: &[[f64; 2]], turn: usize) -> [PixelPair; BITS] {
    let (sin, cos) = (std::f64::consts::TAU * turn as f64 / ORIENTATIONS as f64).sin_cos();
    let half = (SIDE / 2) as f64;
    let index = |[x, y]: [f64; 2]| {
        let (right, down) = ((cos * x - sin * y + half).round(), (sin * x + cos * y + half).round());
        (down as usize * SIDE + right as usize) as u16
    };
    std::array::from_fn(|bit| [index(points[2 * bit]), index(points[2 * bit + 1])])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ramp(turn: f32) -> [[f32; SIDE]; SIDE] {
        let (sin, cos) = turn.sin_cos();
        std::array::from_fn(|y| std::array::from_fn(|x| (x as f32 - 10.0) * cos + (y as f32 - 10.0) * sin))
    }

    #[test]
    fn rotated_patch_keeps_its_code() {
        let binary = BinaryWords::default();
        let straight = binary.code(&ramp(0.0));
        let turned = binary.code(&ramp(std::f32::consts::FRAC_PI_2));
        assert!((straight ^ turned).count_ones() <= 16);
    }
}
