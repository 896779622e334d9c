//! Relief that is painted once: lumps over lumps with creases between them, cells of corals, and the dark of crevices.

use super::fields::ramp;
use super::texture::{Texture, blurred};
use crate::noise::floor;
use scene_model::random::{CounterRng, derive};
use std::f32::consts::TAU;

/// Gradient noise that repeats after a whole number of cells; -1 to 1.
pub(super) struct TiledNoise {
    cells: usize,
    gradients: Vec<[f32; 2]>,
}

impl TiledNoise {
    pub(super) fn new(cells: usize, key: u64) -> Self {
        let mut rng = CounterRng::new(key);
        let gradient = |_| {
            let (sin, cos) = (TAU * rng.unit() as f32).sin_cos();
            [1.5 * cos, 1.5 * sin]
        };
        Self { cells, gradients: (0..cells * cells).map(gradient).collect() }
    }

    /// The value at a place given in shares of the period.
    #[inline]
    pub(super) fn at(&self, x: f32, y: f32) -> f32 {
        let (x, y) = (x * self.cells as f32, y * self.cells as f32);
        let (left, low) = (floor(x), floor(y));
        let (fx, fy) = (x - left as f32, y - low as f32);
        let wrapped = |c: i32| c.rem_euclid(self.cells as i32) as usize;
        let next = |c: usize| if c + 1 == self.cells { 0 } else { c + 1 };
        let (column, row) = (wrapped(left), wrapped(low));
        let (columns, rows) = ([column, next(column)], [row, next(row)]);
        let corner = |i: usize, j: usize| {
            let g = self.gradients[rows[j] * self.cells + columns[i]];
            g[0] * (fx - i as f32) + g[1] * (fy - j as f32)
        };
        let (sx, sy) = (ramp(0.0, 1.0, fx), ramp(0.0, 1.0, fy));
        let lower = corner(0, 0) + sx * (corner(1, 0) - corner(0, 0));
        let upper = corner(0, 1) + sx * (corner(1, 1) - corner(0, 1));
        lower + sy * (upper - lower)
    }
}

/// Stone or sand as a sum of octaves.
pub(super) struct Relief {
    pub side: usize,
    pub texel_m: f32,
    /// Wavelength and height of each octave, metres.
    pub octaves: &'static [[f32; 2]],
    /// Share of each octave that is folded: 1 gives round lumps with sharp creases, 0 soft waves.
    pub fold: f32,
    /// How far places are shifted, metres.
    pub warp_m: f32,
    /// Depth of the holes, metres.
    pub hole_m: f32,
    pub key: u64,
}

impl Relief {
    /// Heights around 0, tones around 1 that are paler on top, and a slowly changing value that chooses colours.
    pub(super) fn paint(&self) -> Texture {
        let period_m = self.side as f32 * self.texel_m;
        let noise = |wave_m: f32, stream: u64| {
            TiledNoise::new(((period_m / wave_m).round() as usize).max(1), derive(self.key, stream))
        };
        let layers: Vec<(TiledNoise, f32)> =
            (0u64..).zip(self.octaves).map(|(i, octave)| (noise(octave[0], i), octave[1])).collect();
        let bends = [noise(0.7, 20), noise(0.7, 21), noise(0.25, 22), noise(0.25, 23)];
        let (rough, pores, hues) = (noise(0.9, 24), noise(0.13, 25), [noise(1.1, 26), noise(0.23, 27)]);
        let mut texels = Vec::with_capacity(self.side * self.side);
        for at in 0..self.side * self.side {
            let share = |index: usize| (index as f32 + 0.5) / self.side as f32;
            let (x, y) = (share(at % self.side), share(at / self.side));
            let bend = |i: usize| (bends[i].at(x, y) + 0.25 * bends[i + 2].at(x, y)) * self.warp_m / period_m;
            let (u, v) = (x + bend(0), y + bend(1));
            // Some places are smooth, others are eroded.
            let fine = 0.35 + 1.3 * ramp(-0.5, 0.5, rough.at(x, y));
            let mut height = 0.0;
            for (i, (layer, amplitude)) in layers.iter().enumerate() {
                let value = layer.at(u, v);
                let folded = value + self.fold * (2.0 * value.abs() - 0.5 - value);
                height += amplitude * folded * if i < 2 { 1.0 } else { fine };
            }
            height -= self.hole_m * fine * ramp(0.30, 0.55, pores.at(u, v));
            let hue = (0.5 + 0.45 * hues[0].at(x, y) + 0.25 * hues[1].at(u, v)).clamp(0.0, 1.0);
            texels.push([height, 1.0, hue]);
        }
        Texture::from_texels(self.texel_m, texels)
    }
}

