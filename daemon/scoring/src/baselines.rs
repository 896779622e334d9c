//! The baselines of the scene model: k-means on colours, and k-means on words.

use image::RgbImage;

use scene_model::words::{Word, cie_lab};

use crate::annotations::Annotations;
use crate::k_means::k_means;
use crate::label_grid::LabelGrid;

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
