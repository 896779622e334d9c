//! A label map on a rectangle of cells.

use scene_model::topics::FlatCell;

/// A label map on a rectangle of cells, row by row from the top.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LabelGrid {
    /// The number of cells in a row.
    pub columns: usize,
    /// The number of rows, from north to south.
    pub rows: usize,
    /// `columns` x `rows` labels; `None` for a cell without a label.
    pub labels: Vec<Option<u32>>,
}

impl LabelGrid {
    /// Returns a grid without labels.
    #[must_use]
    pub fn empty(columns: usize, rows: usize) -> Self {
        Self { columns, rows, labels: vec![None; columns * rows] }
    }

    /// Returns the part of a label map on the rectangle whose top left cell is `(left, top)`; in the map, y grows
    /// upwards.
    ///
    /// Labels are topic numbers. Cells outside the rectangle are left out.
    #[must_use]
    pub fn from_map(map: &[FlatCell], left: i32, top: i32, columns: usize, rows: usize) -> Self {
        let mut grid = Self::empty(columns, rows);
        for cell in map {
            let (x, y) = (i64::from(cell.x) - i64::from(left), i64::from(top) - i64::from(cell.y));
            if (0..columns as i64).contains(&x) && (0..rows as i64).contains(&y) {
                grid.labels[y as usize * columns + x as usize] = Some(cell.topic.0);
            }
        }
        grid
    }
}
