//! The branches of staghorn corals, one by one.

use super::fields::{blend, scale};
use super::grass::Segment;
use super::things::Thing;
use scene_model::random::CounterRng;

/// The largest number of branches of a colony.
const MAX_BRANCHES: usize = 420;

/// Draws the branches of a colony in steps of `step_m`, each of them as discs of the given radius.
pub(super) fn branches(colony: &Thing, step_m: f32, draw: &mut dyn FnMut(&Segment, f32)) {
    let mut rng = CounterRng::new(colony.key);
    let count = ((colony.radius_m / 0.040).powi(2) as usize).clamp(5, MAX_BRANCHES);
    for _ in 0..count {
        let angle = std::f32::consts::TAU * rng.unit() as f32;
        let out = (rng.unit() as f32).sqrt();
        let (sin, cos) = angle.sin_cos();
        let at = [colony.x + 0.85 * out * colony.radius_m * cos, colony.y + 0.85 * out * colony.radius_m * sin];
        // Branches in the middle point up, those at the edge lean outwards.
        let lean = angle + (rng.unit() + rng.unit() - 1.0) as f32 * (2.6 - 1.6 * out);
        let length_m = (0.06 + 0.10 * rng.unit() as f32) * (0.45 + 0.75 * out);
        let top_m = 0.12 + 0.5 * colony.radius_m.min(0.5) * (1.0 - out * out) + 0.10 * rng.unit() as f32;
        branch(colony, at, lean, [length_m, colony.base_m + top_m, 0.011], step_m, &mut rng, draw);
        for _ in 0..2 {
            let part = 0.3 + 0.6 * rng.unit() as f32;
            let (sin, cos) = lean.sin_cos();
            let from = [at[0] + part * length_m * cos, at[1] + part * length_m * sin];
            let side = lean + if rng.unit() < 0.5 { 0.9 } else { -0.9 };
            branch(colony, from, side, [0.5 * length_m, colony.base_m + top_m, 0.008], step_m, &mut rng, draw);
        }
    }
}

fn branch(
    colony: &Thing,
    [mut x, mut y]: [f32; 2],
    direction: f32,
    [length_m, top_m, radius_m]: [f32; 3],
    step_m: f32,
    rng: &mut CounterRng,
    draw: &mut dyn FnMut(&Segment, f32),
) {
    let steps = (length_m / step_m).ceil().max(2.0);
    let (sin, cos) = direction.sin_cos();
    let (mut dx, mut dy) = (cos * step_m, sin * step_m);
    let curl = (rng.unit() as f32 - 0.5) * 0.9 / steps;
    let shade = 0.45 + 0.9 * rng.unit() as f32;
    for step in 0..steps as u32 {
        let t = step as f32 / steps;
        let body = scale(colony.tone, shade * (0.35 + 0.75 * t));
        let pale = ((t - 0.65) / 0.35).clamp(0.0, 1.0);
        let colour = blend(body, [0.40, 0.40, 0.36], 0.65 * pale * shade.min(1.0));
        draw(
            &Segment { x, y, height_m: top_m * (0.35 + 0.65 * t), colour, cover: [1.0, 0.0] },
            radius_m * (1.35 - 0.6 * t) * (0.8 + 0.4 * shade),
        );
        (dx, dy) = (dx - curl * dy, dy + curl * dx);
        x += dx;
        y += dy;
    }
}
