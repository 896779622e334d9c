//! Matches of single tiles of a frame, which relief shifts one by one.
//!
//! A point at height z above the mean floor is nearer to a camera at the altitude H. Where the camera moved by b, the
//! point moves by b (1 + z / H) in the frame: parallax lies along b, and its errors do not reach across b.

use crate::plane::Plane;
use crate::refine::Reference;
use crate::similarity::Similarity;
use nalgebra::{Matrix2, Vector2};

/// Columns and rows of tiles in a frame.
const COLUMNS: usize = 6;
const ROWS: usize = 5;
/// Least share of a tile's pixels that overlap.
const MIN_SHARE: f32 = 0.5;
/// Least correlation of a tile.
const MIN_CORRELATION: f64 = 0.5;
const STEPS: usize = 5;
/// Brightness errors of neighbouring pixels are alike.
const CORRELATED: f64 = 6.0;

/// A match of a tile, in pixels to the right and ahead of the middles of both planes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct TileMatch {
    pub(crate) new: Vector2<f64>,
    pub(crate) old: Vector2<f64>,
    /// Standard deviation in each direction.
    pub(crate) sigma: f64,
}

/// The pixels of a tile, with their places and gradients to the right and ahead.
struct Tile {
    pixels: Vec<([f32; 2], f32, [f32; 2])>,
    middle: Vector2<f64>,
}

/// The tiles of `new` that match `old` within `reach` pixels of a similarity.
pub(crate) fn match_tiles(new: &Reference, old: &Plane, similarity: &Similarity, reach: f64) -> Vec<TileMatch> {
    let tiles = (0..COLUMNS * ROWS).filter_map(|i| Tile::new(new, i % COLUMNS, i / COLUMNS));
    tiles.filter_map(|tile| tile.matched(old, similarity, reach)).collect()
}

impl Tile {
    fn new(frame: &Reference, column: usize, row: usize) -> Option<Self> {
        let (width, height) = (frame.columns(), frame.rows());
        let span = |i: usize, count: usize, pixels: usize| {
            (i * pixels / count).max(1)..((i + 1) * pixels / count).min(pixels.saturating_sub(1))
        };
        let (columns, rows) = (span(column, COLUMNS, width), span(row, ROWS, height));
        let mut pixels = Vec::with_capacity(columns.len() * rows.len());
        for row in rows {
            frame.each_in_row(row, columns.clone(), |at, value, slope| pixels.push((at, value, slope)));
        }
        let texture = |slope: [f32; 2]| f64::from(slope[0] * slope[0] + slope[1] * slope[1]);
        let total: f64 = pixels.iter().map(|(.., slope)| texture(*slope)).sum();
        let sum: Vector2<f64> =
            pixels.iter().map(|(at, _, slope)| Vector2::new(at[0].into(), at[1].into()) * texture(*slope)).sum();
        (total > 1e-3).then(|| Self { pixels, middle: sum / total })
    }

    fn matched(&self, old: &Plane, similarity: &Similarity, reach: f64) -> Option<TileMatch> {
        let mut by = self.searched(old, similarity, reach)?;
        let (sin, cos) = (similarity.turned().y, similarity.turned().x);
        let linear = Matrix2::new(cos, -sin, sin, cos);
        for step in 0..=STEPS {
            let sums = self.sums(old, similarity, by, 1)?;
            let change = sums.matrix.cholesky()?.solve(&sums.right);
            if step == STEPS || change.norm() < 0.01 {
                let is_good = sums.correlation() >= MIN_CORRELATION && by.norm() <= 1.5 * reach + 2.0;
                let noise = (sums.squares / sums.pixels).max(1e-3) * CORRELATED;
                let sigma = (noise * sums.matrix.try_inverse()?.trace() / 2.0).sqrt();
                let matched = TileMatch { new: self.middle, old: similarity.apply(self.middle) + by, sigma };
                return (is_good && sigma < 2.0).then_some(matched);
            }
            by -= linear * change;
        }
        None
    }

    /// The best even shift within `reach` along the parallax, and within two pixels across it.
    fn searched(&self, old: &Plane, similarity: &Similarity, reach: f64) -> Option<Vector2<f64>> {
        let steps = (reach / 2.0).round() as i32;
        let along = similarity.shift().try_normalize(1.0).unwrap_or(Vector2::new(1.0, 0.0));
        let across = Vector2::new(-along.y, along.x);
        let mut best: Option<(f64, Vector2<f64>)> = None;
        for i in -steps..=steps {
            for j in -1..=1 {
                let by = along * f64::from(2 * i) + across * f64::from(2 * j);
                let Some(sums) = self.sums(old, similarity, by, 5) else { continue };
                // A tie goes to the shift that the frame as a whole has.
                let value = sums.correlation() - 0.002 * by.norm();
                if best.is_none_or(|(most, _)| value > most) {
                    best = Some((value, by));
                }
            }
        }
        best.map(|(_, by)| by)
    }

    /// The sums over every `stride`-th pixel of the overlap with the old plane shifted by `by`.
    fn sums(&self, old: &Plane, similarity: &Similarity, by: Vector2<f64>, stride: usize) -> Option<TileSums> {
        let (mid_x, mid_y) = (old.columns() as f32 / 2.0 - 0.5, old.rows() as f32 / 2.0 - 0.5);
        let (turned, shift) = (similarity.turned(), similarity.shift() + by);
        let (cos, sin, dx, dy) = (turned.x as f32, turned.y as f32, shift.x as f32, shift.y as f32);
        let mut h = [0.0f32; 3];
        let mut right = [0.0f32; 2];
        let mut products = [0.0f32; 3];
        let (mut squares, mut pixels) = (0.0f32, 0.0f32);
        for ([x, y], a, [gx, gy]) in self.pixels.iter().step_by(stride) {
            let Some(b) = old.at(mid_x + cos * x - sin * y + dx, mid_y - sin * x - cos * y - dy) else { continue };
            let off = b - a;
            h[0] += gx * gx;
            h[1] += gx * gy;
            h[2] += gy * gy;
            right[0] += gx * off;
            right[1] += gy * off;
            products[0] += a * a;
            products[1] += b * b;
            products[2] += a * b;
            squares += off * off;
            pixels += 1.0;
        }
        let all = self.pixels.len().div_ceil(stride) as f32;
        let [xx, xy, yy] = h.map(f64::from);
        (pixels >= MIN_SHARE * all).then(|| TileSums {
            matrix: Matrix2::new(xx + 1e-3, xy, xy, yy + 1e-3),
            right: Vector2::new(right[0].into(), right[1].into()),
            products: products.map(f64::from),
            squares: squares.into(),
            pixels: pixels.into(),
        })
    }
}

struct TileSums {
    matrix: Matrix2<f64>,
    right: Vector2<f64>,
    products: [f64; 3],
    squares: f64,
    pixels: f64,
}

impl TileSums {
    fn correlation(&self) -> f64 {
        self.products[2] / (self.products[0] * self.products[1]).sqrt().max(1e-6)
    }
}
