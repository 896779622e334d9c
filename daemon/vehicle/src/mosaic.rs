//! Pictures of the sea floor, tile by tile, put together from camera frames.

use image::{Rgb, RgbImage};
use scene_model::project::Observation;
use scene_model::words::Word;
use scenecast_protocol::map::Cell;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Edge of a tile in cells of the map.
const TILE_CELLS: i32 = 8;
/// Edge of a tile in pixels.
pub const TILE_PX: u32 = 128;
/// Edge of a block of a tile in pixels. Between its corners, the places of pixels are interpolated.
const BLOCK_PX: u32 = 8;
/// Corners of blocks along the edge of a tile.
const CORNERS: u32 = TILE_PX / BLOCK_PX + 1;
/// Tiles that are kept, 64 kB each; of more, those that were out of view for the longest time are dropped.
const MAX_TILES: usize = 512;
/// Tiles that a frame changes at most: one that seems to see more has no sound geometry.
const MAX_IN_VIEW: f64 = 100.0;
/// A tile is given out once it was out of view for this time, seconds; sooner, the next frame would change it.
const SETTLED_S: f64 = 10.0;
/// The part of a tile that has to be seen, and that has to be new since it was given out last.
const MIN_SEEN: f64 = 0.3;
const MIN_NEW: f64 = 0.1;
/// A frame is added if it lies so far from the last one, in parts of what it reaches from its middle.
const MIN_STEP: f64 = 0.3;
/// How much nearer to the middle of its frame a pixel has to be than the one that it replaces, of 255.
const NEARER: u8 = 12;

/// The column and the row of a tile, east and north of the origin of the map.
pub type TilePlace = (i32, i32);

/// The cells of the map under a tile.
pub(super) fn cells_of_tile((column, row): TilePlace) -> impl Iterator<Item = Cell> {
    let cells = |tile: i32| TILE_CELLS * tile..TILE_CELLS * (tile + 1);
    cells(row).flat_map(move |y| cells(column).map(move |x| Cell::new(x, y)))
}

/// A picture of a square of the sea floor, north up.
#[derive(Debug, Clone, PartialEq)]
pub struct FloorTile {
    pub at: TilePlace,
    /// [`TILE_PX`] square. Pixels that no frame has shown have the mean colour of the others.
    pub picture: Arc<RgbImage>,
    /// Pixels that a frame has shown.
    pub seen: u32,
    /// The middle in the map frame, metres east and north.
    pub middle_m: (f64, f64),
    pub width_m: f64,
    /// Mission time of the last frame in it, seconds.
    pub t_s: f64,
}

/// A tile in the making.
#[derive(Debug, Clone)]
struct OpenTile {
    picture: RgbImage,
    /// How near to the middle of its frame each pixel was, 1 to 255; 0 where no frame has shown it.
    near: Vec<u8>,
    seen_s: f64,
    /// Pixels that were seen when it was given out last, and whether it has changed since then.
    given: usize,
    is_changed: bool,
}

impl OpenTile {
    fn new(t_s: f64) -> Self {
        let pixels = TILE_PX as usize * TILE_PX as usize;
        Self {
            picture: RgbImage::new(TILE_PX, TILE_PX),
            near: vec![0; pixels],
            seen_s: t_s,
            given: 0,
            is_changed: false,
        }
    }

    /// Puts the pixels of a frame on the block of these first pixels whose corners lie there in the frame; whether one is better than
    /// what was there.
    fn add_block(&mut self, first: (u32, u32), corners: [(f64, f64); 4], frame: &RgbImage, box_px: u32) -> bool {
        let part_of = [frame.width(), frame.height()].map(|edge| 2.0 / f64::from(edge));
        let [a, b, c, d] = corners;
        let between = |a: f64, b: f64, part: f64| a + (b - a) * part;
        let part = |index: u32| (f64::from(index) + 0.5) / f64::from(BLOCK_PX);
        let mut is_better = false;
        for down in 0..BLOCK_PX {
            let left = (between(a.0, c.0, part(down)), between(a.1, c.1, part(down)));
            let end = (between(b.0, d.0, part(down)), between(b.1, d.1, part(down)));
            for right in 0..BLOCK_PX {
                let (u, v) = (between(left.0, end.0, part(right)), between(left.1, end.1, part(right)));
                let off = (u * part_of[0] - 1.0).abs().max((v * part_of[1] - 1.0).abs());
                let near = (255.0 * (1.0 - off)).max(1.0) as u8;
                let (x, y) = (first.0 + right, first.1 + down);
                let known = &mut self.near[(y * TILE_PX + x) as usize];
                if off >= 1.0 || (*known > 0 && near <= known.saturating_add(NEARER)) {
                    continue;
                }
                self.picture.put_pixel(x, y, mean_around(frame, (u, v), box_px));
                (*known, is_better) = (near, true);
            }
        }
        is_better
    }

