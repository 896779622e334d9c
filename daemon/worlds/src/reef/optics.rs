//! Water, lamp, lens and sensor.

use super::camera::View;
use super::fields::Colour;
use image::RgbImage;
use scene_model::random::{CounterRng, derive, mix};

/// Attenuation of red, green and blue light by water, 1/m.
const ATTENUATION: [f32; 3] = [0.32, 0.082, 0.052];
/// What the camera's white balance leaves of the colours at the altitude for which it is set: red is the first to go.
const BALANCED: [f32; 3] = [0.60, 0.96, 1.04];
const BALANCED_M: f32 = 4.0;
/// Light that the water scatters back from an endless depth, and the rate at which it grows, 1/m.
const VEIL: [f32; 3] = [0.003, 0.040, 0.046];
const VEIL_RATE: f32 = 0.10;
const EXPOSURE: f32 = 2.2;
/// Standard deviation of the sensor's noise in display values: of the dark, and per root of the light.
const NOISE: [f32; 2] = [0.006, 0.012];
const STEPS: usize = 512;
const TONES: usize = 2048;
/// The light at which the sensor saturates.
const BRIGHTEST: f32 = 1.5;

/// The optical path of one frame.
pub(super) struct Optics {
    width: usize,
    height: usize,
    key: u64,
    pitch_m: f32,
    altitude_m: f32,
    /// Gain and veil over the squared distance from the middle.
    paths: Vec<(Colour, Colour)>,
    to_path: f32,
    /// The light of marine snow at each pixel.
    snow: Vec<f32>,
    /// Display value and its noise over the light.
    tones: Vec<[f32; 2]>,
}

impl Optics {
    pub(super) fn new(view: &View, pitch_m: f64, key: u64) -> Self {
        let altitude_m = view.altitude_m.clamp(0.2, 60.0) as f32;
        let (width, height) = (view.width_px as usize, view.height_px as usize);
        let corner = (width * width + height * height) as f32 / 4.0;
        let mut optics = Self {
            width,
            height,
            key: derive(derive(key, 40), view.moment),
            pitch_m: pitch_m as f32,
            altitude_m,
            paths: Vec::new(),
            to_path: STEPS as f32 / corner.max(1.0),
            snow: vec![0.0; width * height],
            tones: tones(),
        };
        optics.paths = (0..=STEPS).map(|i| optics.path(i as f32 / STEPS as f32, corner)).collect();
        optics.let_snow();
        optics
    }

    /// Gain and veil at a squared distance from the middle, a share of that of the corners, in pixels.
    fn path(&self, share: f32, corner: f32) -> (Colour, Colour) {
        let square = share * corner;
        let range = (self.altitude_m * self.altitude_m + square * self.pitch_m * self.pitch_m).sqrt();
        let slant = self.altitude_m / range;
        let vignette = 0.70 + 0.30 * slant * slant * slant;
        let lamp = 0.82 + 0.28 / (1.0 + 1.6 * share);
        // The sun's part of the way does not grow towards the corners.
        let way = 0.4 * range + 0.6 * self.altitude_m;
        let gain = |i: usize| BALANCED[i] * (ATTENUATION[i] * (BALANCED_M - way)).exp() * vignette * lamp * EXPOSURE;
        let veil = |i: usize| VEIL[i] * (1.0 - (-VEIL_RATE * range).exp()) * EXPOSURE;
        (std::array::from_fn(gain), std::array::from_fn(veil))
    }

    /// Marine snow: a few sharp specks, and blurred ones near the lens.
    fn let_snow(&mut self) {
        let mut rng = CounterRng::new(derive(self.key, 1));
        let area = (self.width * self.height) as f64 / 307_200.0;
        let count = (area * (25.0 + 45.0 * rng.unit())) as usize;
        for _ in 0..count {
            let (x, y) = (self.width as f64 * rng.unit(), self.height as f64 * rng.unit());
            let near = rng.unit() * rng.unit() * rng.unit();
            let radius = 0.8 + 5.0 * near * near + 0.6 * rng.unit();
            let glow = (0.05 + 0.22 * rng.unit() * rng.unit()) / (0.6 + 0.35 * radius * radius);
            self.add_speck(x as f32, y as f32, radius as f32, glow as f32 * EXPOSURE);
        }
    }

    fn add_speck(&mut self, x: f32, y: f32, radius: f32, glow: f32) {
        let reach = 2.0 * radius;
        let range = |at: f32, size: usize| {
            ((at - reach).max(0.0) as usize)..((at + reach + 1.0).clamp(0.0, size as f32) as usize)
        };
        for v in range(y, self.height) {
            for u in range(x, self.width) {
                let (dx, dy) = (u as f32 + 0.5 - x, v as f32 + 0.5 - y);
                let fall = (1.0 - (dx * dx + dy * dy) / (reach * reach)).max(0.0);
                self.snow[v * self.width + u] += glow * fall * fall;
            }
        }
    }

    /// The display values of a pixel that looks at the given light of the floor.
    #[inline]
    pub(super) fn expose(&self, u: usize, v: usize, floor: Colour) -> [u8; 3] {
        let at = v * self.width + u;
        let (dx, dy) = (u as f32 + 0.5 - self.width as f32 / 2.0, v as f32 + 0.5 - self.height as f32 / 2.0);
        let (gain, veil) = &self.paths[((dx * dx + dy * dy) * self.to_path) as usize];
        // Neighbouring colours share a part of their noise, as after demosaicing.
        let bits = mix(self.key.wrapping_add(at as u64));
        let (shared, snow) = (0.75 * bell(bits), self.snow[at]);
        std::array::from_fn(|i| {
            let light = floor[i] * gain[i] + veil[i] + snow;
            let [value, sigma] = self.tones[step(light)];
            display(value + sigma * (shared + 0.65 * bell(bits >> (16 * (i + 1)))))
        })
    }
}

/// A value of a triangular distribution around 0 with unit variance, from 16 random bits.
#[inline]
fn bell(bits: u64) -> f32 {
    let sum = (bits & 0xFF) as i32 + (bits >> 8 & 0xFF) as i32 - 255;
    sum as f32 * (2.45 / 256.0)
}

/// Display values of light, a gamma curve with a soft shoulder and deepened shadows, and the noise's standard deviation.
fn tones() -> Vec<[f32; 2]> {
    let tone = |i: usize| {
        let light = BRIGHTEST * i as f32 / TONES as f32;
        let soft = light * (1.0 + light * 0.16) / (1.0 + light * 0.42);
        let value = soft.powf(1.0 / 2.1).min(1.0);
        [value + 0.55 * (value * value * (3.0 - 2.0 * value) - value), NOISE[0] + NOISE[1] * light.sqrt()]
    };
    (0..=TONES).map(tone).collect()
}

#[inline]
fn step(light: f32) -> usize {
    (light.clamp(0.0, BRIGHTEST) * (TONES as f32 / BRIGHTEST)) as usize
}

#[inline]
fn display(value: f32) -> u8 {
    (value.clamp(0.0, 1.0) * 255.0 + 0.5) as u8
}

/// Light as display values, without any effect of the camera.
pub(super) fn develop(light: &[Colour], width: u32, height: u32) -> RgbImage {
    let table = tones();
    let mut image = RgbImage::new(width, height);
    for (pixel, light) in image.as_mut().as_chunks_mut::<3>().0.iter_mut().zip(light) {
        *pixel = light.map(|value| display(table[step(EXPOSURE * value)][0]));
    }
    image
}
