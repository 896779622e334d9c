//! The cells of the world: their words with labels, label counts and neighbours.

use super::affinity::Affinity;
use super::grid::{Coord, NONE, SpatialHash, colour_of, neighbours_of};
use super::labels::{LANES, Lanes, UNLABELLED, label_of, pack, word_of};

/// All observed cells. Their ids are consecutive in the order of their first observation.
#[derive(Clone, Debug)]
pub(crate) struct Cells {
    blocks: usize,
    hash: SpatialHash,
    coords: Vec<Coord>,
    words: Vec<Vec<u32>>,
    counts: Vec<u16>,
    neighbours: Vec<[u32; 6]>,
    affinity: Affinity,
    total: u64,
}

impl Cells {
    /// No cells yet; each will have `blocks` x 16 label slots. `colour_levels` is as in the configuration.
    pub(crate) fn new(blocks: usize, colour_levels: u32) -> Self {
        Self {
            blocks,
            hash: SpatialHash::default(),
            coords: Vec::new(),
            words: Vec::new(),
            counts: Vec::new(),
            neighbours: Vec::new(),
            affinity: Affinity::new(colour_levels),
            total: 0,
        }
    }

    pub(crate) fn len(&self) -> usize {
        self.coords.len()
    }

    pub(crate) fn total(&self) -> u64 {
        self.total
    }

    pub(crate) fn coord(&self, cell: u32) -> Coord {
        self.coords[cell as usize]
    }

    pub(crate) fn colour(&self, cell: u32) -> usize {
        colour_of(self.coords[cell as usize])
    }

    /// The words of a cell, each packed with its label.
    pub(crate) fn words(&self, cell: u32) -> &[u32] {
        &self.words[cell as usize]
    }

    pub(crate) fn words_mut(&mut self, cell: u32) -> &mut Vec<u32> {
        &mut self.words[cell as usize]
    }

    pub(crate) fn width(&self) -> usize {
        self.blocks * LANES
    }

    /// The label counts of a cell, one for each slot.
    pub(crate) fn counts(&self, cell: u32) -> &[u16] {
        let width = self.width();
        &self.counts[cell as usize * width..][..width]
    }

    pub(crate) fn counts_mut(&mut self, cell: u32) -> &mut [u16] {
        let width = self.width();
        &mut self.counts[cell as usize * width..][..width]
    }

    pub(crate) fn neighbours(&self, cell: u32) -> &[u32; 6] {
        &self.neighbours[cell as usize]
    }

    /// The id of the cell at `coord`. A new cell is linked with its neighbours.
    pub(crate) fn find_or_add(&mut self, coord: Coord) -> u32 {
        if let Some(cell) = self.hash.get(coord) {
            return cell;
        }
        let cell = self.coords.len() as u32;
        let mut neighbours = [NONE; 6];
        for (direction, there) in neighbours_of(coord).into_iter().enumerate() {
            if let Some(other) = self.hash.get(there) {
                neighbours[direction] = other;
                self.neighbours[other as usize][direction ^ 1] = cell;
            }
        }
        self.hash.insert(coord, cell);
        self.coords.push(coord);
        self.words.push(Vec::new());
        self.counts.resize(self.counts.len() + self.width(), 0);
        self.neighbours.push(neighbours);
        self.affinity.add_cell();
        cell
    }

    /// Adds a cell of a checkpoint with its labelled words.
    pub(crate) fn restore(&mut self, coord: Coord, words: &[u32]) {
        let cell = self.find_or_add(coord);
        self.total += words.len() as u64;
        self.words[cell as usize] = words.to_vec();
        words.iter().for_each(|&packed| self.affinity.add_word(cell, word_of(packed)));
        self.affinity.update_cell(cell, &self.neighbours[cell as usize]);
        let counts = self.counts_mut(cell);
        words.iter().for_each(|&packed| counts[label_of(packed) as usize] += 1);
    }

    /// The sums of the label counts of `coord` and its six neighbours, of those that exist.
    pub(crate) fn counts_around(&self, coord: Coord) -> Vec<u32> {
        let mut sums = vec![0; self.width()];
        for there in std::iter::once(coord).chain(neighbours_of(coord)) {
            if let Some(cell) = self.hash.get(there) {
                sums.iter_mut().zip(self.counts(cell)).for_each(|(sum, &count)| *sum += u32::from(count));
            }
        }
        sums
    }

    /// Adds a word without a label.
    pub(crate) fn push(&mut self, cell: u32, word: u32) {
        self.words[cell as usize].push(pack(word, UNLABELLED));
        self.affinity.add_word(cell, word);
        self.total += 1;
    }

    /// Updates the appearance affinity after the cells in `changed` got words.
    pub(crate) fn update_affinity(&mut self, changed: impl Iterator<Item = u32>) {
        for cell in changed {
            self.affinity.update_cell(cell, &self.neighbours[cell as usize]);
        }
        self.affinity.update_weights();
    }

    /// Writes the label counts of a cell's neighbours, weighted by affinity, into `around`, and these
    /// plus its own into `near`.
    pub(crate) fn gather(&self, cell: u32, near: &mut [Lanes], around: &mut [Lanes]) {
        around.fill(Lanes([0.0; LANES]));
        for (direction, &other) in self.neighbours(cell).iter().enumerate() {
            if other != NONE {
                add_counts(around, self.counts(other), self.affinity.weight(cell, direction));
            }
        }
        near.copy_from_slice(around);
        add_counts(near, self.counts(cell), 1.0);
    }
}

fn add_counts(sum: &mut [Lanes], counts: &[u16], weight: f32) {
    for (lanes, counts) in sum.iter_mut().zip(counts.as_chunks::<LANES>().0) {
        for (lane, &count) in lanes.0.iter_mut().zip(counts) {
            *lane += weight * f32::from(count);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_are_linked_in_both_directions() {
        let mut cells = Cells::new(1, 0);
        let middle = cells.find_or_add([0, 0, 0]);
        let north = cells.find_or_add([0, 1, 0]);
        let below = cells.find_or_add([0, 0, -1]);
        assert_eq!(cells.neighbours(middle)[3], north);
        assert_eq!(cells.neighbours(north)[2], middle);
        assert_eq!(cells.neighbours(middle)[4], below);
        assert_eq!(cells.neighbours(below)[5], middle);
        assert_eq!(cells.find_or_add([0, 1, 0]), north);
        assert_eq!(cells.len(), 3);
    }
}
