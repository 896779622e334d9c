//! Periodic patterns of the sea floor that are painted once and then only looked up.

use super::fields::ramp;
use crate::noise::{Noise, floor};
use scene_model::random::{CounterRng, derive, mix};
use std::f32::consts::TAU;

/// Height in metres, tone around 1, and a value from 0 to 1 that chooses the colour of a piece.
pub(super) type Texel = [f32; 3];

/// A square of texels that repeats in both directions.
pub(super) struct Texture {
    /// Texels along the edge, a power of two.
    side: usize,
    per_m: f32,
    texels: Vec<Texel>,
}

impl Texture {
    pub(super) fn new(side: usize, texel_m: f32, fill: Texel) -> Self {
        Self { side, per_m: 1.0 / texel_m, texels: vec![fill; side * side] }
    }

    pub(super) fn from_texels(texel_m: f32, texels: Vec<Texel>) -> Self {
        Self { side: texels.len().isqrt(), per_m: 1.0 / texel_m, texels }
    }

    pub(super) fn side(&self) -> usize {
        self.side
    }

    pub(super) fn texel_m(&self) -> f32 {
        1.0 / self.per_m
    }

    pub(super) fn texels(&self) -> &[Texel] {
        &self.texels
    }

    pub(super) fn texels_mut(&mut self) -> &mut [Texel] {
        &mut self.texels
    }

    /// The texel at a position in metres, interpolated.
    #[inline]
    pub(super) fn at(&self, x: f32, y: f32) -> Texel {
        let (x, y) = (x * self.per_m, y * self.per_m);
        let (left, top) = (floor(x), floor(y));
        let (fx, fy) = (x - left as f32, y - top as f32);
        let mask = self.side - 1;
        let (i, j) = (left as usize & mask, top as usize & mask);
        let (right, below) = ((i + 1) & mask, (j + 1) & mask);
        let node = |i: usize, j: usize| &self.texels[j * self.side + i];
        let (a, b, c, d) = (node(i, j), node(right, j), node(i, below), node(right, below));
        std::array::from_fn(|k| {
            let upper = a[k] + fx * (b[k] - a[k]);
            let lower = c[k] + fx * (d[k] - c[k]);
            upper + fy * (lower - upper)
        })
    }

    fn place(&self, x: f32, y: f32) -> usize {
        let mask = self.side - 1;
        (floor(y) as usize & mask) * self.side + (floor(x) as usize & mask)
    }

    fn cover(&mut self, at: usize, texel: Texel, share: f32) {
        let old = &mut self.texels[at];
        *old = std::array::from_fn(|k| old[k] + share * (texel[k] - old[k]));
    }
}

/// How the pieces of a pattern look. Later pieces lie on earlier ones, and small ones are far more frequent than large
/// ones, which gives the statistics of natural images ("dead leaves", Lee, Mumford and Huang 2001).
pub(super) struct Pieces {
    pub side: usize,
    pub texel_m: f32,
    pub radius_m: [f32; 2],
    /// The largest ratio of length and width.
    pub aspect: f32,
    /// Height of a piece in its radii.
    pub rise: f32,
    pub contrast: f32,
    /// Mean number of pieces over a place.
    pub cover: f32,
    pub key: u64,
}

impl Pieces {
    pub(super) fn paint(&self) -> Texture {
        let mut texture = Texture::new(self.side, self.texel_m, [0.0, 0.7, 0.5]);
        let noise = Noise::new(derive(self.key, 1));
        let mut rng = CounterRng::new(derive(self.key, 2));
        let whole = (self.side * self.side) as f32;
        let mut painted = 0.0;
        while painted < self.cover * whole {
            let piece = self.piece(&mut rng);
            painted += std::f32::consts::PI * piece.radius * piece.radius * piece.aspect;
            self.put(&mut texture, &noise, &piece);
        }
        texture
    }

