//! The surfaces of corals, of the branches of staghorn corals, of boulders and smaller things.

use super::fields::{Colour, blend, ramp, scale};
use super::grass::Segment;
use super::ground::Spot;
use super::patterns::patterns;
use super::texture::{Texel, Texture};
use super::things::{Form, Thing};
use super::{CORAL, ROCK, RUBBLE, SAND, THICKET};
use crate::noise::Noise;
use scene_model::random::CounterRng;

const DEAD: Colour = [0.150, 0.135, 0.095];
const FOUL: Colour = [0.088, 0.090, 0.046];

impl Thing {
    /// The surface at a place, `d` lengths of the radius from the middle.
    pub(super) fn surface(&self, noise: &Noise, at: [f32; 2], d: f32) -> Spot {
        let r = self.radius_m;
        let dome = (1.0 - d * d).max(0.0).sqrt();
        match self.form {
            Form::Brain => self.brain(noise, at, dome),
            Form::Massive => self.massive(noise, at, dome),
            Form::Branching => self.branching(noise, at, dome),
            Form::Plate => self.plate(noise, at, d),
            Form::Soft => self.soft(noise, at, dome),
            Form::Boulder => self.boulder(noise, at, dome),
            Form::Staghorn => {
                // The ground between the branches, which are drawn one by one.
                let [height_m, tone, _] = self.pattern(&patterns().rubble, at, 1.0);
                let colour = scale(blend(self.tone, FOUL, 0.6), 0.10 + 0.45 * tone);
                Spot { height_m: 0.5 * height_m + 0.10 * r * dome, colour, class: THICKET }
            }
            Form::Crust => {
                let [grit_m, tone, _] = self.pattern(&patterns().grit, at, 1.0);
                let height_m = 0.030 * dome.min(0.4) + 0.5 * grit_m;
                self.worn(noise, at, height_m, 0.25 + 0.75 * tone)
            }
            Form::Stick => {
                let knobbly = noise.value(at[0] / 0.02, at[1] / 0.02 + self.offset());
                let colour = scale(self.tone, 0.45 + 0.75 * knobbly);
                Spot { height_m: 0.8 * r * dome + 0.004 * knobbly, colour, class: RUBBLE }
            }
            Form::Shell => Spot { height_m: 0.4 * r * dome, colour: self.tone, class: SAND },
            Form::Pit => {
                // The rim is the spoil, which the current has spread.
                let wall = ramp(0.45, 0.7, d) * (1.0 - ramp(0.7, 1.0, d));
                let spoil = noise.value(at[0] / 0.25, at[1] / 0.25 + self.offset());
                let height_m = 0.05 * wall * spoil - 0.06 * (1.0 - ramp(0.0, 0.75, d));
                Spot { height_m, colour: self.tone, class: SAND }
            }
            Form::Urchin => Spot { height_m: 0.5 * r * dome, colour: self.tone, class: CORAL },
        }
    }

    fn offset(&self) -> f32 {
        (self.key >> 8 & 0xFF) as f32
    }

    /// A pattern turned and shifted for this thing, `zoom` times as large.
    #[inline]
    fn pattern(&self, texture: &Texture, [x, y]: [f32; 2], zoom: f32) -> Texel {
        let (dx, dy) = ((x - self.x) / zoom, (y - self.y) / zoom);
        let [cos, sin] = self.turn;
        texture.at(dx * cos + dy * sin + self.offset(), dy * cos - dx * sin + 0.37 * self.offset())
    }

    /// A living surface with parts that have died and are overgrown with turf.
    fn worn(&self, noise: &Noise, [x, y]: [f32; 2], height_m: f32, tint: f32) -> Spot {
        let off = (self.key >> 16 & 0xFF) as f32;
        let size = 0.6 * self.radius_m + 0.06;
        let decay = noise.value(x / size + 90.0, y / size + off) + 0.4 * (noise.value(x / 0.07, y / 0.07) - 0.5);
        let health = (self.key >> 40 & 0xFF) as f32 / 255.0;
        let dead = ramp(0.0, 0.16, decay - 0.50 - 0.45 * health);
        let mottle = 0.80 + 0.40 * noise.value(x / 0.21 + off, y / 0.21);
        let living = scale(self.tone, tint * mottle);
        if dead == 0.0 {
            return Spot { height_m, colour: living, class: CORAL };
        }
        let [grit_m, fine, hue] = self.pattern(&patterns().grit, [y, x], 1.2);
        let colour = blend(living, scale(blend(DEAD, FOUL, hue), 0.15 + 0.9 * fine), 0.9 * dead);
        Spot { height_m: height_m + dead * (1.3 * grit_m - 0.03), colour, class: CORAL }
    }

    /// The height of a lobed dome.
    #[inline]
    fn lobed(&self, noise: &Noise, [x, y]: [f32; 2], dome: f32) -> f32 {
        let (r, off) = (self.radius_m, self.offset());
        let lobe = noise.value(x / (0.55 * r) + off, y / (0.55 * r)) - 0.5;
        r * dome * (0.72 + 0.75 * lobe)
    }

