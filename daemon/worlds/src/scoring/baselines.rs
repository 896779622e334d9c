//! The baselines of the scene model: k-means on colours and on word histograms, with k-means++ seeding (Arthur and Vassilvitskii,
//! SODA 2007).

use super::annotations::{Annotations, LabelGrid};
use image::RgbImage;
use scene_model::random::CounterRng;
use scene_model::words::{Word, cie_lab};

/// Labels each cell by k-means on the mean CIE Lab colours of the cells, with at most `k` labels.
pub(crate) fn mean_lab_labels(image: &RgbImage, cell_px: f32, k: usize, seed: u64) -> LabelGrid {
    let (columns, rows, colours) = cell_lab(image, cell_px);
    let labels = k_means(colours.as_flattened(), 3, k, seed);
    LabelGrid { columns, rows, labels: labels.into_iter().map(Some).collect() }
}

/// Returns the colours of an image as 64 classes: L, a and b of the cell's mean, each in four levels of equal
/// probability under a normal distribution.
///
/// They stand in for annotations where none exist.
#[must_use]
pub fn mosaic_classes(image: &RgbImage, cell_px: f32) -> Annotations {
    const CUTS: [f32; 3] = [-0.674, 0.0, 0.674];
    let (columns, rows, colours) = cell_lab(image, cell_px);
    let scales: [(f32, f32); 3] = std::array::from_fn(|i| {
        let count = colours.len().max(1) as f64;
        let mean = colours.iter().map(|colour| f64::from(colour[i])).sum::<f64>() / count;
        let variance = colours.iter().map(|colour| (f64::from(colour[i]) - mean).powi(2)).sum::<f64>() / count;
        (mean as f32, variance.sqrt() as f32)
    });
    let class = |colour: &[f32; 3]| {
        colour.iter().zip(scales).fold(0u8, |class, (value, (mean, deviation))| {
            4 * class + CUTS.iter().map(|cut| u8::from(value - mean > cut * deviation)).sum::<u8>()
        })
    };
    let of_cells = colours.iter().map(|colour| Some(class(colour))).collect();
    Annotations { columns, rows, classes: 64, of_cells }
}

/// Labels each cell by k-means on the word frequencies of the cell and its eight neighbours, with at most `k` labels.
///
/// `size` is the width and the height of the image in pixels.
pub(crate) fn pooled_word_labels(
    words: &[Word],
    vocabulary: u32,
    size: (u32, u32),
    cell_px: f32,
    k: usize,
    seed: u64,
) -> LabelGrid {
    let cells = |length: u32| (length as f32 / cell_px).ceil().max(1.0) as usize;
    let (columns, rows, width) = (cells(size.0), cells(size.1), vocabulary as usize);
    let mut own = vec![0.0f32; columns * rows * width];
    for word in words {
        let (x, y) = ((word.u / cell_px) as usize, (word.v / cell_px) as usize);
        if x < columns && y < rows && word.id < vocabulary {
            own[(y * columns + x) * width + word.id as usize] += 1.0;
        }
    }
    let mut pooled = vec![0.0f32; own.len()];
    for (cell, pool) in pooled.chunks_exact_mut(width).enumerate() {
        let (x, y) = (cell % columns, cell / columns);
        for row in y.saturating_sub(1)..(y + 2).min(rows) {
            for column in x.saturating_sub(1)..(x + 2).min(columns) {
                let other = &own[(row * columns + column) * width..][..width];
                pool.iter_mut().zip(other).for_each(|(sum, value)| *sum += value);
            }
        }
        let total: f32 = pool.iter().sum();
        pool.iter_mut().for_each(|value| *value /= total.max(1.0));
    }
    let labels = k_means(&pooled, width, k, seed);
    LabelGrid { columns, rows, labels: labels.into_iter().map(Some).collect() }
}

/// The mean CIE Lab colour of each cell, without a tone stretch: columns, rows, and the colours row
/// by row from the top.
fn cell_lab(image: &RgbImage, cell_px: f32) -> (usize, usize, Vec<[f32; 3]>) {
    let cells = |length: u32| (length as f32 / cell_px).ceil().max(1.0) as usize;
    let (columns, rows) = (cells(image.width()), cells(image.height()));
    let place = |at: u32, count: usize| ((at as f32 / cell_px) as usize).min(count - 1);
    let across: Vec<usize> = (0..image.width()).map(|x| place(x, columns)).collect();
    let mut sums = vec![[0u64; 4]; columns * rows];
    for (y, row) in image.rows().enumerate() {
        let cells = &mut sums[place(y as u32, rows) * columns..][..columns];
        for (pixel, &column) in row.zip(&across) {
            let [red, green, blue] = pixel.0.map(u64::from);
            let sum = &mut cells[column];
            *sum = [sum[0] + red, sum[1] + green, sum[2] + blue, sum[3] + 1];
        }
    }
    let share = |sum: &[u64; 4]| [0, 1, 2].map(|i| sum[i] as f32 / (sum[3].max(1) as f32 * 255.0));
    (columns, rows, sums.iter().map(|sum| cie_lab(share(sum))).collect())
}