/// The cups of a coral: walls, a rim and a dark mouth, one beside the other, with the relief of each.
pub(super) fn cups(side: usize, texel_m: f32, cup_m: f32, key: u64) -> Texture {
    let cells = ((side as f32 * texel_m / cup_m).round() as usize).max(2);
    let mut rng = CounterRng::new(derive(key, 1));
    let points: Vec<[f32; 3]> = (0..cells * cells)
        .map(|at| {
            let mut near = |cell: usize| cell as f32 + 0.12 + 0.76 * rng.unit() as f32;
            let (x, y) = (near(at % cells), near(at / cells));
            [x, y, rng.unit() as f32]
        })
        .collect();
    let bends = [2, 3].map(|stream| TiledNoise::new(cells / 3 + 1, derive(key, stream)));
    let texel = |at: usize| {
        let share = |index: usize| (index as f32 + 0.5) / side as f32;
        let (x, y) = (share(at % side), share(at / side));
        let [u, v] = [x + 0.9 / cells as f32 * bends[0].at(x, y), y + 0.9 / cells as f32 * bends[1].at(x, y)];
        let (first, second, own) = nearest(&points, cells, u * cells as f32, v * cells as f32);
        // 0 in the middle of a cup and 1 at its border.
        let t = 2.0 * first / (first + second).max(1e-6);
        let wall = ramp(0.15, 0.55, t) * (1.0 - 0.9 * ramp(0.72, 1.0, t));
        [cup_m * (0.30 * wall + 0.10 * own), 0.35 + 0.75 * wall + 0.15 * (own - 0.5), own]
    };
    Texture::from_texels(texel_m, (0..side * side).map(texel).collect())
}

/// The distances to the nearest two points, and the third value of the nearest.
fn nearest(points: &[[f32; 3]], cells: usize, x: f32, y: f32) -> (f32, f32, f32) {
    let count = cells as i32;
    let (mut first, mut second, mut own) = (9.0f32, 9.0f32, 0.0);
    for j in floor(y) - 1..=floor(y) + 1 {
        for i in floor(x) - 1..=floor(x) + 1 {
            let (column, row) = (i.rem_euclid(count), j.rem_euclid(count));
            let point = points[(row * count + column) as usize];
            let (dx, dy) = (point[0] + (i - column) as f32 - x, point[1] + (j - row) as f32 - y);
            let distance = (dx * dx + dy * dy).sqrt();
            if distance < first {
                (first, second, own) = (distance, first, point[2]);
            } else if distance < second {
                second = distance;
            }
        }
    }
    (first, second, own)
}

/// The same texture with tones that are darker in what is lower than the mean around it, over several radii.
pub(super) fn with_crevices(mut texture: Texture, strength: f32) -> Texture {
    let (side, texel_m) = (texture.side(), texture.texel_m());
    let height: Vec<f32> = texture.texels().iter().map(|texel| texel[0]).collect();
    for radius in [2, 7, 22] {
        let mean = blurred(&height, side, radius);
        let per_m = strength / (radius as f32 * texel_m);
        for ((texel, mean), height) in texture.texels_mut().iter_mut().zip(mean).zip(&height) {
            let sunk = (mean - height) * per_m;
            texel[1] *= if sunk > 0.0 { 1.0 / (1.0 + 2.2 * sunk) } else { 1.0 + 0.2 * (-sunk).min(0.8) };
        }
    }
    texture
}
