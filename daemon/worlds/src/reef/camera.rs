//! The camera that looks down at the reef through water, and the tiles of the sea floor that were drawn last.

use super::Reef;
use super::fields::Colour;
use super::optics::{self, Optics, View};
use super::shading::{CREVICE_M, MAX_APRON, SHADOW_M, shade};
use super::surface::Surface;
use crate::noise::floor;
use image::RgbImage;

/// Nodes of the floor are so many pixels apart: the lens and the water blur what is smaller.
const BLUR: f64 = 1.35;

/// A camera over a reef. It draws the sea floor that it sees and keeps the latest of it, at most 50 MB.
#[derive(Clone, Debug)]
pub struct ReefCamera {
    reef: Reef,
    metres_per_pixel: f64,
    tiles: Tiles,
}

impl ReefCamera {
    /// A camera whose pixels measure `metres_per_pixel` on the sea floor, at least a millimetre.
    #[must_use]
    pub fn new(reef: Reef, metres_per_pixel: f64) -> Self {
        let metres_per_pixel = metres_per_pixel.max(0.001);
        Self { reef, metres_per_pixel, tiles: Tiles::new((metres_per_pixel * BLUR) as f32) }
    }

    #[must_use]
    pub fn reef(&self) -> &Reef {
        &self.reef
    }

    /// The frame of a view: the same reef and view give the same frame, bit for bit.
    pub fn frame(&mut self, view: &View) -> RgbImage {
        let optics = Optics::new(view, self.metres_per_pixel, &self.reef);
        let mut image = RgbImage::new(view.width_px, view.height_px);
        let mut above = vec![[0.0; 3]; view.width_px as usize];
        self.look(view, |v, row| {
            let line = &mut image.as_mut()[3 * v * row.len()..][..3 * row.len()];
            optics.expose(v, row, &mut above, line.as_chunks_mut().0);
        });
        optics::render_colour(&mut image, self.reef.water.saturation);
        image
    }

    /// The view as if there were no water, light, snow and noise of the camera, as display values.
    pub fn clear_frame(&mut self, view: &View) -> RgbImage {
        let mut light = Vec::with_capacity(view.width_px as usize * view.height_px as usize);
        self.look(view, |_, row| light.extend_from_slice(row));
        optics::develop(&light, view.width_px, view.height_px)
    }

    /// Calls `see` with each row of pixels from the top: its number and the light of the sea floor.
    fn look(&mut self, view: &View, mut see: impl FnMut(usize, &[Colour])) {
        let pitch = f64::from(self.tiles.pitch_m());
        let (width, height) = (view.width_px, view.height_px);
        let (half_w, half_h) = (f64::from(width) / 2.0, f64::from(height) / 2.0);
        // From pixels to nodes.
        let (sin, cos) = view.heading_rad.sin_cos();
        let (sin, cos) = (sin * self.metres_per_pixel / pitch, cos * self.metres_per_pixel / pitch);
        let reach = |a: f64, b: f64| (half_w * a.abs() + half_h * b.abs()).ceil() as i32 + 2;
        let (reach_x, reach_y) = (reach(cos, sin), reach(sin, cos));
        let (sin, cos) = (sin as f32, cos as f32);
        // Nodes are half a pitch from the lines between them.
        let (cx, cy) = (view.x_m / pitch - 0.5, view.y_m / pitch - 0.5);
        let (nx, ny) = (cx.floor(), cy.floor());
        let (at_x, at_y) = (nx as i32, ny as i32);
        let window =
            self.tiles.window(&self.reef, [at_x - reach_x, at_y - reach_y], [at_x + reach_x + 1, at_y + reach_y + 1]);
        let window = window.seen_from(at_x, at_y);
        let (fx, fy) = ((cx - nx) as f32, (cy - ny) as f32);
        let mut line = vec![[0.0; 3]; width as usize];
        for v in 0..height {
            let ahead = (half_h - f64::from(v) - 0.5) as f32;
            let (x, y) = (fx + sin * ahead, fy + cos * ahead);
            for (u, light) in line.iter_mut().enumerate() {
                let right = u as f32 + 0.5 - half_w as f32;
                *light = window.at(x + cos * right, y - sin * right);
            }
            see(v as usize, &line);
        }
    }
}

/// Nodes along the edge of a tile.
pub(super) const EDGE: usize = 256;
/// Bound of the memory: so many tiles of 768 KiB.
const MAX_TILES: usize = 64;

#[derive(Clone, Debug)]
struct Tile {
    at: [i32; 2],
    used: u64,
    light: Vec<Colour>,
}

/// A cache of tiles, all with the same pitch.
#[derive(Clone, Debug)]
pub(super) struct Tiles {
    pitch_m: f32,
    tiles: Vec<Tile>,
    clock: u64,
}

