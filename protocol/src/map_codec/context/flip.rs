//! The decision whether a cell near a border or a change keeps its label.

use super::canvas::Canvas;
use super::recent::Recent;
use super::stage::{Contexts, StageLayout};
use super::view::View;

pub(super) const LAYOUT: StageLayout = StageLayout {
    name: "flip",
    direct: &[108, 512, 320, 1024, 180, 162, 5 * Recent::GAPS, 256, 30 * Recent::RATES, 900],
    keyed: &[5, 5],
    sets: [9, 12, Recent::RATES],
    apms: 27,
};

pub(super) fn contexts(canvas: &Canvas, view: &View, wide: usize, calm: &Recent, border: &Recent) -> Contexts {
    let held = view.held;
    let ring = view.ring(held);
    let same = ring.count_ones() as usize;
    let unseen = view.ring(0).count_ones() as usize;
    let changes = (view.changed.count_ones() as usize).min(3);
    let near_changes = view.changed & 63;
    let few_same = [0, 0, 1, 1, 2, 2, 3, 3, 4][same];
    let one_in = border.one_in() - 2;
    let noise = canvas.noise;
    let (other, votes) = leading_other(view);
    let unseen_class = [0, 1, 1, 2, 2, 2, 2, 2, 2][unseen];
    let other_is_new = usize::from(other != 0 && (0..4).any(|i| view.changed >> i & 1 == 1 && view.behind[i] == other));
    Contexts {
        direct: [
            (same * 3 + unseen_class) * 4 + changes,
            ring * 2 + usize::from(unseen > 0),
            near_changes * 5 + few_same,
            ring * 4 + changes,
            (wide * 9 + same) * 4 + (view.changed & 3),
            (votes * 9 + same) * 2 + other_is_new,
            border.gap() * 5 + few_same,
            view.ring(other) & if other == 0 { 0 } else { 255 },
            (border.rate() * 5 + few_same) * 6 + noise,
            (one_in * 10 + calm.one_in() - 2) * 9 + same,
        ],
        keyed: [
            (u32::from(held), few_same),
            (u32::from(held) << 8 | u32::from(other), few_same),
            (0, 0),
            (0, 0),
            (0, 0),
        ],
        sets: [same, unseen_class * 4 + changes, border.rate()],
        apm: same * 3 + changes.min(2),
    }
}

/// How many of the sixteen cells two steps away differ, in five classes.
pub(super) fn wider_ring(canvas: &Canvas, at: usize, held: u8) -> usize {
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

/// The most frequent label among the eight neighbours other than this cell's and unexplored, and its number of cells.
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
