//! Procedural scenes: spatial CRP samples, Potts fields, fractal fields, colonies on a ground; with sampler noise.

use super::Chance;
use crate::map_codec::Plane;

/// How a scene comes about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scene {
    /// Cells take labels from their neighbourhood or, rarely, a new one.
    SpatialCrp,
    /// Neighbours agree, with some heat.
    Potts,
    /// The highest of several fractal fields wins.
    Fractal,
    /// Patches of all sizes on a ground.
    Colonies,
}

impl Scene {
    /// Every kind of scene.
    pub const ALL: [Self; 4] = [Self::SpatialCrp, Self::Potts, Self::Fractal, Self::Colonies];

    /// A fully seen map with up to `labels` labels, at least 2.
    pub fn draw(self, chance: &mut Chance, width: usize, height: usize, labels: usize) -> Plane {
        let names = names(chance, labels);
        let mut plane = match self {
            Self::SpatialCrp => crp(chance, width, height, labels),
            Self::Potts => potts(chance, width, height, labels),
            Self::Fractal => fractal(chance, width, height, labels),
            Self::Colonies => colonies(chance, width, height, labels),
        };
        plane.labels.iter_mut().for_each(|label| *label = names[usize::from(*label)]);
        plane
    }
}

/// Label ids in a random order: usually the lowest, sometimes anywhere.
fn names(chance: &mut Chance, labels: usize) -> Vec<u8> {
    let end = if chance.happens(800_000) { labels } else { 254 };
    let mut pool: Vec<u8> = (1..=end as u8).collect();
    (0..labels).map(|_| pool.swap_remove(chance.below(pool.len()))).collect()
}

/// Every cell takes the label of one around it, `sweeps` times over.
fn settle(chance: &mut Chance, plane: &mut Plane, sweeps: usize, heat: usize, labels: usize) {
    for _ in 0..sweeps * plane.labels.len() {
        let i = chance.below(plane.labels.len());
        let mut votes = [0u8; 256];
        plane.around(i).for_each(|label| votes[usize::from(label)] += 1);
        let label = if chance.happens(heat) {
            let around: Vec<u8> = plane.around(i).collect();
            if chance.happens(950_000) { chance.pick(&around) } else { chance.below(labels) as u8 }
        } else {
            let held = plane.labels[i];
            let most = votes.iter().copied().max().unwrap_or(0);
            if votes[usize::from(held)] == most {
                held
            } else {
                votes.iter().position(|&v| v == most).map_or(held, |l| l as u8)
            }
        };
        plane.labels[i] = label;
    }
}

fn potts(chance: &mut Chance, width: usize, height: usize, labels: usize) -> Plane {
    let mut plane = Plane::uniform(width, height, 0);
    let grain = chance.pick(&[1, 1, 2, 3, 5, 8]);
    for row in 0..height {
        for column in 0..width {
            let first = (column % grain, row % grain) == (0, 0);
            let label = match first {
                true => chance.below(labels) as u8,
                false => plane.get(column - column % grain, row - row % grain),
            };
            plane.set(column, row, label);
        }
    }
    let heat = chance.pick(&[20_000, 100_000, 300_000]);
    let sweeps = chance.within(3, 14);
    settle(chance, &mut plane, sweeps, heat, labels);
    plane
}

fn crp(chance: &mut Chance, width: usize, height: usize, labels: usize) -> Plane {
    let mut plane = Plane::uniform(width, height, 0);
    let (mut tables, newness) = (1, chance.pick(&[300, 1500, 6000]));
    for i in 0..plane.labels.len() {
        let (column, row) = (i % width, i / width);
        plane.labels[i] = if chance.happens(newness) {
            tables = (tables + 1).min(labels);
            chance.below(tables) as u8
        } else {
            match (column, row) {
                (0, 0) => 0,
                (_, 0) => plane.labels[i - 1],
                (0, _) => plane.labels[i - width],
                _ => plane.labels[chance.pick(&[i - 1, i - width, i - 1, i - width, i - width - 1])],
            }
        };
    }
    let sweeps = chance.within(1, 8);
    settle(chance, &mut plane, sweeps, 150_000, labels);
    plane
}

