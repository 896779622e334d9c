//! The floor between the things that lie and grow on it: layers of sand, rubble, reef rock and meadow. What is higher
//! covers what is lower, so every edge is as irregular as the pieces at it.

use super::fields::{Colour, blend, fbm, ramp, scale, speck};
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
pub(super) struct Slow([f32; 14]);

/// Shift of the patterns' places, metres: it bends them, so that they do not repeat.
const WARP: [usize; 2] = [0, 1];
/// Shift of the ripples' phase: it makes them bend, fork and end.
const BEND: usize = 2;
const WORN: usize = 3;
/// Share of the sand under scattered fragments.
const LITTER: usize = 4;
const FILM: usize = 5;
const MOUNDS: usize = 6;
const MOTTLE: usize = 7;
/// What grows on the rock.
const TURF: usize = 8;
const CRUST: usize = 9;
const ALGAE: usize = 10;
const COARSE: usize = 11;
/// Age of the seagrass.
const AGE: usize = 12;
const CLUMP: usize = 13;

impl Slow {
    /// The values between two neighbours: `t` = 0 gives `self`, 1 gives `other`.
    #[inline]
    pub(super) fn towards(&self, other: &Self, t: f32) -> Self {
        Self(std::array::from_fn(|i| self.0[i] + t * (other.0[i] - self.0[i])))
    }
}

/// The colours of a world: sand is grey, white or tan, and turf is brown or green.
#[derive(Clone, Debug)]
struct Palette {
    sand: Colour,
    film: Colour,
    rubble: Colour,
    turf: Colour,
    sediment: Colour,
    /// Crustose coralline algae.
    crust: Colour,
    algae: Colour,
    /// Sponges, ascidians and red algae: small, bright and few.
    sponge: [Colour; 2],
    young: Colour,
    old: Colour,
}

