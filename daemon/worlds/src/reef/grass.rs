//! The blades of the seagrass meadows.

use super::fields::{Colour, blend, fbm, ramp, scale};
use super::ground::Ground;
use super::layout::{Habitat, Layout, Region};
use super::scatter::JitteredLattice;
use scene_model::random::{CounterRng, derive};

/// Distance of neighbouring shoots, metres.
const SPACING_M: f32 = 0.064;
/// Shoots along the edge of a block.
const BLOCK: i32 = 4;
const MAX_BLADE_M: f32 = 0.36;

const YOUNG: Colour = [0.085, 0.112, 0.050];
const OLD: Colour = [0.150, 0.138, 0.090];
const DARK: Colour = [0.036, 0.044, 0.022];

/// A part of a blade, about as long as wide.
pub(super) struct Segment {
    pub x: f32,
    pub y: f32,
    pub height_m: f32,
    pub colour: Colour,
    /// Shares of the node below it and of the next node that it covers, 0 to 1.
    pub cover: [f32; 2],
}

/// Draws the blades that may reach into the region, in steps of `step_m`.
pub(super) fn blades(
    key: u64,
    layout: &Layout,
    ground: &Ground,
    region: &Region,
    step_m: f32,
    draw: &mut dyn FnMut(&Segment),
) {
    let shoots = JitteredLattice { spacing_m: SPACING_M, block: BLOCK, stream: derive(key, 30) };
    let has_grass = |habitat: &Habitat| habitat.grass > 0.01;
    shoots.visit(layout, (region, MAX_BLADE_M), has_grass, |mut shoot| {
        let (x, y) = (shoot.x, shoot.y);
        // Shoots stand in clumps, with thin places between.
        let clump = fbm(&ground.noise, x / 0.45 + 70.0, y / 0.45, 3);
        if (shoot.rng.unit() as f32) < ground.meadow(x, y, &shoot.habitat) * ramp(0.35, 0.75, clump) {
            blade(ground, [x, y], step_m, &mut shoot.rng, draw);
        }
    });
}

fn blade(ground: &Ground, at: [f32; 2], step_m: f32, rng: &mut CounterRng, draw: &mut dyn FnMut(&Segment)) {
    let [x, y] = at;
    // The current bends neighbouring blades to the same side.
    let sway = std::f32::consts::TAU * ground.noise.value(x / 7.0 + 20.0, y / 7.0)
        + 2.4 * (ground.noise.value(x / 0.6, y / 0.6) - 0.5);
    let own = (rng.unit() + rng.unit() - 1.0) as f32;
    let (sin, cos) = (sway + 1.5 * own).sin_cos();
    let curl = 1.8 * (rng.unit() as f32 - 0.5);
    let length_m = 0.10 + (MAX_BLADE_M - 0.10) * (rng.unit() * rng.unit()) as f32;
    let lift_m = 0.03 + 0.07 * rng.unit() as f32;
    let age = rng.unit() as f32;
    let dead = ramp(0.45, 0.7, ground.noise.value(x / 1.6 + 15.0, y / 1.6));
    let tone = scale(blend(YOUNG, OLD, (age * age + 0.5 * dead).min(1.0)), 0.55 + 0.6 * rng.unit() as f32);
    // Blades near the camera are wide, and those that sway are blurred.
    let cover = [0.45 + 0.5 * rng.unit() as f32, (1.6 * rng.unit() as f32 - 0.7).max(0.0)];
    let steps = (length_m / step_m).ceil().max(1.0);
    let (mut px, mut py, mut dx, mut dy) = (x, y, cos * step_m, sin * step_m);
    let turn = curl / steps;
    for step in 0..steps as u32 {
        let t = step as f32 / steps;
        let height_m = 0.02 + lift_m * (4.0 * t * (1.0 - 0.75 * t)).min(1.0);
        // Epiphytes mottle the blade.
        let mottle = 0.85 + 0.3 * ground.noise.value(px / 0.05, py / 0.05);
        let colour = scale(blend(DARK, tone, (0.25 + 1.1 * t).min(1.0)), mottle);
        draw(&Segment { x: px, y: py, height_m, colour, cover });
        (dx, dy) = (dx - turn * dy, dy + turn * dx);
        px += dx;
        py += dy;
    }
}
