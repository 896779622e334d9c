//! The floor between the things that lie and grow on it: sand, rubble's bed, meadow mats and reef rock.

use super::fields::{Colour, blend, fbm, nearest_knob, ramp, scale, speck};
use super::layout::Habitat;
use super::{CORAL, ROCK, RUBBLE, SAND, SEAGRASS, THICKET};
use crate::noise::{Noise, floor};

const SAND_TONE: Colour = [0.335, 0.305, 0.235];
const MAT_TONE: Colour = [0.075, 0.075, 0.045];
const RUBBLE_TONE: Colour = [0.165, 0.150, 0.118];
const TURF_TONE: Colour = [0.098, 0.092, 0.060];
const PALE_TURF: Colour = [0.330, 0.300, 0.230];
/// Crustose coralline algae.
const CRUST_TONE: Colour = [0.175, 0.125, 0.130];

/// One place of the sea floor.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spot {
    /// Metres above the local floor.
    pub height_m: f32,
    pub colour: Colour,
    pub class: u8,
}

/// Fields of the ground that vary so slowly that they are computed at some places only.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Slow {
    /// Shift of the ripples' phase: it makes them bend, fork and end.
    bend: f32,
    worn: f32,
    litter: f32,
    film: f32,
    bumps: f32,
    mottle: f32,
    patch: f32,
    crust: f32,
    bumpy: f32,
    algae: f32,
}

impl Slow {
    /// The values between two neighbours: `t` = 0 gives `self`, 1 gives `other`.
    #[inline]
    pub(super) fn towards(&self, other: &Self, t: f32) -> Self {
        let mix = |a: f32, b: f32| a + t * (b - a);
        Self {
            bend: mix(self.bend, other.bend),
            worn: mix(self.worn, other.worn),
            litter: mix(self.litter, other.litter),
            film: mix(self.film, other.film),
            bumps: mix(self.bumps, other.bumps),
            mottle: mix(self.mottle, other.mottle),
            patch: mix(self.patch, other.patch),
            crust: mix(self.crust, other.crust),
            bumpy: mix(self.bumpy, other.bumpy),
            algae: mix(self.algae, other.algae),
        }
    }
}

/// The floor of one seed.
#[derive(Clone, Debug)]
pub(super) struct Ground {
    pub noise: Noise,
    key: u64,
    /// Direction across the ripples.
    turn: [f32; 2],
}

impl Ground {
    pub(super) fn new(key: u64, turn: [f32; 2]) -> Self {
        Self { noise: Noise::new(key), key, turn }
    }

    /// Meadow at a place, 0 to 1, with a ragged edge.
    #[inline]
    pub(super) fn meadow(&self, x: f32, y: f32, habitat: &Habitat) -> f32 {
        if habitat.grass <= 0.01 {
            return 0.0;
        }
        let rag = fbm(&self.noise, x / 0.8, y / 0.8 + 40.0, 2) - 0.5;
        ramp(0.30, 0.62, habitat.grass + 0.9 * rag)
    }

    pub(super) fn slow(&self, x: f32, y: f32) -> Slow {
        let n = &self.noise;
        Slow {
            bend: 2.2 * n.value(x / 1.1, y / 1.1 + 9.0) + 5.0 * n.value(x / 6.1 + 2.0, y / 6.1),
            worn: ramp(0.28, 0.62, n.value(x / 3.3 + 70.0, y / 3.3)),
            litter: ramp(0.45, 0.8, n.value(x / 2.4, y / 2.4 + 31.0)),
            film: ramp(0.48, 0.75, fbm(n, x / 1.3 + 44.0, y / 1.3, 3)),
            bumps: ramp(0.4, 0.7, n.value(x / 2.7, y / 2.7 + 90.0)),
            mottle: 0.82 + 0.26 * n.value(x / 1.9 + 5.0, y / 1.9),
            patch: fbm(n, x / 0.6 + 14.0, y / 0.6, 3),
            crust: n.value(x / 1.4 + 3.0, y / 1.4),
            bumpy: ramp(0.25, 0.75, n.value(x / 0.5 + 27.0, y / 0.5)),
            algae: ramp(0.42, 0.62, n.value(x / 0.44 + 60.0, y / 0.44 + 3.0)),
        }
    }

