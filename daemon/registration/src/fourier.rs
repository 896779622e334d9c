//! Fourier transforms of planes.
//!
//! Only this module names the transforms: they are generic code, which would be compiled again, for half a minute of the processor, in each
//! crate that names them.

pub(crate) use rustfft::num_complex::Complex32;
use rustfft::{Fft, FftPlanner};
use std::sync::Arc;

/// Transforms of planes of one size. Spectra have columns as rows, which saves two transpositions.
pub(crate) struct PlaneFft {
    columns: usize,
    rows: usize,
    /// Along rows and along columns.
    forward: [Arc<dyn Fft<f32>>; 2],
    inverse: [Arc<dyn Fft<f32>>; 2],
    scratch: Vec<Complex32>,
    turned: Vec<Complex32>,
}

impl PlaneFft {
    /// Transforms of planes of `columns` x `rows`, at least one each.
    pub(crate) fn new(columns: usize, rows: usize) -> Self {
        let mut planner = FftPlanner::new();
        let forward = [planner.plan_fft_forward(columns), planner.plan_fft_forward(rows)];
        let inverse = [planner.plan_fft_inverse(columns), planner.plan_fft_inverse(rows)];
        let scratch = forward.iter().chain(&inverse).map(|fft| fft.get_inplace_scratch_len()).max().unwrap_or(0);
        let zero = Complex32::default();
        Self { columns, rows, forward, inverse, scratch: vec![zero; scratch], turned: vec![zero; columns * rows] }
    }

    pub(crate) fn columns(&self) -> usize {
        self.columns
    }

    pub(crate) fn rows(&self) -> usize {
        self.rows
    }

    /// Replaces a plane, row by row, by its spectrum. Panics if it has another size.
    pub(crate) fn transform(&mut self, plane: &mut [Complex32]) {
        self.forward[0].process_with_scratch(plane, &mut self.scratch);
        transpose(plane, &mut self.turned, self.columns);
        self.forward[1].process_with_scratch(&mut self.turned, &mut self.scratch);
        plane.copy_from_slice(&self.turned);
    }

    /// Replaces a spectrum by its plane, times the number of pixels. Panics if it has another size.
    pub(crate) fn restore(&mut self, spectrum: &mut [Complex32]) {
        self.inverse[1].process_with_scratch(spectrum, &mut self.scratch);
        transpose(spectrum, &mut self.turned, self.rows);
        self.inverse[0].process_with_scratch(&mut self.turned, &mut self.scratch);
        spectrum.copy_from_slice(&self.turned);
    }

    /// The spectra of the real and the imaginary part of a plane, from the spectrum of the plane.
    pub(crate) fn separated(&self, spectrum: &[Complex32]) -> [Vec<Complex32>; 2] {
        let (columns, rows) = (self.columns, self.rows);
        let mut parts = [Vec::with_capacity(spectrum.len()), Vec::with_capacity(spectrum.len())];
        for u in 0..columns {
            let opposite = ((columns - u) % columns) * rows;
            for v in 0..rows {
                let (a, b) = (spectrum[u * rows + v], spectrum[opposite + (rows - v) % rows].conj());
                let (sum, difference) = ((a + b) * 0.5, (a - b) * 0.5);
                parts[0].push(sum);
                parts[1].push(Complex32::new(difference.im, -difference.re));
            }
        }
        parts
    }
}

fn transpose(from: &[Complex32], to: &mut [Complex32], columns: usize) {
    let rows = from.len() / columns;
    // Blocks of 16 x 16 stay in the cache.
    for top in (0..rows).step_by(16) {
        for left in (0..columns).step_by(16) {
            for row in top..(top + 16).min(rows) {
                for column in left..(left + 16).min(columns) {
                    to[column * rows + row] = from[row * columns + column];
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_real_planes_share_a_transform() {
        let mut fft = PlaneFft::new(48, 32);
        let value = |i: usize, k: usize| ((i * k + i / 5) % 17) as f32 - 8.0;
        let both: Vec<Complex32> = (0..48 * 32).map(|i| Complex32::new(value(i, 7), value(i, 3))).collect();
        let mut spectrum = both.clone();
        fft.transform(&mut spectrum);
        for (part, k) in fft.separated(&spectrum).iter_mut().zip([7, 3]) {
            fft.restore(part);
            for (i, number) in part.iter().enumerate() {
                assert!(
                    (number.re / (48.0 * 32.0) - value(i, k)).abs() < 1e-3 && number.im.abs() < 1.0,
                    "{i}: {number}"
                );
            }
        }
    }
}
