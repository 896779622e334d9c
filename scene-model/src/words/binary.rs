//! Binary words: an oriented pattern of brightness comparisons (as ORB), nearest of random prototypes.

use super::Word;
use super::grid::centres;
use super::plane::Plane;
use crate::random::Stream;

const BITS: usize = 128;
const SIDE: usize = 21;
/// The pattern stays this far from the centre, pixels of half resolution.
const RADIUS: f64 = 9.0;
const TURNS: usize = 32;
const SEED: u64 = 0x0b5e_55ed;

/// Number of binary words.
pub(crate) const SIZE: u32 = 64;

/// Two places in a patch that are compared.
type Pair = [u16; 2];

/// The pattern in each orientation, and the prototypes.
#[derive(Clone, Debug)]
pub(crate) struct Binary {
    patterns: Vec<[Pair; BITS]>,
    prototypes: Vec<u128>,
}

impl Default for Binary {
    fn default() -> Self {
        let mut chance = Stream::new(SEED);
        let places: Vec<[f64; 2]> = (0..2 * BITS).map(|_| place(&mut chance)).collect();
        let patterns = (0..TURNS).map(|turn| turned(&places, turn)).collect();
        let prototypes =
            (0..SIZE).map(|_| u128::from(chance.next_u64()) << 64 | u128::from(chance.next_u64())).collect();
        Self { patterns, prototypes }
    }
}

impl Binary {
    /// One word for each position of a grid of `spacing` pixels of the full frame, seen at half resolution.
    pub(crate) fn extract(&self, half: &Plane, spacing: f32, first_id: u32, words: &mut Vec<Word>) {
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

/// Direction from the centre of a patch to its centre of brightness, in turns of 1 / 32.
fn orientation(patch: &[[f32; SIDE]; SIDE]) -> usize {
    let half = (SIDE / 2) as f32;
    let (mut right, mut down) = (0.0f32, 0.0f32);
    for (y, line) in patch.iter().enumerate() {
        for (x, &value) in line.iter().enumerate() {
            right += (x as f32 - half) * value;
            down += (y as f32 - half) * value;
        }
    }
    let turn = down.atan2(right) / std::f32::consts::TAU * TURNS as f32;
    (turn.round() as i32).rem_euclid(TURNS as i32) as usize
}

fn place(chance: &mut Stream) -> [f64; 2] {
    loop {
        let place = [chance.normal() * RADIUS / 2.0, chance.normal() * RADIUS / 2.0];
        if place[0].hypot(place[1]) <= RADIUS {
            return place;
        }
    }
}

fn turned(places: &[[f64; 2]], turn: usize) -> [Pair; BITS] {
    let (sin, cos) = (std::f64::consts::TAU * turn as f64 / TURNS as f64).sin_cos();
    let half = (SIDE / 2) as f64;
    let index = |[x, y]: [f64; 2]| {
        let (right, down) = ((cos * x - sin * y + half).round(), (sin * x + cos * y + half).round());
        (down as usize * SIDE + right as usize) as u16
    };
    std::array::from_fn(|bit| [index(places[2 * bit]), index(places[2 * bit + 1])])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ramp(turn: f32) -> [[f32; SIDE]; SIDE] {
        let (sin, cos) = turn.sin_cos();
        std::array::from_fn(|y| std::array::from_fn(|x| (x as f32 - 10.0) * cos + (y as f32 - 10.0) * sin))
    }

    #[test]
    fn a_turned_patch_keeps_its_code() {
        let binary = Binary::default();
        let straight = binary.code(&ramp(0.0));
        let turned = binary.code(&ramp(std::f32::consts::FRAC_PI_2));
        assert!((straight ^ turned).count_ones() <= 16);
    }
}
