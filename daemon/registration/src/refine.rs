//! The similarity between two thumbnails to a fraction of a pixel, by Gauss-Newton on the brightness (Lucas and Kanade
//! 1981; in the inverse compositional form of Baker and Matthews 2004).

use crate::plane::Plane;
use crate::similarity::Similarity;
use nalgebra::{Matrix4, Vector2, Vector4};
use std::ops::Range;

/// Residuals beyond so many contrasts count less: snow, animals, shadows.
const HUBER: f32 = 0.7;
/// Brightness errors of neighbouring pixels are alike, so that the errors of a fit are larger than for noise.
const CORRELATED: f64 = 12.0;

/// A plane with its gradients, to which others are fitted. Coordinates are pixels to the right and ahead of its middle.
pub(crate) struct Reference<'a> {
    plane: &'a Plane,
    gradients: [Plane; 2],
}

/// A fitted similarity, in pixels of both planes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Fit {
    /// From the reference to the other plane.
    pub(crate) similarity: Similarity,
    /// Normalised correlation over the overlap.
    pub(crate) correlation: f64,
    /// Number of pixels in the overlap.
    pub(crate) pixels: f64,
    /// The middle of the overlap in the reference, weighted by its texture. The errors of turn and shift are nearly
    /// independent there.
    pub(crate) anchor: Vector2<f64>,
    /// Standard deviations of turn and log scale, and of the shift at the anchor in pixels.
    pub(crate) spread_sigma: f64,
    pub(crate) shift_sigma: f64,
}

/// Sums over the pixels of the overlap of two planes.
#[derive(Default)]
struct Sums {
    h: [f64; 10],
    right: [f64; 4],
    /// Of a², b² and ab.
    products: [f64; 3],
    /// Of the squared gradient, and of it times the coordinates and their square.
    texture: [f64; 4],
    squares: f64,
    pixels: f64,
}

impl<'a> Reference<'a> {
    pub(crate) fn new(plane: &'a Plane) -> Self {
        Self { plane, gradients: plane.gradients() }
    }

    pub(crate) fn columns(&self) -> usize {
        self.plane.columns()
    }

    pub(crate) fn rows(&self) -> usize {
        self.plane.rows()
    }

    /// Calls `see` with the place, the value and the gradient of pixels of a row.
    pub(crate) fn each_in_row(&self, row: usize, columns: Range<usize>, mut see: impl FnMut([f32; 2], f32, [f32; 2])) {
        let (half_x, half_y) = (self.columns() as f32 / 2.0 - 0.5, self.rows() as f32 / 2.0 - 0.5);
        let (line, across, down) = (self.plane.row(row), self.gradients[0].row(row), self.gradients[1].row(row));
        for column in columns {
            see([column as f32 - half_x, half_y - row as f32], line[column], [across[column], -down[column]]);
        }
    }

    /// Fits `other`, starting at `start`. `tightness` is the inverse variance of the turn and of the log scale before.
    /// `None` if the overlap is too small or has no texture.
    pub(crate) fn fit(&self, other: &Plane, start: &Similarity, tightness: f64, steps: usize) -> Option<Fit> {
        let mut now = *start;
        let mut gain = 1.0;
        let reach = 0.3 * (self.plane.columns() as f64).hypot(self.plane.rows() as f64);
        for step in 0..=steps {
            let sums = self.sums(other, &now, gain);
            if sums.pixels < 64.0 || sums.texture[0] < 1e-3 {
                return None;
            }
            let noise = (sums.squares / sums.pixels).max(1e-4);
            if step == steps {
                return Some(fit_of(now, &sums, noise));
            }
            gain = (sums.products[2] / sums.products[1].max(1e-6)).clamp(0.5, 2.0) as f32;
            let off = start.inverse().after(&now);
            let spread = [off.scale().ln(), off.turn_rad()];
            let change = solve(&sums, CORRELATED * noise * tightness, spread)?;
            let inverse = Similarity::new(
                change[1].atan2(1.0 + change[0]),
                (1.0 + change[0]).hypot(change[1]),
                Vector2::new(change[2], change[3]),
            );
            now = now.after(&inverse.inverse());
            if !now.is_finite() {
                return None;
            }
            if change[2].hypot(change[3]) + reach * change[0].hypot(change[1]) < 2e-3 {
                let sums = self.sums(other, &now, gain);
                let noise = (sums.squares / sums.pixels.max(1.0)).max(1e-4);
                return (sums.pixels >= 64.0).then(|| fit_of(now, &sums, noise));
            }
        }
        None
    }

