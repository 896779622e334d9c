//! The kinds of decisions about a cell: whether it stays unexplored, whether it keeps its label, and which label it gets.

use super::canvas::{Canvas, View, magnitude};
use super::stage::{Contexts, MAX_KEYED, StageLayout};
use crate::grid::MAX_LABEL;

pub(super) const CALM_LAYOUT: StageLayout = StageLayout {
    name: "calm",
    direct: &[6 * Recent::RATES, 5 * Recent::GAPS, 500],
    keyed: &[10],
    sets: [6, Recent::RATES, 10],
    apms: 1,
};

pub(super) fn calm_contexts(view: &View, noise: usize, calm: &Recent, border: &Recent) -> Contexts {
    let rate = calm.rate();
    let one_in = calm.one_in() - 2;
    let mut contexts = Contexts::default();
    contexts.direct[..3].copy_from_slice(&[
        rate * 6 + noise,
        calm.gap() * 5 + one_in / 2,
        (one_in * 10 + border.one_in() - 2) * 5 + rate / 10,
    ]);
    contexts.keyed[0] = (u32::from(view.held), one_in);
    contexts.sets = [noise, rate, border.one_in() - 2];
    contexts
}

pub(super) const FLIP_LAYOUT: StageLayout = StageLayout {
    name: "flip",
    direct: &[108, 512, 320, 1024, 180, 162, 5 * Recent::GAPS, 256, 30 * Recent::RATES, 900],
    keyed: &[5, 5],
    sets: [9, 12, Recent::RATES],
    apms: 27,
};

pub(super) fn flip_contexts(canvas: &Canvas, view: &View, wide: usize, calm: &Recent, border: &Recent) -> Contexts {
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

pub(super) const LABEL_LAYOUT: StageLayout = StageLayout {
    name: "label",
    direct: &[512, 512, 2048, 512, 256, 704, 128, 128],
    keyed: &[8, 8, 8, 128, 128],
    sets: [8, 18, 32],
    apms: 16,
};

/// Labels around a cell by votes, most votes first.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Votes {
    labels: [(u8, u8); 16],
    count: usize,
}

const WEIGHT_BEHIND: [u8; 10] = [6, 6, 3, 3, 2, 2, 1, 1, 1, 1];
const WEIGHT_AHEAD: [u8; 6] = [5, 5, 3, 3, 1, 1];

impl Votes {
    /// Votes of the neighbours for labels other than the one held.
    pub(super) fn around(view: &View) -> Self {
        let mut votes = Self::default();
        let ballots = view.behind.iter().zip(WEIGHT_BEHIND).chain(view.ahead.iter().zip(WEIGHT_AHEAD));
        for (&label, weight) in ballots.filter(|(label, _)| **label != 0 && **label != view.held) {
            match votes.labels[..votes.count].iter_mut().find(|entry| entry.0 == label) {
                Some(entry) => entry.1 += weight,
                None => {
                    votes.labels[votes.count] = (label, weight);
                    votes.count += 1;
                }
            }
        }
        votes.labels[..votes.count].sort_by_key(|&(_, weight)| std::cmp::Reverse(weight));
        votes
    }
    pub(super) fn ranked(&self) -> &[(u8, u8)] {
        &self.labels[..self.count]
    }

    fn weight(&self, rank: usize) -> usize {
        self.ranked().get(rank).map_or(0, |entry| usize::from(entry.1))
    }
}

/// Labels in use around the patch that got no vote, most frequent first.
pub(super) fn other_labels(canvas: &Canvas, view: &View, votes: &Votes) -> Vec<u8> {
    let voted = |label| votes.ranked().iter().any(|entry| entry.0 == label);
    let mut labels: Vec<u8> = (1..=MAX_LABEL).filter(|&l| canvas.count(l) > 0 && l != view.held && !voted(l)).collect();
    labels.sort_by_key(|&label| std::cmp::Reverse(canvas.count(label)));
    labels
}

