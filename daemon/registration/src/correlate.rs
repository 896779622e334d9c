//! Masked normalised cross-correlation: by how many pixels one plane is shifted against another one.
//!
//! The planes are high-passed, so their means over an overlap are taken as 0 (Padfield 2012 without the means).
//!
//! Only this module names the transforms: they are generic code, which would be compiled again, for half a minute of the processor, in each
//! crate that names them.

use crate::plane::Plane;
pub(crate) use rustfft::num_complex::Complex32;
use rustfft::{Fft, FftPlanner};
use std::sync::Arc;

/// The second peak is at least so far from the first one, pixels.
const PEAK_RADIUS_PX: f32 = 4.0;

/// The best shift of a plane against a canvas.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Peak {
    /// Whole pixels to the right and down.
    pub(crate) shift_px: [i32; 2],
    /// The place of the peak between pixels, from the whole ones, by the parabolas through its neighbours.
    pub(crate) offset_px: [f32; 2],
    /// Normalised correlation, -1 to 1.
    pub(crate) correlation: f32,
    /// The correlation times the root of the overlapping pixels, less that of the second peak.
    pub(crate) confidence: f32,
    /// The share of the plane that overlaps.
    pub(crate) overlap: f32,
}

/// Values on a canvas around a plane, and whether they are known.
pub(crate) struct Canvas {
    values: Vec<Complex32>,
    mask: Vec<Complex32>,
}

/// A plane that is compared with several canvases. The canvas has a margin on each side for the shifts.
pub(crate) struct Correlator {
    fft: PlaneFft,
    columns: usize,
    rows: usize,
    plane: Spectra,
}

/// Spectra of the values, of their squares and of the mask.
struct Spectra {
    values: Vec<Complex32>,
    squares: Vec<Complex32>,
    mask: Vec<Complex32>,
}

impl Correlator {
    /// Prepares a plane for shifts up to at least `margin_px` in each direction.
    pub(crate) fn new(plane: &Plane, margin_px: usize) -> Self {
        let size = |pixels: usize| (pixels + 2 * margin_px).next_multiple_of(16);
        let fft = PlaneFft::new(size(plane.columns()), size(plane.rows()));
        let empty = Spectra { values: Vec::new(), squares: Vec::new(), mask: Vec::new() };
        let mut correlator = Self { fft, columns: plane.columns(), rows: plane.rows(), plane: empty };
        let [left, top] = correlator.margins();
        let mut canvas = correlator.canvas(|_, _| None);
        for row in 0..plane.rows() {
            let first = (row + top) * correlator.fft.columns() + left;
            for (column, &value) in plane.row(row).iter().enumerate() {
                canvas.values[first + column] = Complex32::new(value, value * value);
                canvas.mask[first + column].re = 1.0;
            }
        }
        correlator.plane = correlator.spectra(canvas);
        correlator
    }

    /// Pixels of the canvas to the left and above the plane.
    pub(crate) fn margins(&self) -> [usize; 2] {
        [(self.fft.columns() - self.columns) / 2, (self.fft.rows() - self.rows) / 2]
    }

    /// A canvas whose pixels are given by their column and row in the plane, which may be negative.
    pub(crate) fn canvas(&self, mut value: impl FnMut(i32, i32) -> Option<f32>) -> Canvas {
        let (columns, rows) = (self.fft.columns(), self.fft.rows());
        let [left, top] = self.margins();
        let zero = Complex32::default();
        let mut canvas = Canvas { values: vec![zero; columns * rows], mask: vec![zero; columns * rows] };
        for row in 0..rows {
            for column in 0..columns {
                if let Some(value) = value(column as i32 - left as i32, row as i32 - top as i32) {
                    canvas.values[row * columns + column] = Complex32::new(value, value * value);
                    canvas.mask[row * columns + column].re = 1.0;
                }
            }
        }
        canvas
    }

    fn spectra(&mut self, mut canvas: Canvas) -> Spectra {
        self.fft.transform(&mut canvas.values);
        self.fft.transform(&mut canvas.mask);
        let [values, squares] = self.fft.separated(&canvas.values);
        Spectra { values, squares, mask: canvas.mask }
    }