    fn sums(&self, other: &Plane, now: &Similarity, gain: f32) -> Sums {
        let mut sums = Sums::default();
        let (columns, rows) = (self.plane.columns(), self.plane.rows());
        let (half_x, half_y) = (columns as f32 / 2.0 - 0.5, rows as f32 / 2.0 - 0.5);
        let (mid_x, mid_y) = (other.columns() as f32 / 2.0 - 0.5, other.rows() as f32 / 2.0 - 0.5);
        let (turned, shift) = (now.turned(), now.shift());
        let (cos, sin) = (turned.x as f32, turned.y as f32);
        for row in 1..rows - 1 {
            let y = half_y - row as f32;
            let (line, across, down) = (self.plane.row(row), self.gradients[0].row(row), self.gradients[1].row(row));
            let (from_x, from_y) = (mid_x - sin * y + shift.x as f32, mid_y - cos * y - shift.y as f32);
            let mut part = RowSums::default();
            for column in 1..columns - 1 {
                let x = column as f32 - half_x;
                if let Some(value) = other.at(from_x + cos * x, from_y - sin * x) {
                    part.add([x, y], line[column], value, gain, [across[column], -down[column]]);
                }
            }
            sums.add(&part);
        }
        sums
    }
}

/// The sums of a row, in single precision.
#[derive(Default)]
struct RowSums {
    h: [f32; 10],
    right: [f32; 4],
    products: [f32; 3],
    texture: [f32; 4],
    squares: f32,
    pixels: f32,
}

impl RowSums {
    #[inline]
    fn add(&mut self, [x, y]: [f32; 2], a: f32, b: f32, gain: f32, [gx, gy]: [f32; 2]) {
        let off = gain * b - a;
        let weight = if off.abs() > HUBER { HUBER / off.abs() } else { 1.0 };
        let slope = [gx * x + gy * y, gy * x - gx * y, gx, gy];
        let weighted = slope.map(|s| weight * s);
        let pairs = (0..4).flat_map(|i| (i..4).map(move |j| (i, j)));
        self.h.iter_mut().zip(pairs).for_each(|(sum, (i, j))| *sum += weighted[i] * slope[j]);
        self.right.iter_mut().zip(weighted).for_each(|(sum, slope)| *sum += slope * off);
        self.products[0] += a * a;
        self.products[1] += b * b;
        self.products[2] += a * b;
        let texture = gx * gx + gy * gy;
        self.texture[0] += texture;
        self.texture[1] += texture * x;
        self.texture[2] += texture * y;
        self.texture[3] += texture * (x * x + y * y);
        self.squares += weight * off * off;
        self.pixels += 1.0;
    }
}

impl Sums {
    fn add(&mut self, part: &RowSums) {
        fn add<const N: usize>(sums: &mut [f64; N], parts: &[f32; N]) {
            sums.iter_mut().zip(parts).for_each(|(sum, part)| *sum += f64::from(*part));
        }
        add(&mut self.h, &part.h);
        add(&mut self.right, &part.right);
        add(&mut self.products, &part.products);
        add(&mut self.texture, &part.texture);
        self.squares += f64::from(part.squares);
        self.pixels += f64::from(part.pixels);
    }
}

/// The change of scale, turn and shift. `tightness` pulls scale and turn, which are `spread` off, back to the start.
fn solve(sums: &Sums, tightness: f64, spread: [f64; 2]) -> Option<Vector4<f64>> {
    let h = &sums.h;
    let mut matrix = Matrix4::new(
        h[0], h[1], h[2], h[3], //
        h[1], h[4], h[5], h[6], //
        h[2], h[5], h[7], h[8], //
        h[3], h[6], h[8], h[9],
    );
    let mut right = Vector4::from(sums.right);
    for i in 0..2 {
        matrix[(i, i)] += tightness;
        // The change is undone from the fit, so a fit that is off by `spread` asks for a change of the same sign.
        right[i] += tightness * spread[i];
    }
    matrix.cholesky().map(|factors| factors.solve(&right))
}

