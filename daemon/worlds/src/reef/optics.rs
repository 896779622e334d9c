//! The view of a frame; water, lamp, lens, sensor, and the camera's balance of colours.

use super::Reef;
use super::fields::{Colour, blend, scale};
use crate::noise::Noise;
use image::RgbImage;
use scene_model::random::{CounterRng, derive, mix};

/// Exposure of pictures without water.
const EXPOSURE: f32 = 2.2;
/// Most of a row's light that smears into the next one while the shutter is open.
const MAX_SMEAR: f32 = 0.36;
/// Pixels that share a gain, which changes slowly, and 64 random bits.
const RUN: usize = 4;
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
    light: Light,
    smear: f32,
    /// Gain and veil over the squared distance from the middle.
    paths: Vec<(Colour, Colour)>,
    to_path: f32,
    /// The light of marine snow at each pixel.
    snow: Vec<f32>,
    /// Display value and its noise over the light.
    tones: Vec<[f32; 2]>,
}

impl Optics {
    pub(super) fn new(view: &View, pitch_m: f64, reef: &Reef) -> Self {
        let altitude_m = view.altitude_m.clamp(0.2, 60.0) as f32;
        let key = derive(derive(reef.key, 40), view.moment);
        let (width, height) = (view.width_px as usize, view.height_px as usize);
        let corner = (width * width + height * height) as f32 / 4.0;
        let mut optics = Self {
            width,
            height,
            key,
            pitch_m: pitch_m as f32,
            light: reef.water.light(&reef.ground.noise, view.x_m as f32, view.y_m as f32, altitude_m),
            smear: MAX_SMEAR * CounterRng::new(derive(key, 2)).unit() as f32,
            paths: Vec::new(),
            to_path: STEPS as f32 / corner.max(1.0),
            snow: vec![0.0; width * height],
            tones: tones(reef.water.contrast),
        };
        optics.paths = (0..=STEPS).map(|i| optics.path(i as f32 / STEPS as f32, corner, altitude_m)).collect();
        optics.let_snow();
        optics
    }

