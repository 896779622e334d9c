//! A part of the sea floor on a grid of nodes: height, colour and class of each.

use super::Reef;
use super::corals::branches;
use super::fields::{Colour, blend};
use super::grass::blades;
use super::ground::Slow;
use super::layout::{Habitat, Region};
use super::scatter::{large_things, small_things};
use super::things::{Form, Thing};

/// Nodes between two places at which the habitats are computed; between these places they are interpolated.
const STRIDE: usize = 8;

/// Nodes `pitch_m` apart, row by row from the south-west. The first is at (`west`, `south`) nodes from the origin.
pub(super) struct Surface {
    pub west: i32,
    pub south: i32,
    pub columns: usize,
    pub rows: usize,
    pub pitch_m: f32,
    pub height_m: Vec<f32>,
    pub colour: Vec<Colour>,
    pub class: Vec<u8>,
}

impl Surface {
    /// The surface with everything that can be seen.
    pub(super) fn new(reef: &Reef, corner: [i32; 2], size: [usize; 2], pitch_m: f32) -> Self {
        let (mut surface, colonies) = Self::coarse(reef, corner, size, pitch_m);
        let region = surface.region();
        for colony in &colonies {
            surface.lay_branches(colony);
        }
        small_things(reef.key, &reef.layout, &reef.ground, &region, &mut |thing| surface.lay(reef, thing));
        surface.lay_blades(reef, &region);
        surface.lay_wreck(reef, &region);
        surface
    }

    /// The surface with everything that has a class.
    pub(super) fn of_classes(reef: &Reef, corner: [i32; 2], size: [usize; 2], pitch_m: f32) -> Self {
        let (mut surface, _) = Self::coarse(reef, corner, size, pitch_m);
        let region = surface.region();
        surface.lay_wreck(reef, &region);
        surface
    }

    /// The surface without small things and branches, and the colonies whose branches are missing.
    fn coarse(reef: &Reef, [west, south]: [i32; 2], [columns, rows]: [usize; 2], pitch_m: f32) -> (Self, Vec<Thing>) {
        let count = columns * rows;
        let mut surface = Self {
            west,
            south,
            columns,
            rows,
            pitch_m,
            height_m: Vec::with_capacity(count),
            colour: Vec::with_capacity(count),
            class: Vec::with_capacity(count),
        };
        surface.lay_ground(reef);
        let region = surface.region();
        let mut colonies = Vec::new();
        large_things(reef.key, &reef.layout, &reef.ground, &region, &mut |thing| {
            surface.lay(reef, thing);
            if thing.form == Form::Staghorn {
                colonies.push(*thing);
            }
        });
        (surface, colonies)
    }

    fn region(&self) -> Region {
        Region { west: self.x(0), south: self.y(0), east: self.x(self.columns - 1), north: self.y(self.rows - 1) }
    }

    #[inline]
    fn x(&self, column: usize) -> f32 {
        ((self.west + column as i32) as f32 + 0.5) * self.pitch_m
    }

    #[inline]
    fn y(&self, row: usize) -> f32 {
        ((self.south + row as i32) as f32 + 0.5) * self.pitch_m
    }

    fn lay_ground(&mut self, reef: &Reef) {
        // Places of the coarse grid are multiples of the stride in the world, so that neighbouring surfaces agree.
        let stride = STRIDE as i32;
        let (left, bottom) = (self.west.div_euclid(stride), self.south.div_euclid(stride));
        let wide = ((self.west + self.columns as i32).div_euclid(stride) - left + 2) as usize;
        let line = |row: i32| -> Vec<(Habitat, Slow)> {
            let y = (row * stride) as f32 * self.pitch_m;
            let place = |i: i32| {
                let x = ((left + i) * stride) as f32 * self.pitch_m;
                (reef.layout.at(x, y), reef.ground.slow(x, y))
            };
            (0..wide as i32).map(place).collect()
        };
        let (mut lower, mut upper) = (line(bottom), line(bottom + 1));
        let mut at = bottom;
        for row in 0..self.rows {
            let node = self.south + row as i32;
            if node.div_euclid(stride) > at {
                at += 1;
                lower = std::mem::replace(&mut upper, line(at + 1));
            }
            let up = (node.rem_euclid(stride) as f32 + 0.5) / STRIDE as f32;
            let mix = |(a, b): (&(Habitat, Slow), &(Habitat, Slow))| (a.0.towards(&b.0, up), a.1.towards(&b.1, up));
            let between: Vec<(Habitat, Slow)> = lower.iter().zip(&upper).map(mix).collect();
            let y = self.y(row);
            for column in 0..self.columns {
                let node = self.west + column as i32;
                let i = (node.div_euclid(stride) - left) as usize;
                let along = (node.rem_euclid(stride) as f32 + 0.5) / STRIDE as f32;
                let (habitat, slow) = &between[i];
                let habitat = habitat.towards(&between[i + 1].0, along);
                let slow = slow.towards(&between[i + 1].1, along);
                let spot = reef.ground.spot(self.x(column), y, &habitat, &slow);
                self.height_m.push(spot.height_m);
                self.colour.push(spot.colour);
                self.class.push(spot.class);
            }
        }
    }

