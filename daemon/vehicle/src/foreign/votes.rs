//! The votes of segmented images for the classes of cells.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Votes of a cell beyond which all are halved, so that new images keep their weight.
const MAX_VOTES: u32 = 60_000;

/// The pixels of each class in a cell, the lowest class first.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct CellVotes(Vec<(u8, u32)>);

impl CellVotes {
    pub(super) fn add(&mut self, class: u8, pixels: u32) {
        match self.0.binary_search_by_key(&class, |&(class, _)| class) {
            Ok(at) => self.0[at].1 += pixels,
            Err(at) => self.0.insert(at, (class, pixels)),
        }
    }

    fn merge(&mut self, other: &Self) {
        other.0.iter().for_each(|&(class, pixels)| self.add(class, pixels));
        while self.0.iter().map(|&(_, pixels)| pixels).sum::<u32>() > MAX_VOTES {
            self.0.iter_mut().for_each(|(_, pixels)| *pixels /= 2);
            self.0.retain(|&(_, pixels)| pixels > 0);
        }
    }

    /// The class with most votes; `held` on a tie that it is part of, else the lowest.
    pub(super) fn winner(&self, held: Option<u8>) -> Option<u8> {
        let most = self.0.iter().map(|&(_, pixels)| pixels).max()?;
        let mut winners = self.0.iter().filter(|&&(_, pixels)| pixels == most).map(|&(class, _)| class);
        let first = winners.next()?;
        held.filter(|held| *held == first || winners.any(|class| class == *held)).or(Some(first))
    }
}

/// The votes of all cells.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Votes(BTreeMap<(i32, i32), CellVotes>);

impl Votes {
    /// Adds the votes of an image for a cell, or, if `is_newest_only`, puts them in the place of those of earlier images.
    pub(super) fn vote(&mut self, cell: (i32, i32), image: &CellVotes, is_newest_only: bool) -> &CellVotes {
        let votes = self.0.entry(cell).or_default();
        if is_newest_only {
            votes.0.clear();
        }
        votes.merge(image);
        votes
    }

    /// A grid states the class of a cell, so that earlier images no longer count.
    pub(super) fn forget(&mut self, cell: (i32, i32)) {
        self.0.remove(&cell);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn votes(counts: &[(u8, u32)]) -> CellVotes {
        let mut votes = CellVotes::default();
        counts.iter().for_each(|&(class, pixels)| votes.add(class, pixels));
        votes
    }

    #[test]
    fn the_most_frequent_class_of_all_images_wins() {
        let mut all = Votes::default();
        assert_eq!(all.vote((0, 0), &votes(&[(4, 9), (2, 10)]), false).winner(None), Some(2));
        assert_eq!(all.vote((0, 0), &votes(&[(4, 1)]), false).winner(Some(2)), Some(2), "a tie keeps the class");
        assert_eq!(all.vote((0, 0), &votes(&[(4, 1)]), false).winner(Some(2)), Some(4));
        assert_eq!(all.vote((0, 0), &votes(&[(7, 1)]), true).winner(Some(4)), Some(7), "the newest image alone");
        assert_eq!(votes(&[(3, 1), (9, 1)]).winner(Some(5)), Some(3));
        assert_eq!(CellVotes::default().winner(None), None);
    }

    #[test]
    fn an_old_cell_still_follows_new_images() {
        let mut all = Votes::default();
        (0..1000).for_each(|_| drop(all.vote((0, 0), &votes(&[(1, 50_000)]), false).clone()));
        let changed = (1..9).find(|_| all.vote((0, 0), &votes(&[(2, 50_000)]), false).winner(Some(1)) == Some(2));
        assert!(changed.is_some_and(|images| images <= 3));
    }
}
