//! Label maps drawn from the prior: a spatial Chinese Restaurant Process, as in the figure of the paper.

use scene_model::random::CounterRng;

/// A label map that was drawn from the prior.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LabelWorld {
    /// The number of cells in a row.
    pub columns: usize,
    /// The number of rows of cells.
    pub rows: usize,
    /// The label of each cell, row by row, numbered from 0 in the order of birth.
    pub labels: Vec<u32>,
}

/// Draws a world of `columns` x `rows` cells with `words` words in each.
///
/// Cells are filled in the order of an explorer: each is next to an earlier one. Each word takes label k with the
/// weight n_k + `alpha`, where n_k counts the label in the cell and its Von Neumann neighbours, or a new label with the
/// weight `gamma`. Both weights are 0 or above. The cell shows the label that most of its words have, ties to the
/// oldest.
///
/// ```
/// let world = scenecast_worlds::sample(1, 50, 40, 1e-4, 0.01, 8);
/// assert_eq!(world.labels.len(), 50 * 40);
/// ```
#[must_use]
pub fn sample(seed: u64, columns: usize, rows: usize, alpha: f64, gamma: f64, words: u32) -> LabelWorld {
    let mut rng = CounterRng::new(seed);
    let mut tables: Vec<Vec<(u32, u32)>> = vec![Vec::new(); columns * rows];
    let mut prior = Prior { alpha, gamma, totals: Vec::new() };
    for cell in growth(columns, rows, &mut rng) {
        let mut near: Vec<(u32, u32)> = Vec::new();
        for &(label, words) in neighbours(cell, columns, rows).flat_map(|other| &tables[other]) {
            add(&mut near, label, words);
        }
        for _ in 0..words.max(1) {
            let label = prior.draw(&near, &mut rng);
            add(&mut near, label, 1);
            add(&mut tables[cell], label, 1);
        }
    }
    let shown = |table: &Vec<(u32, u32)>| {
        table.iter().max_by_key(|(label, words)| (*words, std::cmp::Reverse(*label))).map_or(0, |largest| largest.0)
    };
    LabelWorld { columns, rows, labels: tables.iter().map(shown).collect() }
}

/// All cells in a random order in which each, except the first, is next to an earlier one.
fn growth(columns: usize, rows: usize, rng: &mut CounterRng) -> Vec<usize> {
    let mut reached = vec![false; columns * rows];
    let mut edge = Vec::new();
    let mut order = Vec::with_capacity(columns * rows);
    if !reached.is_empty() {
        edge.push(rng.below(columns * rows));
        reached[edge[0]] = true;
    }
    while !edge.is_empty() {
        let cell = edge.swap_remove(rng.below(edge.len()));
        order.push(cell);
        for other in neighbours(cell, columns, rows) {
            if !std::mem::replace(&mut reached[other], true) {
                edge.push(other);
            }
        }
    }
    order
}

/// The weights of the process, and the labels born so far.
struct Prior {
    alpha: f64,
    gamma: f64,
    /// The number of words with each label.
    totals: Vec<u32>,
}

impl Prior {
    fn draw(&mut self, near: &[(u32, u32)], rng: &mut CounterRng) -> u32 {
        let occupied: u32 = near.iter().map(|entry| entry.1).sum();
        let elsewhere = self.alpha * self.totals.len() as f64;
        let mut aim = rng.unit() * (f64::from(occupied) + elsewhere + self.gamma);
        for &(label, words) in near {
            aim -= f64::from(words);
            if aim < 0.0 {
                return self.count(label);
            }
        }
        let index = if self.alpha > 0.0 { (aim / self.alpha) as usize } else { usize::MAX };
        self.count(index.min(self.totals.len()) as u32)
    }

    fn count(&mut self, label: u32) -> u32 {
        if label as usize == self.totals.len() {
            self.totals.push(0);
        }
        self.totals[label as usize] += 1;
        label
    }
}

fn neighbours(cell: usize, columns: usize, rows: usize) -> impl Iterator<Item = usize> {
    let (x, y) = (cell % columns, cell / columns);
    let places = [
        (x > 0).then(|| cell - 1),
        (x + 1 < columns).then(|| cell + 1),
        (y > 0).then(|| cell - columns),
        (y + 1 < rows).then(|| cell + columns),
    ];
    places.into_iter().flatten()
}

fn add(table: &mut Vec<(u32, u32)>, label: u32, words: u32) {
    match table.iter_mut().find(|entry| entry.0 == label) {
        Some(entry) => entry.1 += words,
        None => table.push((label, words)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(alpha: f64, gamma: f64) -> usize {
        let world = sample(3, 40, 40, alpha, gamma, 8);
        world.labels.iter().collect::<std::collections::BTreeSet<_>>().len()
    }

    #[test]
    fn gamma_sets_the_number_of_labels() {
        assert!(labels(1e-4, 1e-3) < labels(1e-4, 0.1));
        assert!(labels(1e-4, 0.1) < labels(1e-4, 2.0));
    }

    #[test]
    fn neighbours_often_share_a_label() {
        let world = sample(1, 50, 50, 1e-4, 0.01, 8);
        let same = (0..50 * 49).filter(|&i| world.labels[i] == world.labels[i + 50]).count();
        assert!(same > 50 * 49 * 2 / 3, "{same}");
        assert_eq!(sample(1, 50, 50, 1e-4, 0.01, 8), world);
    }

    #[test]
    fn an_empty_world_has_no_labels() {
        assert!(sample(1, 0, 5, 0.1, 0.1, 1).labels.is_empty());
    }
}
