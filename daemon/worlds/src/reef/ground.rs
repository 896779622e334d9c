//! The floor between the things that lie and grow on it: layers of sand, rubble, reef rock and meadow. What is higher
//! covers what is lower, so every edge is as irregular as the pieces at it.

use super::fields::{Colour, blend, fbm, ramp, scale};
use super::layout::Habitat;
use super::patterns::{Patterns, patterns};
use super::{CORAL, ROCK, RUBBLE, SAND, SEAGRASS, THICKET};
use crate::noise::{Noise, floor};
use scene_model::random::{CounterRng, derive};

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
pub(super) struct Slow([f32; 12]);

/// Shift of the patterns' places, metres: it bends them, so that they do not repeat.
const WARP: [usize; 2] = [0, 1];
/// Shift of the ripples' phase: it makes them bend, fork and end.
const BEND: usize = 2;
const RIPPLED: usize = 3;
/// Share of the sand under scattered fragments.
const LITTER: usize = 4;
const FILM: usize = 5;
/// Height of the sand's own mounds and hollows, metres.
const DUNE: usize = 6;
const MOTTLE: usize = 7;
/// What grows on the rock.
const TURF: usize = 8;
/// Height of the large forms of rock, 0 in their creases to about 1 on top.
const MASS: usize = 9;
const COARSE: usize = 10;
const CLUMP: usize = 11;

impl Slow {
    /// The values between two neighbours: `t` = 0 gives `self`, 1 gives `other`.
    #[inline]
    pub(super) fn towards(&self, other: &Self, t: f32) -> Self {
        Self(std::array::from_fn(|i| self.0[i] + t * (other.0[i] - self.0[i])))
    }
}

/// The colours of a world. They are few and alike: silt, turf and the water's colour cover everything.
#[derive(Clone, Debug)]
struct Palette {
    sand: Colour,
    film: Colour,
    rubble: Colour,
    turf: Colour,
    sediment: Colour,
    /// Coralline algae and thin sponges, and how much of the rock they cover, 0 to 1: from almost none to most of it.
    crust: Colour,
    crusted: f32,
    algae: Colour,
    young: Colour,
    old: Colour,
}

impl Palette {
    fn new(key: u64) -> Self {
        let mut rng = CounterRng::new(key);
        let crusted = 0.15 + 0.85 * (rng.unit() * rng.unit()) as f32;
        // Where they are many they are red, pink or violet.
        let vivid =
            [[0.27, 0.075, 0.065], [0.30, 0.150, 0.155], [0.215, 0.150, 0.180], [0.25, 0.150, 0.050]][rng.below(4)];
        let crust = blend([0.195, 0.155, 0.150], vivid, crusted);
        let mut between = |a: Colour, b: Colour| {
            let light = 0.88 + 0.24 * rng.unit() as f32;
            scale(blend(a, b, rng.unit() as f32), light)
        };
        Self {
            sand: between([0.36, 0.345, 0.30], [0.34, 0.30, 0.225]),
            film: between([0.17, 0.160, 0.105], [0.18, 0.150, 0.110]),
            rubble: between([0.185, 0.170, 0.130], [0.175, 0.150, 0.110]),
            turf: between([0.140, 0.105, 0.055], [0.112, 0.106, 0.058]),
            sediment: between([0.29, 0.262, 0.190], [0.30, 0.235, 0.145]),
            crust,
            crusted,
            algae: between([0.072, 0.076, 0.036], [0.092, 0.070, 0.036]),
            young: between([0.080, 0.097, 0.048], [0.079, 0.090, 0.049]),
            old: between([0.145, 0.128, 0.084], [0.118, 0.108, 0.076]),
        }
    }
}

/// The floor of one seed.
#[derive(Clone, Debug)]
pub(super) struct Ground {
    pub noise: Noise,
    /// The direction across the ripples, as a unit vector.
    turn: [f32; 2],
    /// Where this world's patterns begin, metres.
    shift: [f32; 2],
    palette: Palette,
}

impl Ground {
    pub(super) fn new(key: u64, turn: [f32; 2]) -> Self {
        let mut rng = CounterRng::new(derive(key, 1));
        let shift = [0, 1].map(|_| 300.0 + 100.0 * rng.unit() as f32);
        Self { noise: Noise::new(key), turn, shift, palette: Palette::new(derive(key, 2)) }
    }

