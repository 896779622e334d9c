//! Procedural scenes: spatial CRP samples, Potts fields, fractal fields, colonies; with sampler noise.

use crate::MapRng;
use scenecast_protocol::map_codec::LabelRaster;

/// The random process that draws a scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MapScene {
    /// Each cell takes the label of a neighbour or, rarely, a new one (Chinese restaurant process).
    SpatialCrp,
    /// Neighbours agree, up to a temperature.
    Potts,
    /// The highest of several fractal fields decides the label.
    Fractal,
    /// Patches of all sizes on one background label.
    Colonies,
}

impl MapScene {
    /// Every kind of scene, in a fixed order.
    pub const ALL: [Self; 4] = [Self::SpatialCrp, Self::Potts, Self::Fractal, Self::Colonies];

    /// A fully explored map with up to `labels` labels, at least 2.
    pub fn draw(self, rng: &mut MapRng, width: usize, height: usize, labels: usize) -> LabelRaster {
        let names = names(rng, labels);
        let mut raster = match self {
            Self::SpatialCrp => crp(rng, width, height, labels),
            Self::Potts => potts(rng, width, height, labels),
            Self::Fractal => fractal(rng, width, height, labels),
            Self::Colonies => colonies(rng, width, height, labels),
        };
        raster.labels.iter_mut().for_each(|label| *label = names[usize::from(*label)]);
        raster
    }
}

/// Label ids in random order: usually the lowest, sometimes any.
fn names(rng: &mut MapRng, labels: usize) -> Vec<u8> {
    let end = if rng.happens(800_000) { labels } else { 254 };
    let mut pool: Vec<u8> = (1..=end as u8).collect();
    (0..labels).map(|_| pool.swap_remove(rng.below(pool.len()))).collect()
}

/// Each cell takes the label of a neighbour, in `sweeps` sweeps.
fn settle(rng: &mut MapRng, raster: &mut LabelRaster, sweeps: usize, heat: usize, labels: usize) {
    for _ in 0..sweeps * raster.labels.len() {
        let i = rng.below(raster.labels.len());
        let mut votes = [0u8; 256];
        neighbours(raster, i).for_each(|label| votes[usize::from(label)] += 1);
        let label = if rng.happens(heat) {
            let around: Vec<u8> = neighbours(raster, i).collect();
            if rng.happens(950_000) { rng.pick(&around) } else { rng.below(labels) as u8 }
        } else {
            let held = raster.labels[i];
            let most = votes.iter().copied().max().unwrap_or(0);
            if votes[usize::from(held)] == most {
                held
            } else {
                votes.iter().position(|&v| v == most).map_or(held, |l| l as u8)
            }
        };
        raster.labels[i] = label;
    }
}

fn potts(rng: &mut MapRng, width: usize, height: usize, labels: usize) -> LabelRaster {
    let mut raster = LabelRaster::uniform(width, height, 0);
    let grain = rng.pick(&[1, 1, 2, 3, 5, 8]);
    for row in 0..height {
        for column in 0..width {
            let first = (column % grain, row % grain) == (0, 0);
            let label = match first {
                true => rng.below(labels) as u8,
                false => raster.get(column - column % grain, row - row % grain),
            };
            raster.set(column, row, label);
        }
    }
    let heat = rng.pick(&[20_000, 100_000, 300_000]);
    let sweeps = rng.within(3, 14);
    settle(rng, &mut raster, sweeps, heat, labels);
    raster
}

fn crp(rng: &mut MapRng, width: usize, height: usize, labels: usize) -> LabelRaster {
    let mut raster = LabelRaster::uniform(width, height, 0);
    let (mut tables, newness) = (1, rng.pick(&[300, 1500, 6000]));
    for i in 0..raster.labels.len() {
        let (column, row) = (i % width, i / width);
        raster.labels[i] = if rng.happens(newness) {
            tables = (tables + 1).min(labels);
            rng.below(tables) as u8
        } else {
            match (column, row) {
                (0, 0) => 0,
                (_, 0) => raster.labels[i - 1],
                (0, _) => raster.labels[i - width],
                _ => raster.labels[rng.pick(&[i - 1, i - width, i - 1, i - width, i - width - 1])],
            }
        };
    }
    let sweeps = rng.within(1, 8);
    settle(rng, &mut raster, sweeps, 150_000, labels);
    raster
}

