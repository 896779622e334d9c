//! Texture words: Gabor energy at three scales, each quantised into six levels of equal probability.

use super::config::{Word, centres};
use super::flat_field::{Moments, standardised};
use super::grey_plane::GreyPlane;

const SCALES: usize = 3;
const ORIENTATIONS: usize = 6;
/// Even and odd filters, one of each for every orientation.
const FILTERS: usize = 2 * ORIENTATIONS;
const SIDE: usize = 9;
/// Wavelength and standard deviation of the filters, in pixels of their scale.
const WAVELENGTH: f32 = 5.0;
const SIGMA: f32 = 2.0;
/// The sextiles of the standard normal distribution.
const CUTS: [f32; 5] = [-0.967, -0.431, 0.0, 0.431, 0.967];

/// The number of texture words: 6 levels at each of 3 scales.
pub(crate) const SIZE: u32 = 216;

/// Even and odd Gabor filters of six orientations.
#[derive(Clone, Debug)]
pub(crate) struct GaborBank(Vec<[[f32; FILTERS]; SIDE]>);

impl GaborBank {
    pub(crate) fn new() -> Self {
        Self(bank())
    }

    /// The sum of the squared responses of all filters at a position of a plane, and the mean grey value around it.
    pub(crate) fn power(&self, plane: &GreyPlane, x: f32, y: f32) -> (f32, f32) {
        let patch = plane.patch::<SIDE>(x, y);
        let sum: f32 = patch.as_flattened().iter().sum();
        (self.power_of(&patch), sum / (SIDE * SIDE) as f32)
    }

    fn power_of(&self, patch: &[[f32; SIDE]; SIDE]) -> f32 {
        let mut response = [0.0f32; FILTERS];
        for (line, filters) in patch.iter().zip(&self.0) {
            for (&pixel, taps) in line.iter().zip(filters) {
                for (sum, tap) in response.iter_mut().zip(taps) {
                    *sum += pixel * tap;
                }
            }
        }
        response.iter().map(|value| value * value).sum()
    }
}

/// The filter bank, and the moments of the log energy at each scale.
#[derive(Clone, Debug)]
pub(crate) struct TextureWords {
    bank: GaborBank,
    energy: [Moments; SCALES],
}

impl Default for TextureWords {
    fn default() -> Self {
        Self { bank: GaborBank::new(), energy: [Moments::default(); SCALES] }
    }
}

impl TextureWords {
    /// Continues with moments that were learnt before.
    pub(crate) fn with_energy(energy: [Moments; SCALES]) -> Self {
        Self { energy, ..Self::default() }
    }

    /// The moments of the log energy at each scale.
    pub(crate) fn learnt(&self) -> [Moments; SCALES] {
        self.energy
    }

    /// Appends one word for each position on a grid of `spacing` pixels, and the z-scores behind each to `kept`.
    pub(crate) fn extract(
        &mut self,
        levels: &[GreyPlane; SCALES],
        spacing: f32,
        learn: bool,
        first_id: u32,
        words: &mut Vec<Word>,
        mut kept: Option<&mut Vec<[f32; SCALES]>>,
    ) {
        let across = centres(levels[0].width as u32, spacing);
        let down = centres(levels[0].height as u32, spacing);
        let places = || down.iter().flat_map(|&v| across.iter().map(move |&u| (u, v)));
        let energies: Vec<[f32; SCALES]> = places().map(|(u, v)| self.energies(levels, u, v)).collect();
        if learn {
            Moments::learn(&mut self.energy, &energies);
        }
        let scales = self.energy.map(|moments| moments.scale());
        for (energy, (u, v)) in energies.iter().zip(places()) {
            let scores = standardised(energy, &scales);
            words.push(Word { id: first_id + sextiles(&scores), u, v });
            if let Some(kept) = &mut kept {
                kept.push(scores);
            }
        }
    }

    /// The log energy over all orientations, at each scale.
    fn energies(&self, levels: &[GreyPlane; SCALES], u: f32, v: f32) -> [f32; SCALES] {
        let mut energies = [0.0; SCALES];
        let mut zoom = 1.0;
        for (energy, level) in energies.iter_mut().zip(levels) {
            *energy = self.energy(&level.patch::<SIDE>(u * zoom, v * zoom));
            zoom *= 0.5;
        }
        energies
    }

    fn energy(&self, patch: &[[f32; SIDE]; SIDE]) -> f32 {
        (self.bank.power_of(patch) + 1e-5).ln()
    }
}

/// The number of a combination of sextiles, one for each z-score.
pub(super) fn sextiles(scores: &[f32; 3]) -> u32 {
    scores.iter().fold(0, |id, &score| id * 6 + sextile(score))
}

/// The sextile of the normal distribution that a z-score falls in, 0 to 5.
fn sextile(z: f32) -> u32 {
    CUTS.iter().map(|&cut| u32::from(z > cut)).sum()
}

/// Even and odd Gabor filters whose response to a constant is 0.
fn bank() -> Vec<[[f32; FILTERS]; SIDE]> {
    let offsets = || (0..SIDE * SIDE).map(|i| ((i % SIDE) as f32 - 4.0, (i / SIDE) as f32 - 4.0));
    let window = |(dx, dy): (f32, f32)| (-(dx * dx + dy * dy) / (2.0 * SIGMA * SIGMA)).exp();
    let mass: f32 = offsets().map(window).sum();
    let filter = |index: usize| -> Vec<f32> {
        let (sin, cos) = (std::f32::consts::PI * (index / 2) as f32 / ORIENTATIONS as f32).sin_cos();
        let wave = |(dx, dy): (f32, f32)| {
            let phase = std::f32::consts::TAU * (dx * cos + dy * sin) / WAVELENGTH;
            if index.is_multiple_of(2) { phase.cos() } else { phase.sin() }
        };
        let mean = offsets().map(|place| window(place) * wave(place)).sum::<f32>() / mass;
        offsets().map(|place| window(place) * (wave(place) - mean) / mass).collect()
    };
    let filters: Vec<Vec<f32>> = (0..FILTERS).map(filter).collect();
    let taps = |y: usize, x: usize| std::array::from_fn(|index| filters[index][y * SIDE + x]);
    (0..SIDE).map(|y| std::array::from_fn(|x| taps(y, x))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn energy_of(pixel: impl Fn(usize, usize) -> f32) -> f32 {
        let mut patch = [[0.0; SIDE]; SIDE];
        for (y, line) in patch.iter_mut().enumerate() {
            for (x, value) in line.iter_mut().enumerate() {
                *value = pixel(x, y);
            }
        }
        TextureWords::default().energy(&patch)
    }

    #[test]
    fn stripes_have_energy_and_a_uniform_patch_has_none() {
        let even = energy_of(|_, _| 0.7);
        let stripes = energy_of(|x, _| if x % 5 < 2 { 1.0 } else { 0.0 });
        assert!(even < -11.0, "{even}");
        assert!(stripes > -4.0, "{stripes}");
    }
}
