//! Light on a surface: the sun's soft shadows, the relief's slopes, and the dark of crevices.

use super::fields::{Colour, blend, ramp};
use super::surface::Surface;

/// Direction to the sun: east, north and up.
const SUN: [f32; 3] = [-0.49, 0.60, 0.632];
/// Light from the whole sky and from the water, which is bluer than the sun's: red, green and blue.
const AMBIENT: Colour = [0.185, 0.260, 0.290];
const DIRECT: Colour = [0.79, 0.75, 0.71];
/// Radii of the neighbourhoods whose mean height tells a crevice, metres.
const NEAR_M: f32 = 0.05;
const WIDE_M: f32 = 0.22;

/// Nodes along the edge of the squares from which the haze is computed.
const GLOW: usize = 8;
/// Share of the light that is scattered on its way to the camera.
const HAZE: f32 = 0.10;

/// How much sharper the camera makes its frames.
const SHARPEN: f32 = 0.20;

/// Longest shadow, and width of the widest crevice, metres: a surface needs so much more around what is shown.
pub(super) const SHADOW_M: f32 = 0.48;
/// Most nodes around a tile that are computed for its shadows.
pub(super) const MAX_APRON: usize = 96;
pub(super) const CREVICE_M: f32 = WIDE_M + 0.03;

/// The light that each node sends back, row by row.
pub(super) fn shade(surface: &Surface) -> Vec<Colour> {
    let (columns, rows, pitch) = (surface.columns, surface.rows, surface.pitch_m);
    let height = &surface.height_m;
    let shadow = shadows(surface);
    let radius = |metres: f32| ((metres / pitch).round() as usize).max(1);
    let (near, wide) = (mean(height, columns, radius(NEAR_M)), mean(height, columns, radius(WIDE_M)));
    let mut light = Vec::with_capacity(height.len());
    for row in 0..rows {
        let (below, above) = (row.saturating_sub(1) * columns, (row + 1).min(rows - 1) * columns);
        for column in 0..columns {
            let at = row * columns + column;
            let east = height[row * columns + (column + 1).min(columns - 1)];
            let west = height[row * columns + column.saturating_sub(1)];
            let slope =
                [(east - west) / (2.0 * pitch), (height[above + column] - height[below + column]) / (2.0 * pitch)];
            let length = (1.0 + slope[0] * slope[0] + slope[1] * slope[1]).sqrt();
            let facing = (SUN[2] - slope[0] * SUN[0] - slope[1] * SUN[1]).max(0.0) / (length * SUN[2]);
            let sunk = 16.0 * (near[at] - height[at]).max(0.0) + 10.0 * (wide[at] - height[at]).max(0.0);
            let open = 1.0 / (1.0 + sunk);
            let raised = 1.0 + 2.0 * (height[at] - wide[at]).clamp(0.0, 0.2);
            let sun = facing.min(1.5) * (1.0 - shadow[at]);
            let colour = surface.colour[at];
            light.push(std::array::from_fn(|i| colour[i] * (AMBIENT[i] * raised + DIRECT[i] * sun) * open));
        }
    }
    haze(surface, &mut light);
    // A picture from far away is sharp as it is.
    let strength = SHARPEN * (1.0 - ramp(0.015, 0.04, pitch));
    sharpened(light, columns, strength)
}

/// Adds the light that the water scatters forward: everything glows a little over what is around it.
fn haze(surface: &Surface, light: &mut [Colour]) {
    let (columns, rows) = (surface.columns, surface.rows);
    // Squares of the coarse grid are multiples of their edge in the world, so that neighbouring surfaces agree.
    let first = [surface.west, surface.south].map(|node| node.rem_euclid(GLOW as i32) as usize);
    let (wide, high) = ((columns + first[0]) / GLOW + 1, (rows + first[1]) / GLOW + 1);
    let mut sums = vec![[0.0f32; 4]; wide * high];
    for (at, light) in light.iter().enumerate() {
        let (i, j) = ((at % columns + first[0]) / GLOW, (at / columns + first[1]) / GLOW);
        let sum = &mut sums[j * wide + i];
        (0..3).for_each(|k| sum[k] += light[k]);
        sum[3] += 1.0;
    }
    let around = |i: usize, j: usize| {
        let mut sum = [0.0f32; 4];
        for row in j.saturating_sub(1)..=(j + 1).min(high - 1) {
            for column in i.saturating_sub(1)..=(i + 1).min(wide - 1) {
                (0..4).for_each(|k| sum[k] += sums[row * wide + column][k]);
            }
        }
        [sum[0] / sum[3], sum[1] / sum[3], sum[2] / sum[3]]
    };
    let glow: Vec<Colour> = (0..wide * high).map(|at| around(at % wide, at / wide)).collect();
    let middle = |node: usize, first: usize, count: usize| {
        let at = ((node + first) as f32 + 0.5) / GLOW as f32 - 0.5;
        let low = (at.max(0.0) as usize).min(count.saturating_sub(2));
        (low, (at - low as f32).clamp(0.0, 1.0))
    };
    for row in 0..rows {
        let (j, up) = middle(row, first[1], high);
        let next = (j + 1).min(high - 1);
        let line: Vec<Colour> = (0..wide).map(|i| blend(glow[j * wide + i], glow[next * wide + i], up)).collect();
        for column in 0..columns {
            let (i, right) = middle(column, first[0], wide);
            let at = row * columns + column;
            light[at] = blend(light[at], blend(line[i], line[(i + 1).min(wide - 1)], right), HAZE);
        }
    }
}

