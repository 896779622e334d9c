//! The branches of staghorn corals, one by one.

use super::fields::{blend, scale};
use super::grass::Segment;
use super::things::Thing;
use scene_model::random::CounterRng;

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
