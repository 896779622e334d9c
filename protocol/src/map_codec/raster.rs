//! A dense map of labels.

use crate::grid::{Cell, LabelGrid};

/// A map that stores a label for each cell of a rectangle.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LabelRaster {
    /// The number of columns, at least 1.
    pub width: usize,
    /// The number of rows, at least 1.
    pub height: usize,
    /// `width * height` labels, row by row from the south; 0 is unexplored.
    pub labels: Vec<u8>,
}

impl LabelRaster {
    /// A map with one label everywhere.
    pub fn uniform(width: usize, height: usize, label: u8) -> Self {
        Self { width, height, labels: vec![label; width * height] }
    }

    /// The map as a grid whose cell (0, 0) is the first label.
    pub fn to_grid(&self) -> LabelGrid {
        let cells = self.labels.iter().enumerate().filter(|&(_, &label)| label != 0);
        cells.map(|(i, &label)| (Cell::new((i % self.width) as i32, (i / self.width) as i32), label)).collect()
    }

    /// The part of `grid` from cell (0, 0) on that has `width` columns and `height` rows.
    pub fn from_grid(grid: &LabelGrid, width: usize, height: usize) -> Self {
        Self { width, height, labels: grid.copy_area(0, 0, width, height) }
    }

    /// The change from `before`, which has the same size: 0 = untouched, 255 = becomes unexplored.
    pub fn delta_from(&self, before: &Self) -> Self {
        let delta = self.labels.iter().zip(&before.labels).map(|(&new, &old)| match new {
            same if same == old => 0,
            0 => 255,
            new => new,
        });
        Self { width: self.width, height: self.height, labels: delta.collect() }
    }

    /// The smallest part that holds every cell other than 0; one cell if there is none.
    pub fn trimmed(&self) -> Self {
        let set: Vec<usize> = (0..self.labels.len()).filter(|&i| self.labels[i] != 0).collect();
        let columns = || set.iter().map(|i| i % self.width);
        let (left, right) = (columns().min().unwrap_or(0), columns().max().unwrap_or(0));
        let (first, last) = (set.first().unwrap_or(&0) / self.width, set.last().unwrap_or(&0) / self.width);
        let labels = (first..=last).flat_map(|row| (left..=right).map(move |column| self.get(column, row))).collect();
        Self { width: right - left + 1, height: last - first + 1, labels }
    }

    /// The label in `column` of `row`.
    pub fn get(&self, column: usize, row: usize) -> u8 {
        self.labels[row * self.width + column]
    }

    /// Sets the label in `column` of `row`.
    pub fn set(&mut self, column: usize, row: usize, label: u8) {
        self.labels[row * self.width + column] = label;
    }
}
