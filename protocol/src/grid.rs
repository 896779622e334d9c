//! An unbounded sparse grid of labels.

use std::collections::BTreeMap;

/// Label of a cell that was never seen.
pub const UNEXPLORED: u8 = 0;
/// Highest label id on the map; 255 stays free for the codecs' own use.
pub const MAX_LABEL: u8 = 254;
/// Edge of a storage tile in cells.
pub const TILE: i32 = 16;
/// Cells of a storage tile.
pub(crate) const TILE_CELLS: usize = (TILE * TILE) as usize;

/// Row and column of a storage tile, counted in tiles from the origin.
pub(crate) type TileKey = (i32, i32);
/// Labels of a tile, row by row.
pub(crate) type TileLabels = [u8; TILE_CELLS];

/// A cell of the grid, addressed by counts of cells from the session's origin.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Cell {
    /// Cells east of the origin, negative to the west.
    pub x: i32,
    /// Cells north of the origin, negative to the south.
    pub y: i32,
}

impl Cell {
    /// The cell `x` cells east and `y` cells north of the origin.
    pub const fn new(x: i32, y: i32) -> Self {
        Self { x, y }
    }

    pub(crate) fn tile(self) -> TileKey {
        (self.y.div_euclid(TILE), self.x.div_euclid(TILE))
    }

    /// The cell's index in its tile, row by row.
    pub(crate) fn place(self) -> u8 {
        (self.y.rem_euclid(TILE) * TILE + self.x.rem_euclid(TILE)) as u8
    }

    /// The cell at an index of a tile.
    pub(crate) fn at((row, column): TileKey, place: u8) -> Self {
        let place = i32::from(place);
        Self::new(column * TILE + place % TILE, row * TILE + place / TILE)
    }

    fn index(self) -> usize {
        usize::from(self.place())
    }
}

/// A rectangle of cells; `width` and `height` are at least 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rect {
    /// The westernmost column, in cells from the origin.
    pub x: i32,
    /// The southernmost row, in cells from the origin.
    pub y: i32,
    /// Number of columns, at least 1.
    pub width: u32,
    /// Number of rows, at least 1.
    pub height: u32,
}

impl Rect {
    /// Smallest rectangle that holds every cell; `None` if there is none.
    pub fn around(cells: impl IntoIterator<Item = Cell>) -> Option<Self> {
        let mut bounds: Option<(i32, i32, i32, i32)> = None;
        for c in cells {
            let (x0, y0, x1, y1) = bounds.unwrap_or((c.x, c.y, c.x, c.y));
            bounds = Some((x0.min(c.x), y0.min(c.y), x1.max(c.x), y1.max(c.y)));
        }
        let span = |low: i32, high: i32| high.abs_diff(low).saturating_add(1);
        bounds.map(|(x0, y0, x1, y1)| Self { x: x0, y: y0, width: span(x0, x1), height: span(y0, y1) })
    }

    /// Whether `cell` lies inside the rectangle.
    pub fn contains(&self, cell: Cell) -> bool {
        cell.x >= self.x
            && cell.y >= self.y
            && cell.x.abs_diff(self.x) < self.width
            && cell.y.abs_diff(self.y) < self.height
    }

    /// Every cell, row by row from the south-west corner.
    pub fn cells(&self) -> impl Iterator<Item = Cell> + use<> {
        let r = *self;
        (0..r.height).flat_map(move |dy| {
            (0..r.width).map(move |dx| Cell::new(r.x.wrapping_add_unsigned(dx), r.y.wrapping_add_unsigned(dy)))
        })
    }

    /// Number of cells in the rectangle.
    pub fn area(&self) -> u64 {
        u64::from(self.width) * u64::from(self.height)
    }
}

/// Labels by cell; a cell never set reads as [`UNEXPLORED`].
///
/// Memory is one byte a cell in tiles of [`TILE`] x [`TILE`] that hold at least one set cell.
///
/// ```
/// use scenecast_protocol::map::{Cell, LabelGrid, UNEXPLORED};
///
/// let mut map = LabelGrid::default();
/// assert_eq!(map.set(Cell::new(-3, 8), 7), UNEXPLORED, "the label until now");
/// assert_eq!((map.get(Cell::new(-3, 8)), map.explored()), (7, 1));
/// assert_eq!(map.bounds().unwrap().area(), 1);
/// ```
#[derive(Debug, Clone, Default)]
pub struct LabelGrid {
    tiles: BTreeMap<TileKey, Box<TileLabels>>,
}

impl LabelGrid {
    /// The label of `cell`, 0 if it is unexplored.
    pub fn get(&self, cell: Cell) -> u8 {
        self.tiles.get(&cell.tile()).map_or(0, |t| t[cell.index()])
    }

    /// Sets the label of `cell` and returns the one it had.
    pub fn set(&mut self, cell: Cell, label: u8) -> u8 {
        if label == 0 && !self.tiles.contains_key(&cell.tile()) {
            return 0;
        }
        let tile = self.tiles.entry(cell.tile()).or_insert_with(|| Box::new([0; TILE_CELLS]));
        std::mem::replace(&mut tile[cell.index()], label)
    }

