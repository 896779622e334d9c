//! A small wooden wreck with iron fittings: the outline of the hull, ribs, planks, a boiler and rust.

use super::fields::{Colour, blend, fbm, ramp, scale};
use super::ground::Spot;
use super::layout::Berth;
use super::{WRECK, jittered::Region};
use crate::noise::Noise;

/// Half of the length and of the beam, metres.
const HALF_LENGTH_M: f32 = 5.6;
const HALF_BEAM_M: f32 = 1.75;
/// Distance of neighbouring ribs, metres.
const RIB_M: f32 = 0.48;

const WOOD: Colour = [0.115, 0.100, 0.072];
const RUST: Colour = [0.175, 0.098, 0.055];
const SILT: Colour = [0.19, 0.18, 0.14];

impl Berth {
    /// Whether the wreck may cover a part of the region.
    pub(super) fn touches(&self, region: &Region) -> bool {
        let reach = HALF_LENGTH_M + 0.6;
        let near = |low: f32, high: f32, at: f32| at + reach > low && at - reach < high;
        near(region.west, region.east, self.x) && near(region.south, region.north, self.y)
    }

    /// The wreck at a place, if it covers the place.
    pub(super) fn spot(&self, noise: &Noise, x: f32, y: f32) -> Option<Spot> {
        // Growth and rot leave no straight line.
        let ragged = |at: f32| 0.16 * (fbm(noise, x / 0.3 + at, y / 0.3, 3) - 0.5);
        let [along, abeam] = self.to_hull(x + ragged(5.0), y + ragged(77.0));
        let grit = 0.6 * noise.value(x / 0.045, y / 0.045 + 31.0) + 0.4 * noise.value(x / 0.02 + 31.0, y / 0.02);
        let t = along / HALF_LENGTH_M;
        if t.abs() >= 1.0 {
            return None;
        }
        // A pointed bow and a rounder stern.
        let fullness = if t > 0.0 { 1.0 - t * t } else { 1.0 - t * t * t * t };
        let side =
            HALF_BEAM_M * fullness.sqrt() * (1.0 + 0.10 * (noise.value(along / 0.9, 4.0 + abeam.signum()) - 0.5));
        let from_wall = side - abeam.abs();
        if from_wall < -0.05 {
            return None;
        }
        let decay = fbm(noise, along / 1.3 + 60.0, abeam / 1.3, 3);
        let stain = fbm(noise, x / 0.22, y / 0.22 + 11.0, 3);
        let wood = scale(WOOD, 0.3 + 0.6 * noise.value(along / 0.5, abeam / 0.025) + 0.6 * grit);
        let mut spot =
            Spot { height_m: 0.05 * decay, colour: scale(SILT, 0.4 + 0.4 * stain + 0.5 * grit), class: WRECK };
        let mut put = |height_m: f32, colour: Colour| {
            if height_m > spot.height_m {
                (spot.height_m, spot.colour) = (height_m, colour);
            }
        };
        let standing = ramp(0.32, 0.5, decay);
        let rib = (along / RIB_M - (along / RIB_M).floor() - 0.5).abs() * RIB_M;
        if rib < 0.055 && from_wall < side * (0.35 + 0.9 * decay) {
            put(0.12 + 0.35 * (1.0 - from_wall / side), scale(wood, 0.9));
        }
        if abeam.abs() < 0.11 && decay > 0.33 {
            put(0.26, scale(wood, 0.8));
        }
        let plank = abeam / 0.19 - (abeam / 0.19).floor();
        if decay > 0.56 && plank > 0.13 && noise.value(along / 0.8, (abeam / 0.19).floor() * 3.7) > 0.3 {
            put(0.42, scale(wood, 1.25));
        }
        if from_wall < 0.11 {
            put(0.25 + 0.75 * standing * (0.6 + 0.4 * decay), blend(wood, RUST, ramp(0.45, 0.65, stain)));
        }
        let (a, b) = ((along + 1.6) / 0.95, (abeam - 0.25) / 0.55);
        if a.abs() < 1.0 && b.abs() < 1.0 {
            let seam = if (a * 3.0 - (a * 3.0).floor() - 0.5).abs() < 0.06 { 0.6 } else { 1.0 };
            put(0.35 + 0.5 * (1.0 - b * b).sqrt(), scale(RUST, seam * (0.55 + 0.8 * stain)));
        }
        spot.colour = blend(spot.colour, RUST, 0.55 * ramp(0.55, 0.75, stain));
        spot.colour =
            blend(spot.colour, [0.085, 0.09, 0.05], 0.7 * ramp(0.5, 0.7, noise.value(x / 0.31 + 8.0, y / 0.31)));
        spot.height_m += 0.05 * grit + 0.10 * (decay - 0.5);
        spot.colour = scale(spot.colour, 0.55 + 0.8 * grit);
        Some(spot)
    }
}