/// Smooth random heights: octaves of bilinear lattices.
fn heights(chance: &mut Chance, width: usize, height: usize, coarsest: usize) -> Vec<i64> {
    let mut field = vec![0i64; width * height];
    let (mut step, mut amplitude) = (coarsest, 1 << 12);
    while step >= 2 {
        let columns = width / step + 2;
        let lattice: Vec<i64> = (0..columns * (height / step + 2)).map(|_| chance.below(2048) as i64 - 1024).collect();
        for (i, value) in field.iter_mut().enumerate() {
            let (column, row) = (i % width, i / width);
            let (c, r) = (column / step, row / step);
            let (u, v) = ((column % step) as i64, (row % step) as i64);
            let n = step as i64;
            let at = |c: usize, r: usize| lattice[r * columns + c];
            let south = at(c, r) * (n - u) + at(c + 1, r) * u;
            let north = at(c, r + 1) * (n - u) + at(c + 1, r + 1) * u;
            *value += ((south * (n - v) + north * v) / (n * n) * amplitude) >> 12;
        }
        step /= 2;
        amplitude = amplitude * 6 / 10;
    }
    field
}

fn fractal(chance: &mut Chance, width: usize, height: usize, labels: usize) -> Plane {
    let coarsest = chance.pick(&[8, 16, 32, 64]);
    let mut plane = Plane::uniform(width, height, 0);
    if chance.happens(300_000) {
        let field = heights(chance, width, height, coarsest);
        let band = 2400 / labels as i64 + 1;
        for (label, value) in plane.labels.iter_mut().zip(field) {
            *label = ((value + 1200) / band).clamp(0, labels as i64 - 1) as u8;
        }
        return plane;
    }
    let mut best = vec![i64::MIN; width * height];
    for name in 0..labels {
        let favour = chance.below(600) as i64;
        for (i, value) in heights(chance, width, height, coarsest).into_iter().enumerate() {
            if value + favour > best[i] {
                (best[i], plane.labels[i]) = (value + favour, name as u8);
            }
        }
    }
    plane
}

fn colonies(chance: &mut Chance, width: usize, height: usize, labels: usize) -> Plane {
    let mut plane = Plane::uniform(width, height, 0);
    let rough = heights(chance, width, height, 8);
    let count = width * height / chance.pick(&[60, 200, 600, 2000]) + 1;
    let largest = chance.pick(&[6, 12, 30]);
    for _ in 0..count {
        // Many small ones, few large ones.
        let size = 1 + largest * largest / (largest + chance.below(largest * largest));
        let (across, along) = (chance.within(size, size * 2 + 1) as i64, chance.within(size, size * 2 + 1) as i64);
        let lean = chance.below(129) as i64 - 64;
        let (x, y) = (chance.below(width) as i64, chance.below(height) as i64);
        let label = chance.within(1, labels) as u8;
        let reach = 2 * across.max(along) + 1;
        for row in (y - reach).max(0)..(y + reach).min(height as i64) {
            for column in (x - reach).max(0)..(x + reach).min(width as i64) {
                let (u, v) = (column - x + (row - y) * lean / 64, row - y);
                let i = row as usize * width + column as usize;
                let edge = 1024 + rough[i] / 2;
                if u * u * 1024 / (across * across) + v * v * 1024 / (along * along) < edge {
                    plane.labels[i] = label;
                }
            }
        }
    }
    plane
}

/// What a sampler does to a map: `border` in a million border cells take a neighbour's label, `anywhere` in a million
/// cells take any label of the map. Unexplored cells stay so.
pub fn sampler_noise(chance: &mut Chance, plane: &mut Plane, border: usize, anywhere: usize) {
    let before = plane.clone();
    let mut known: Vec<u8> = before.labels.iter().copied().filter(|&label| label != 0).collect();
    known.sort_unstable();
    known.dedup();
    for (i, label) in plane.labels.iter_mut().enumerate().filter(|(_, label)| **label != 0) {
        if border > 0 && before.on_border(i) && chance.happens(border) {
            let others: Vec<u8> = before.around(i).filter(|&l| l != 0 && l != *label).collect();
            if !others.is_empty() {
                *label = chance.pick(&others);
            }
        }
        if chance.happens(anywhere) {
            *label = chance.pick(&known);
        }
    }
}
