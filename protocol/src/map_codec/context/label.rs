//! The decision about the label of a changed cell, by one candidate after another.

use super::canvas::Canvas;
use super::stage::{Contexts, StageLayout};
use super::view::{View, magnitude};
use crate::grid::MAX_LABEL;

pub(super) const LAYOUT: StageLayout = StageLayout {
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
pub(super) fn others(canvas: &Canvas, view: &View, votes: &Votes) -> Vec<u8> {
    let voted = |label| votes.ranked().iter().any(|entry| entry.0 == label);
    let mut labels: Vec<u8> = (1..=MAX_LABEL).filter(|&l| canvas.count(l) > 0 && l != view.held && !voted(l)).collect();
    labels.sort_by_key(|&label| std::cmp::Reverse(canvas.count(label)));
    labels
}

/// Contexts of the decision for `candidate`, which has rank `rank`, while `left` labels in use are not ruled out.
pub(super) fn contexts(view: &View, votes: &Votes, candidate: u8, rank: usize, left: usize) -> Contexts {
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
