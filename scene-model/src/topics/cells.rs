//! The cells of the world: their words with labels, label counts and neighbours; from positions to cells by a spatial hash.

use super::affinity::{Affinity, NONE};
use super::labels::{LANES, Lanes, UNLABELLED, label_of, pack, word_of};
use crate::random::mix;

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

/// Cell coordinates in x, y, z.
pub(crate) type Coord = [i32; 3];

/// Returns the cell coordinates of a position, both `position` and the cell's `edges` in metres.
///
/// `None` if a coordinate is not finite, or 2^30 or more cells away from the origin. In x and y the origin is the
/// corner of cell 0; in z it is the middle of cell 0, so that a flat bottom near z = 0 does not fall into two cells in
/// turn.
///
/// ```
/// use scene_model::topics::{centre_of, coord_of};
///
/// let edges = [0.5, 0.5, 2.0];
/// assert_eq!(coord_of([-0.1, 0.6, -0.9], edges), Some([-1, 1, 0]));
/// assert_eq!(centre_of([-1, 1, 0], edges), [-0.25, 0.75, 0.0]);
/// assert_eq!(coord_of([f64::NAN, 0.0, 0.0], edges), None);
/// ```
#[must_use]
pub fn coord_of(position: [f64; 3], edges: [f64; 3]) -> Option<[i32; 3]> {
    const REACH: f64 = (1 << 30) as f64;
    let mut coord = [0; 3];
    for axis in 0..3 {
        let offset = if axis == 2 { 0.5 } else { 0.0 };
        let index = (position[axis] / edges[axis] + offset).floor();
        if !(-REACH..REACH).contains(&index) {
            return None;
        }
        coord[axis] = index as i32;
    }
    Some(coord)
}

/// Returns the centre of a cell in metres; the inverse of [`coord_of`].
#[must_use]
pub fn centre_of(coord: [i32; 3], edges: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|axis| (f64::from(coord[axis]) + if axis == 2 { 0.0 } else { 0.5 }) * edges[axis])
}

/// The six Von Neumann neighbours. The indices of opposite directions differ in the last bit.
pub(crate) fn neighbours_of([x, y, z]: Coord) -> [Coord; 6] {
    [[x - 1, y, z], [x + 1, y, z], [x, y - 1, z], [x, y + 1, z], [x, y, z - 1], [x, y, z + 1]]
}

/// Checkerboard colour: cells of one colour are never neighbours.
pub(crate) fn colour_of([x, y, z]: Coord) -> usize {
    ((x ^ y ^ z) & 1) as usize
}

/// An open-addressing hash table from coordinates to cell ids, at most half full.
#[derive(Clone, Debug, Default)]
pub(crate) struct SpatialHash {
    slots: Vec<(Coord, u32)>,
    len: usize,
}

impl SpatialHash {
    pub(crate) fn get(&self, coord: Coord) -> Option<u32> {
        if self.slots.is_empty() {
            return None;
        }
        let (_, id) = self.slots[self.slot(coord)];
        (id != NONE).then_some(id)
    }

    /// Adds a cell, which must be new.
    pub(crate) fn insert(&mut self, coord: Coord, id: u32) {
        if self.len * 2 >= self.slots.len() {
            self.grow();
        }
        let slot = self.slot(coord);
        self.slots[slot] = (coord, id);
        self.len += 1;
    }

    fn grow(&mut self) {
        let wider = vec![([0; 3], NONE); (self.slots.len() * 2).max(64)];
        let old = std::mem::replace(&mut self.slots, wider);
        for (coord, id) in old.into_iter().filter(|entry| entry.1 != NONE) {
            let slot = self.slot(coord);
            self.slots[slot] = (coord, id);
        }
    }

    /// The slot of `coord`, or the free slot to insert it in.
    fn slot(&self, coord: Coord) -> usize {
        let mask = self.slots.len() - 1;
        let mut slot = hash(coord) as usize & mask;
        while self.slots[slot].1 != NONE && self.slots[slot].0 != coord {
            slot = (slot + 1) & mask;
        }
        slot
    }
}

fn hash([x, y, z]: Coord) -> u64 {
    mix((u64::from(x as u32) << 32 | u64::from(y as u32)) ^ mix(u64::from(z as u32)))
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

    #[test]
    fn negative_positions_get_their_own_cells() {
        let edges = [0.5, 0.5, 2.0];
        assert_eq!(coord_of([-0.1, 0.1, -0.9], edges), Some([-1, 0, 0]));
        assert_eq!(coord_of([-0.5, -0.51, -1.1], edges), Some([-1, -2, -1]));
    }

    #[test]
    fn the_middle_of_a_cell_lies_in_it() {
        for coord in [[-3, 0, 2], [4, -1, -7], [0, 0, 0]] {
            assert_eq!(coord_of(centre_of(coord, [0.3, 2.0, 0.7]), [0.3, 2.0, 0.7]), Some(coord));
        }
    }

    #[test]
    fn a_position_out_of_range_has_no_cell() {
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300] {
            assert_eq!(coord_of([0.0, bad, 0.0], [1.0; 3]), None);
        }
    }

    #[test]
    fn every_inserted_cell_is_found_again() {
        let mut table = SpatialHash::default();
        let coords: Vec<Coord> = (0..3000).map(|i| [i % 50 - 25, i / 50 - 30, i % 3 - 1]).collect();
        for (id, coord) in coords.iter().enumerate() {
            assert_eq!(table.get(*coord), None);
            table.insert(*coord, id as u32);
        }
        for (id, coord) in coords.iter().enumerate() {
            assert_eq!(table.get(*coord), Some(id as u32));
        }
    }

    #[test]
    fn neighbours_have_the_other_colour() {
        for neighbour in neighbours_of([-3, 4, 0]) {
            assert_ne!(colour_of(neighbour), colour_of([-3, 4, 0]));
        }
    }
}