    /// Meadow at a place, 0 to 1, with a ragged edge.
    #[inline]
    pub(super) fn meadow(&self, x: f32, y: f32, habitat: &Habitat) -> f32 {
        if habitat.grass <= 0.01 {
            return 0.0;
        }
        let rag = 0.6 * self.noise.value(x / 1.9 + 9.0, y / 1.9) + fbm(&self.noise, x / 0.7, y / 0.7 + 40.0, 3) - 0.8;
        // It thins out over a metre or so.
        ramp(-0.05, 1.0, habitat.grass + 1.7 * rag)
    }

    pub(super) fn slow(&self, x: f32, y: f32) -> Slow {
        let n = &self.noise;
        let warp = |off: f32| {
            0.40 * (n.value(x / 2.3 + off, y / 2.3) - 0.5) + 0.03 * (n.value(x / 0.45, y / 0.45 + off) - 0.5)
        };
        let mut slow = Slow::default();
        let mut put = |index: usize, value: f32| slow.0[index] = value;
        put(WARP[0], warp(3.0));
        put(WARP[1], warp(55.0));
        put(BEND, 2.6 * n.value(x / 0.9, y / 0.9 + 9.0) + 6.0 * n.value(x / 4.1 + 2.0, y / 4.1));
        put(RIPPLED, ramp(0.52, 0.78, fbm(n, x / 2.7 + 70.0, y / 2.7, 3)));
        put(LITTER, ramp(0.51, 0.78, fbm(n, x / 1.7, y / 1.7 + 31.0, 3)));
        put(FILM, ramp(0.42, 0.78, fbm(n, x / 1.3 + 44.0, y / 1.3, 3)));
        put(DUNE, 0.42 * (fbm(n, x / 1.5, y / 1.5 + 90.0, 2) - 0.5));
        put(MOTTLE, 0.72 + 0.56 * fbm(n, x / 1.9 + 5.0, y / 1.9, 2));
        put(TURF, fbm(n, x / 0.9 + 14.0, y / 0.9, 2));
        put(MASS, 2.0 * (fbm(n, x / 1.15 + 3.0, y / 1.15, 2) - 0.5).abs().sqrt() - 0.35);
        put(COARSE, ramp(0.25, 0.75, n.value(x / 1.5 + 27.0, y / 1.5)));
        put(CLUMP, fbm(n, x / 0.6 + 70.0, y / 0.6, 3));
        slow
    }

    pub(super) fn spot(&self, x: f32, y: f32, habitat: &Habitat, slow: &Slow) -> Spot {
        let n = &self.noise;
        let rag = n.value(x / 0.37, y / 0.37) - 0.5;
        // Where the patterns are looked up.
        let at = [x + self.shift[0] + slow.0[WARP[0]], y + self.shift[1] + slow.0[WARP[1]]];
        let patterns = patterns();
        // The class depends on this, so it must not depend on how far apart the nodes are.
        let reef = if habitat.reef > 0.0 {
            let wide = n.value(x / 0.75 + 31.0, y / 0.75) - 0.5;
            ramp(0.30, 0.70, habitat.reef + 0.4 * rag + 0.8 * wide)
        } else {
            0.0
        };
        // Between rocks only pockets of sand can be seen.
        let rock = (reef > 0.0).then(|| self.rock(patterns, at, reef, habitat, slow));
        let mut spot = match rock {
            Some(rock) if reef >= 1.0 && rock.height_m > slow.0[DUNE] + 0.12 => rock,
            _ if reef >= 1.0 => self.pocket(patterns, at, slow),
            _ => self.sand(patterns, [x, y], at, habitat, slow),
        };
        let littered = 0.62 * slow.0[LITTER] * (1.0 - habitat.grass);
        let rubble = ramp(0.12, 0.88, habitat.rubble + 0.9 * rag).max(littered);
        if rubble > 0.05 && reef < 1.0 {
            self.lay_rubble(patterns, &mut spot, at, rubble, slow);
        }
        if let Some(rock) = rock {
            let seen = ramp(-0.01, 0.02, rock.height_m - spot.height_m);
            spot.height_m += seen * (rock.height_m - spot.height_m);
            spot.colour = blend(spot.colour, rock.colour, seen);
        }
        spot.class = if reef > 0.5 {
            rock_class(habitat)
        } else if habitat.rubble + 0.9 * rag > 0.5 {
            RUBBLE
        } else {
            SAND
        };
        let meadow = self.meadow(x, y, habitat) * (1.0 - reef);
        if meadow > 0.0 {
            self.lay_meadow(patterns, &mut spot, at, meadow, slow);
        }
        spot.height_m += habitat.lump_m;
        spot.colour = scale(spot.colour, slow.0[MOTTLE]);
        spot
    }