    pub(super) fn spot(&self, x: f32, y: f32, habitat: &Habitat, slow: &Slow) -> Spot {
        let n = &self.noise;
        let rag = n.value(x / 0.37, y / 0.37) - 0.5;
        let reef = ramp(0.35, 0.65, habitat.reef + 0.5 * rag);
        let mottle = slow.mottle + 0.12 * n.value(x / 0.21, y / 0.21);
        let grain = speck(self.key, (x * 110.0) as i32, (y * 110.0) as i32) - 0.5;
        let mut spot = if reef < 1.0 {
            self.sand(x, y, habitat, slow, rag)
        } else {
            Spot { height_m: 0.0, colour: scale(SAND_TONE, 0.8), class: SAND }
        };
        if reef > 0.0 {
            let rock = self.rock(x, y, habitat, slow);
            // Sand fills the pockets of the rock.
            let filled = ramp(-0.01, 0.02, rock.height_m - 0.05 + 0.12 * reef) * reef;
            spot.height_m += filled * (rock.height_m - spot.height_m);
            spot.colour = blend(spot.colour, rock.colour, filled);
            if filled > 0.5 || reef > 0.5 {
                spot.class = rock.class;
            }
        }
        spot.height_m += habitat.lump_m + (0.004 + 0.014 * reef) * grain;
        // Single grains and fragments, light and dark.
        let speckled = 0.26 + 0.3 * reef;
        let fleck = if grain > 0.492 {
            0.3
        } else if grain < -0.49 {
            -0.3
        } else {
            0.0
        };
        spot.colour = scale(spot.colour, mottle * (1.0 + speckled * grain + fleck));
        spot
    }

    fn sand(&self, x: f32, y: f32, habitat: &Habitat, slow: &Slow, rag: f32) -> Spot {
        let n = &self.noise;
        let wave_m = if habitat.channel > 0.5 { 0.30 } else { 0.155 };
        let across = x * self.turn[0] + y * self.turn[1];
        let phase = across / wave_m + slow.bend;
        let part = phase - floor(phase) as f32 - 0.5;
        let crest = 4.0 * part * part;
        let worn = slow.worn * (1.0 - 0.8 * habitat.rubble);
        let rough = 0.6 * n.value(x / 0.05 + 3.0, y / 0.05) + 0.4 * n.value(x / 0.017, y / 0.017) - 0.5;
        let bumps = 0.05 * ramp(0.62, 0.95, n.value(x / 0.16 + 13.0, y / 0.16)) * slow.bumps;
        let height_m = (0.011 + 0.012 * habitat.channel) * (crest - 0.35) * worn + 0.014 * rough + bumps;
        let litter = (1.0 - crest) * worn * slow.litter;
        let mut colour = scale(SAND_TONE, 1.0 - 0.40 * litter - 0.10 * habitat.channel);
        colour = blend(colour, [0.175, 0.165, 0.105], 0.55 * slow.film);
        let mut class = SAND;
        let rubble = ramp(0.35, 0.65, habitat.rubble + 0.9 * rag);
        if rubble > 0.0 {
            colour = blend(colour, RUBBLE_TONE, 0.75 * rubble);
            if rubble > 0.5 {
                class = RUBBLE;
            }
        }
        let meadow = self.meadow(x, y, habitat);
        if meadow > 0.0 {
            colour = blend(colour, MAT_TONE, 0.85 * meadow);
            if meadow > 0.5 {
                class = SEAGRASS;
            }
        }
        Spot { height_m, colour, class }
    }

    fn rock(&self, x: f32, y: f32, habitat: &Habitat, slow: &Slow) -> Spot {
        let n = &self.noise;
        let rough = fbm(n, x / 0.42, y / 0.42 + 80.0, 5) - 0.5;
        let (distance, own) = {
            let sway = [n.value(x / 0.085 + 7.0, y / 0.085), n.value(x / 0.085, y / 0.085 + 7.0)];
            nearest_knob(self.key, x / 0.07 + 1.9 * sway[0], y / 0.07 + 1.9 * sway[1])
        };
        let bumpy = slow.bumpy;
        let knob = (1.0 - ramp(0.1, 0.75, distance)) * bumpy * (0.4 + 0.8 * own) + 0.4 * (1.0 - bumpy);
        let grit =
            0.55 * n.value(x / 0.038 + 2.0 * rough, y / 0.038 + 19.0) + 0.45 * n.value(x / 0.016, y / 0.016 + 2.0);
        let hole = ramp(0.70, 0.92, n.value(x / 0.21 + 5.0, y / 0.21 + 52.0) - 0.4 * rough);
        let height_m = 0.50 * rough + 0.05 * knob - 0.05 * hole + 0.035 * grit;
        let patch = slow.patch + 0.7 * rough + 0.30 * (own - 0.5);
        let mut colour = blend(TURF_TONE, PALE_TURF, ramp(0.30, 0.75, patch));
        let crust = n.value(x / 0.12, y / 0.12 + 23.0) * slow.crust + 0.3 * (own - 0.5);
        colour = blend(colour, CRUST_TONE, 0.7 * ramp(0.30, 0.46, crust));
        colour = scale(colour, (0.30 + 0.45 * knob + 0.5 * rough + 0.85 * grit) * (1.0 - 0.3 * hole));
        let is_thicket = habitat.thicket > 0.5 * habitat.reef;
        let is_rock = habitat.rock > 0.5 * habitat.reef;
        if is_rock {
            colour = blend(colour, [0.085, 0.095, 0.045], 0.7 * slow.algae);
        }
        let class = if is_rock {
            ROCK
        } else if is_thicket {
            THICKET
        } else {
            CORAL
        };
        Spot { height_m, colour, class }
    }
}