impl Palette {
    fn new(key: u64) -> Self {
        let mut rng = CounterRng::new(key);
        let mut between = |a: Colour, b: Colour| {
            let light = 0.88 + 0.24 * rng.unit() as f32;
            scale(blend(a, b, rng.unit() as f32), light)
        };
        Self {
            sand: between([0.40, 0.385, 0.34], [0.40, 0.345, 0.25]),
            film: between([0.19, 0.185, 0.11], [0.21, 0.17, 0.12]),
            rubble: between([0.215, 0.200, 0.165], [0.200, 0.170, 0.120]),
            turf: between([0.135, 0.098, 0.045], [0.100, 0.108, 0.058]),
            sediment: between([0.30, 0.285, 0.235], [0.31, 0.240, 0.145]),
            crust: between([0.270, 0.110, 0.125], [0.215, 0.150, 0.180]),
            algae: between([0.084, 0.100, 0.038], [0.135, 0.088, 0.030]),
            sponge: [between([0.34, 0.15, 0.05], [0.30, 0.06, 0.05]), between([0.36, 0.27, 0.07], [0.22, 0.05, 0.09])],
            young: between([0.084, 0.130, 0.048], [0.078, 0.108, 0.046]),
            old: between([0.150, 0.138, 0.075], [0.115, 0.118, 0.075]),
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
    /// Where this world's patterns begin, metres.
    shift: [f32; 2],
    palette: Palette,
}

impl Ground {
    pub(super) fn new(key: u64, turn: [f32; 2]) -> Self {
        let mut rng = CounterRng::new(derive(key, 1));
        let shift = [0, 1].map(|_| 300.0 + 100.0 * rng.unit() as f32);
        Self { noise: Noise::new(key), key, turn, shift, palette: Palette::new(derive(key, 2)) }
    }

    /// Meadow at a place, 0 to 1, with a ragged edge.
    #[inline]
    pub(super) fn meadow(&self, x: f32, y: f32, habitat: &Habitat) -> f32 {
        if habitat.grass <= 0.01 {
            return 0.0;
        }
        let rag = 0.6 * self.noise.value(x / 1.9 + 9.0, y / 1.9) + fbm(&self.noise, x / 0.7, y / 0.7 + 40.0, 3) - 0.8;
        ramp(0.25, 0.70, habitat.grass + 1.7 * rag)
    }

    pub(super) fn slow(&self, x: f32, y: f32) -> Slow {
        let n = &self.noise;
        let warp = |off: f32| {
            0.42 * (n.value(x / 2.1 + off, y / 2.1) - 0.5) + 0.07 * (n.value(x / 0.45, y / 0.45 + off) - 0.5)
        };
        let mut slow = Slow::default();
        let mut put = |index: usize, value: f32| slow.0[index] = value;
        put(WARP[0], warp(3.0));
        put(WARP[1], warp(55.0));
        put(BEND, 2.2 * n.value(x / 1.1, y / 1.1 + 9.0) + 5.0 * n.value(x / 6.1 + 2.0, y / 6.1));
        put(WORN, ramp(0.42, 0.72, fbm(n, x / 3.3 + 70.0, y / 3.3, 2)));
        put(LITTER, ramp(0.46, 0.72, fbm(n, x / 1.7, y / 1.7 + 31.0, 3)));
        put(FILM, ramp(0.45, 0.75, fbm(n, x / 1.3 + 44.0, y / 1.3, 3)));
        put(MOUNDS, ramp(0.4, 0.7, n.value(x / 2.7, y / 2.7 + 90.0)));
        put(MOTTLE, 0.70 + 0.60 * fbm(n, x / 1.9 + 5.0, y / 1.9, 3));
        put(TURF, fbm(n, x / 0.9 + 14.0, y / 0.9, 3));
        put(CRUST, ramp(0.45, 0.65, fbm(n, x / 1.2 + 3.0, y / 1.2, 2)));
        put(ALGAE, ramp(0.45, 0.62, fbm(n, x / 0.6 + 60.0, y / 0.6 + 3.0, 2)));
        put(COARSE, ramp(0.25, 0.75, n.value(x / 1.5 + 27.0, y / 1.5)));
        put(AGE, ramp(0.30, 0.75, fbm(n, x / 1.6 + 15.0, y / 1.6, 2)));
        put(CLUMP, fbm(n, x / 0.5 + 70.0, y / 0.5, 2));
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
        let mut spot = if reef < 1.0 {
            self.sand(patterns, [x, y], at, habitat, slow)
        } else {
            Spot { height_m: 0.0, colour: scale(self.palette.sand, 0.85), class: SAND }
        };
        let littered = 0.62 * slow.0[LITTER] * (1.0 - habitat.grass);
        let rubble = ramp(0.30, 0.70, habitat.rubble + 0.9 * rag).max(littered);
        if rubble > 0.05 && reef < 1.0 {
            self.lay_rubble(patterns, &mut spot, at, rubble, slow);
        }
        if reef > 0.0 {
            self.lay_rock(patterns, &mut spot, at, reef, habitat, slow);
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
        let grain = speck(self.key, (x * 110.0) as i32, (y * 110.0) as i32) - 0.5;
        spot.height_m += habitat.lump_m + (0.0015 + 0.006 * reef) * grain;
        spot.colour = scale(spot.colour, slow.0[MOTTLE] * (1.0 + (0.12 + 0.12 * reef) * grain));
        spot
    }

    fn sand(&self, patterns: &Patterns, [x, y]: [f32; 2], at: [f32; 2], habitat: &Habitat, slow: &Slow) -> Spot {
        let n = &self.noise;
        let wave_m = if habitat.channel > 0.5 { 0.30 } else { 0.155 };
        let across = x * self.turn[0] + y * self.turn[1];
        let phase = across / wave_m + slow.0[BEND];
        let part = phase - floor(phase) as f32 - 0.5;
        let crest = 4.0 * part * part;
        let worn = slow.0[WORN] * (1.0 - 0.8 * habitat.rubble);
        let rough = fbm(n, x / 0.28 + 3.0, y / 0.28, 3) - 0.5;
        let mounds = if slow.0[MOUNDS] > 0.0 {
            0.06 * ramp(0.55, 0.95, n.value(x / 0.21 + 13.0, y / 0.21)) * slow.0[MOUNDS]
        } else {
            0.0
        };
        let [grit_m, tone, hue] = patterns.grit.at(at[0], at[1]);
        let coarse = 0.12 + 0.88 * slow.0[COARSE];
        let ripple_m = (0.010 + 0.010 * habitat.channel) * (crest - 0.35) * worn;
        let height_m = ripple_m + 0.034 * rough + mounds + (0.15 + 0.55 * coarse) * grit_m;
        let trough = (1.0 - crest) * worn * slow.0[FILM];
        let mut colour = blend(self.palette.sand, self.palette.film, 0.60 * slow.0[FILM] * (0.6 + 0.8 * rough));
        // Shell grit is white, fragments with turf are dark.
        let fleck = ramp(0.93, 0.97, hue) * 0.45 - ramp(0.10, 0.05, hue) * 0.45;
        let tone = 1.0 + coarse * (1.1 * (tone - 0.85) + fleck);
        colour = scale(colour, tone * (1.0 - 0.25 * trough) * (1.0 - 0.10 * habitat.channel));
        // Turf grows in tufts on what is raised.
        let tuft = ramp(0.06, 0.26, rough + 0.8 * (slow.0[TURF] - 0.60) + 0.22 * (hue - 0.5));
        colour = blend(colour, scale(self.palette.turf, 0.25 + 0.8 * tone), 0.75 * tuft);
        Spot { height_m: height_m + 0.03 * tuft * tone, colour, class: SAND }
    }

    /// Lays pieces of dead coral that lie the deeper in the sand the fewer there are.
    fn lay_rubble(&self, patterns: &Patterns, spot: &mut Spot, at: [f32; 2], share: f32, slow: &Slow) {
        let [height_m, tone, hue] = patterns.rubble.at(at[0], at[1]);
        let height_m = height_m - 0.115 * (1.0 - share) + 0.01;
        let seen = ramp(-0.004, 0.012, height_m - spot.height_m);
        if seen > 0.0 {
            let palette = &self.palette;
            let bare = if hue > 0.9 { scale(palette.sand, 0.9) } else { palette.rubble };
            let mut colour = blend(bare, palette.crust, 0.40 * ramp(0.72, 0.80, hue) * (1.0 - ramp(0.86, 0.90, hue)));
            colour = blend(colour, palette.turf, 0.85 * ramp(0.45, 0.25, hue));
            // Dust of sand lies on what is flat.
            colour = blend(colour, spot.colour, 0.25 * slow.0[COARSE]);
            spot.height_m += seen * (height_m - spot.height_m);
            spot.colour = blend(spot.colour, scale(colour, 0.2 + 0.9 * tone), seen);
        }
    }

    fn lay_rock(&self, patterns: &Patterns, spot: &mut Spot, at: [f32; 2], reef: f32, habitat: &Habitat, slow: &Slow) {
        let n = &self.noise;
        let palette = &self.palette;
        let [lump_m, tone, hue] = patterns.rock.at(at[0], at[1]);
        let [grit_m, fine, other] = patterns.grit.at(1.3 * at[1], 1.3 * at[0]);
        let rough = fbm(n, at[0] / 0.62, at[1] / 0.62 + 80.0, 2) - 0.5;
        // Borers and shade leave dark holes.
        let hole = ramp(0.72, 0.86, n.value(at[0] / 0.13 + 5.0, at[1] / 0.13 + 52.0) - 0.25 * rough);
        let height_m = 1.15 * lump_m + 0.50 * rough - 0.09 * hole + 1.5 * grit_m - 0.34 * (1.0 - reef);
        let seen = ramp(-0.01, 0.02, height_m - spot.height_m);
        if seen <= 0.0 {
            return;
        }
        let grown = 0.55 * hue + 0.9 * (slow.0[TURF] - 0.5) + 0.25 * (other - 0.5) + 0.3 * rough;
        let mut colour = blend(palette.turf, palette.sediment, ramp(0.10, 0.48, grown));
        let crust = slow.0[CRUST] * ramp(0.60, 0.72, hue + 0.3 * (fine - 0.8));
        colour = blend(colour, palette.crust, 0.8 * crust);
        let algae = slow.0[ALGAE] * ramp(0.55, 0.35, hue + 0.3 * (other - 0.5));
        colour = blend(colour, palette.algae, if is_rock(habitat) { 0.9 } else { 0.55 } * algae);
        let rare = slow.0[TURF] + 0.5 * slow.0[CRUST];
        if other > 0.5 {
            colour = blend(colour, palette.sponge[0], 0.8 * ramp(0.955, 0.975, hue) * ramp(0.45, 0.7, rare));
        } else {
            colour = blend(colour, palette.sponge[1], 0.8 * ramp(0.045, 0.025, hue) * ramp(0.45, 0.7, rare));
        }
        let light = (0.30 + 0.85 * tone) * (0.32 + 0.88 * fine) * (1.0 - 0.55 * hole);
        spot.height_m += seen * (height_m - spot.height_m);
        spot.colour = blend(spot.colour, scale(colour, light), seen);
    }

    fn lay_meadow(&self, patterns: &Patterns, spot: &mut Spot, at: [f32; 2], meadow: f32, slow: &Slow) {
        let palette = &self.palette;
        let [lift_m, tone, hue] = patterns.canopy.at(0.8 * at[0], 0.8 * at[1]);
        let dense = meadow * ramp(0.20, 0.50, slow.0[CLUMP] + 0.35 * (meadow - 0.4));
        let height_m = lift_m + 0.10 * (dense - 0.75) + 0.10 * (slow.0[CLUMP] - 0.5);
        let seen = ramp(-0.03, 0.02, height_m - spot.height_m) * ramp(0.05, 0.3, dense);
        let old = (hue * hue * 0.7 + 0.6 * slow.0[AGE]).min(1.0);
        let mut colour = blend(palette.young, palette.old, old);
        // Epiphytes whiten the tips of old blades.
        colour = blend(colour, [0.24, 0.235, 0.20], 0.6 * ramp(0.75, 0.95, hue) * ramp(0.7, 1.2, tone));
        spot.colour = blend(
            scale(spot.colour, 1.0 - 0.45 * dense),
            scale(colour, (0.12 + 0.95 * tone) * (0.5 + 1.0 * slow.0[CLUMP])),
            seen,
        );
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