/// The light with stronger differences between neighbours, as cameras compute it.
fn sharpened(light: Vec<Colour>, columns: usize, strength: f32) -> Vec<Colour> {
    if strength == 0.0 {
        return light;
    }
    let mut sharp = light.clone();
    for at in columns..light.len().saturating_sub(columns) {
        if (1..columns - 1).contains(&(at % columns)) {
            let around = [light[at - 1], light[at + 1], light[at - columns], light[at + columns]];
            sharp[at] = std::array::from_fn(|i| {
                let mean = 0.25 * (around[0][i] + around[1][i] + around[2][i] + around[3][i]);
                let value = light[at][i];
                (value + strength * (value - mean)).clamp(0.3 * value, 2.0 * value)
            });
        }
    }
    sharp
}

/// How far each node lies in the shadow of what is between it and the sun, 0 to 1.
fn shadows(surface: &Surface) -> Vec<f32> {
    let (columns, rows) = (surface.columns, surface.rows);
    // Towards the sun a ray moves this many columns for each row, and gains this much height.
    let shift = SUN[0] / SUN[1];
    let rise = SUN[2] / SUN[1] * surface.pitch_m;
    let (whole, part) = (shift.floor() as i64, shift - shift.floor());
    // A shadow is filled by light from around it before it leaves the margin of a tile.
    let longest = (SHADOW_M / surface.pitch_m).clamp(4.0, MAX_APRON as f32);
    let mut shadow = vec![0.0; columns * rows];
    // The height of the ray over each node of the last row, and the rows since it touched something.
    let mut edge: Vec<[f32; 2]> =
        surface.height_m[(rows - 1) * columns..].iter().map(|&height| [height, 0.0]).collect();
    let mut next = edge.clone();
    for row in (0..rows - 1).rev() {
        let heights = &surface.height_m[row * columns..][..columns];
        for column in 0..columns {
            let from = column as i64 + whole;
            let at = |c: i64| edge[c.clamp(0, columns as i64 - 1) as usize];
            // The ray of the whole sun is wide, so that shadows blur the more the longer they are.
            let [first, second] = [at(from), at(from + 1)];
            let inner = first[0] + part * (second[0] - first[0]);
            let outer = at(from - 1)[0] + part * (at(from + 2)[0] - at(from - 1)[0]);
            let ray = 0.8 * inner + 0.2 * outer - rise;
            let length = first[1] + part * (second[1] - first[1]) + 1.0;
            let deep = ray - heights[column];
            next[column] = if deep > 0.0 && length < longest {
                let fade = 1.0 - ramp(0.5, 1.0, length / longest);
                shadow[row * columns + column] = 0.90 * fade * ramp(0.0, 0.12, deep);
                [ray, length]
            } else {
                [heights[column], 0.0]
            };
        }
        std::mem::swap(&mut edge, &mut next);
    }
    shadow
}

/// The mean over a square of the given radius around each node; at the border, over the part inside.
fn mean(values: &[f32], columns: usize, radius: usize) -> Vec<f32> {
    let rows = values.len() / columns;
    let mut across = vec![0.0; values.len()];
    for (line, out) in values.chunks_exact(columns).zip(across.chunks_exact_mut(columns)) {
        running(columns, radius, |i| line[i], |i, value| out[i] = value);
    }
    let mut sums = vec![0.0f32; columns];
    let mut result = vec![0.0; values.len()];
    for row in 0..rows.min(radius) {
        add(&mut sums, &across[row * columns..][..columns], 1.0);
    }
    for row in 0..rows {
        if row + radius < rows {
            add(&mut sums, &across[(row + radius) * columns..][..columns], 1.0);
        }
        if row > radius {
            add(&mut sums, &across[(row - radius - 1) * columns..][..columns], -1.0);
        }
        let count = (row + radius).min(rows - 1) - row.saturating_sub(radius) + 1;
        let share = 1.0 / count as f32;
        for (out, sum) in result[row * columns..][..columns].iter_mut().zip(&sums) {
            *out = sum * share;
        }
    }
    result
}

fn add(sums: &mut [f32], line: &[f32], sign: f32) {
    for (sum, value) in sums.iter_mut().zip(line) {
        *sum += sign * value;
    }
}

fn running(count: usize, radius: usize, value: impl Fn(usize) -> f32, mut put: impl FnMut(usize, f32)) {
    let mut sum: f32 = (0..count.min(radius)).map(&value).sum();
    for i in 0..count {
        if i + radius < count {
            sum += value(i + radius);
        }
        if i > radius {
            sum -= value(i - radius - 1);
        }
        let inside = (i + radius).min(count - 1) - i.saturating_sub(radius) + 1;
        put(i, sum / inside as f32);
    }
}
