//! The water of a world and the camera's balance of colours in it.

use super::fields::{Colour, blend, scale};
use crate::noise::Noise;
use scene_model::random::CounterRng;

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