/// The tiles of a rectangle, for quick access to single nodes.
pub(super) struct Window<'a> {
    /// The south-western node, from the node to which places are relative.
    first: [i32; 2],
    columns: usize,
    tiles: Vec<&'a [Colour]>,
}

impl Tiles {
    pub(super) fn new(pitch_m: f32) -> Self {
        Self { pitch_m, tiles: Vec::new(), clock: 0 }
    }

    pub(super) fn pitch_m(&self) -> f32 {
        self.pitch_m
    }

    /// The tiles from node `low` to node `high`, drawn where they are missing.
    pub(super) fn window(&mut self, reef: &Reef, low: [i32; 2], high: [i32; 2]) -> Window<'_> {
        let edge = EDGE as i32;
        let first = low.map(|node| node.div_euclid(edge));
        let last = high.map(|node| node.div_euclid(edge));
        self.clock += 1;
        let places: Vec<[i32; 2]> =
            (first[1]..=last[1]).flat_map(|row| (first[0]..=last[0]).map(move |column| [column, row])).collect();
        for &at in &places {
            match self.tiles.iter_mut().find(|tile| tile.at == at) {
                Some(tile) => tile.used = self.clock,
                None => self.tiles.push(Tile { at, used: self.clock, light: draw(reef, at, self.pitch_m) }),
            }
        }
        self.forget(places.len());
        let found = |at: &[i32; 2]| self.tiles.iter().find(|tile| tile.at == *at).map(|tile| tile.light.as_slice());
        let tiles = places.iter().filter_map(found).collect();
        Window { first: first.map(|tile| tile * edge), columns: (last[0] - first[0] + 1) as usize, tiles }
    }

    /// Removes the tiles that were used longest ago, but none of the `needed` ones.
    fn forget(&mut self, needed: usize) {
        while self.tiles.len() > MAX_TILES.max(needed) {
            let oldest = (0..self.tiles.len()).min_by_key(|&i| self.tiles[i].used).unwrap_or(0);
            self.tiles.swap_remove(oldest);
        }
    }
}

/// Draws a tile, with a margin for the crevices around it and, towards the sun, for the shadows that fall into it.
fn draw(reef: &Reef, at: [i32; 2], pitch_m: f32) -> Vec<Colour> {
    let nodes = |metres: f32| ((metres / pitch_m).ceil() as usize).clamp(4, MAX_APRON);
    let (sunny, other) = (nodes(SHADOW_M), nodes(CREVICE_M));
    // The sun is in the north-west.
    let (west, south) = (sunny, other);
    let whole = EDGE + sunny + other;
    let corner = [at[0] * EDGE as i32 - west as i32, at[1] * EDGE as i32 - south as i32];
    let light = shade(&Surface::new(reef, corner, [whole; 2], pitch_m));
    light.chunks_exact(whole).skip(south).take(EDGE).flat_map(|line| &line[west..][..EDGE]).copied().collect()
}

impl Window<'_> {
    /// The same window with places relative to a node, for which small numbers are precise.
    pub(super) fn seen_from(mut self, column: i32, row: i32) -> Self {
        self.first = [self.first[0] - column, self.first[1] - row];
        self
    }

    /// A node with its neighbours to the east, to the north and to the north-east.
    #[inline]
    fn square(&self, column: i32, row: i32) -> [[Colour; 2]; 2] {
        let (i, j) = ((column - self.first[0]).max(0) as usize, (row - self.first[1]).max(0) as usize);
        if i % EDGE < EDGE - 1 && j % EDGE < EDGE - 1 {
            let tile = self.tiles[(j / EDGE) * self.columns + i / EDGE];
            let at = (j % EDGE) * EDGE + i % EDGE;
            if let [a, b, .., c, d] = tile[at..=at + EDGE + 1] {
                return [[a, b], [c, d]];
            }
        }
        [
            [self.node(column, row), self.node(column + 1, row)],
            [self.node(column, row + 1), self.node(column + 1, row + 1)],
        ]
    }

    fn node(&self, column: i32, row: i32) -> Colour {
        let (i, j) = (column - self.first[0], row - self.first[1]);
        let (i, j) = (i.max(0) as usize, j.max(0) as usize);
        self.tiles[(j / EDGE) * self.columns + i / EDGE][(j % EDGE) * EDGE + i % EDGE]
    }

    /// The light at a place in nodes, interpolated.
    #[inline]
    pub(super) fn at(&self, x: f32, y: f32) -> Colour {
        let (column, row) = (floor(x), floor(y));
        let (fx, fy) = (x - column as f32, y - row as f32);
        let [[a, b], [c, d]] = self.square(column, row);
        std::array::from_fn(|i| {
            let lower = a[i] + fx * (b[i] - a[i]);
            let upper = c[i] + fx * (d[i] - c[i]);
            lower + fy * (upper - lower)
        })
    }
}