    /// Winding ridges over a lobed dome.
    fn brain(&self, noise: &Noise, [x, y]: [f32; 2], dome: f32) -> Spot {
        let off = self.offset();
        let bend = |shift: f32| 0.06 * noise.value(x / 0.17 + shift, y / 0.17 + off);
        let zoom = (0.45 + 0.5 * self.radius_m).min(0.9) * (0.8 + 0.5 * (self.key & 0xFF) as f32 / 255.0);
        let [ridge, ..] = self.pattern(&patterns().maze, [x + bend(0.0), y + bend(40.0)], zoom);
        let height_m = self.lobed(noise, [x, y], dome) + 0.022 * zoom * ridge;
        self.worn(noise, [x, y], height_m, 0.52 + 0.55 * ridge)
    }

    /// Lobes with cups that are dark in the middle.
    fn massive(&self, noise: &Noise, [x, y]: [f32; 2], dome: f32) -> Spot {
        // Small cups are only a fine grain; some colonies are smooth.
        let choice = (self.key >> 24 & 0xFF) as f32 / 255.0;
        let zoom = 0.7 + 1.3 * choice * choice;
        let [cup_m, tone, _] = self.pattern(&patterns().cups, [x, y], zoom);
        let depth = 0.50 * ramp(0.1, 0.5, choice);
        let height_m = self.lobed(noise, [x, y], dome) + zoom * depth * cup_m;
        self.worn(noise, [x, y], height_m, 0.75 + (0.25 + 0.75 * depth) * (tone - 0.75))
    }

    /// A bush of branchlets, paler where they grow.
    fn branching(&self, noise: &Noise, [x, y]: [f32; 2], dome: f32) -> Spot {
        let r = self.radius_m;
        let zoom = 0.75 + 0.6 * r.min(0.6) + 0.8 * (self.key >> 24 & 0xFF) as f32 / 255.0;
        let bend = |shift: f32| 0.10 * noise.value(x / 0.23 + shift, y / 0.23 + self.offset());
        let [knob_m, tone, hue] = self.pattern(&patterns().knobs, [x + bend(3.0), y + bend(60.0)], zoom);
        let crown = noise.value(x / (0.5 * r) + self.offset(), y / (0.5 * r));
        let body = scale(self.tone, 0.10 + 0.98 * tone + 0.12 * (hue - 0.5) * tone);
        let pale = 0.35 * ramp(0.8, 1.4, tone) * (self.key >> 32 & 0xFF) as f32 / 255.0;
        let colour = blend(body, scale([0.30, 0.31, 0.31], tone), pale);
        let old = ramp(0.55, 0.85, noise.value(x / 0.3 + 17.0, y / 0.3 + self.offset()) + 0.25 * (1.0 - dome));
        let colour = blend(colour, scale(FOUL, 0.1 + tone), 0.75 * old);
        let height_m = r * dome * (0.45 + 0.5 * crown) + 1.3 * zoom * knob_m * (0.5 + 0.5 * dome);
        Spot { height_m, colour, class: CORAL }
    }

    /// A plate above the floor with a pale rim, on which sediment collects.
    fn plate(&self, noise: &Noise, [x, y]: [f32; 2], d: f32) -> Spot {
        let r = self.radius_m;
        let rim = ramp(0.75, 0.97, d);
        let [grit_m, fine, _] = self.pattern(&patterns().grit, [x, y], 0.9);
        let fold = noise.value(x / (0.35 * r) + self.offset(), y / (0.35 * r)) - 0.5;
        let [lump_m, lump, _] = self.pattern(&patterns().rock, [x, y], 0.5);
        let tint = (0.50 + 0.30 * rim + 0.3 * fold) * (0.40 + 0.60 * fine) * (0.35 + 0.65 * lump);
        let tilt = 0.24 * ((x - self.x) * self.turn[1] + (y - self.y) * self.turn[0]);
        let height_m = 0.12 + 0.22 * r + tilt - 0.16 * r * (1.0 - d) + 0.14 * r * fold + 0.6 * grit_m + 0.2 * lump_m;
        self.worn(noise, [x, y], height_m, tint)
    }

    fn soft(&self, noise: &Noise, [x, y]: [f32; 2], dome: f32) -> Spot {
        let fold = noise.value(x / 0.14 + self.offset(), y / 0.14);
        let finger = noise.value(x / 0.05 + 9.0, y / 0.05 + self.offset());
        let [_, fine, _] = self.pattern(&patterns().knobs, [x, y], 0.6);
        let colour = scale(self.tone, (0.35 + 0.45 * fold + 0.35 * finger) * (0.35 + 0.65 * fine));
        let height_m = 0.30 * self.radius_m * dome + (0.07 * fold + 0.03 * finger) * (0.4 + 0.6 * dome);
        Spot { height_m, colour, class: CORAL }
    }