    /// The best shift among those up to `window_px` in length where at least the share `min_overlap` of the plane
    /// overlaps. All shifts count for the confidence.
    pub(crate) fn peak(&mut self, canvas: Canvas, window_px: f32, min_overlap: f32) -> Option<Peak> {
        let other = self.spectra(canvas);
        let (sums, counts) = self.correlations(&other);
        let [left, top] = self.margins().map(|margin| margin as i32);
        let (columns, rows) = (self.fft.columns() as i32, self.fft.rows() as i32);
        let all = (self.columns * self.rows) as f32;
        let norm = 1.0 / (columns * rows) as f32;
        let length = |x: i32, y: i32| (x as f32).hypot(y as f32);
        let side = (2 * left + 1) as usize;
        // The strength of each shift: its correlation times the root of the overlapping pixels, in units of its standard
        // deviation by chance. Too small overlaps have none.
        let mut surface = vec![f32::NEG_INFINITY; side * (2 * top + 1) as usize];
        let mut best: Option<([i32; 2], f32, f32)> = None;
        for (i, value) in surface.iter_mut().enumerate() {
            let (x, y) = ((i % side) as i32 - left, (i / side) as i32 - top);
            let at = (y.rem_euclid(rows) * columns + x.rem_euclid(columns)) as usize;
            let count = counts[at].im * norm;
            if count < min_overlap * all {
                continue;
            }
            let energy = (sums[at].im * norm).max(0.0) * (counts[at].re * norm).max(0.0);
            let correlation = if energy > 1.0 { sums[at].re * norm / energy.sqrt() } else { 0.0 };
            *value = correlation * count.sqrt();
            if length(x, y) <= window_px && best.is_none_or(|(_, most, _)| *value > most) {
                best = Some(([x, y], *value, count));
            }
        }
        let (best, strength, count) = best?;
        let is_other = |&i: &usize| {
            let (x, y) = ((i % side) as i32 - left, (i / side) as i32 - top);
            length(x - best[0], y - best[1]) > PEAK_RADIUS_PX
        };
        let second = (0..surface.len()).filter(is_other).map(|i| surface[i]).fold(0.0, f32::max);
        let correlation = strength / count.sqrt();
        let place = (best[1] + top) as usize * side + (best[0] + left) as usize;
        let between = |step: usize| {
            let beside =
                |at: Option<usize>| at.and_then(|at| surface.get(at)).copied().filter(|value| value.is_finite());
            let Some((before, after)) = beside(place.checked_sub(step)).zip(beside(Some(place + step))) else {
                return 0.0;
            };
            let bend = 2.0 * strength - before - after;
            if bend > 0.0 { ((after - before) / (2.0 * bend)).clamp(-0.5, 0.5) } else { 0.0 }
        };
        let offset_px = [between(1), between(side)];
        Some(Peak { offset_px, shift_px: best, correlation, confidence: strength - second, overlap: count / all })
    }

    /// For each shift: the sum of products and the energy of the plane; the energy of the canvas and the overlap.
    fn correlations(&mut self, other: &Spectra) -> (Vec<Complex32>, Vec<Complex32>) {
        let plane = &self.plane;
        let both = |a: Complex32, b: Complex32| a + Complex32::new(-b.im, b.re);
        let spectrum = |i: usize| {
            let (a, mask) = (plane.values[i].conj(), plane.mask[i].conj());
            let sums = both(a * other.values[i], plane.squares[i].conj() * other.mask[i]);
            let counts = both(mask * other.squares[i], mask * other.mask[i]);
            (sums, counts)
        };
        let (mut sums, mut counts): (Vec<_>, Vec<_>) = (0..other.mask.len()).map(spectrum).unzip();
        self.fft.restore(&mut sums);
        self.fft.restore(&mut counts);
        (sums, counts)
    }
}

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

    fn noise(x: i32, y: i32) -> f32 {
        let mut bits = (x as u32).wrapping_mul(0x9E37_79B1) ^ (y as u32).wrapping_mul(0x85EB_CA77);
        bits = (bits ^ (bits >> 15)).wrapping_mul(0x2C1B_3C6D);
        ((bits >> 12) & 255) as f32 / 128.0 - 1.0
    }

    fn plane(columns: usize, rows: usize, value: impl Fn(i32, i32) -> f32) -> Plane {
        let pixel = |i: usize| value((i % columns) as i32, (i / columns) as i32);
        Plane::from_values(columns, (0..columns * rows).map(pixel).collect()).unwrap()
    }

    #[test]
    fn a_shift_is_found_in_a_partly_known_canvas() {
        let mut correlator = Correlator::new(&plane(80, 60, noise), 20);
        for (dx, dy) in [(0, 0), (7, -4), (-15, 12)] {
            let canvas = correlator.canvas(|x, y| (x > 55).then(|| noise(x - dx, y - dy)));
            let peak = correlator.peak(canvas, 25.0, 0.05).unwrap();
            assert_eq!(peak.shift_px, [dx, dy]);
            assert!(peak.offset_px.iter().all(|offset| offset.abs() < 0.1), "{peak:?}");
            assert!(peak.correlation > 0.99 && peak.confidence > 15.0 && peak.overlap < 0.45, "{peak:?}");
        }
    }

    #[test]
    fn another_floor_has_no_confidence() {
        let mut correlator = Correlator::new(&plane(80, 60, noise), 20);
        let canvas = correlator.canvas(|x, y| Some(noise(x + 900, y + 700)));
        let peak = correlator.peak(canvas, 25.0, 0.1).unwrap();
        assert!(peak.confidence < 4.0, "{peak:?}");
    }

    #[test]
    fn ripples_have_no_confidence() {
        let ripples = |x: i32, _: i32| (x as f32 / 7.0 * std::f32::consts::TAU).sin();
        let mut correlator = Correlator::new(&plane(80, 60, ripples), 20);
        let canvas = correlator.canvas(|x, y| Some(ripples(x - 3, y)));
        assert!(correlator.peak(canvas, 25.0, 0.1).unwrap().confidence < 1.0);
    }

    #[test]
    fn bars_along_which_a_plane_slides_have_no_confidence() {
        // Irregular bars: the shift across them is certain, the one along them is not.
        let bars = |x: i32, _: i32| noise(x, 0);
        let mut correlator = Correlator::new(&plane(80, 60, bars), 20);
        let canvas = correlator.canvas(|x, y| Some(bars(x - 3, y)));
        assert!(correlator.peak(canvas, 25.0, 0.1).unwrap().confidence < 4.0);
    }

    #[test]
    fn an_empty_canvas_has_no_peak() {
        let mut correlator = Correlator::new(&plane(40, 40, noise), 8);
        let canvas = correlator.canvas(|_, _| None);
        assert_eq!(correlator.peak(canvas, 8.0, 0.1), None);
    }

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