fn fit_of(similarity: Similarity, sums: &Sums, noise: f64) -> Fit {
    let [weight, x, y, square] = sums.texture;
    let anchor = Vector2::new(x, y) / weight.max(1e-9);
    // Each direction has half of the squared gradient.
    let around = (square - weight * anchor.norm_squared()).max(1e-9);
    let variance = CORRELATED * noise;
    Fit {
        similarity,
        correlation: sums.products[2] / (sums.products[0] * sums.products[1]).sqrt().max(1e-9),
        pixels: sums.pixels,
        anchor,
        spread_sigma: (2.0 * variance / around).sqrt(),
        shift_sigma: (2.0 * variance / weight.max(1e-9)).sqrt(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A smooth floor, at a point in pixels to the right and ahead.
    fn floor(at: Vector2<f64>) -> f32 {
        let wave = |x: f64, y: f64| (at.x * x + at.y * y).sin();
        (wave(0.31, 0.11) + wave(-0.17, 0.23) + wave(0.05, -0.41) + wave(0.52, 0.3)) as f32 / 2.0
    }

    fn seen(from: &Similarity, columns: usize, rows: usize) -> Plane {
        let pixel = |i: usize| {
            let right = (i % columns) as f64 + 0.5 - columns as f64 / 2.0;
            let ahead = rows as f64 / 2.0 - (i / columns) as f64 - 0.5;
            floor(from.apply(Vector2::new(right, ahead)))
        };
        Plane::from_values(columns, (0..columns * rows).map(pixel).collect()).unwrap()
    }

    #[test]
    fn turn_scale_and_shift_are_recovered() {
        let (first, second) =
            (Similarity::new(0.2, 1.0, Vector2::new(3.0, 4.0)), Similarity::new(0.25, 1.03, Vector2::new(9.0, -2.0)));
        let truth = second.inverse().after(&first);
        let (a, b) = (seen(&first, 90, 70), seen(&second, 80, 64));
        let start =
            Similarity::new(truth.turn_rad() + 0.015, truth.scale() * 0.99, truth.shift() + Vector2::new(0.8, -0.6));
        let fit = Reference::new(&a).fit(&b, &start, 0.0, 12).unwrap();
        assert!((fit.similarity.turn_rad() - truth.turn_rad()).abs() < 4e-4, "{fit:?} {truth:?}");
        assert!((fit.similarity.scale() - truth.scale()).abs() < 4e-4);
        assert!((fit.similarity.apply(fit.anchor) - truth.apply(fit.anchor)).norm() < 0.02);
        assert!(fit.correlation > 0.99 && fit.shift_sigma < 0.1 && fit.spread_sigma < 0.003, "{fit:?}");
    }

    #[test]
    fn a_tight_turn_stays_where_it_starts() {
        let first = Similarity::new(0.0, 1.0, Vector2::zeros());
        let (a, b) = (seen(&first, 90, 70), seen(&Similarity::new(0.02, 1.0, Vector2::zeros()), 90, 70));
        let loose = Reference::new(&a).fit(&b, &first, 0.0, 12).unwrap();
        let tight = Reference::new(&a).fit(&b, &first, 1e12, 12).unwrap();
        assert!((loose.similarity.turn_rad() + 0.02).abs() < 5e-4 && tight.similarity.turn_rad().abs() < 1e-4);
    }

    #[test]
    fn planes_without_overlap_have_no_fit() {
        let a = seen(&Similarity::new(0.0, 1.0, Vector2::zeros()), 90, 70);
        let far = Similarity::new(0.0, 1.0, Vector2::new(400.0, 0.0));
        assert_eq!(Reference::new(&a).fit(&a, &far, 0.0, 8), None);
    }
}
