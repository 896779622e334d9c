//! How much a neighbour counts: more, the more alike two cells look.
//!
//! The weight of a pair is exp(-d / mean d), d the squared distance of their mean colours, scaled so that the mean
//! weight is 1: on average as many neighbours count as in the paper, but borders of labels come to lie where the colour
//! changes. (The same contrast term is usual in segmentation: Boykov and Jolly, ICCV 2001.)

use super::grid::NONE;

/// Classes of distances: 8 an octave from 2^-16 on; 0 stands for "not known".
const CLASSES: usize = 256;
/// Weights are multiples of 1 / this, so that sums of weighted counts are exact in f32.
const STEPS: f64 = 8.0;
const MOST: f64 = 4.0;

/// Colours of cells, and what follows for their neighbours.
#[derive(Clone, Debug)]
pub(crate) struct Kinship {
    /// Words below the cube of this are points of a colour lattice; 0: all neighbours count alike.
    levels: u32,
    /// Sums of the lattice coordinates of a cell's colour words, and their number.
    looks: Vec<[u32; 4]>,
    /// Class of the distance to each neighbour.
    links: Vec<[u8; 6]>,
    /// Links of each class; each pair counts twice.
    census: Vec<u64>,
    weights: Vec<f32>,
}

impl Kinship {
    pub(crate) fn new(levels: u32) -> Self {
        Self { levels, looks: Vec::new(), links: Vec::new(), census: vec![0; CLASSES], weights: vec![1.0; CLASSES] }
    }

    /// Makes room for the next cell.
    pub(crate) fn add_cell(&mut self) {
        if self.levels > 0 {
            self.looks.push([0; 4]);
            self.links.push([0; 6]);
        }
    }

    /// Takes a word of a cell into its looks.
    pub(crate) fn see(&mut self, cell: u32, word: u32) {
        let n = self.levels;
        if word < n * n * n {
            let look = &mut self.looks[cell as usize];
            for (sum, add) in look.iter_mut().zip([word / (n * n), word / n % n, word % n, 1]) {
                *sum += add;
            }
        }
    }

    /// Compares a cell whose looks have changed with its neighbours.
    pub(crate) fn relink(&mut self, cell: u32, neighbours: &[u32; 6]) {
        if self.levels == 0 {
            return;
        }
        for (direction, &other) in neighbours.iter().enumerate().filter(|entry| *entry.1 != NONE) {
            let class = class(self.looks[cell as usize], self.looks[other as usize]);
            let old = std::mem::replace(&mut self.links[cell as usize][direction], class);
            self.links[other as usize][direction ^ 1] = class;
            self.census[usize::from(old)] = self.census[usize::from(old)].saturating_sub(2);
            self.census[usize::from(class)] += 2;
        }
    }

    /// Brings the weights up to date with the links.
    pub(crate) fn settle(&mut self) {
        let known = || self.census.iter().enumerate().skip(1).map(|(class, &links)| (distance(class), links as f64));
        let links: f64 = known().map(|entry| entry.1).sum();
        if links == 0.0 {
            return;
        }
        let mean = known().map(|(distance, links)| distance * links).sum::<f64>() / links;
        let scale = links / known().map(|(distance, links)| (-distance / mean).exp() * links).sum::<f64>();
        for (class, weight) in self.weights.iter_mut().enumerate().skip(1) {
            let exact = (scale * (-distance(class) / mean).exp()).min(MOST);
            *weight = ((exact * STEPS).round() / STEPS) as f32;
        }
    }

    /// How much the neighbour in a direction counts.
    pub(crate) fn weight(&self, cell: u32, direction: usize) -> f32 {
        self.links.get(cell as usize).map_or(1.0, |links| self.weights[usize::from(links[direction])])
    }
}

/// Class of the squared distance between two mean colours.
fn class(a: [u32; 4], b: [u32; 4]) -> u8 {
    if a[3] == 0 || b[3] == 0 {
        return 0;
    }
    let mean = |look: [u32; 4], axis: usize| look[axis] as f32 / look[3] as f32;
    let distance: f32 = (0..3).map(|axis| (mean(a, axis) - mean(b, axis)).powi(2)).sum();
    // Exponent and three bits of the mantissa.
    ((distance.to_bits() >> 20).saturating_sub(111 << 3)).clamp(1, 255) as u8
}

/// Squared distance in the middle of a class.
fn distance(class: usize) -> f64 {
    f64::from(f32::from_bits((((111 << 3) + class as u32) << 20) + (1 << 19)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A row of cells with one colour word each.
    fn row(words: &[u32], levels: u32) -> Kinship {
        let mut kinship = Kinship::new(levels);
        for (cell, &word) in words.iter().enumerate() {
            kinship.add_cell();
            kinship.see(cell as u32, word);
            let west = if cell == 0 { NONE } else { cell as u32 - 1 };
            kinship.relink(cell as u32, &[west, NONE, NONE, NONE, NONE, NONE]);
        }
        kinship.settle();
        kinship
    }

    #[test]
    fn cells_that_look_alike_count_more_and_the_mean_stays_one() {
        let kinship = row(&[0, 1, 0, 1, 511, 510, 511], 8);
        let weights: Vec<f32> = (1..7).map(|cell| kinship.weight(cell, 0)).collect();
        assert_eq!(weights[3], 0.0, "across the edge");
        assert!(weights.iter().enumerate().all(|(i, &w)| i == 3 || w > 1.0), "{weights:?}");
        assert!((weights.iter().sum::<f32>() / 6.0 - 1.0).abs() < 0.1, "{weights:?}");
        assert_eq!(kinship.weight(0, 1), kinship.weight(1, 0));
    }

    #[test]
    fn where_nothing_differs_or_is_known_all_neighbours_count_alike() {
        for (words, levels) in [(&[5, 5, 5][..], 8), (&[600, 700, 800], 8), (&[0, 511, 3], 0)] {
            let kinship = row(words, levels);
            assert!((0..3).all(|cell| (0..2).all(|direction| kinship.weight(cell, direction) == 1.0)));
        }
    }

    #[test]
    fn classes_tell_distances_apart_within_an_eighth() {
        for (a, b) in [([0, 0, 0, 1], [1, 0, 0, 1]), ([7, 7, 7, 2], [0, 0, 0, 3]), ([1, 0, 0, 40], [0, 0, 0, 40])] {
            let mean = |look: [u32; 4], axis: usize| f64::from(look[axis]) / f64::from(look[3]);
            let exact: f64 = (0..3).map(|axis| (mean(a, axis) - mean(b, axis)).powi(2)).sum();
            let found = distance(usize::from(class(a, b)));
            assert!((found / exact - 1.0).abs() < 0.125, "{found} for {exact}");
        }
    }
}