    fn piece(&self, rng: &mut CounterRng) -> Piece {
        let mut unit = || rng.unit() as f32;
        let [small, large] = self.radius_m.map(|metres| metres / self.texel_m);
        // The density of radii falls with their third power, so that each octave covers the same area.
        let u = unit();
        let radius = (1.0 / (small.powi(-2) + u * (large.powi(-2) - small.powi(-2)))).sqrt();
        let slim = unit();
        let (sin, cos) = (TAU * unit()).sin_cos();
        let tone = 1.0 + self.contrast * (unit() + unit() + unit() - 1.5);
        Piece {
            x: self.side as f32 * unit(),
            y: self.side as f32 * unit(),
            radius,
            aspect: 1.0 + (self.aspect - 1.0) * slim * slim,
            turn: [cos, sin],
            tone: tone.max(0.15),
            hue: unit(),
        }
    }

    fn put(&self, texture: &mut Texture, noise: &Noise, piece: &Piece) {
        let reach = piece.radius * piece.aspect * 1.35 + 1.0;
        let base = 0.55 * texture.texels[texture.place(piece.x, piece.y)][0];
        let (wide, fine) = (1.1 * piece.radius + 1.0, 0.35 * piece.radius + 1.2);
        for row in floor(piece.y - reach)..=floor(piece.y + reach) {
            for column in floor(piece.x - reach)..=floor(piece.x + reach) {
                let (dx, dy) = (column as f32 + 0.5 - piece.x, row as f32 + 0.5 - piece.y);
                let along = (dx * piece.turn[0] + dy * piece.turn[1]) / piece.aspect;
                let abeam = dy * piece.turn[0] - dx * piece.turn[1];
                let distance = (along * along + abeam * abeam).sqrt();
                if distance > 1.35 * piece.radius {
                    continue;
                }
                let (x, y) = (column as f32 + 97.0 * piece.hue, row as f32 + 61.0 * piece.tone);
                let rag =
                    0.55 * (noise.value(x / wide, y / wide) - 0.5) + 0.40 * (noise.value(x / fine, y / fine) - 0.5);
                let d = distance / piece.radius * (1.0 + rag);
                let share = ((1.0 - d) * piece.radius).clamp(0.0, 1.0);
                if share > 0.0 {
                    let dome = (1.0 - d * d).max(0.0).sqrt();
                    let height = base + self.rise * piece.radius * self.texel_m * dome * (1.0 + 0.5 * rag);
                    let grain = 0.82 + 0.36 * noise.value(x / 1.7, y / 1.7);
                    let tone = piece.tone * grain * (0.55 + 0.45 * dome) * (1.0 + 0.5 * rag);
                    let at = texture.place(column as f32, row as f32);
                    texture.cover(at, [height, tone, piece.hue], share);
                }
            }
        }
    }
}

struct Piece {
    x: f32,
    y: f32,
    /// Half of its width across the long axis, texels.
    radius: f32,
    aspect: f32,
    turn: [f32; 2],
    tone: f32,
    hue: f32,
}

/// How the strands of a pattern look: fingers of corals or blades of grass, each dark at its base and pale at its tip.
pub(super) struct Strands {
    pub side: usize,
    pub texel_m: f32,
    pub length_m: [f32; 2],
    pub half_width_m: [f32; 2],
    /// Turn from the base to the tip, radians.
    pub curl: f32,
    /// Deviation from the common direction, radians.
    pub spread: f32,
    pub rise_m: f32,
    pub cover: f32,
    pub key: u64,
}

impl Strands {
    pub(super) fn paint(&self) -> Texture {
        let mut texture = Texture::new(self.side, self.texel_m, [0.0, 0.12, 0.5]);
        let mut rng = CounterRng::new(self.key);
        let whole = (self.side * self.side) as f32;
        let mut painted = 0.0;
        while painted < self.cover * whole {
            painted += self.strand(&mut texture, &mut rng);
        }
        texture
    }