const ROUNDS: usize = 60;
const STARTS: usize = 4;

/// The cluster of each point, the best of four starts. Points are rows of `width` numbers; there
/// are at most `k` clusters.
pub(crate) fn k_means(points: &[f32], width: usize, k: usize, seed: u64) -> Vec<u32> {
    let mut rng = CounterRng::new(seed);
    let runs = (0..STARTS).map(|_| one_start(points, width, k, &mut rng));
    runs.min_by(|a, b| a.cost.total_cmp(&b.cost)).map(|best| best.owners).unwrap_or_default()
}

/// The centres of at most `k` clusters from one start, each a row of `width` numbers.
pub(crate) fn cluster_centres(points: &[f32], width: usize, k: usize, seed: u64) -> Vec<f32> {
    one_start(points, width, k, &mut CounterRng::new(seed)).centres
}

struct Clusters {
    owners: Vec<u32>,
    cost: f64,
    centres: Vec<f32>,
}

fn one_start(points: &[f32], width: usize, k: usize, rng: &mut CounterRng) -> Clusters {
    let mut centres = seeds(points, width, k, rng);
    let mut owners = vec![u32::MAX; points.len() / width];
    let mut cost = 0.0;
    for _ in 0..ROUNDS {
        let mut moved = false;
        cost = 0.0;
        for (point, owner) in points.chunks_exact(width).zip(&mut owners) {
            let (nearest, away) = nearest(point, &centres, width);
            moved |= std::mem::replace(owner, nearest) != nearest;
            cost += f64::from(away);
        }
        if !moved {
            break;
        }
        centres = means(points, width, &owners, &centres);
    }
    Clusters { owners, cost, centres }
}

fn seeds(points: &[f32], width: usize, k: usize, rng: &mut CounterRng) -> Vec<f32> {
    let count = points.len() / width;
    let mut centres = Vec::new();
    let mut away = vec![f32::INFINITY; count];
    let mut next = rng.below(count);
    while count > 0 && centres.len() < k * width {
        let centre = &points[next * width..][..width];
        centres.extend_from_slice(centre);
        for (point, away) in points.chunks_exact(width).zip(&mut away) {
            *away = away.min(distance(point, centre));
        }
        let mut aim = rng.unit() * away.iter().map(|&d| f64::from(d)).sum::<f64>();
        let passed = away.iter().position(|&d| {
            aim -= f64::from(d);
            aim < 0.0
        });
        let Some(passed) = passed else { break };
        next = passed;
    }
    centres
}

fn nearest(point: &[f32], centres: &[f32], width: usize) -> (u32, f32) {
    let mut best = (0, f32::INFINITY);
    for (index, centre) in centres.chunks_exact(width).enumerate() {
        let away = distance(point, centre);
        if away < best.1 {
            best = (index as u32, away);
        }
    }
    best
}

fn means(points: &[f32], width: usize, owners: &[u32], old: &[f32]) -> Vec<f32> {
    let mut sums = vec![0.0f32; old.len()];
    let mut sizes = vec![0u32; old.len() / width];
    for (point, &owner) in points.chunks_exact(width).zip(owners) {
        sizes[owner as usize] += 1;
        let sum = &mut sums[owner as usize * width..][..width];
        sum.iter_mut().zip(point).for_each(|(sum, value)| *sum += value);
    }
    for (index, &size) in sizes.iter().enumerate() {
        let span = index * width..(index + 1) * width;
        if size == 0 {
            sums[span.clone()].copy_from_slice(&old[span]);
        } else {
            sums[span].iter_mut().for_each(|value| *value /= size as f32);
        }
    }
    sums
}

fn distance(a: &[f32], b: &[f32]) -> f32 {
    let mut lanes = [0.0f32; 8];
    let (a8, a_rest) = a.as_chunks::<8>();
    let (b8, b_rest) = b.as_chunks::<8>();
    for (a, b) in a8.iter().zip(b8) {
        for lane in 0..8 {
            lanes[lane] += (a[lane] - b[lane]) * (a[lane] - b[lane]);
        }
    }
    lanes.iter().sum::<f32>() + a_rest.iter().zip(b_rest).map(|(a, b)| (a - b) * (a - b)).sum::<f32>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn separate_groups_get_separate_clusters() {
        let points: Vec<f32> = (0..300).flat_map(|i| [(i % 3) as f32 * 10.0, (i / 3) as f32 * 0.01]).collect();
        let owners = k_means(&points, 2, 3, 1);
        assert!(owners.chunks(3).all(|c| c == &owners[..3]));
        assert!(owners[0] != owners[1] && owners[1] != owners[2] && owners[0] != owners[2]);
    }

    #[test]
    fn fewer_points_than_clusters_are_accepted() {
        assert_eq!(k_means(&[1.0, 1.0], 1, 5, 1), [0, 0]);
        assert!(k_means(&[], 3, 5, 1).is_empty());
    }
}
