//! What a scene model has to beat: clusters of colour, clusters of words.

use image::RgbImage;

use super::cluster::k_means;
use super::{Annotations, LabelGrid};
use crate::words::{Word, cell_lab};

/// k-means on the mean CIE Lab colour of each cell.
pub fn mean_lab_labels(image: &RgbImage, cell_px: f32, k: usize, seed: u64) -> LabelGrid {
    let (columns, rows, colours) = cell_lab(image, cell_px);
    let labels = k_means(colours.as_flattened(), 3, k, seed);
    LabelGrid { columns, rows, labels: labels.into_iter().map(Some).collect() }
}

/// The colours of an image as if they were annotations: each of L, a and b of a cell's mean in four levels of equal
/// share under a normal distribution.
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

/// k-means on the word shares of each cell and its eight neighbours together.
pub fn pooled_word_labels(
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
