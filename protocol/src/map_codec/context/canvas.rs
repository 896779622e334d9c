//! The patch and what lies around it, as the coder sees it: new labels where it has been, old ones elsewhere.

use crate::map::{LabelGrid, Rect};
use crate::map_codec::window::Patch;

/// Cells around the patch that contexts look at.
pub(super) const MARGIN: usize = 3;
/// Cells around the patch whose labels are expected first.
const CENSUS_MARGIN: i64 = 16;

/// Labels in and around a patch.
#[derive(Debug, Clone)]
pub(super) struct Canvas {
    pub(super) width: usize,
    pub(super) height: usize,
    stride: usize,
    base: Vec<u8>,
    now: Vec<u8>,
    /// Cells by label, in the base around the patch and as coded.
    census: [u32; 256],
}

impl Canvas {
    pub(super) fn new(base: &LabelGrid, rect: Rect) -> Self {
        let (width, height) = (rect.width as usize, rect.height as usize);
        let area = |margin: i64| {
            let (w, h) = (width + 2 * margin as usize, height + 2 * margin as usize);
            base.copy_area(i64::from(rect.x) - margin, i64::from(rect.y) - margin, w, h)
        };
        let mut census = [0; 256];
        area(CENSUS_MARGIN).into_iter().for_each(|label| census[usize::from(label)] += 1);
        let held = area(MARGIN as i64);
        Self { width, height, stride: width + 2 * MARGIN, base: held.clone(), now: held, census }
    }

    /// Where the cell in `column` of `row` lies.
    pub(super) fn at(&self, column: usize, row: usize) -> usize {
        (row + MARGIN) * self.stride + column + MARGIN
    }

    /// The label that the cell had.
    pub(super) fn held(&self, at: usize) -> u8 {
        self.base[at]
    }

    /// The label `east` and `north` of the cell: new where coded, old elsewhere.
    #[inline(always)]
    pub(super) fn near(&self, at: usize, east: isize, north: isize) -> u8 {
        self.now[at.wrapping_add_signed(east + north * self.stride as isize)]
    }

    /// Whether the cell `east` and `north` of the cell has been coded and changed.
    #[inline(always)]
    pub(super) fn changed(&self, at: usize, east: isize, north: isize) -> bool {
        let i = at.wrapping_add_signed(east + north * self.stride as isize);
        self.now[i] != self.base[i]
    }

    /// Writes the cell's new label.
    pub(super) fn set(&mut self, at: usize, label: u8) {
        self.now[at] = label;
        self.census[usize::from(label)] += 1;
    }

    /// How many cells hold `label`, nearly.
    pub(super) fn count(&self, label: u8) -> u32 {
        self.census[usize::from(label)]
    }

    /// The coded patch.
    pub(super) fn into_patch(self, rect: Rect) -> Patch {
        let inside = |cells: &[u8]| -> Vec<u8> {
            let rows = cells.chunks(self.stride).skip(MARGIN).take(self.height);
            rows.flat_map(|row| row.iter().skip(MARGIN).take(self.width).copied()).collect()
        };
        Patch { rect, base: inside(&self.base), outcome: inside(&self.now) }
    }
}
