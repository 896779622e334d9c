//! Does a cell that has a label keep it?

use super::canvas::Canvas;
use super::stage::{Contexts, Layout};
use super::view::{View, magnitude};

pub(super) const LAYOUT: Layout =
    Layout { direct: &[108, 512, 320, 1024, 180, 162, 60, 256], keyed: &[5, 5], sets: [9, 12], curves: 27 };

/// What the decisions so far tell about the next.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Recent {
    /// Seen cells since the last one that changed, apart for the inside of regions and their borders.
    since: [usize; 3],
}

impl Recent {
    pub(super) fn note(&mut self, view: &View, kept: bool) {
        let since = &mut self.since[border(view)];
        *since = if kept { *since + 1 } else { 0 };
    }
}

/// 0 inside a region, 1 near its border, 2 where fewer than half the neighbours hold the label.
fn border(view: &View) -> usize {
    match view.ring(view.held).count_ones() {
        8 => 0,
        5..=7 => 1,
        _ => 2,
    }
}

pub(super) fn contexts(canvas: &Canvas, at: usize, view: &View, recent: &Recent) -> Contexts {
    let held = view.held;
    let ring = view.ring(held);
    let same = ring.count_ones() as usize;
    let unseen = view.ring(0).count_ones() as usize;
    let changes = (view.changed.count_ones() as usize).min(3);
    let near_changes = view.changed & 63;
    let few_same = [0, 0, 1, 1, 2, 2, 3, 3, 4][same];
    let wide = wider_ring(canvas, at, held);
    let (other, votes) = leading_other(view);
    let unseen_class = [0, 1, 1, 2, 2, 2, 2, 2, 2][unseen];
    let other_is_new = usize::from(other != 0 && (0..4).any(|i| view.changed >> i & 1 == 1 && view.behind[i] == other));
    let gap = magnitude(recent.since[border(view)]).min(19);
    Contexts {
        direct: [
            (same * 3 + unseen_class) * 4 + changes,
            ring * 2 + usize::from(unseen > 0),
            near_changes * 5 + few_same,
            ring * 4 + changes,
            (wide * 9 + same) * 4 + (view.changed & 3),
            (votes * 9 + same) * 2 + other_is_new,
            border(view) * 20 + gap,
            view.ring(other) & if other == 0 { 0 } else { 255 },
            0,
            0,
        ],
        keyed: [(u32::from(held), few_same), (u32::from(held) << 8 | u32::from(other), few_same), (0, 0)],
        sets: [same, unseen_class * 4 + changes],
        curve: same * 3 + changes.min(2),
    }
}

/// How many of the sixteen cells two steps away differ, in five classes.
fn wider_ring(canvas: &Canvas, at: usize, held: u8) -> usize {
    let mut differ = 0;
    for i in -2..=2 {
        differ += usize::from(canvas.near(at, i, -2) != held) + usize::from(canvas.near(at, i, 2) != held);
    }
    for i in -1..=1 {
        differ += usize::from(canvas.near(at, -2, i) != held) + usize::from(canvas.near(at, 2, i) != held);
    }
    match differ {
        0 => 0,
        1..=2 => 1,
        3..=5 => 2,
        6..=9 => 3,
        _ => 4,
    }
}

/// The label that most of the eight around hold, other than this cell's and none, and how many.
pub(super) fn leading_other(view: &View) -> (u8, usize) {
    let mut best = (0, 0);
    for &label in view.behind[..4].iter().chain(&view.ahead[..4]) {
        if label != 0 && label != view.held && label != best.0 {
            let votes = view.ring(label).count_ones() as usize;
            if votes > best.1 {
                best = (label, votes);
            }
        }
    }
    best
}
