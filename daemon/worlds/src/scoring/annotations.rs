//! Expert annotations and label maps on a rectangle of cells.

use image::GrayImage;
use scene_model::topics::FlatCell;

/// The class of each cell: that of most of its annotated pixels, ties to the lowest class.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Annotations {
    pub(crate) columns: usize,
    pub(crate) rows: usize,
    pub(crate) classes: usize,
    /// `columns` x `rows` classes; `None` if no pixel of the cell is annotated.
    pub(crate) of_cells: Vec<Option<u8>>,
}

/// The annotations and the image differ in size.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the annotations are {found:?} pixels, the image is {wanted:?}")]
pub struct AnnotationError {
    /// Width and height of the annotations, pixels.
    pub found: (u32, u32),
    /// Width and height of the image, pixels.
    pub wanted: (u32, u32),
}

impl Annotations {
    /// Reduces the classes of an image of `size` (width, height) pixels to cells of `cell_px` x `cell_px` pixels.
    ///
    /// Pixels with a class in `ignore` count as not annotated. Fails if `labels` is not of the size of the image.
    ///
    /// ```
    /// use image::{GrayImage, Luma};
    /// use scenecast_worlds::scoring::Annotations;
    ///
    /// let classes = GrayImage::from_fn(40, 20, |x, _| Luma([if x < 20 { 3 } else { 255 }]));
    /// let annotations = Annotations::new(&classes, (40, 20), 10.0, &[255])?;
    /// assert_eq!(annotations.size(), (4, 2));
    /// // Four annotated cells, one class.
    /// assert_eq!(annotations.cells(), Some((4, 1)));
    /// # Ok::<(), scenecast_worlds::scoring::AnnotationError>(())
    /// ```
    pub fn new(labels: &GrayImage, size: (u32, u32), cell_px: f32, ignore: &[u8]) -> Result<Self, AnnotationError> {
        if labels.dimensions() != size {
            return Err(AnnotationError { found: labels.dimensions(), wanted: size });
        }
        let cells = |length: u32| (length as f32 / cell_px).ceil().max(1.0) as usize;
        let (columns, rows) = (cells(size.0), cells(size.1));
        let counted = |class: &u8| !ignore.contains(class);
        let classes = labels.as_raw().iter().copied().filter(counted).max().map_or(0, |highest| highest as usize + 1);
        let mut counts = vec![0u32; columns * rows * classes];
        for (x, y, pixel) in labels.enumerate_pixels().filter(|entry| counted(&entry.2.0[0])) {
            let column = ((x as f32 / cell_px) as usize).min(columns - 1);
            let row = ((y as f32 / cell_px) as usize).min(rows - 1);
            counts[(row * columns + column) * classes + pixel.0[0] as usize] += 1;
        }
        let most = |counts: &[u32]| {
            let ranked = counts.iter().zip((0..=u8::MAX).rev()).max().filter(|best| *best.0 > 0);
            ranked.map(|best| u8::MAX - best.1)
        };
        let of_cells =
            if classes == 0 { vec![None; columns * rows] } else { counts.chunks_exact(classes).map(most).collect() };
        Ok(Self { columns, rows, classes, of_cells })
    }

    /// Returns the number of annotated cells and of different classes, or `None` if no cell is annotated.
    #[must_use]
    pub fn cells(&self) -> Option<(usize, usize)> {
        let classes: std::collections::BTreeSet<u8> = self.of_cells.iter().copied().flatten().collect();
        (!classes.is_empty()).then(|| (self.of_cells.iter().flatten().count(), classes.len()))
    }

    /// Returns the number of columns and of rows, in cells.
    #[must_use]
    pub fn size(&self) -> (usize, usize) {
        (self.columns, self.rows)
    }
}

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