    fn seen(&self) -> usize {
        self.near.iter().filter(|near| **near > 0).count()
    }

    /// The picture, if enough of it is new since it was given out last.
    fn give(&mut self, at: TilePlace, width_m: f64) -> Option<FloorTile> {
        if !std::mem::take(&mut self.is_changed) {
            return None;
        }
        let (seen, all) = (self.seen(), f64::from(TILE_PX * TILE_PX));
        if (seen as f64) < MIN_SEEN * all || (seen.saturating_sub(self.given) as f64) < MIN_NEW * all {
            return None;
        }
        self.given = seen;
        let middle = |index: i32| (f64::from(index) + 0.5) * width_m;
        let (middle_m, picture) = ((middle(at.0), middle(at.1)), self.filled(seen).into());
        Some(FloorTile { at, picture, seen: seen as u32, middle_m, width_m, t_s: self.seen_s })
    }

    /// The picture, with the mean colour of its `seen` pixels in its holes.
    fn filled(&self, seen: usize) -> RgbImage {
        let (mut sum, seen) = ([0_u64; 3], seen.max(1) as u64);
        for (pixel, _) in self.picture.pixels().zip(&self.near).filter(|(_, near)| **near > 0) {
            (0..3).for_each(|c| sum[c] += u64::from(pixel.0[c]));
        }
        let mean = Rgb(sum.map(|sum| (sum / seen) as u8));
        let mut filled = self.picture.clone();
        let holes = filled.pixels_mut().zip(&self.near).filter(|(_, near)| **near == 0);
        holes.for_each(|(pixel, _)| *pixel = mean);
        filled
    }
}

/// How the pixels of a frame lie on the map, about: exact in its middle, where the camera looks straight down.
struct Lie {
    /// Middle of the frame, pixels, and its place, metres.
    middle: (f64, f64),
    place: (f64, f64),
    /// Pixels to the right and down for a metre to the east and to the north.
    to_pixels: [[f64; 2]; 2],
}

impl Lie {
    /// `None` if the middle of the frame sees no floor.
    fn of((width, height): (u32, u32), project: &impl Fn(&[Word]) -> Vec<Observation>) -> Option<Self> {
        let middle = (f64::from(width) / 2.0, f64::from(height) / 2.0);
        let step = f64::from(width.min(height)) / 4.0;
        let word = |id, right: f64, down: f64| Word { id, u: (middle.0 + right) as f32, v: (middle.1 + down) as f32 };
        let seen = project(&[word(0, 0.0, 0.0), word(1, step, 0.0), word(2, 0.0, step)]);
        let [at, right, down] = [0, 1, 2].map(|id| seen.iter().find(|seen| seen.word == id));
        let (at, right, down) = (at?, right?, down?);
        let [[a, b], [c, d]] = [[right.x - at.x, down.x - at.x], [right.y - at.y, down.y - at.y]];
        let determinant = a * d - b * c;
        let by = step / determinant;
        let to_pixels = [[d * by, -b * by], [-c * by, a * by]];
        let is_sound = determinant.abs() > 1e-9 && at.x.is_finite() && at.y.is_finite();
        is_sound.then_some(Self { middle, place: (at.x, at.y), to_pixels })
    }

    fn pixels(&self, east_m: f64, north_m: f64) -> (f64, f64) {
        let [[a, b], [c, d]] = self.to_pixels;
        (a * east_m + b * north_m, c * east_m + d * north_m)
    }

