//! How much a label map tells about expert annotations, beyond what any map with patches would.

mod annotations;
mod baselines;
mod cluster;
mod null;
mod trial;

pub use annotations::{AnnotationError, Annotations};
pub use baselines::{mean_lab_labels, mosaic_classes, pooled_word_labels};
pub use null::{SceneScore, score};
pub use trial::{MeanScore, Method, Scene, Trial, TrialError};

use crate::topics::FlatCell;

/// One label for each cell of a rectangle, row by row from the top; nothing where a cell has none.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LabelGrid {
    /// Cells across.
    pub columns: usize,
    /// Cells down.
    pub rows: usize,
    /// `columns` x `rows` labels.
    pub labels: Vec<Option<u32>>,
}

impl LabelGrid {
    /// A grid without labels.
    pub fn empty(columns: usize, rows: usize) -> Self {
        Self { columns, rows, labels: vec![None; columns * rows] }
    }

    /// The cells of a label map on a rectangle whose top left cell is `(left, top)`; y grows upwards in the map.
    ///
    /// Labels are topic numbers; cells outside the rectangle are left out.
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
