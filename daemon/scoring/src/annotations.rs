//! Expert annotations, one class per cell.

use image::GrayImage;

/// The class that most annotated pixels of each cell have; ties to the lowest class.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Annotations {
    pub(super) columns: usize,
    pub(super) rows: usize,
    pub(super) classes: usize,
    /// `columns` x `rows` classes, nothing where no pixel counts.
    pub(super) of_cells: Vec<Option<u8>>,
}

/// Annotations that do not fit their image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the annotations are {found:?} pixels, the image is {wanted:?}")]
pub struct AnnotationError {
    /// Width and height of the annotations.
    pub found: (u32, u32),
    /// Width and height of the image.
    pub wanted: (u32, u32),
}

impl Annotations {
    /// Takes the classes of an image of `size` pixels on cells of `cell_px` pixels; classes in `ignore` do not count.
    pub fn new(labels: &GrayImage, size: (u32, u32), cell_px: f32, ignore: &[u8]) -> Result<Self, AnnotationError> {
        if labels.dimensions() != size {
            return Err(AnnotationError { found: labels.dimensions(), wanted: size });
        }
        let cells = |length: u32| (length as f32 / cell_px).ceil().max(1.0) as usize;
        let (columns, rows) = (cells(size.0), cells(size.1));
        let counted = |class: &u8| !ignore.contains(class);
        let classes = labels.as_raw().iter().copied().filter(counted).max().map_or(0, |most| most as usize + 1);
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

    /// Annotated cells and different classes among them; nothing if no cell is annotated.
    pub fn cells(&self) -> Option<(usize, usize)> {
        let classes: std::collections::BTreeSet<u8> = self.of_cells.iter().copied().flatten().collect();
        (!classes.is_empty()).then(|| (self.of_cells.iter().flatten().count(), classes.len()))
    }

    /// Cells across and down.
    pub fn size(&self) -> (usize, usize) {
        (self.columns, self.rows)
    }
}