    fn pixel_of(&self, (x, y): (f64, f64)) -> (f64, f64) {
        let (right, down) = self.pixels(x - self.place.0, y - self.place.1);
        (self.middle.0 + right, self.middle.1 + down)
    }

    /// Metres to the east and to the north that the frame reaches from its middle, about.
    fn reach_m(&self) -> (f64, f64) {
        let [[a, b], [c, d]] = self.to_pixels;
        let determinant = a * d - b * c;
        let reach =
            |right: f64, down: f64| (right.abs() * self.middle.0 + down.abs() * self.middle.1) / determinant.abs();
        (reach(d, b), reach(c, a))
    }
}

/// The picture of the sea floor so far.
#[derive(Debug, Clone, Default)]
pub struct Mosaic {
    tiles: BTreeMap<TilePlace, OpenTile>,
    /// Place of the last frame that was added, metres, and its mission time, seconds.
    last: Option<((f64, f64), f64)>,
}

impl Mosaic {
    /// Adds a frame of mission time `t_s`, of which `project` puts pixels on the map with cells of `cell_m`.
    pub fn add(&mut self, frame: &RgbImage, project: impl Fn(&[Word]) -> Vec<Observation>, cell_m: f64, t_s: f64) {
        let Some(lie) = Lie::of(frame.dimensions(), &project) else { return };
        let (east_m, north_m) = lie.reach_m();
        let edge_m = f64::from(TILE_CELLS) * cell_m;
        if (2.0 * east_m / edge_m + 1.0) * (2.0 * north_m / edge_m + 1.0) > MAX_IN_VIEW {
            return;
        }
        // What a frame shows better than one from about the same place is not worth the time.
        let is_near = |(x, y): (f64, f64)| (x - lie.place.0).hypot(y - lie.place.1) < MIN_STEP * east_m.min(north_m);
        if self.last.is_some_and(|(place, last_s)| is_near(place) && (t_s - last_s).abs() < SETTLED_S / 2.0) {
            return;
        }
        self.last = Some((lie.place, t_s));
        let span = |at: f64, reach: f64| {
            let tile = |m: f64| (m / edge_m).floor();
            (tile(at - reach) as i64, tile(at + reach) as i64)
        };
        let (columns, rows) = (span(lie.place.0, east_m), span(lie.place.1, north_m));
        for at in
            (rows.0..=rows.1).flat_map(|row| (columns.0..=columns.1).map(move |column| (column as i32, row as i32)))
        {
            self.add_to(at, edge_m, frame, &lie, &project, t_s);
        }
    }

    /// Puts the pixels of a frame on a tile that are nearer to the middle than those that the tile has.
    fn add_to(
        &mut self,
        at: TilePlace,
        edge_m: f64,
        frame: &RgbImage,
        lie: &Lie,
        project: &impl Fn(&[Word]) -> Vec<Observation>,
        t_s: f64,
    ) {
        let corners = corners(at, edge_m, frame, lie, project);
        let corner = |column: u32, row: u32| corners[(row * CORNERS + column) as usize];
        let (pitch_right, pitch_down) = lie.pixels(edge_m / f64::from(TILE_PX), 0.0);
        let box_px = (pitch_right.hypot(pitch_down).round() as u32).clamp(1, 8);
        let blocks = (0..CORNERS - 1).flat_map(|row| (0..CORNERS - 1).map(move |column| (column, row)));
        let tile = self.tiles.entry(at).or_insert_with(|| OpenTile::new(t_s));
        let mut is_better = false;
        for (column, row) in blocks {
            let around = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(right, down)| corner(column + right, row + down));
            if let [Some(a), Some(b), Some(c), Some(d)] = around {
                is_better |= tile.add_block((column * BLOCK_PX, row * BLOCK_PX), [a, b, c, d], frame, box_px);
            }
        }
        if is_better {
            (tile.is_changed, tile.seen_s) = (true, t_s);
        } else if tile.seen() == 0 {
            self.tiles.remove(&at);
        }
    }

    /// The tiles that have settled at mission time `t_s` and have enough that is new.
    pub fn poll_settled(&mut self, cell_m: f64, t_s: f64) -> Vec<FloorTile> {
        let width_m = f64::from(TILE_CELLS) * cell_m;
        let mut settled = Vec::new();
        for (at, tile) in self.tiles.iter_mut().filter(|(_, tile)| t_s - tile.seen_s >= SETTLED_S) {
            settled.extend(tile.give(*at, width_m));
        }
        while self.tiles.len() > MAX_TILES {
            let oldest = self.tiles.iter().min_by(|a, b| a.1.seen_s.total_cmp(&b.1.seen_s)).map(|(at, _)| *at);
            let Some((at, mut tile)) = oldest.and_then(|at| Some((at, self.tiles.remove(&at)?))) else { break };
            // A camera that sees little at a time fills all of them before any has settled.
            settled.extend(tile.give(at, width_m));
        }
        settled
    }
}

