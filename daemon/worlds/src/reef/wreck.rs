//! A small wooden wreck with iron fittings: the outline of the hull, ribs, planks, a boiler and rust.

use super::fields::{Colour, blend, fbm, ramp, scale};
use super::ground::Spot;
use super::layout::Berth;
use super::patterns::patterns;
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
        let [along, abeam] = self.to_hull(x, y);
        if along.abs() > HALF_LENGTH_M + 0.2 || abeam.abs() > HALF_BEAM_M + 0.4 {
            return None;
        }
        // Growth and rot leave no straight line.
        let ragged = |at: f32| 0.22 * (fbm(noise, x / 0.5 + at, y / 0.5, 4) - 0.5);
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
        let [lump_m, lump, hue] = patterns().rock.at(x + 311.0, y + 177.0);
        let wood = scale(WOOD, 0.3 + 0.6 * noise.value(along / 0.5, abeam / 0.025) + 0.6 * grit);
        let [heap_m, heap, _] = patterns().rubble.at(x + 101.0, y + 53.0);
        // Silt and debris fill the hull and bury most of what has fallen.
        let fill_m = 0.36 * fbm(noise, x / 0.9, y / 0.9 + 33.0, 3) + 0.9 * heap_m;
        let mut spot = Spot { height_m: fill_m, colour: scale(SILT, 0.15 + 0.95 * heap), class: WRECK };
        let mut put = |height_m: f32, colour: Colour| {
            if height_m > spot.height_m {
                (spot.height_m, spot.colour) = (height_m, colour);
            }
        };
        let standing = ramp(0.32, 0.5, decay);
        // Ribs lean, break off and are grown over, each in its own way.
        let number = (along / RIB_M + 0.25 * abeam.signum()).floor();
        let own = noise.value(number * 3.7 + 8.0, 2.0 * abeam.signum());
        let lean = (0.5 * (own - 0.5) + 0.25 * noise.value(number * 5.1, abeam / 0.6)) * RIB_M;
        let rib = (along + lean - (number + 0.5 - 0.25 * abeam.signum()) * RIB_M).abs();
        if rib < 0.03 + 0.05 * grit + 0.03 * own && from_wall < side * (0.15 + 0.9 * decay * own * 1.6) {
            put(0.12 + 0.35 * (1.0 - from_wall / side) * (0.5 + own), scale(wood, 0.9));
        }
        if abeam.abs() < 0.07 + 0.08 * grit && decay > 0.42 {
            put(0.30, scale(wood, 0.8));
        }
        let plank = abeam / 0.19 - (abeam / 0.19).floor();
        if decay > 0.54 && plank > 0.13 && noise.value(along / 0.8, (abeam / 0.19).floor() * 3.7) > 0.35 {
            put(0.40, scale(wood, 1.25));
        }
        if from_wall < 0.02 + 0.22 * grit * decay.max(0.3) && own + decay > 0.55 {
            put(0.15 + 0.75 * standing * (0.4 + 0.6 * decay), blend(wood, RUST, ramp(0.45, 0.65, stain)));
        }
        let (a, b) = ((along + 1.6) / 0.95, (abeam - 0.25) / 0.55);
        let dent = 0.3 * (stain - 0.5);
        if a.abs() < 1.0 + dent && b.abs() < 1.0 {
            put(0.35 + 0.5 * (1.0 - b * b).sqrt() + dent, scale(RUST, 0.45 + 0.9 * stain));
        }
        // Turf, corallines and sponges cover all of it.
        let growth = blend([0.100, 0.092, 0.056], [0.23, 0.20, 0.16], ramp(0.55, 0.9, hue));
        spot.colour =
            blend(spot.colour, scale(growth, 0.2 + 0.9 * lump), 0.85 * ramp(0.30, 0.65, stain + 0.25 * (hue - 0.5)));
        spot.height_m += 0.55 * lump_m;
        spot.colour = blend(spot.colour, RUST, 0.35 * ramp(0.55, 0.75, stain));
        spot.colour =
            blend(spot.colour, [0.085, 0.09, 0.05], 0.7 * ramp(0.5, 0.7, noise.value(x / 0.31 + 8.0, y / 0.31)));
        spot.height_m += 0.05 * grit + 0.10 * (decay - 0.5);
        spot.colour = scale(spot.colour, 0.55 + 0.8 * grit);
        Some(spot)
    }
}