/// Smooth random heights: octaves of bilinear lattices.
fn heights(rng: &mut MapRng, width: usize, height: usize, coarsest: usize) -> Vec<i64> {
    let mut field = vec![0i64; width * height];
    let (mut step, mut amplitude) = (coarsest, 1 << 12);
    while step >= 2 {
        let columns = width / step + 2;
        let lattice: Vec<i64> = (0..columns * (height / step + 2)).map(|_| rng.below(2048) as i64 - 1024).collect();
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

fn fractal(rng: &mut MapRng, width: usize, height: usize, labels: usize) -> LabelRaster {
    let coarsest = rng.pick(&[8, 16, 32, 64]);
    let mut raster = LabelRaster::uniform(width, height, 0);
    if rng.happens(300_000) {
        let field = heights(rng, width, height, coarsest);
        let band = 2400 / labels as i64 + 1;
        for (label, value) in raster.labels.iter_mut().zip(field) {
            *label = ((value + 1200) / band).clamp(0, labels as i64 - 1) as u8;
        }
        return raster;
    }
    let mut best = vec![i64::MIN; width * height];
    for name in 0..labels {
        let favour = rng.below(600) as i64;
        for (i, value) in heights(rng, width, height, coarsest).into_iter().enumerate() {
            if value + favour > best[i] {
                (best[i], raster.labels[i]) = (value + favour, name as u8);
            }
        }
    }
    raster
}

fn colonies(rng: &mut MapRng, width: usize, height: usize, labels: usize) -> LabelRaster {
    let mut raster = LabelRaster::uniform(width, height, 0);
    let rough = heights(rng, width, height, 8);
    let count = width * height / rng.pick(&[60, 200, 600, 2000]) + 1;
    let largest = rng.pick(&[6, 12, 30]);
    for _ in 0..count {
        // Many small colonies, few large ones.
        let size = 1 + largest * largest / (largest + rng.below(largest * largest));
        let (across, along) = (rng.within(size, size * 2 + 1) as i64, rng.within(size, size * 2 + 1) as i64);
        let lean = rng.below(129) as i64 - 64;
        let (x, y) = (rng.below(width) as i64, rng.below(height) as i64);
        let label = rng.within(1, labels) as u8;
        let reach = 2 * across.max(along) + 1;
        for row in (y - reach).max(0)..(y + reach).min(height as i64) {
            for column in (x - reach).max(0)..(x + reach).min(width as i64) {
                let (u, v) = (column - x + (row - y) * lean / 64, row - y);
                let i = row as usize * width + column as usize;
                let edge = 1024 + rough[i] / 2;
                if u * u * 1024 / (across * across) + v * v * 1024 / (along * along) < edge {
                    raster.labels[i] = label;
                }
            }
        }
    }
    raster
}

/// Changes a map as a sampler does: of a million border cells, `border` take a neighbour's label; of a million cells,
/// `anywhere` take any label of the map. Unexplored cells stay unexplored.
pub fn sampler_noise(rng: &mut MapRng, raster: &mut LabelRaster, border: usize, anywhere: usize) {
    let before = raster.clone();
    let mut known: Vec<u8> = before.labels.iter().copied().filter(|&label| label != 0).collect();
    known.sort_unstable();
    known.dedup();
    for (i, label) in raster.labels.iter_mut().enumerate().filter(|(_, label)| **label != 0) {
        if border > 0 && is_on_border(&before, i) && rng.happens(border) {
            let others: Vec<u8> = neighbours(&before, i).filter(|&l| l != 0 && l != *label).collect();
            if !others.is_empty() {
                *label = rng.pick(&others);
            }
        }
        if rng.happens(anywhere) {
            *label = rng.pick(&known);
        }
    }
}

/// Labels of the up to eight cells around cell `i`.
pub(crate) fn neighbours(raster: &LabelRaster, i: usize) -> impl Iterator<Item = u8> + '_ {
    let (column, row) = (i % raster.width, i / raster.width);
    let columns = column.saturating_sub(1)..(column + 2).min(raster.width);
    (row.saturating_sub(1)..(row + 2).min(raster.height))
        .flat_map(move |r| columns.clone().map(move |c| (c, r)))
        .filter(move |&place| place != (column, row))
        .map(|(c, r)| raster.get(c, r))
}

/// Whether cell `i` shares a side with a cell that has another label and is explored.
fn is_on_border(raster: &LabelRaster, i: usize) -> bool {
    let (column, row) = (i % raster.width, i / raster.width);
    let other = |label: u8| label != 0 && label != raster.labels[i];
    (column > 0 && other(raster.labels[i - 1]))
        || (column + 1 < raster.width && other(raster.labels[i + 1]))
        || (row > 0 && other(raster.labels[i - raster.width]))
        || (row + 1 < raster.height && other(raster.labels[i + raster.width]))
}
