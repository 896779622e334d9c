//! A plain implementation of the published algorithm, as a reference for the speed of the sampler: one word after
//! another, 64-bit floats, one division for each label, one cumulative distribution for each word.

use super::workload::{Workload, XorShiftRng};

/// A square world with a fixed number of labels, all of them in use from the start.
pub struct PlainSampler {
    labels: usize,
    vocabulary: usize,
    words: Vec<Vec<(usize, usize)>>,
    neighbours: Vec<Vec<usize>>,
    in_cell: Vec<Vec<f64>>,
    of_word: Vec<Vec<f64>>,
    of_label: Vec<f64>,
    rng: XorShiftRng,
}

const ALPHA: f64 = 0.01;
const BETA: f64 = 0.1;

impl PlainSampler {
    pub fn new(work: &Workload, labels: usize) -> Self {
        let side = work.side as usize;
        let vocabulary = work.vocabulary as usize;
        let around = |cell: usize| {
            let (x, y) = (cell % side, cell / side);
            let mut near = Vec::new();
            near.extend((x > 0).then(|| cell - 1));
            near.extend((x + 1 < side).then(|| cell + 1));
            near.extend((y > 0).then(|| cell - side));
            near.extend((y + 1 < side).then(|| cell + side));
            near
        };
        let mut plain = Self {
            labels,
            vocabulary,
            words: vec![Vec::new(); side * side],
            neighbours: (0..side * side).map(around).collect(),
            in_cell: vec![vec![0.0; labels]; side * side],
            of_word: vec![vec![0.0; labels]; vocabulary],
            of_label: vec![0.0; labels],
            rng: XorShiftRng(99),
        };
        for seen in &work.observations {
            let cell = seen.y as usize * side + seen.x as usize;
            let label = (plain.rng.unit() * labels as f64) as usize;
            plain.words[cell].push((seen.word as usize, label));
            plain.count(cell, seen.word as usize, label, 1.0);
        }
        plain
    }

    fn count(&mut self, cell: usize, word: usize, label: usize, sign: f64) {
        self.in_cell[cell][label] += sign;
        self.of_word[word][label] += sign;
        self.of_label[label] += sign;
    }

    /// Resamples every word once, and returns their number.
    pub fn sweep(&mut self) -> u64 {
        let mut done = 0;
        for cell in 0..self.words.len() {
            for index in 0..self.words[cell].len() {
                let (word, old) = self.words[cell][index];
                self.count(cell, word, old, -1.0);
                let new = self.draw(cell, word);
                self.count(cell, word, new, 1.0);
                self.words[cell][index].1 = new;
                done += 1;
            }
        }
        done
    }

    fn draw(&mut self, cell: usize, word: usize) -> usize {
        let mut near = self.in_cell[cell].clone();
        for &other in &self.neighbours[cell] {
            near.iter_mut().zip(&self.in_cell[other]).for_each(|(sum, count)| *sum += count);
        }
        let mut total = 0.0;
        let cumulative: Vec<f64> = (0..self.labels)
            .map(|k| {
                let likelihood = (self.of_word[word][k] + BETA) / (self.of_label[k] + self.vocabulary as f64 * BETA);
                total += (near[k] + ALPHA) * likelihood;
                total
            })
            .collect();
        let aim = self.rng.unit() * total;
        cumulative.partition_point(|&sum| sum <= aim).min(self.labels - 1)
    }
}