    fn sand(&self, patterns: &Patterns, [x, y]: [f32; 2], at: [f32; 2], habitat: &Habitat, slow: &Slow) -> Spot {
        let [dent_m, tone, hue] = patterns.sand.at(at[0], at[1]);
        // Grains are too small to be seen, but not their differences.
        let [grit_m, fine, own] = patterns.grit.at(1.5 * at[0], 1.5 * at[1]);
        let coarse = slow.0[COARSE];
        let mut height_m = slow.0[DUNE] + (0.6 + 0.6 * coarse) * dent_m + (0.04 + 0.12 * coarse) * grit_m;
        let rippled = slow.0[RIPPLED].max(0.6 * habitat.channel * slow.0[FILM]) * (1.0 - habitat.rubble);
        if rippled > 0.0 {
            let wave_m = if habitat.channel > 0.5 { 0.34 } else { 0.19 };
            let phase = (x * self.turn[0] + y * self.turn[1]) / wave_m + slow.0[BEND] + 9.0 * dent_m;
            let part = phase - floor(phase) as f32 - 0.5;
            // Crests are sharper than troughs, and some of them are worn away.
            height_m += 0.085 * wave_m * (4.0 * part * part - 0.35) * rippled * (0.4 + 1.2 * hue);
        }
        // Algae and detritus gather in spots between the grains.
        let spots = 0.65 + 0.50 * ramp(0.85, 0.40, fine + 0.5 * (hue - 0.5));
        let film = (0.75 * slow.0[FILM] * ramp(0.15, 0.75, hue + 0.4 * (slow.0[TURF] - 0.4)) * spots).min(0.95);
        let mut colour = blend(self.palette.sand, self.palette.film, film);
        // Bits of shell are white, bits with turf on them dark.
        let fleck = ramp(0.94, 0.98, own) - ramp(0.06, 0.02, own);
        let grain = 1.0 + (0.10 + 0.30 * coarse) * (fine - 0.75) + (0.06 + 0.26 * coarse) * fleck;
        colour = scale(colour, (0.25 + 0.75 * tone) * grain);
        // Turf grows in tufts on what is raised.
        let tuft = ramp(0.08, 0.50, 7.0 * dent_m + 1.6 * (slow.0[TURF] - 0.60) + 0.15 * (own - 0.5));
        colour = blend(colour, scale(self.palette.turf, 0.45 + 0.6 * fine), 0.70 * tuft);
        Spot { height_m: height_m + 0.015 * tuft * fine, colour, class: SAND }
    }

    /// Sand between rocks, where only a little of it can be seen: flat, and grey with debris.
    fn pocket(&self, patterns: &Patterns, at: [f32; 2], slow: &Slow) -> Spot {
        let [dent_m, tone, hue] = patterns.sand.at(at[0], at[1]);
        let colour = blend(self.palette.sand, self.palette.film, 0.8 * ramp(0.2, 0.8, hue));
        let [grit_m, fine, _] = patterns.grit.at(at[1], at[0]);
        let height_m = slow.0[DUNE] + 1.5 * dent_m + 0.35 * grit_m;
        Spot { height_m, colour: scale(colour, (0.1 + 0.85 * tone) * (0.5 + 0.5 * fine)), class: SAND }
    }

    /// Lays pieces of dead coral that lie the deeper in the sand the fewer there are.
    fn lay_rubble(&self, patterns: &Patterns, spot: &mut Spot, at: [f32; 2], share: f32, slow: &Slow) {
        let [height_m, tone, hue] = patterns.rubble.at(0.75 * at[0], 0.75 * at[1]);
        // Drifts of sand bury parts of it.
        let drift_m = 0.10 * slow.0[FILM] * (1.0 - 0.5 * slow.0[COARSE]);
        let height_m = slow.0[DUNE] + 1.2 * height_m - 0.13 * (1.0 - share) - drift_m + 0.02;
        let seen = ramp(-0.004, 0.012, height_m - spot.height_m);
        if seen > 0.0 {
            let palette = &self.palette;
            let mut colour = blend(palette.rubble, palette.crust, 0.30 * ramp(0.72, 0.95, hue));
            colour = blend(colour, palette.turf, 0.75 * ramp(0.55, 0.15, hue));
            // Dust of sand lies on what is flat.
            colour = blend(colour, spot.colour, 0.08 + 0.22 * slow.0[COARSE]);
            spot.height_m += seen * (height_m - spot.height_m);
            spot.colour = blend(spot.colour, scale(colour, 0.15 + 1.05 * tone), seen);
        }
    }

