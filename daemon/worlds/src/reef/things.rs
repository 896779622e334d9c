//! Things that lie and grow on the floor: corals of several growth forms, boulders, rubble, shells, pits.

use super::fields::{Colour, blend, nearest_knob, ramp, scale};
use super::ground::Spot;
use super::{CORAL, ROCK, RUBBLE, SAND, THICKET};
use crate::noise::Noise;

/// The growth form of a coral, or the kind of another thing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Form {
    /// A dome with winding grooves.
    Brain,
    /// A smooth or lumpy dome.
    Massive,
    /// Knobs and branches with pale tips, seen from above.
    Branching,
    /// A thicket of long branches.
    Staghorn,
    /// A flat plate above the floor, with a pale rim.
    Plate,
    /// A thin crust on the rock.
    Crust,
    /// A leathery lobed soft coral.
    Soft,
    Boulder,
    /// A stick of dead coral.
    Stick,
    Shell,
    /// A pit that a ray has dug into the sand.
    Pit,
    Urchin,
}

/// One thing at its place.
#[derive(Clone, Copy, Debug)]
pub(super) struct Thing {
    pub x: f32,
    pub y: f32,
    /// Mean radius, metres.
    pub radius_m: f32,
    /// Height of the floor under its middle.
    pub base_m: f32,
    pub form: Form,
    pub tone: Colour,
    /// Cosine and sine of its long axis.
    pub turn: [f32; 2],
    /// Length of the long axis in lengths of the short one.
    pub aspect: f32,
    pub key: u64,
}

impl Thing {
    /// The largest distance from the middle that it covers, metres.
    pub(super) fn reach_m(&self) -> f32 {
        self.radius_m * 1.3 * self.aspect.max(1.0)
    }

    /// Whether it is large enough to have a class of its own; others have that of the floor below them.
    pub(super) fn has_class(&self) -> bool {
        !matches!(self.form, Form::Stick | Form::Shell | Form::Pit)
    }

    /// Whether it changes the floor's height instead of covering it.
    pub(super) fn is_pit(&self) -> bool {
        self.form == Form::Pit
    }

    /// The thing's surface at a place, if it covers the place.
    #[inline]
    pub(super) fn spot(&self, noise: &Noise, x: f32, y: f32) -> Option<Spot> {
        let (dx, dy) = (x - self.x, y - self.y);
        let along = (dx * self.turn[0] + dy * self.turn[1]) / (self.radius_m * self.aspect);
        let abeam = (dy * self.turn[0] - dx * self.turn[1]) / self.radius_m;
        let square = along * along + abeam * abeam;
        if square > 1.69 {
            return None;
        }
        let off = (self.key & 0xFF) as f32;
        let lobes = match self.form {
            Form::Crust | Form::Soft => 1.0,
            Form::Boulder | Form::Staghorn => 0.8,
            Form::Stick | Form::Shell | Form::Urchin => 0.2,
            _ => 0.55,
        };
        let bend =
            0.6 * noise.value(along * 1.6 + off, abeam * 1.6) + 0.4 * noise.value(along * 3.9, abeam * 3.9 + off) - 0.5;
        // Turf and sediment gnaw at every edge.
        let gnaw = 0.010 * (noise.value(x / 0.035 + off, y / 0.035) - 0.5) / self.radius_m.max(0.03);
        let d = square.sqrt() * (1.0 + lobes * bend) + gnaw;
        if d >= 1.0 {
            return None;
        }
        let mut spot = self.surface(noise, x, y, d);
        spot.height_m += self.base_m;
        Some(spot)
    }

    /// A living surface with parts that have died and are overgrown with turf.
    fn worn(&self, noise: &Noise, [x, y]: [f32; 2], height_m: f32, tint: f32) -> Spot {
        let off = (self.key >> 16 & 0xFF) as f32;
        let size = 0.5 * self.radius_m + 0.05;
        let decay = noise.value(x / size + 90.0, y / size + off) + 0.35 * (noise.value(x / 0.05, y / 0.05) - 0.5);
        let dead = ramp(0.50, 0.85, decay);
        let grit = noise.value(x / 0.027 + off, y / 0.027);
        let colour = blend(scale(self.tone, tint), scale([0.155, 0.140, 0.100], 0.4 + grit), 0.85 * dead);
        Spot { height_m: height_m - 0.03 * dead + 0.015 * grit * dead, colour, class: CORAL }
    }

