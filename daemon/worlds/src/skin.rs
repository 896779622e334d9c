//! The appearance of a class: two tones mixed by layered noise with a grain and a direction.

use crate::noise::Noise;
use scene_model::random::CounterRng;

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
