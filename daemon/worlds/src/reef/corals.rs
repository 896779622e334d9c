//! The surfaces of corals, boulders and smaller things.

use super::fields::{Colour, blend, nearest_knob, ramp, scale};
use super::ground::Spot;
use super::patterns::patterns;
use super::texture::{Texel, Texture};
use super::things::{Form, Thing};
use super::{CORAL, ROCK, RUBBLE, SAND, THICKET};
use crate::noise::Noise;

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
                Spot { height_m: 0.6 * height_m, colour: scale(self.tone, 0.10 + 0.55 * tone), class: THICKET }
            }
            Form::Crust => {
                let [grit_m, tone, _] = self.pattern(&patterns().grit, at, 1.0);
                let height_m = 0.018 + 0.014 * dome + 0.6 * grit_m;
                self.worn(noise, at, height_m, 0.15 + 0.95 * tone)
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
                let height_m = 0.06 * wall * spoil - 0.07 * (1.0 - ramp(0.0, 0.75, d));
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
        let size = 0.5 * self.radius_m + 0.05;
        let [grit_m, fine, hue] = self.pattern(&patterns().grit, [y, x], 1.2);
        let decay = noise.value(x / size + 90.0, y / size + off) + 0.45 * (noise.value(x / 0.06, y / 0.06) - 0.5);
        let health = (self.key >> 40 & 0xFF) as f32 / 255.0;
        let dead = ramp(0.0, 0.16, decay - 0.50 - 0.45 * health + 0.2 * (hue - 0.5));
        let mottle = 0.72 + 0.56 * noise.value(x / 0.13 + off, y / 0.13);
        let living = scale(self.tone, tint * mottle * (0.55 + 0.55 * fine));
        let colour = blend(living, scale(blend(DEAD, FOUL, hue), 0.2 + 1.0 * fine), 0.9 * dead);
        Spot { height_m: height_m - 0.03 * dead + (0.3 + 0.9 * dead) * grit_m, colour, class: CORAL }
    }

    /// Winding ridges over a lobed dome.
    fn brain(&self, noise: &Noise, [x, y]: [f32; 2], dome: f32) -> Spot {
        let off = self.offset();
        let bend = |shift: f32| 0.06 * noise.value(x / 0.17 + shift, y / 0.17 + off);
        let zoom = (0.35 + 0.5 * self.radius_m).min(0.8) * (0.8 + 0.4 * (self.key & 0xFF) as f32 / 255.0);
        let [ridge, ..] = self.pattern(&patterns().maze, [x + bend(0.0), y + bend(40.0)], zoom);
        let [lump_m, lump, _] = self.pattern(&patterns().rock, [x, y], 1.3);
        let height_m = 0.55 * self.radius_m * dome + 0.018 * ridge + 0.9 * lump_m * dome;
        self.worn(noise, [x, y], height_m, (0.42 + 0.65 * ridge) * (0.55 + 0.55 * lump))
    }

    /// Lobes with polyps that are dark in the middle.
    fn massive(&self, noise: &Noise, [x, y]: [f32; 2], dome: f32) -> Spot {
        let size = 0.024 + 0.028 * (self.key >> 24 & 0xFF) as f32 / 255.0;
        let (distance, own) = nearest_knob(self.key, x / size, y / size);
        let polyp = ramp(0.08, 0.48, distance);
        let [lump_m, lump, _] = self.pattern(&patterns().rock, [x, y], 0.8 + 0.6 * self.radius_m);
        let height_m = self.radius_m * 0.5 * dome + 1.2 * lump_m * dome + 0.008 * polyp;
        self.worn(noise, [x, y], height_m, (0.5 + 0.5 * polyp + 0.2 * own) * (0.30 + 0.85 * lump))
    }

    /// A bush of branchlets with pale tips.
    fn branching(&self, noise: &Noise, [x, y]: [f32; 2], dome: f32) -> Spot {
        let r = self.radius_m;
        let zoom = 0.8 + 0.6 * r.min(0.6) + 0.4 * (self.key >> 24 & 0xFF) as f32 / 255.0;
        let [finger_m, tone, hue] = self.pattern(&patterns().fingers, [x, y], zoom);
        let crown = noise.value(x / (0.4 * r) + self.offset(), y / (0.4 * r));
        let pale = ramp(0.75, 1.35, tone);
        let body = scale(self.tone, 0.10 + 0.95 * tone + 0.2 * (hue - 0.5) * tone);
        let colour = blend(body, [0.42, 0.42, 0.40], 0.55 * pale * (self.key >> 32 & 0xFF) as f32 / 255.0);
        let old = ramp(0.50, 0.85, noise.value(x / 0.3 + 17.0, y / 0.3 + self.offset()) + 0.25 * (1.0 - dome));
        let colour = blend(colour, scale(FOUL, 0.2 + tone), 0.75 * old);
        Spot {
            height_m: 0.55 * r * dome * (0.5 + 0.5 * crown) + zoom * finger_m * (0.4 + 0.6 * dome),
            colour,
            class: CORAL,
        }
    }

    /// A plate above the floor with a pale rim, on which sediment collects.
    fn plate(&self, noise: &Noise, [x, y]: [f32; 2], d: f32) -> Spot {
        let r = self.radius_m;
        let rim = ramp(0.80, 0.97, d);
        let ring = noise.value(d * 6.0 + self.offset(), 0.5 + x / 0.5) - 0.5;
        let [lump_m, lump, _] = self.pattern(&patterns().rock, [x, y], 0.6);
        let [grit_m, fine, _] = self.pattern(&patterns().grit, [x, y], 1.0);
        let tint = (0.20 + 0.22 * ring + 0.55 * lump + 0.22 * rim) * (0.35 + 0.75 * fine);
        let tilt = 0.14 * ((x - self.x) * self.turn[1] + (y - self.y) * self.turn[0]);
        let height_m = 0.07 + 0.18 * r + tilt - 0.12 * r * (1.0 - d) + 0.7 * lump_m + 0.8 * grit_m;
        self.worn(noise, [x, y], height_m, 1.15 * tint)
    }

    fn soft(&self, noise: &Noise, [x, y]: [f32; 2], dome: f32) -> Spot {
        let [lump_m, lump, _] = self.pattern(&patterns().rock, [x, y], 0.7);
        let [_, fur, _] = self.pattern(&patterns().grit, [x, y], 0.8);
        let fold = noise.value(x / 0.12 + self.offset(), y / 0.12);
        let colour = scale(self.tone, (0.25 + 0.6 * lump + 0.3 * fold) * (0.35 + 0.75 * fur));
        Spot { height_m: 0.22 * self.radius_m * dome + 0.8 * lump_m, colour, class: CORAL }
    }

    fn boulder(&self, noise: &Noise, [x, y]: [f32; 2], dome: f32) -> Spot {
        let (r, off) = (self.radius_m, self.offset());
        let facet = noise.value(x / (0.5 * r) + off, y / (0.5 * r)) + 0.4 * noise.value(x / 0.08, y / 0.08);
        let [lump_m, lump, hue] = self.pattern(&patterns().rock, [x, y], 0.9);
        let [grit_m, fine, other] = self.pattern(&patterns().grit, [x, y], 1.1);
        let algae = ramp(0.35, 0.75, noise.value(x / 0.22 + off, y / 0.22) * 0.7 + 0.3 * hue + 0.3 * (other - 0.5));
        let bare = scale(self.tone, 0.35 + 0.35 * facet + 0.45 * lump);
        let colour = scale(blend(bare, FOUL, 0.8 * algae), (0.3 + 0.8 * fine) * (0.45 + 0.6 * lump));
        let height_m = r * (0.42 * dome + 0.22 * facet * dome) + 0.7 * lump_m + 1.4 * grit_m;
        Spot { height_m, colour, class: ROCK }
    }
}
