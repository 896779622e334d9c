//! Small functions that fields over the sea floor are made of.

use crate::noise::Noise;

/// Colours are reflectances of red, green and blue light, 0 to 1.
pub(super) type Colour = [f32; 3];

/// 0 below `low`, 1 above `high`, smooth between.
#[inline]
pub(super) fn ramp(low: f32, high: f32, value: f32) -> f32 {
    let t = ((value - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Layered noise: each octave has twice the frequency and half the amplitude; 0 to 1.
#[inline]
pub(super) fn fbm(noise: &Noise, x: f32, y: f32, octaves: u32) -> f32 {
    let (mut sum, mut weight, mut total, mut scale) = (0.0, 1.0, 0.0, 1.0);
    for octave in 0..octaves {
        let shift = 37.0 * octave as f32;
        sum += weight * noise.value(x * scale + shift, y * scale + 0.7 * shift);
        total += weight;
        weight *= 0.5;
        scale *= 2.03;
    }
    sum / total
}

#[inline]
pub(super) fn blend(a: Colour, b: Colour, t: f32) -> Colour {
    std::array::from_fn(|i| a[i] + t * (b[i] - a[i]))
}

#[inline]
pub(super) fn scale(colour: Colour, factor: f32) -> Colour {
    colour.map(|c| c * factor)
}

/// The column and the row of a place on a lattice, as one number.
#[inline]
pub(super) fn place_number(column: i32, row: i32) -> u64 {
    u64::from(column as u32) << 32 | u64::from(row as u32)
}
