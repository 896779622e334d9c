//! A procedural sea floor of patches: labels from a spatial Chinese Restaurant Process, each with an appearance of its own.

use crate::noise::Noise;
use image::RgbImage;
use scene_model::random::{CounterRng, derive};

/// A procedural sea floor with known truth.
#[derive(Clone, Debug)]
pub struct Patches {
    /// The sea floor from above, without effects of light and water.
    pub image: RgbImage,
    /// The class of each pixel, row by row from the top.
    pub truth: Vec<u8>,
    /// Columns of the image, pixels.
    pub width: u32,
    /// Rows of the image, pixels.
    pub height: u32,
}

/// Draws a world of patches: a sample of the spatial Chinese Restaurant Process on patches of about `patch_px` pixels.
/// Each class has its own colours and texture.
///
/// At most `classes` classes occur (1 to 24), fewer if there are few patches. Sizes below 1 are raised to 1.
///
/// ```
/// let (a, b) = (scenecast_worlds::patches(3, 90, 60, 15, 6), scenecast_worlds::patches(3, 90, 60, 15, 6));
/// assert_eq!((a.image, a.truth), (b.image, b.truth));
/// ```
#[must_use]
pub fn patches(seed: u64, width_px: u32, height_px: u32, patch_px: u32, classes: u8) -> Patches {
    let (width, height, patch) = (width_px.max(1), height_px.max(1), patch_px.max(1));
    let classes = classes.clamp(1, MAX_CLASSES);
    // Two more patches on each side, because the bent edges of the patches reach beyond the border.
    let (columns, rows) = (width.div_ceil(patch) as usize + 4, height.div_ceil(patch) as usize + 4);
    let patches = PatchLabels::sample(derive(seed, 1), columns, rows, classes);
    let skins = palette(derive(seed, 2), classes);
    let painter = Painter { patch: patch as f32, patches, skins, noise: Noise::new(derive(seed, 3)) };
    let mut image = RgbImage::new(width, height);
    let mut truth = Vec::with_capacity(width as usize * height as usize);
    for (y, row) in image.as_mut().chunks_exact_mut(3 * width as usize).enumerate() {
        for (x, pixel) in row.as_chunks_mut::<3>().0.iter_mut().enumerate() {
            let (class, colour) = painter.pixel(x as f32, y as f32);
            truth.push(class);
            *pixel = colour;
        }
    }
    Patches { image, truth, width, height }
}

struct Painter {
    patch: f32,
    patches: PatchLabels,
    skins: Vec<Skin>,
    noise: Noise,
}

impl Painter {
    /// The class and the colour of a pixel. Noise bends the edges of the patches, so that they look natural.
    fn pixel(&self, x: f32, y: f32) -> (u8, [u8; 3]) {
        let (u, v) = (x / self.patch + 2.0, y / self.patch + 2.0);
        let bend = |offset: f32| {
            let coarse = self.noise.value(u * 0.9 + offset, v * 0.9) - 0.5;
            let fine = self.noise.value(u * 4.1, v * 4.1 + offset) - 0.5;
            1.3 * coarse + 0.35 * fine
        };
        let class = self.patches.at(u + bend(17.0), v + bend(91.0));
        (class, self.skins[class as usize].colour(&self.noise, x, y))
    }
}

/// The prior weight of a label that no neighbour has.
const ALPHA: f64 = 0.01;
/// The weight of a new label.
const GAMMA: f64 = 0.06;
/// How often every patch is drawn again. With more sweeps the largest label would take over the grid.
const SWEEPS: usize = 3;
/// The exponent of the neighbours' count. A patch stands for many words, so a neighbour weighs more than one word does.
const SHARPNESS: i32 = 2;

/// The labels of a grid of patches, row by row.
#[derive(Clone, Debug)]
pub(crate) struct PatchLabels {
    columns: usize,
    rows: usize,
    labels: Vec<u8>,
}

impl PatchLabels {
    pub(crate) fn sample(key: u64, columns: usize, rows: usize, classes: u8) -> Self {
        let mut rng = CounterRng::new(key);
        let mut labels = Self { columns, rows, labels: vec![u8::MAX; columns * rows] };
        let mut sizes = vec![0usize; classes as usize];
        let mut order: Vec<usize> = (0..columns * rows).collect();
        for _ in 0..=SWEEPS {
            for i in (1..order.len()).rev() {
                order.swap(i, rng.below(i + 1));
            }
            for &place in &order {
                labels.draw(place, &mut sizes, &mut rng);
            }
        }
        labels
    }

    /// Draws the label of one patch given its neighbours: a label in use by its count there, a new one by gamma.
    fn draw(&mut self, place: usize, sizes: &mut [usize], rng: &mut CounterRng) {
        if let Some(size) = sizes.get_mut(self.labels[place] as usize) {
            *size -= 1;
        }
        let mut near = vec![0.0; sizes.len()];
        for other in self.neighbours(place) {
            if let Some(count) = near.get_mut(self.labels[other] as usize) {
                *count += 1.0;
            }
        }
        let unused = sizes.iter().position(|&size| size == 0);
        let weight = |label: usize| match sizes[label] {
            0 if unused == Some(label) => GAMMA,
            0 => 0.0,
            _ => f64::powi(near[label], SHARPNESS) + ALPHA,
        };
        let weights: Vec<f64> = (0..sizes.len()).map(weight).collect();
        let mut aim = rng.unit() * weights.iter().sum::<f64>();
        let label = weights.iter().position(|weight| {
            aim -= weight;
            aim < 0.0
        });
        let label = label.unwrap_or(0);
        self.labels[place] = label as u8;
        sizes[label] += 1;
    }