    /// Lays a thing on the floor: it covers what is lower, or follows the floor below it.
    fn lay(&mut self, reef: &Reef, thing: &Thing) {
        let reach = thing.reach_m();
        let (columns, rows) = self.span([thing.x - reach, thing.y - reach, thing.x + reach, thing.y + reach]);
        for row in rows {
            let y = self.y(row);
            for column in columns.clone() {
                let Some(spot) = thing.spot(&reef.ground.noise, self.x(column), y) else { continue };
                let at = row * self.columns + column;
                if thing.follows_floor() {
                    self.height_m[at] += spot.height_m - thing.base_m;
                    if !thing.is_pit() {
                        self.colour[at] = spot.colour;
                    }
                    if thing.has_class() {
                        self.class[at] = spot.class;
                    }
                    continue;
                }
                // An edge is soft where both surfaces are nearly as high.
                let above = spot.height_m - self.height_m[at];
                let seen = ((above + 0.006) / 0.014).clamp(0.0, 1.0);
                if seen > 0.0 {
                    self.height_m[at] += above.max(0.0);
                    self.colour[at] = blend(self.colour[at], spot.colour, seen);
                }
                if seen > 0.5 && thing.has_class() {
                    self.class[at] = spot.class;
                }
            }
        }
    }

    fn lay_branches(&mut self, thing: &Thing) {
        branches(thing, self.pitch_m.min(0.02), &mut |segment, radius_m| {
            let (x, y) = (segment.x, segment.y);
            let (columns, rows) = self.span([x - radius_m, y - radius_m, x + radius_m, y + radius_m]);
            for row in rows {
                for column in columns.clone() {
                    let (dx, dy) = ((self.x(column) - x) / radius_m, (self.y(row) - y) / radius_m);
                    let round = 1.0 - dx * dx - dy * dy;
                    let height_m = segment.height_m + 0.9 * radius_m * round;
                    let at = row * self.columns + column;
                    if round > -0.3 && height_m > self.height_m[at] {
                        self.height_m[at] = height_m;
                        self.colour[at] = segment.colour.map(|c| c * (0.6 + 0.45 * round));
                    }
                }
            }
        });
    }

    fn lay_blades(&mut self, reef: &Reef, region: &Region) {
        let step_m = self.pitch_m.min(0.02);
        blades(reef.key, &reef.layout, &reef.ground, region, step_m, &mut |segment| {
            let column = (segment.x / self.pitch_m).floor() as i64 - i64::from(self.west);
            let row = (segment.y / self.pitch_m).floor() as i64 - i64::from(self.south);
            for (shift, cover) in [0, 1].into_iter().zip(segment.cover) {
                let column = column + shift;
                if (0..self.columns as i64).contains(&column) && (0..self.rows as i64).contains(&row) {
                    let at = row as usize * self.columns + column as usize;
                    if cover > 0.0 && segment.height_m > self.height_m[at] {
                        self.height_m[at] += cover * (segment.height_m - self.height_m[at]);
                        self.colour[at] = blend(self.colour[at], segment.colour, cover);
                    }
                }
            }
        });
    }

    fn lay_wreck(&mut self, reef: &Reef, region: &Region) {
        let berth = reef.layout.berth;
        if !berth.touches(region) {
            return;
        }
        for row in 0..self.rows {
            for column in 0..self.columns {
                if let Some((spot, cover)) = berth.spot(&reef.ground.noise, self.x(column), self.y(row)) {
                    let at = row * self.columns + column;
                    self.height_m[at] += cover * (spot.height_m - self.height_m[at]);
                    self.colour[at] = blend(self.colour[at], spot.colour, cover);
                    self.class[at] = spot.class;
                }
            }
        }
    }

    /// The columns and rows of the surface within west, south, east and north limits in metres.
    fn span(&self, [west, south, east, north]: [f32; 4]) -> (std::ops::Range<usize>, std::ops::Range<usize>) {
        let range = |low: f32, high: f32, first: i32, count: usize| {
            let at = |metres: f32| i64::from((metres / self.pitch_m).floor() as i32 - first);
            (at(low).clamp(0, count as i64) as usize)..((at(high) + 1).clamp(0, count as i64) as usize)
        };
        (range(west, east, self.west, self.columns), range(south, north, self.south, self.rows))
    }
}