    /// Labels of the `width` x `height` cells whose south-west corner is (`x`, `y`), row by row from the south;
    /// places outside the 32-bit grid read as unexplored.
    pub fn copy_area(&self, x: i64, y: i64, width: usize, height: usize) -> Vec<u8> {
        let mut out = vec![0; width * height];
        let edge = i64::from(TILE);
        let (x_end, y_end) = (x + width as i64, y + height as i64);
        for ty in y.div_euclid(edge)..=(y_end - 1).div_euclid(edge) {
            for tx in x.div_euclid(edge)..=(x_end - 1).div_euclid(edge) {
                let (Ok(kx), Ok(ky)) = (i32::try_from(tx), i32::try_from(ty)) else { continue };
                let Some(tile) = self.tiles.get(&(ky, kx)) else { continue };
                let (from, to) = (x.max(tx * edge), x_end.min((tx + 1) * edge));
                for row in y.max(ty * edge)..y_end.min((ty + 1) * edge) {
                    let at = ((row - y) * width as i64 + from - x) as usize;
                    let source = ((row - ty * edge) * edge + from - tx * edge) as usize;
                    let length = (to - from) as usize;
                    out[at..at + length].copy_from_slice(&tile[source..source + length]);
                }
            }
        }
        out
    }

    /// Explored cells with their labels, tile by tile in a fixed order.
    pub fn iter(&self) -> impl Iterator<Item = (Cell, u8)> + '_ {
        self.tiles().flat_map(|(key, tile)| {
            (0..=u8::MAX).zip(tile).filter(|&(_, &l)| l != 0).map(move |(place, &l)| (Cell::at(key, place), l))
        })
    }

    /// Tiles that hold or held a set cell.
    pub(crate) fn tiles(&self) -> impl Iterator<Item = (TileKey, &TileLabels)> + '_ {
        self.tiles.iter().map(|(&key, tile)| (key, tile.as_ref()))
    }

    /// Labels of a tile, all 0 if the tile was never touched.
    pub(crate) fn tile(&self, key: TileKey) -> &TileLabels {
        self.tiles.get(&key).map_or(&[0; TILE_CELLS], |tile| tile)
    }

    /// Number of explored cells; takes time proportional to the stored tiles.
    pub fn explored(&self) -> usize {
        self.iter().count()
    }

    /// Smallest rectangle around the explored cells.
    pub fn bounds(&self) -> Option<Rect> {
        Rect::around(self.iter().map(|(c, _)| c))
    }

    /// Whether every cell is unexplored.
    pub fn is_empty(&self) -> bool {
        self.iter().next().is_none()
    }

    /// Sets every cell to unexplored.
    pub fn clear(&mut self) {
        self.tiles.clear();
    }
}

impl PartialEq for LabelGrid {
    fn eq(&self, other: &Self) -> bool {
        self.iter().eq(other.iter())
    }
}

impl Eq for LabelGrid {}

impl Extend<(Cell, u8)> for LabelGrid {
    fn extend<I: IntoIterator<Item = (Cell, u8)>>(&mut self, cells: I) {
        for (cell, label) in cells {
            self.set(cell, label);
        }
    }
}

impl FromIterator<(Cell, u8)> for LabelGrid {
    fn from_iter<I: IntoIterator<Item = (Cell, u8)>>(cells: I) -> Self {
        let mut grid = Self::default();
        grid.extend(cells);
        grid
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn negative_and_far_cells_keep_their_own_labels() {
        let cells = [(-1, -1), (0, 0), (-16, 15), (-17, 16), (i32::MAX, i32::MIN)];
        let mut grid = LabelGrid::default();
        for (i, (x, y)) in cells.into_iter().enumerate() {
            assert_eq!(grid.set(Cell::new(x, y), i as u8 + 1), 0);
        }
        for (i, (x, y)) in cells.into_iter().enumerate() {
            assert_eq!(grid.get(Cell::new(x, y)), i as u8 + 1);
        }
        assert_eq!(grid.explored(), cells.len());
    }

    #[test]
    fn grids_with_equal_cells_are_equal_whatever_tiles_they_touched() {
        let mut a = LabelGrid::default();
        a.set(Cell::new(100, 100), 3);
        a.set(Cell::new(100, 100), 0);
        assert_eq!(a, LabelGrid::default());
        assert!(a.is_empty());
    }

    #[test]
    fn a_copied_area_reads_like_its_cells_one_by_one() {
        let mut grid = LabelGrid::default();
        for i in 0..4000i32 {
            grid.set(Cell::new(i * 37 % 101 - 50, i * 53 % 89 - 40), (i % 254) as u8 + 1);
        }
        grid.set(Cell::new(i32::MIN, i32::MAX), 9);
        let area = grid.copy_area(-33, -19, 70, 41);
        let rect = Rect { x: -33, y: -19, width: 70, height: 41 };
        assert!(rect.cells().zip(&area).all(|(cell, &label)| grid.get(cell) == label));
        let corner = grid.copy_area(i64::from(i32::MIN) - 1, i64::from(i32::MAX), 2, 2);
        assert_eq!(corner, [0, 9, 0, 0]);
    }

    #[test]
    fn rect_iterates_every_cell_inside_it() {
        let r = Rect { x: -2, y: 5, width: 3, height: 2 };
        let cells: Vec<_> = r.cells().collect();
        assert_eq!(cells.len() as u64, r.area());
        assert!(cells.iter().all(|&c| r.contains(c)));
        assert_eq!(Rect::around(cells), Some(r));
    }
}
