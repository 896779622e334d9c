//! The neighbours of one cell.

use super::canvas::Canvas;

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