    fn neighbours(&self, place: usize) -> impl Iterator<Item = usize> + use<> {
        let (columns, rows) = (self.columns, self.rows);
        let (x, y) = (place % columns, place / columns);
        let left = (x > 0).then(|| place - 1);
        let right = (x + 1 < columns).then(|| place + 1);
        let above = (y > 0).then(|| place - columns);
        let below = (y + 1 < rows).then(|| place + columns);
        [left, right, above, below].into_iter().flatten()
    }

    /// The label at a position in patch units; beyond the border, the label at the border.
    #[inline]
    pub(crate) fn at(&self, x: f32, y: f32) -> u8 {
        let column = (x.max(0.0) as usize).min(self.columns - 1);
        let row = (y.max(0.0) as usize).min(self.rows - 1);
        self.labels[row * self.columns + column]
    }
}

pub(crate) const MAX_CLASSES: u8 = 24;

/// Colours of sand, rubble, rock, algae, corals and sponges as an underwater camera shows them.
const TONES: [[f32; 3]; 12] = [
    [196.0, 190.0, 158.0],
    [128.0, 132.0, 122.0],
    [84.0, 98.0, 104.0],
    [74.0, 112.0, 66.0],
    [168.0, 128.0, 82.0],
    [150.0, 92.0, 118.0],
    [112.0, 78.0, 60.0],
    [104.0, 138.0, 142.0],
    [186.0, 164.0, 96.0],
    [60.0, 74.0, 58.0],
    [172.0, 112.0, 92.0],
    [96.0, 92.0, 132.0],
];

/// The appearance of one class.
#[derive(Clone, Debug)]
pub(crate) struct Skin {
    dark: [f32; 3],
    bright: [f32; 3],
    /// Lattice steps in a pixel, along and across the grain.
    pitch: [f32; 2],
    turn: [f32; 2],
    /// The shares of coarse, middle and fine noise.
    octaves: [f32; 3],
    offset: f32,
}

impl Skin {
    #[inline]
    pub(crate) fn colour(&self, noise: &Noise, x: f32, y: f32) -> [u8; 3] {
        let along = (x * self.turn[0] + y * self.turn[1]) * self.pitch[0] + self.offset;
        let across = (y * self.turn[0] - x * self.turn[1]) * self.pitch[1] - self.offset;
        let coarse = noise.value(along * 0.17, across * 0.17);
        let middle = noise.value(along, across);
        let fine = noise.value(along * 3.7 + 40.0, across * 3.7);
        let tone = self.octaves[0] * coarse + self.octaves[1] * middle + self.octaves[2] * fine;
        let light = 0.9 + 0.2 * noise.value(x * 0.004, y * 0.004);
        std::array::from_fn(|channel| {
            let value = self.dark[channel] + (self.bright[channel] - self.dark[channel]) * tone;
            (value * light) as u8
        })
    }
}

/// One skin for each class. Tones repeat only when there are more classes than tones.
pub(crate) fn palette(key: u64, classes: u8) -> Vec<Skin> {
    let mut rng = CounterRng::new(key);
    let mut order: Vec<usize> = (0..TONES.len()).collect();
    for i in (1..order.len()).rev() {
        order.swap(i, rng.below(i + 1));
    }
    (0..classes as usize).map(|class| skin(TONES[order[class % order.len()]], &mut rng)).collect()
}

fn skin(tone: [f32; 3], rng: &mut CounterRng) -> Skin {
    let mut between = |low: f64, high: f64| (low + (high - low) * rng.unit()) as f32;
    let contrast = between(0.25, 0.6);
    let brightness = between(0.85, 1.15);
    let grain = 1.0 / between(3.0, 14.0);
    let stretch = between(1.0, 3.0);
    let (sin, cos) = between(0.0, std::f64::consts::PI).sin_cos();
    let octaves = [between(0.2, 0.6), between(0.2, 0.8), between(0.1, 0.6)];
    let sum: f32 = octaves.iter().sum();
    Skin {
        dark: tone.map(|value| value * brightness * (1.0 - contrast)),
        bright: tone.map(|value| value * brightness * (1.0 + contrast)),
        pitch: [grain / stretch, grain],
        turn: [cos, sin],
        octaves: octaves.map(|octave| octave / sum),
        offset: between(0.0, 200.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn world_is_a_function_of_its_seed() {
        let (a, b) = (patches(5, 90, 60, 15, 6), patches(5, 90, 60, 15, 6));
        assert_eq!((a.image.as_raw(), &a.truth), (b.image.as_raw(), &b.truth));
        assert_ne!(a.truth, patches(6, 90, 60, 15, 6).truth);
        assert_eq!((a.truth.len(), a.width, a.height), (90 * 60, 90, 60));
    }

    #[test]
    fn world_has_several_classes_within_the_bound() {
        for seed in 0..6 {
            let world = patches(seed, 400, 300, 20, 6);
            let used: std::collections::BTreeSet<u8> = world.truth.iter().copied().collect();
            assert!(used.len() >= 3 && used.iter().all(|&class| class < 6), "seed {seed}: {used:?}");
        }
    }

    #[test]
    fn sizes_below_one_are_raised_to_one() {
        assert_eq!(patches(1, 0, 0, 0, 0).truth.len(), 1);
    }
}
