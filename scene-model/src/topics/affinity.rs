//! Appearance affinity: the label counts of a neighbour weigh more, the more alike the two cells look.
//!
//! The weight of a pair of neighbours is exp(-d / mean d), where d is the squared distance of their mean
//! colours. Weights are scaled to a mean of 1, so that on average the neighbours weigh as much as in the
//! paper, but label borders move to where the colour changes. It is the contrast term of image segmentation
//! (Boykov and Jolly, ICCV 2001).

/// The id of an absent cell or neighbour.
pub(crate) const NONE: u32 = u32::MAX;

/// Classes of squared distances: eight for each factor of two from 2^-16 on. Class 0 stands for an unknown distance.
const CLASSES: usize = 256;
/// Weights are multiples of 1/8, so that sums of weighted counts are exact in f32.
const STEPS: f64 = 8.0;
const MAX_WEIGHT: f64 = 4.0;

/// The mean colours of all cells, and the weights of their neighbours that follow.
#[derive(Clone, Debug)]
pub(crate) struct Affinity {
    /// Words below the cube of this are points of a colour lattice. 0: all neighbours have the weight 1.
    levels: u32,
    /// Sums of the lattice coordinates of a cell's colour words, and their number.
    colours: Vec<[u32; 4]>,
    /// The class of the distance to each neighbour.
    classes: Vec<[u8; 6]>,
    /// The number of neighbours in each class; each pair counts twice.
    pairs: Vec<u64>,
    weights: Vec<f32>,
}

impl Affinity {
    pub(crate) fn new(levels: u32) -> Self {
        Self { levels, colours: Vec::new(), classes: Vec::new(), pairs: vec![0; CLASSES], weights: vec![1.0; CLASSES] }
    }

    pub(crate) fn add_cell(&mut self) {
        if self.levels > 0 {
            self.colours.push([0; 4]);
            self.classes.push([0; 6]);
        }
    }

    /// Adds a word to the mean colour of its cell; words that are not colour words are ignored.
    pub(crate) fn add_word(&mut self, cell: u32, word: u32) {
        let n = self.levels;
        if word < n * n * n {
            let colour = &mut self.colours[cell as usize];
            for (sum, add) in colour.iter_mut().zip([word / (n * n), word / n % n, word % n, 1]) {
                *sum += add;
            }
        }
    }

    /// Updates the distances between a cell whose colour has changed and its neighbours.
    pub(crate) fn update_cell(&mut self, cell: u32, neighbours: &[u32; 6]) {
        if self.levels == 0 {
            return;
        }
        for (direction, &other) in neighbours.iter().enumerate().filter(|entry| *entry.1 != NONE) {
            let class = class(self.colours[cell as usize], self.colours[other as usize]);
            let old = std::mem::replace(&mut self.classes[cell as usize][direction], class);
            self.classes[other as usize][direction ^ 1] = class;
            self.pairs[usize::from(old)] = self.pairs[usize::from(old)].saturating_sub(2);
            self.pairs[usize::from(class)] += 2;
        }
    }

    /// Computes the weight of each class from the distances of all neighbours.
    pub(crate) fn update_weights(&mut self) {
        let known = || self.pairs.iter().enumerate().skip(1).map(|(class, &count)| (distance(class), count as f64));
        let total: f64 = known().map(|entry| entry.1).sum();
        if total == 0.0 {
            return;
        }
        let mean = known().map(|(distance, count)| distance * count).sum::<f64>() / total;
        let scale = total / known().map(|(distance, count)| (-distance / mean).exp() * count).sum::<f64>();
        for (class, weight) in self.weights.iter_mut().enumerate().skip(1) {
            let exact = (scale * (-distance(class) / mean).exp()).min(MAX_WEIGHT);
            *weight = ((exact * STEPS).round() / STEPS) as f32;
        }
    }

    /// The weight of the neighbour in one of the six directions.
    pub(crate) fn weight(&self, cell: u32, direction: usize) -> f32 {
        self.classes.get(cell as usize).map_or(1.0, |classes| self.weights[usize::from(classes[direction])])
    }
}

/// The class of the squared distance between two mean colours.
fn class(a: [u32; 4], b: [u32; 4]) -> u8 {
    if a[3] == 0 || b[3] == 0 {
        return 0;
    }
    let mean = |sums: [u32; 4], axis: usize| sums[axis] as f32 / sums[3] as f32;
    let distance: f32 = (0..3).map(|axis| (mean(a, axis) - mean(b, axis)).powi(2)).sum();
    // Exponent and three bits of the mantissa.
    ((distance.to_bits() >> 20).saturating_sub(111 << 3)).clamp(1, 255) as u8
}

/// The squared distance in the middle of a class.
fn distance(class: usize) -> f64 {
    f64::from(f32::from_bits((((111 << 3) + class as u32) << 20) + (1 << 19)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A row of cells with one colour word each.
    fn row(words: &[u32], levels: u32) -> Affinity {
        let mut affinity = Affinity::new(levels);
        for (cell, &word) in words.iter().enumerate() {
            affinity.add_cell();
            affinity.add_word(cell as u32, word);
            let west = if cell == 0 { NONE } else { cell as u32 - 1 };
            affinity.update_cell(cell as u32, &[west, NONE, NONE, NONE, NONE, NONE]);
        }
        affinity.update_weights();
        affinity
    }

    #[test]
    fn similar_neighbours_weigh_more_and_the_mean_is_one() {
        let affinity = row(&[0, 1, 0, 1, 511, 510, 511], 8);
        let weights: Vec<f32> = (1..7).map(|cell| affinity.weight(cell, 0)).collect();
        assert_eq!(weights[3], 0.0, "across the edge");
        assert!(weights.iter().enumerate().all(|(i, &w)| i == 3 || w > 1.0), "{weights:?}");
        assert!((weights.iter().sum::<f32>() / 6.0 - 1.0).abs() < 0.1, "{weights:?}");
        assert_eq!(affinity.weight(0, 1), affinity.weight(1, 0));
    }

    #[test]
    fn neighbours_of_equal_or_unknown_colour_weigh_one() {
        for (words, levels) in [(&[5, 5, 5][..], 8), (&[600, 700, 800], 8), (&[0, 511, 3], 0)] {
            let affinity = row(words, levels);
            assert!((0..3).all(|cell| (0..2).all(|direction| affinity.weight(cell, direction) == 1.0)));
        }
    }

    #[test]
    fn classes_are_within_an_eighth_of_the_distance() {
        for (a, b) in [([0, 0, 0, 1], [1, 0, 0, 1]), ([7, 7, 7, 2], [0, 0, 0, 3]), ([1, 0, 0, 40], [0, 0, 0, 40])] {
            let mean = |sums: [u32; 4], axis: usize| f64::from(sums[axis]) / f64::from(sums[3]);
            let exact: f64 = (0..3).map(|axis| (mean(a, axis) - mean(b, axis)).powi(2)).sum();
            let found = distance(usize::from(class(a, b)));
            assert!((found / exact - 1.0).abs() < 0.125, "{found} for {exact}");
        }
    }
}