    fn rock(&self, patterns: &Patterns, at: [f32; 2], reef: f32, habitat: &Habitat, slow: &Slow) -> Spot {
        let palette = &self.palette;
        let [lump_m, tone, hue] = patterns.rock.at(0.8 * at[0], 0.8 * at[1]);
        let [grit_m, fine, own] = patterns.grit.at(1.3 * at[1], 1.3 * at[0]);
        let mass = slow.0[MASS];
        // Bare rock stands higher than a garden of corals.
        let tall = if is_rock(habitat) { 0.50 } else { 0.30 };
        let height_m = tall * mass + 0.9 * lump_m + 0.6 * grit_m - 0.04 - 0.5 * (1.0 - reef);
        // Sediment lies on top, turf and algae grow on the sides.
        let grown = 0.8 * hue + 0.5 * (slow.0[TURF] - 0.5) + 0.15 * (own - 0.5) + 0.9 * lump_m;
        let mut colour = blend(palette.turf, palette.sediment, ramp(0.15, 0.75, grown));
        let crust = palette.crusted * (0.35 + slow.0[COARSE]) * ramp(0.0, 0.35, hue + 0.5 * own + 0.9 * lump_m - 0.55);
        colour = blend(colour, scale(palette.crust, 0.65 + 0.7 * own), (0.9 * crust).min(0.9));
        let algae = ramp(0.42, 0.62, slow.0[CLUMP]) * ramp(0.75, 0.35, hue);
        // Algae keep corals off the bare rock.
        let algae = if is_rock(habitat) { 0.40 + 0.45 * algae } else { 0.35 * algae };
        colour = blend(colour, palette.algae, algae);
        let light = (0.08 + 1.0 * tone) * (0.55 + 0.50 * fine) * (0.45 + 0.65 * ramp(-0.2, 0.7, mass));
        Spot { height_m, colour: scale(colour, light), class: rock_class(habitat) }
    }

    fn lay_meadow(&self, patterns: &Patterns, spot: &mut Spot, at: [f32; 2], meadow: f32, slow: &Slow) {
        let palette = &self.palette;
        let clump = slow.0[CLUMP];
        // The current turns the blades, each clump of them a little differently.
        let [lift_m, tone, hue] = patterns.canopy.at(at[0] + 0.3 * clump, at[1] - 0.4 * clump);
        // Its edge dissolves into tufts.
        let tuft = self.noise.value(at[0] / 0.16, at[1] / 0.16) - 0.5;
        let dense =
            ramp(0.05, 0.75, meadow + 1.1 * tuft * (1.0 - meadow)) * ramp(0.22, 0.62, clump + 0.6 * (meadow - 0.5));
        let height_m = lift_m + 0.10 * (dense - 0.5) + 0.24 * (clump - 0.5) + slow.0[DUNE];
        // Where the meadow thins out, whole blades are missing.
        let grows = ramp(-0.10, 0.12, 1.25 * dense - 0.12 - hue);
        let seen = ramp(-0.06, 0.03, height_m - spot.height_m) * grows;
        let old = (0.30 * hue + 0.9 * ramp(0.35, 0.75, slow.0[TURF]) * (0.6 + 0.4 * hue)).min(1.0);
        let mut colour = blend(palette.young, palette.old, old);
        // Silt and epiphytes grey the blades in places.
        colour = blend(colour, palette.film, 0.55 * slow.0[FILM]);
        let light = (0.25 + 0.60 * tone) * (0.20 + 1.00 * ramp(0.2, 0.75, clump));
        spot.colour = blend(scale(spot.colour, 1.0 - 0.55 * dense), scale(colour, light), seen);
        spot.height_m += seen * (height_m - spot.height_m);
        if meadow > 0.5 {
            spot.class = SEAGRASS;
        }
    }
}

fn is_rock(habitat: &Habitat) -> bool {
    habitat.rock > 0.5 * habitat.reef
}

fn rock_class(habitat: &Habitat) -> u8 {
    if is_rock(habitat) {
        ROCK
    } else if habitat.thicket > 0.5 * habitat.reef {
        THICKET
    } else {
        CORAL
    }
}