/// Contexts of the decision for `candidate`, which has rank `rank`, while `left` labels in use are not ruled out.
pub(super) fn label_contexts(view: &View, votes: &Votes, candidate: u8, rank: usize, left: usize) -> Contexts {
    let flips = usize::from(view.held != 0);
    let few = rank.min(3);
    let ring = view.ring(candidate);
    let ten = view.behind_mask(candidate, 10);
    let [w, s, sw, se, ..] = view.behind;
    let partition = [w == s, w == sw, s == sw, s == se, w == se].iter().fold(0, |m, &same| m << 1 | usize::from(same));
    let voted = rank < votes.count;
    let (weight, next) = (votes.weight(rank), votes.weight(if rank == 0 { 1 } else { 0 }));
    let arrived = (view.changed & ten & 63) * 2 + flips;
    let left_class = magnitude(left).min(10);
    let top = votes.ranked().first().map_or(0, |entry| entry.0);
    let state = flips * 4 + few;
    Contexts {
        direct: [
            ((ten & 63) * 2 + flips) * 4 + few,
            ring * 2 + flips,
            ten * 2 + flips,
            partition * 16 + (ten & 15),
            ((weight / 3).min(15) * 8 + (next / 4).min(7)) * 2 + flips,
            ((rank.min(15) * 11 + left_class) * 2 + flips) * 2 + usize::from(voted),
            arrived,
            (ring >> 4) * 8 + (ten & 3) * 2 + flips,
            0,
            0,
        ],
        keyed: [
            (u32::from(candidate) << 1 | flips as u32, state),
            (u32::from(candidate) << 8 | u32::from(top), state),
            (u32::from(candidate) << 8 | u32::from(view.held), state),
            (u32::from_be_bytes([0, candidate, w, s]), (ten & 15) * 8 + state),
            (hash([candidate, w, s, sw, se]), (ten & 15) * 8 + state),
        ],
        sets: [state, flips * 9 + ring.count_ones() as usize, (ten & 15) * 2 + flips],
        apm: flips * 8 + few * 2 + usize::from(voted),
    }
}

fn hash(labels: [u8; 5]) -> u32 {
    labels.iter().fold(0, |hash: u32, &label| (hash ^ u32::from(label)).wrapping_mul(0x0100_0193).rotate_left(7))
}

/// Changes so far among one kind of cell.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Recent {
    visits: usize,
    changes: usize,
    since: usize,
}

impl Recent {
    /// The number of values of [`Recent::rate`].
    pub(super) const RATES: usize = 50;
    /// The number of values of [`Recent::gap`].
    pub(super) const GAPS: usize = 20;

    pub(super) fn note(&mut self, kept: bool) {
        self.visits += 1;
        self.changes += usize::from(!kept);
        self.since = if kept { self.since + 1 } else { 0 };
    }

    /// The number of changes and their rate, as a context.
    pub(super) fn rate(&self) -> usize {
        let sure = match self.changes {
            0 => 0,
            1 => 1,
            2..=3 => 2,
            4..=9 => 3,
            _ => 4,
        };
        sure * 10 + self.one_in() - 2
    }

    /// The logarithm of the number of cells for each change, 2 to 11.
    pub(super) fn one_in(&self) -> usize {
        (((self.visits + 8) / (self.changes + 1)).max(1).ilog2() as usize).clamp(2, 11)
    }

    /// The magnitude of the number of cells since the last change.
    pub(super) fn gap(&self) -> usize {
        magnitude(self.since).min(Self::GAPS - 1)
    }
}

pub(super) const UNSEEN_LAYOUT: StageLayout = StageLayout {
    name: "unseen",
    direct: &[256, 256, 512, 64, 81, 256, 1024, 144],
    keyed: &[],
    sets: [9, 16, 16],
    apms: 9,
};

/// The length of the current run of explored or unexplored cells along the row.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct CellRun {
    length: usize,
    seen: bool,
}

impl CellRun {
    pub(super) fn note(&mut self, column: usize, seen: bool) {
        self.length = if column > 0 && seen == self.seen { self.length + 1 } else { 1 };
        self.seen = seen;
    }
}

pub(super) fn unseen_contexts(
    canvas: &Canvas,
    at: usize,
    place: (usize, usize),
    view: &View,
    run: &CellRun,
) -> Contexts {
    let unseen = view.ring(0);
    let new = view.changed;
    let row = (-3..=3).fold(0, |mask, east| mask << 1 | usize::from(canvas.changed(at, east, -1)));
    let states = [0, 1, 2, 3].map(|i| if new >> i & 1 == 1 { 2 } else { usize::from(view.behind[i] != 0) });
    let edges = usize::from(place.0 == 0)
        | usize::from(place.0 + 1 == canvas.width) << 1
        | usize::from(place.1 == 0) << 2
        | usize::from(place.1 + 1 == canvas.height) << 3;
    let ahead = usize::from(view.ahead[0] != 0) | usize::from(view.ahead[1] != 0) << 1;
    let length = if place.0 == 0 { 0 } else { magnitude(run.length).min(15) };
    Contexts {
        direct: [
            unseen,
            (new & 63) * 4 + ahead,
            row * 4 + (new & 1) + (new >> 4 & 1) * 2,
            edges * 4 + (new & 3),
            states.iter().fold(0, |sum, state| sum * 3 + state),
            length * 16 + (new & 15),
            new & 1023,
            edges * 9 + states[0] * 3 + states[1],
            0,
            0,
        ],
        keyed: [(0, 0); MAX_KEYED],
        sets: [states[0] * 3 + states[1], edges, new & 15],
        apm: states[0] * 3 + states[1],
    }
}
