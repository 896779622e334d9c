//! Expert annotations: one class for each cell.

use image::GrayImage;

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
    /// use scenecast_scoring::Annotations;
    ///
    /// let classes = GrayImage::from_fn(40, 20, |x, _| Luma([if x < 20 { 3 } else { 255 }]));
    /// let annotations = Annotations::new(&classes, (40, 20), 10.0, &[255])?;
    /// assert_eq!(annotations.size(), (4, 2));
    /// // Four annotated cells, one class.
    /// assert_eq!(annotations.cells(), Some((4, 1)));
    /// # Ok::<(), scenecast_scoring::AnnotationError>(())
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
