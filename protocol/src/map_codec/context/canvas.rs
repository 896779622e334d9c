//! The patch and its surroundings during coding: new labels where cells are coded, old ones elsewhere; and the neighbours of one
//! cell.

use crate::grid::{Rect, UNEXPLORED};
use crate::map_codec::patch::{Lattice, Patch};

/// The width of the margin around the patch in which contexts look.
pub(super) const MARGIN: usize = 3;
/// The width of the margin around the patch whose labels are expected first.
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
    /// The number of labels in the census.
    kinds: usize,
    /// How noisy the base is: the share of cells without an equal neighbour, in six classes.
    pub(super) noise: usize,
}

impl Canvas {
    pub(super) fn new(base: Lattice<'_>, rect: Rect) -> Self {
        let (width, height) = (rect.width as usize, rect.height as usize);
        let area = |margin: i64| {
            let (w, h) = (width + 2 * margin as usize, height + 2 * margin as usize);
            base.copy_area(i64::from(rect.x) - margin, i64::from(rect.y) - margin, w, h)
        };
        let mut census = [0; 256];
        area(CENSUS_MARGIN).into_iter().for_each(|label| census[usize::from(label)] += 1);
        let kinds = census.iter().skip(1).filter(|&&count| count > 0).count();
        let held = area(MARGIN as i64);
        let stride = width + 2 * MARGIN;
        let noise = noise(&held, stride);
        Self { width, height, stride, base: held.clone(), now: held, census, kinds, noise }
    }

    /// The index of the cell in `column` of `row`.
    pub(super) fn at(&self, column: usize, row: usize) -> usize {
        (row + MARGIN) * self.stride + column + MARGIN
    }

    /// The label of the cell in the base.
    pub(super) fn held(&self, at: usize) -> u8 {
        self.base[at]
    }

    /// The label `east` and `north` of the cell: new where coded, old elsewhere.
    #[inline(always)]
    pub(super) fn near(&self, at: usize, east: isize, north: isize) -> u8 {
        self.now[at.wrapping_add_signed(east + north * self.stride as isize)]
    }

    /// Whether the cell `east` and `north` of the cell is coded and has changed.
    #[inline(always)]
    pub(super) fn changed(&self, at: usize, east: isize, north: isize) -> bool {
        let i = at.wrapping_add_signed(east + north * self.stride as isize);
        self.now[i] != self.base[i]
    }

    pub(super) fn set(&mut self, at: usize, label: u8) {
        self.now[at] = label;
        let count = &mut self.census[usize::from(label)];
        self.kinds += usize::from(*count == 0 && label != UNEXPLORED);
        *count += 1;
    }

    /// The number of labels in use around, without `held`.
    pub(super) fn kinds_beside(&self, held: u8) -> usize {
        self.kinds - usize::from(held != UNEXPLORED && self.count(held) > 0)
    }

    /// The approximate number of cells with `label`.
    pub(super) fn count(&self, label: u8) -> u32 {
        self.census[usize::from(label)]
    }

    pub(super) fn into_patch(self, rect: Rect) -> Patch {
        let inside = |cells: &[u8]| -> Vec<u8> {
            let rows = cells.chunks(self.stride).skip(MARGIN).take(self.height);
            rows.flat_map(|row| row.iter().skip(MARGIN).take(self.width).copied()).collect()
        };
        Patch { rect, base: inside(&self.base), outcome: inside(&self.now) }
    }
}

fn noise(labels: &[u8], stride: usize) -> usize {
    let (mut seen, mut lonely) = (0usize, 0usize);
    for at in stride + 1..labels.len() - stride - 1 {
        let label = labels[at];
        if label != 0 {
            seen += 1;
            let rows = [at - stride, at, at + stride];
            let alike = rows.iter().map(|&i| labels[i - 1..i + 2].iter().filter(|&&l| l == label).count());
            lonely += usize::from(alike.sum::<usize>() == 1);
        }
    }
    match lonely * 1000 / seen.max(1) {
        0 => usize::from(lonely > 0),
        1..=3 => 2,
        4..=11 => 3,
        12..=35 => 4,
        _ => 5,
    }
}

/// Neighbours, nearest first among those already coded, then those ahead.
///
/// ```text
///            nn                   ahead: base labels
///        nw  n  ne
///     ww  w  .  e  ee
///   sww  sw  s  se  see           behind: new labels (w, ww and everything south)
///       ssw ss sse
/// ```
#[derive(Debug, Clone, Copy)]
pub(super) struct View {
    /// The label in the base.
    pub(super) held: u8,
    /// w, s, sw, se, ww, ss, ssw, sse, sww, see.
    pub(super) behind: [u8; 10],
    /// A bit mask of those that changed, lowest bit first.
    pub(super) changed: usize,
    /// e, n, ne, nw, ee, nn.
    pub(super) ahead: [u8; 6],
}

const BEHIND: [(isize, isize); 10] =
    [(-1, 0), (0, -1), (-1, -1), (1, -1), (-2, 0), (0, -2), (-1, -2), (1, -2), (-2, -1), (2, -1)];
const AHEAD: [(isize, isize); 6] = [(1, 0), (0, 1), (1, 1), (-1, 1), (2, 0), (0, 2)];

impl View {
    pub(super) fn of(canvas: &Canvas, at: usize) -> Self {
        let mut changed = 0;
        let behind = BEHIND.map(|(east, north)| canvas.near(at, east, north));
        for (i, (east, north)) in BEHIND.into_iter().enumerate() {
            changed |= usize::from(canvas.changed(at, east, north)) << i;
        }
        Self { held: canvas.held(at), behind, changed, ahead: AHEAD.map(|(east, north)| canvas.near(at, east, north)) }
    }

    /// A bit mask of the first `count` behind that hold `label`, lowest bit first.
    pub(super) fn behind_mask(&self, label: u8, count: usize) -> usize {
        mask(&self.behind[..count], label)
    }

    /// A bit mask of e, n, ne, nw that hold `label`, lowest bit first.
    pub(super) fn ahead_mask(&self, label: u8) -> usize {
        mask(&self.ahead[..4], label)
    }

    /// A bit mask of the eight neighbours that hold `label`: w, s, sw, se, e, n, ne, nw, lowest bit first.
    pub(super) fn ring(&self, label: u8) -> usize {
        self.behind_mask(label, 4) | self.ahead_mask(label) << 4
    }
}

fn mask(labels: &[u8], label: u8) -> usize {
    labels.iter().enumerate().fold(0, |mask, (i, &l)| mask | usize::from(l == label) << i)
}

/// 0, 1, 2, 3, then one class for each doubling.
pub(super) fn magnitude(count: usize) -> usize {
    if count < 4 { count } else { count.ilog2() as usize * 2 + (count >> (count.ilog2() - 1) & 1) }
}
