//! The cells of a map within a rectangle.

use scenecast_protocol::map::{Cell, Rect};

/// Cells of a grid at most: as one message it has 4 MiB, and 16 MiB a layer.
pub const MAX_GRID_CELLS: u64 = 1 << 22;

/// The cells of a map within a rectangle, row by row from the south, each row from the west.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    pub area: Rect,
    /// The edge of a cell, metres.
    pub cell_m: f64,
    /// From the cells' own frame to that of the message, metres east and north.
    pub shift_m: (f64, f64),
    /// The label of each cell; 0 is unexplored.
    pub labels: Vec<u8>,
    pub layers: Vec<GridLayer>,
}

/// A quantity of the cells of a grid.
#[derive(Debug, Clone, PartialEq)]
pub struct GridLayer {
    pub name: String,
    /// Whether it is the depth of the sea floor, metres.
    pub is_depth: bool,
    /// The quantity of each cell; NaN where it is not known.
    pub values: Vec<f32>,
}

impl Grid {
    /// The labels of a rectangle; `None` if it has more than [`MAX_GRID_CELLS`] cells.
    pub fn new(area: Rect, cell_m: f64, shift_m: (f64, f64), label: impl Fn(Cell) -> u8) -> Option<Self> {
        let is_small = area.area() <= MAX_GRID_CELLS;
        is_small.then(|| Self { area, cell_m, shift_m, labels: area.cells().map(label).collect(), layers: Vec::new() })
    }

    /// Adds a layer, with the `value` of each cell of the area.
    pub fn add_layer(&mut self, name: &str, is_depth: bool, value: impl Fn(Cell) -> Option<f64>) {
        let values = self.area.cells().map(|cell| value(cell).map_or(f32::NAN, |value| value as f32)).collect();
        self.layers.push(GridLayer { name: name.to_owned(), is_depth, values });
    }

    /// The south-west corner, metres east and north in the frame of the message.
    pub fn corner_m(&self) -> (f64, f64) {
        let Rect { x, y, .. } = self.area;
        (f64::from(x) * self.cell_m + self.shift_m.0, f64::from(y) * self.cell_m + self.shift_m.1)
    }

    /// Its width from west to east and its height from south to north, metres.
    pub fn size_m(&self) -> (f64, f64) {
        (f64::from(self.area.width) * self.cell_m, f64::from(self.area.height) * self.cell_m)
    }
}

#[cfg(test)]
pub(crate) fn example() -> Grid {
    let area = Rect { x: -1, y: 2, width: 3, height: 2 };
    // North row: 4 0 6; south row: 1 2 200.
    let label = |cell: Cell| match (cell.x, cell.y) {
        (-1, 2) => 1,
        (0, 2) => 2,
        (1, 2) => 200,
        (-1, 3) => 4,
        (1, 3) => 6,
        _ => 0,
    };
    let mut grid = Grid::new(area, 0.5, (10.0, 20.0), label).unwrap();
    grid.add_layer("depth", true, |cell| (cell.y == 2).then_some(f64::from(cell.x) + 8.0));
    grid
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_grid_has_its_corner_in_the_frame_of_the_message() {
        let grid = example();
        assert_eq!(grid.corner_m(), (9.5, 21.0));
        assert_eq!(grid.size_m(), (1.5, 1.0));
        assert_eq!(grid.labels, [1, 2, 200, 4, 0, 6]);
        let wide = Rect { x: 0, y: 0, width: 4096, height: 1025 };
        assert_eq!(Grid::new(wide, 1.0, (0.0, 0.0), |_| 0), None);
    }
}