    /// Paints a strand and gives the area that it covers.
    fn strand(&self, texture: &mut Texture, rng: &mut CounterRng) -> f32 {
        let mut unit = || rng.unit() as f32;
        let mut between = |[low, high]: [f32; 2]| (low + (high - low) * unit()) / self.texel_m;
        let (length, half) = (between(self.length_m), between(self.half_width_m));
        let (mut x, mut y) = (self.side as f32 * unit(), self.side as f32 * unit());
        let mut angle = self.spread * (2.0 * unit() - 1.0);
        let bend = self.curl * (2.0 * unit() - 1.0) / length;
        let (tone, hue) = (0.45 + 0.7 * unit() + 0.3 * unit() * unit(), unit());
        let lift = self.rise_m * (0.6 + 0.4 * unit());
        for step in 0..length.ceil() as u32 {
            let t = step as f32 / length;
            // Narrow at the tip; one side faces the light.
            let width = half * (1.0 - 0.45 * t * t);
            let body = [lift * (0.25 + 0.75 * t), tone * (0.22 + 1.0 * t * (1.35 - 0.5 * t)), hue];
            let (sin, cos) = angle.sin_cos();
            let reach = width.ceil();
            for row in floor(y - reach)..=floor(y + reach) {
                for column in floor(x - reach)..=floor(x + reach) {
                    let (dx, dy) = (column as f32 + 0.5 - x, row as f32 + 0.5 - y);
                    let across = (dy * cos - dx * sin) / width;
                    let share = (width + 0.5 - (dx * dx + dy * dy).sqrt()).clamp(0.0, 1.0);
                    if share > 0.0 {
                        let at = texture.place(column as f32, row as f32);
                        texture.cover(at, [body[0], body[1] * (1.0 + 0.22 * across), body[2]], share);
                    }
                }
            }
            (x, y) = (x + cos, y + sin);
            angle += bend;
        }
        length * 2.0 * half
    }
}

/// Winding ridges, as on brain corals: noise whose band of wavelengths around eight texels is selected again and again
/// until it saturates.
pub(super) fn maze(side: usize, texel_m: f32, key: u64) -> Texture {
    let value = |i: u64| (mix(key ^ mix(i)) >> 40) as f32 / 8_388_608.0 - 1.0;
    let mut field: Vec<f32> = (0..(side * side) as u64).map(value).collect();
    for _ in 0..24 {
        let (near, far) = (blurred(&field, side, 1), blurred(&field, side, 3));
        for ((value, near), far) in field.iter_mut().zip(near).zip(far) {
            *value = (*value * 0.3 + 3.5 * (near - far)).clamp(-1.0, 1.0);
        }
    }
    let ridge = |value: f32| ramp(-0.7, 0.9, value);
    Texture::from_texels(texel_m, blurred(&field, side, 1).into_iter().map(|v| [ridge(v), ridge(v), 0.5]).collect())
}

/// The mean over periodic squares of a radius, taken twice so that it is nearly round.
pub(super) fn blurred(field: &[f32], side: usize, radius: usize) -> Vec<f32> {
    let share = 1.0 / (2 * radius + 1) as f32;
    let mask = side - 1;
    let (mut from, mut to) = (field.to_vec(), vec![0.0; field.len()]);
    for _ in 0..2 {
        for (line, out) in from.chunks_exact(side).zip(to.chunks_exact_mut(side)) {
            let get = |i: usize| line[i & mask];
            let mut sum: f32 = (0..=2 * radius).map(|i| get(i + side - radius)).sum();
            for (i, out) in out.iter_mut().enumerate() {
                *out = sum * share;
                sum += get(i + radius + 1) - get(i + side - radius);
            }
        }
        std::mem::swap(&mut from, &mut to);
        // All columns at once, since their values lie far apart.
        let line = |j: usize| &from[(j & mask) * side..][..side];
        let mut sums = vec![0.0f32; side];
        for j in 0..=2 * radius {
            sums.iter_mut().zip(line(j + side - radius)).for_each(|(sum, value)| *sum += value);
        }
        for (j, out) in to.chunks_exact_mut(side).enumerate() {
            let (enters, leaves) = (line(j + radius + 1), line(j + side - radius));
            for (((out, sum), enters), leaves) in out.iter_mut().zip(&mut sums).zip(enters).zip(leaves) {
                *out = *sum * share;
                *sum += enters - leaves;
            }
        }
        std::mem::swap(&mut from, &mut to);
    }
    from
}