/// Where the corners of the blocks of a tile lie in a frame, pixels, row by row; `None` beyond its edge, and where it sees no floor.
fn corners(
    at: TilePlace,
    edge_m: f64,
    frame: &RgbImage,
    lie: &Lie,
    project: &impl Fn(&[Word]) -> Vec<Observation>,
) -> Vec<Option<(f64, f64)>> {
    let (west, north, pitch) =
        (f64::from(at.0) * edge_m, f64::from(at.1 + 1) * edge_m, edge_m / f64::from(CORNERS - 1));
    let place = |id: u32| (west + f64::from(id % CORNERS) * pitch, north - f64::from(id / CORNERS) * pitch);
    let (right, down) = lie.pixels(pitch, pitch);
    let margin = right.abs().max(down.abs());
    let is_near = |at: f64, edge: u32| -margin < at && at < f64::from(edge) + margin;
    let words = (0..CORNERS * CORNERS).filter_map(|id| {
        let (u, v) = lie.pixel_of(place(id));
        (is_near(u, frame.width()) && is_near(v, frame.height())).then_some(Word { id, u: u as f32, v: v as f32 })
    });
    let words: Vec<Word> = words.collect();
    let mut corners = vec![None; (CORNERS * CORNERS) as usize];
    if words.is_empty() {
        return corners;
    }
    // A second step of Newton's method: a pixel is moved by what the camera puts it beside its place. Places come in the order of the
    // pixels, without those that see no floor.
    let mut seen = project(&words).into_iter().peekable();
    for word in words {
        let Some(seen) = seen.next_if(|seen| seen.word == word.id) else { continue };
        let (x, y) = place(word.id);
        let (right, down) = lie.pixels(x - seen.x, y - seen.y);
        let corner = (f64::from(word.u) + right, f64::from(word.v) + down);
        corners[word.id as usize] = Some(corner).filter(|(u, v)| u.is_finite() && v.is_finite());
    }
    corners
}

/// The mean colour of a square of pixels around a point in a frame.
fn mean_around(frame: &RgbImage, (u, v): (f64, f64), edge: u32) -> Rgb<u8> {
    let range = |at: f64, end: u32| {
        let first = ((at - f64::from(edge) / 2.0 + 0.5).max(0.0) as u32).min(end.saturating_sub(1));
        first as usize..(first + edge).min(end) as usize
    };
    let (across, down) = (range(u, frame.width()), range(v, frame.height()));
    let pixels = (across.len() * down.len()).max(1) as u32;
    let mut sum = [0_u32; 3];
    for y in down {
        let row = y * frame.width() as usize;
        let row = frame.as_raw().get(3 * (row + across.start)..3 * (row + across.end)).unwrap_or_default();
        for pixel in row.chunks_exact(3) {
            (0..3).for_each(|c| sum[c] += u32::from(pixel[c]));
        }
    }
    Rgb(sum.map(|sum| (sum / pixels) as u8))
}

#[cfg(test)]
mod tests {
    use super::*;
    use scene_model::project::{DownCamera, Pose};

    const CELL_M: f64 = 0.25;

    /// The colour of the sea floor at a place, metres.
    fn floor(x: f64, y: f64) -> Rgb<u8> {
        Rgb([(120.0 + 60.0 * (x * 1.3).sin()) as u8, (120.0 + 60.0 * (y * 1.7).sin()) as u8, 90])
    }