    fn boulder(&self, noise: &Noise, [x, y]: [f32; 2], dome: f32) -> Spot {
        let r = self.radius_m;
        let [lump_m, lump, hue] = self.pattern(&patterns().rock, [x, y], 0.55 + 0.5 * r.min(1.0));
        let [grit_m, fine, _] = self.pattern(&patterns().grit, [x, y], 1.1);
        // Silt lies on top, turf grows at the sides.
        let turf = ramp(0.35, 0.75, hue + 0.35 * (1.0 - dome));
        let colour = blend(self.tone, FOUL, 0.65 * turf);
        let height_m = self.lobed(noise, [x, y], dome) + (0.25 + 0.6 * r.min(0.6)) * lump_m * dome + 0.9 * grit_m;
        Spot { height_m, colour: scale(colour, (0.10 + 0.95 * lump) * (0.35 + 0.7 * fine)), class: ROCK }
    }
}

/// The largest number of branches of a colony.
const MAX_BRANCHES: usize = 320;

/// A branch that is being drawn: lengths and heights in metres, the direction in radians.
struct Branch {
    from: [f32; 2],
    direction: f32,
    length_m: f32,
    base_m: f32,
    top_m: f32,
    radius_m: f32,
}

/// Draws the branches of a colony in steps of `step_m`, each of them as discs of the given radius.
pub(super) fn branches(colony: &Thing, step_m: f32, draw: &mut dyn FnMut(&Segment, f32)) {
    let mut rng = CounterRng::new(colony.key);
    // Each colony has its own habit: stout or slender, upright or spreading.
    let stout = (0.95 + 0.85 * rng.unit() as f32) * (0.8 + 0.5 * colony.radius_m.min(1.0));
    let spreading = 0.5 + 0.9 * rng.unit() as f32;
    let slant = std::f32::consts::TAU * rng.unit() as f32;
    let count = ((colony.radius_m / (0.029 * stout)).powi(2) as usize).clamp(9, MAX_BRANCHES);
    for _ in 0..count {
        let mut unit = || rng.unit() as f32;
        let angle = std::f32::consts::TAU * unit();
        let out = unit().sqrt();
        let (sin, cos) = angle.sin_cos();
        let from = [colony.x + 0.8 * out * colony.radius_m * cos, colony.y + 0.8 * out * colony.radius_m * sin];
        // Branches in the middle point up, those at the edge lean outwards, and all follow the light a little.
        let lean = if unit() < 0.20 { slant } else { angle + (unit() + unit() - 1.0) * (1.7 - 1.0 * out) };
        let length_m = (stout * (0.06 + 0.08 * unit() + 0.10 * spreading * out)).min(0.7 * colony.radius_m);
        let top_m = 0.10 + 0.55 * colony.radius_m.min(0.5) * (1.0 - 0.8 * out * out) + 0.12 * unit();
        let radius_m = 0.017 * stout * (0.8 + 0.4 * unit());
        let base_m = colony.base_m + 0.35 * top_m;
        let stem = Branch { from, direction: lean, length_m, base_m, top_m: colony.base_m + top_m, radius_m };
        branch(colony, &stem, step_m, &mut rng, draw);
        let part = 0.35 + 0.4 * rng.unit() as f32;
        let (sin, cos) = lean.sin_cos();
        let twig = Branch {
            from: [from[0] + part * length_m * cos, from[1] + part * length_m * sin],
            direction: lean + if rng.unit() < 0.5 { 0.8 } else { -0.8 },
            length_m: 0.6 * length_m,
            base_m: base_m + part * (stem.top_m - base_m),
            top_m: stem.top_m + 0.03,
            radius_m: 0.8 * radius_m,
        };
        branch(colony, &twig, step_m, &mut rng, draw);
    }
}

fn branch(colony: &Thing, stem: &Branch, step_m: f32, rng: &mut CounterRng, draw: &mut dyn FnMut(&Segment, f32)) {
    let steps = (stem.length_m / step_m).ceil().max(3.0);
    let (sin, cos) = stem.direction.sin_cos();
    let [mut x, mut y] = stem.from;
    let (mut dx, mut dy) = (cos * step_m, sin * step_m);
    let curl = (rng.unit() as f32 - 0.5) * 1.1 / steps;
    let pale = (colony.key >> 20 & 0xFF) as f32 / 255.0 * 0.45;
    let shade = 0.75 + 0.4 * rng.unit() as f32;
    for step in 0..steps as u32 {
        let t = step as f32 / steps;
        // Growing ends have fewer algae and are a little paler.
        let body = scale(colony.tone, shade * (0.55 + 0.60 * t));
        let colour = blend(body, scale([0.34, 0.34, 0.32], shade), pale * t * t);
        let height_m = stem.base_m + (stem.top_m - stem.base_m) * t;
        draw(&Segment { x, y, height_m, colour, cover: [1.0, 0.0] }, stem.radius_m * (1.2 - 0.35 * t));
        (dx, dy) = (dx - curl * dy, dy + curl * dx);
        x += dx;
        y += dy;
    }
}
