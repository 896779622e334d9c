//! Visual words: colour, context, spread, texture and binary features on regular grids of a frame.
//!
//! The vocabularies need no training. Ids are consecutive in the order above: 512 colour, 864 context, 216 spread, 216
//! texture and 64 binary words. Features are compared with a tone stretch and with means and deviations that come from
//! the first frames ([`WordConfig::warm_up_frames`]) and then stay frozen, so that a word keeps its meaning through a
//! mission. A mosaic is a single frame, hence compared with itself.

mod binary;
mod colour;
mod colour_field;
mod config;
mod context;
mod extractor;
mod grey_plane;
mod grid;
mod moments;
mod stretch;
mod texture;
mod word;

use image::RgbImage;

pub use colour::LEVELS as COLOUR_LEVELS;
pub use config::WordConfig;
pub use extractor::{Measures, WordExtractor};
pub use word::Word;

/// Mean CIE Lab colour of each cell, unstretched: cells across, cells down, colours row by row from the top left
/// corner.
pub(crate) fn cell_lab(image: &RgbImage, cell_px: f32) -> (usize, usize, Vec<[f32; 3]>) {
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
    (columns, rows, sums.iter().map(|sum| colour_field::lab(share(sum))).collect())
}