    fn camera() -> DownCamera {
        DownCamera { metres_per_pixel: 0.01, altitude_m: 3.0 }
    }

    /// A frame of that floor.
    fn frame(pose: &Pose) -> RgbImage {
        RgbImage::from_fn(320, 240, |u, v| {
            let word = Word { id: 0, u: u as f32 + 0.5, v: v as f32 + 0.5 };
            let seen = camera().project(320, 240, pose, &[word])[0];
            floor(seen.x, seen.y)
        })
    }

    fn pose(x: f64, y: f64, yaw_rad: f64) -> Pose {
        Pose { x, y, z: -10.0, yaw_rad }
    }

    fn add(mosaic: &mut Mosaic, pose: Pose, t_s: f64) {
        mosaic.add(&frame(&pose), |words| camera().project(320, 240, &pose, words), CELL_M, t_s);
    }

    #[test]
    fn tiles_show_the_floor_at_its_place_with_north_up() {
        let mut mosaic = Mosaic::default();
        for (n, x) in (0..20).map(|n| (n, 0.5 * f64::from(n))) {
            add(&mut mosaic, pose(x, 1.0, 1.2), f64::from(n));
        }
        assert!(mosaic.poll_settled(CELL_M, 20.0).len() < mosaic.tiles.len(), "the last ones are still in view");
        let mut tiles = mosaic.poll_settled(CELL_M, 40.0);
        let at = tiles.iter().position(|tile| tile.at == (4, 0)).unwrap();
        let tile = tiles.swap_remove(at);
        assert_eq!((tile.middle_m, tile.width_m), ((9.0, 1.0), 2.0));
        let pitch = tile.width_m / f64::from(TILE_PX);
        let off = |(u, v, pixel): (u32, u32, &Rgb<u8>)| {
            let (x, y) = (8.0 + (f64::from(u) + 0.5) * pitch, 2.0 - (f64::from(v) + 0.5) * pitch);
            (0..3).map(|c| pixel.0[c].abs_diff(floor(x, y).0[c])).max().unwrap()
        };
        let near = |(u, v, _): &(u32, u32, &Rgb<u8>)| *u < 96 && (16..112).contains(v);
        assert!(tile.picture.enumerate_pixels().filter(near).all(|pixel| off(pixel) <= 4));
    }

    #[test]
    fn a_tile_is_given_out_again_when_more_of_it_is_seen() {
        let mut mosaic = Mosaic::default();
        let given = |mosaic: &mut Mosaic, t_s| {
            let tiles = mosaic.poll_settled(CELL_M, t_s);
            tiles.iter().filter(|tile| tile.at == (0, 0)).count()
        };
        add(&mut mosaic, pose(0.3, 0.3, 0.0), 0.0);
        assert_eq!([given(&mut mosaic, 5.0), given(&mut mosaic, 10.0), given(&mut mosaic, 11.0)], [0, 1, 0]);
        add(&mut mosaic, pose(0.3, 0.3, 0.0), 12.0);
        assert_eq!(given(&mut mosaic, 30.0), 0, "nothing more of it");
        add(&mut mosaic, pose(1.5, 1.5, 0.0), 31.0);
        assert_eq!(given(&mut mosaic, 60.0), 1);
    }

    #[test]
    fn tiles_and_views_are_bounded() {
        let mut mosaic = Mosaic::default();
        for n in 0..200 {
            add(&mut mosaic, pose(4.0 * f64::from(n), 2.0, 0.0), f64::from(n));
            mosaic.poll_settled(CELL_M, f64::from(n));
        }
        assert_eq!(mosaic.tiles.len(), MAX_TILES);
        let before = mosaic.tiles.clone();
        mosaic.add(
            &RgbImage::new(320, 240),
            |words| camera().project(320, 240, &pose(0.0, 0.0, 0.0), words),
            1e-4,
            0.0,
        );
        mosaic.add(&RgbImage::new(320, 240), |_| Vec::new(), CELL_M, 0.0);
        assert_eq!(mosaic.tiles.len(), before.len());
    }
}