    /// Gain and veil at a squared distance from the middle, a share of that of the corners, in pixels.
    fn path(&self, share: f32, corner: f32, altitude_m: f32) -> (Colour, Colour) {
        let square = share * corner;
        let range = (altitude_m * altitude_m + square * self.pitch_m * self.pitch_m).sqrt();
        let slant = altitude_m / range;
        let vignette = 0.70 + 0.30 * slant * slant * slant;
        let lamp = 0.82 + 0.28 / (1.0 + 1.6 * share);
        let (gain, veil) = self.light.along(range);
        (scale(gain, vignette * lamp), veil)
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
            self.add_speck(x as f32, y as f32, radius as f32, 1.6 * glow as f32);
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

    /// The display values of a row of pixels that look at the given light of the floor. `above` is the light of the row
    /// before it, with what smeared into that.
    pub(super) fn expose(&self, v: usize, floor: &[Colour], above: &mut [Colour], line: &mut [[u8; 3]]) {
        let dy = v as f32 + 0.5 - self.height as f32 / 2.0;
        let smear = if v == 0 { 0.0 } else { self.smear };
        let snow = &self.snow[v * self.width..];
        for start in (0..line.len()).step_by(RUN) {
            let dx = (start + RUN / 2) as f32 - self.width as f32 / 2.0;
            let step = ((dx * dx + dy * dy) * self.to_path) as usize;
            let (gain, veil) = &self.paths[step.min(STEPS)];
            let end = (start + RUN).min(line.len());
            let mut bits = mix(self.key.wrapping_add((v * self.width + start) as u64));
            let row = floor[start..end].iter().zip(&mut above[start..end]).zip(&snow[start..end]);
            for (((floor, above), snow), pixel) in row.zip(&mut line[start..end]) {
                *above = blend(*floor, *above, smear);
                let light: Colour = std::array::from_fn(|i| above[i] * gain[i] + veil[i] + snow);
                // Green carries most of the lightness, so its noise is that of all.
                let green = self.tones[step_of(light[1])];
                let noise = bell(bits) * green[1];
                *pixel = [self.tones[step_of(light[0])][0], green[0], self.tones[step_of(light[2])][0]]
                    .map(|value| display(value + noise));
                bits >>= 16;
            }
        }
    }
}

/// Averages the colour of squares of 2 x 2 pixels, as JPEG does, strengthens it and keeps the lightness of each. An odd last
/// row or column stays as it is.
pub(super) fn render_colour(image: &mut RgbImage, saturation: f32) {
    let strength = (256.0 * saturation) as i32;
    let width = image.width() as usize;
    if width == 0 {
        return;
    }
    for rows in image.as_mut().as_chunks_mut::<3>().0.chunks_exact_mut(2 * width) {
        let (upper, lower) = rows.split_at_mut(width);
        for (upper, lower) in upper.chunks_exact_mut(2).zip(lower.chunks_exact_mut(2)) {
            let (mut red, mut blue) = (2, 2);
            for pixel in upper.iter().chain(lower.iter()) {
                red += i32::from(pixel[0]) - lightness(*pixel);
                blue += i32::from(pixel[2]) - lightness(*pixel);
            }
            let (red, blue) = ((red * strength) >> 10, (blue * strength) >> 10);
            let green = -(77 * red + 29 * blue) / 150;
            for pixel in upper.iter_mut().chain(lower) {
                let light = lightness(*pixel);
                *pixel = [red, green, blue].map(|tint| (light + tint).clamp(0, 255) as u8);
            }
        }
    }
}

#[inline]
fn lightness([red, green, blue]: [u8; 3]) -> i32 {
    (77 * i32::from(red) + 150 * i32::from(green) + 29 * i32::from(blue)) >> 8
}

/// A value of a triangular distribution around 0 with unit variance, from 16 random bits.
#[inline]
fn bell(bits: u64) -> f32 {
    let sum = (bits & 0xFF) as i32 + (bits >> 8 & 0xFF) as i32 - 255;
    sum as f32 * (2.45 / 256.0)
}

/// Display values of light, a gamma curve with a soft shoulder and deepened shadows, and the noise's standard deviation.
fn tones(contrast: f32) -> Vec<[f32; 2]> {
    let tone = |i: usize| {
        let light = BRIGHTEST * i as f32 / TONES as f32;
        let soft = light * (1.0 + light * 0.16) / (1.0 + light * 0.42);
        let value = soft.powf(1.0 / 2.1).min(1.0);
        [value + contrast * (value * value * (3.0 - 2.0 * value) - value), NOISE[0] + NOISE[1] * light.sqrt()]
    };
    (0..=TONES).map(tone).collect()
}

#[inline]
fn step_of(light: f32) -> usize {
    (light.clamp(0.0, BRIGHTEST) * (TONES as f32 / BRIGHTEST)) as usize
}

#[inline]
fn display(value: f32) -> u8 {
    (value.clamp(0.0, 1.0) * 255.0 + 0.5) as u8
}

/// Light as display values, without any effect of the camera.
pub(super) fn develop(light: &[Colour], width: u32, height: u32) -> RgbImage {
    let table = tones(0.55);
    let mut image = RgbImage::new(width, height);
    for (pixel, light) in image.as_mut().as_chunks_mut::<3>().0.iter_mut().zip(light) {
        *pixel = light.map(|value| display(table[step_of(EXPOSURE * value)][0]));
    }
    image
}

/// Attenuation of red, green and blue light by water, 1/m.
const ATTENUATION: [f32; 3] = [0.32, 0.082, 0.052];
/// The altitude for which the camera's white balance is set.
const BALANCED_M: f32 = 4.0;
/// Light that the water scatters back from an endless depth.
const VEIL: [f32; 3] = [0.012, 0.042, 0.046];
/// What a white balance leaves of red, green and blue: red is the first to go, and some cameras restore it.
const BALANCES: [Colour; 6] = [
    [0.32, 0.92, 1.08],
    [0.42, 0.91, 1.09],
    [0.58, 0.92, 1.08],
    [0.98, 0.92, 1.05],
    [0.70, 0.95, 1.00],
    [0.54, 0.91, 1.05],
];
/// Distances over which the light changes along a survey, metres.
const LIGHT_M: f32 = 14.0;

/// The water of one world.
#[derive(Clone, Debug)]
pub(super) struct Water {
    balance: Colour,
    exposure: f32,
    turbidity: f32,
    /// Share of the curve that deepens shadows and lightens what is light, 0 to 1.
    pub contrast: f32,
    /// Strength of the colours that the camera renders.
    pub saturation: f32,
}

/// The light at one place and altitude.
pub(super) struct Light {
    gain: Colour,
    veil: Colour,
    altitude_m: f32,
    rate: f32,
}

impl Water {
    pub(super) fn new(key: u64) -> Self {
        let mut rng = CounterRng::new(key);
        let mut unit = || rng.unit() as f32;
        let pick = |unit: f32| BALANCES[((unit * BALANCES.len() as f32) as usize).min(BALANCES.len() - 1)];
        let balance = blend(pick(unit()), pick(unit()), 0.6 * unit());
        Self {
            balance,
            exposure: 1.05 + 1.25 * unit(),
            turbidity: 0.06 + 0.7 * unit() * unit(),
            contrast: 0.80 + 0.30 * unit(),
            saturation: 1.05 + 0.28 * unit(),
        }
    }

    /// The light at a place: clouds, depth and the camera's automatic exposure change it by a few percent.
    pub(super) fn light(&self, noise: &Noise, x: f32, y: f32, altitude_m: f32) -> Light {
        let vary = |off: f32| noise.value(x / LIGHT_M + off, y / LIGHT_M) - 0.5;
        let (bright, warm) = (1.0 + 0.16 * vary(11.0), 0.12 * vary(83.0));
        let gain = scale(self.balance, self.exposure * bright);
        let veil: Colour = std::array::from_fn(|i| VEIL[i] * self.balance[i].max(0.4) * self.exposure * self.turbidity);
        Light { gain: [gain[0] * (1.0 + warm), gain[1], gain[2] * (1.0 - 0.5 * warm)], veil, altitude_m, rate: 0.10 }
    }
}

impl Light {
    /// Gain and veil along a ray of the given length.
    pub(super) fn along(&self, range_m: f32) -> (Colour, Colour) {
        // The sun's part of the way does not grow towards the corners.
        let way = 0.4 * range_m + 0.6 * self.altitude_m;
        let gain = |i: usize| self.gain[i] * (ATTENUATION[i] * (BALANCED_M - way)).exp();
        let veil = |i: usize| self.veil[i] * (1.0 - (-self.rate * range_m).exp()) * 3.0;
        (std::array::from_fn(gain), std::array::from_fn(veil))
    }
}

/// A frame to be taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// The place below the camera, metres east and north.
    pub x_m: f64,
    pub y_m: f64,
    /// Direction of the frame's top, clockwise from north.
    pub heading_rad: f64,
    /// Height above the sea floor: the water in between takes and adds light.
    pub altitude_m: f64,
    /// Columns and rows of the frame.
    pub width_px: u32,
    pub height_px: u32,
    /// Number of the moment. Snow and noise differ from moment to moment.
    pub moment: u64,
}