    fn surface(&self, noise: &Noise, x: f32, y: f32, d: f32) -> Spot {
        let r = self.radius_m;
        let dome = (1.0 - d * d).max(0.0).sqrt();
        let off = (self.key >> 8 & 0xFF) as f32;
        match self.form {
            Form::Brain => {
                let size = 0.024 + 0.015 * r;
                let swirl = noise.value(x / 0.15, y / 0.15 + off);
                let fold = (noise.value(x / size + off + swirl, y / size + swirl) - 0.5).abs() * 2.0;
                let groove = ramp(0.04, 0.40, fold);
                let lump = noise.value(x / (0.5 * r) + off, y / (0.5 * r));
                let tint = (0.35 + 0.75 * groove) * (0.7 + 0.6 * lump);
                self.worn(noise, [x, y], 0.60 * r * dome + 0.02 * groove + 0.15 * r * lump * dome, tint)
            }
            Form::Massive => {
                let lump = noise.value(x / (0.35 * r) + off, y / (0.35 * r));
                // Polyps: dark dots in a pale net.
                let (distance, own) = nearest_knob(self.key, x / 0.028, y / 0.028);
                let polyp = ramp(0.10, 0.42, distance);
                let tint = (0.55 + 0.5 * polyp + 0.15 * own) * (0.65 + 0.6 * lump);
                self.worn(noise, [x, y], r * (0.5 * dome + 0.20 * lump * dome), tint)
            }
            Form::Branching => {
                let size = 0.028 + 0.022 * r.min(0.6);
                let sway = [
                    noise.value(x / (1.9 * size) + off, y / (1.9 * size)),
                    noise.value(x / (1.9 * size), y / (1.9 * size) + off),
                ];
                let (distance, own) = nearest_knob(self.key, x / size + 2.3 * sway[0], y / size + 2.3 * sway[1]);
                let tip = (1.0 - ramp(0.05, 0.70, distance)) * (0.55 + 0.45 * own);
                let colour = blend(scale(self.tone, 0.14), scale(self.tone, 1.5), tip);
                let crown = 0.62 * r * dome * (0.55 + 0.45 * tip) + 0.15 * r * dome * (sway[0] - 0.5);
                Spot { height_m: crown + 0.045 * tip, colour, class: CORAL }
            }
            Form::Staghorn => {
                // The ground between the branches, which are drawn one by one.
                let litter = noise.value(x / 0.07 + off, y / 0.07);
                Spot { height_m: 0.04 * litter, colour: scale(self.tone, 0.10 + 0.30 * litter), class: THICKET }
            }
            Form::Plate => {
                let rim = ramp(0.88, 0.98, d);
                let ring = noise.value(d * 7.0 + off, 0.5) - 0.5;
                let grit =
                    0.6 * noise.value(x / 0.022, y / 0.022 + off) + 0.4 * noise.value(x / 0.055, y / 0.055 + off);
                let tint = 0.42 + 0.2 * ring + 0.55 * grit + 0.30 * rim;
                let tilt = 0.14 * ((x - self.x) * self.turn[1] + (y - self.y) * self.turn[0]);
                let height_m = 0.09 + 0.20 * r + tilt - 0.10 * r * (1.0 - d) + 0.018 * grit;
                self.worn(noise, [x, y], height_m, tint)
            }
            Form::Crust => {
                let spots = noise.value(x / 0.025, y / 0.025 + off);
                Spot { height_m: 0.012 + 0.012 * dome, colour: scale(self.tone, 0.45 + 0.75 * spots), class: CORAL }
            }
            Form::Soft => {
                let size = 0.05 + 0.05 * r;
                let (distance, own) = nearest_knob(self.key, x / size, y / size);
                let lobe = 1.0 - ramp(0.2, 0.75, distance);
                let fur = noise.value(x / 0.02, y / 0.02 + off);
                let colour = blend(scale(self.tone, 0.3), scale(self.tone, 0.8 + 0.2 * own + 0.35 * fur), lobe);
                Spot { height_m: 0.25 * r * dome + 0.03 * lobe, colour, class: CORAL }
            }
            Form::Boulder => {
                let facet = noise.value(x / (0.5 * r) + off, y / (0.5 * r)) + 0.4 * noise.value(x / 0.08, y / 0.08);
                let fur = noise.value(x / 0.018 + off, y / 0.018);
                let algae = ramp(0.40, 0.72, noise.value(x / 0.16 + off, y / 0.16) * 0.6 + 0.3 * dome + 0.3 * fur);
                let grit = noise.value(x / 0.03 + off, y / 0.03);
                let bare = scale(self.tone, 0.25 + 0.45 * facet + 0.8 * grit);
                let colour = blend(bare, [0.085, 0.088, 0.042], 0.75 * algae);
                Spot { height_m: r * (0.45 * dome + 0.22 * facet * dome) + 0.03 * grit, colour, class: ROCK }
            }
            Form::Stick => {
                let knobbly = noise.value(x / 0.02, y / 0.02 + off);
                Spot {
                    height_m: 0.8 * r * dome + 0.004 * knobbly,
                    colour: scale(self.tone, 0.7 + 0.5 * knobbly),
                    class: RUBBLE,
                }
            }
            Form::Shell => Spot { height_m: 0.4 * r * dome, colour: self.tone, class: SAND },
            Form::Pit => {
                // The rim is the spoil, the middle shows darker sand that lay deeper.
                let wall = ramp(0.55, 0.8, d) * (1.0 - ramp(0.8, 1.0, d));
                let tint = noise.value(x / 0.06, y / 0.06 + off);
                let height_m = 0.06 * wall - 0.11 * (1.0 - ramp(0.0, 0.75, d));
                Spot { height_m, colour: scale(self.tone, 0.86 + 0.16 * tint + 0.1 * wall), class: SAND }
            }
            Form::Urchin => Spot { height_m: 0.5 * r * dome, colour: self.tone, class: CORAL },
        }
    }
}
