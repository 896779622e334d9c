//! The tree over labels: which two become one at each coarser cut (Ward 1963).

use super::smooth::squared_distance;
use serde::{Deserialize, Serialize};

/// A merge of the last tree is kept unless another one adds less variance than this share of it.
const KEPT: f32 = 0.8;

/// Merges of labels, the closest first: the second of each pair joins the first, whose number is lower.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct LabelTree {
    merges: Vec<(u32, u32)>,
    clearest: Option<usize>,
}

impl LabelTree {
    /// Merges centres, each with its label and its number of cells, so that the variance within labels grows least. Merges of `earlier`
    /// are preferred, so that groups last while a map grows.
    pub(crate) fn of(mut centres: Vec<(u32, f32, Vec<f32>)>, earlier: &Self) -> Self {
        centres.sort_by_key(|centre| centre.0);
        let (mut merges, mut costs) = (Vec::new(), Vec::new());
        while centres.len() > 1 {
            let pairs = (0..centres.len()).flat_map(|i| (i + 1..centres.len()).map(move |j| (i, j)));
            let added = |&(i, j): &(usize, usize)| {
                let (a, b) = (&centres[i], &centres[j]);
                a.1 * b.1 / (a.1 + b.1).max(1e-9) * squared_distance(&a.2, &b.2)
            };
            let cost = |pair: &(usize, usize)| {
                let is_known = earlier.merges.contains(&(centres[pair.0].0, centres[pair.1].0));
                added(pair) * if is_known { KEPT } else { 1.0 }
            };
            let Some((i, j)) = pairs.min_by(|a, b| cost(a).total_cmp(&cost(b))) else { break };
            costs.push(added(&(i, j)));
            let (joins, cells, place) = centres.remove(j);
            let (into, held, centre) = &mut centres[i];
            let share = cells / (*held + cells).max(1e-9);
            centre.iter_mut().zip(&place).for_each(|(to, from)| *to += share * (from - *to));
            *held += cells;
            merges.push((*into, joins));
        }
        Self { clearest: clearest(&costs), merges }
    }

    /// The merges, the closest first: the second label of each pair joins the first.
    #[must_use]
    pub fn merges(&self) -> &[(u32, u32)] {
        &self.merges
    }

    /// The number of labels at which they differ most clearly: one merge more would join labels that are much farther apart than any that
    /// have joined. `None` below three labels.
    #[must_use]
    pub fn clearest(&self) -> Option<usize> {
        self.clearest
    }

    /// The label that stands for `label` when `count` labels are left, at least one.
    #[must_use]
    pub fn at(&self, label: u32, count: usize) -> u32 {
        let merged = (self.merges.len() + 1).saturating_sub(count.max(1));
        self.merges.iter().take(merged).fold(label, |label, &(into, joins)| if label == joins { into } else { label })
    }
}

/// The number of labels before the merge that adds most variance in relation to the one before it, but for the last one, since any two
/// halves are far apart.
fn clearest(costs: &[f32]) -> Option<usize> {
    let steps =
        costs.windows(2).map(|pair| pair[1] / pair[0].max(1e-9)).enumerate().take(costs.len().saturating_sub(2));
    // Before the merge number k (from 0) there are as many labels as merges left, and one.
    steps.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(step, _)| costs.len() - step)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_closest_labels_merge_first() {
        let centre = |label, at: f32| (label, 10.0, vec![at]);
        let tree =
            LabelTree::of(vec![centre(0, 0.0), centre(1, 9.0), centre(2, 1.0), centre(3, 5.0)], &LabelTree::default());
        assert_eq!(tree.clearest(), Some(3));
        assert_eq!(tree.merges()[0], (0, 2));
        let cut = |count| (0..4).map(|label| tree.at(label, count)).collect::<Vec<_>>();
        assert_eq!((cut(4), cut(3)), (vec![0, 1, 2, 3], vec![0, 1, 0, 3]));
        assert_eq!((cut(2), cut(1), cut(0)), (vec![0, 1, 0, 1], vec![0; 4], vec![0; 4]));
    }
    #[test]
    fn a_merge_lasts_while_it_is_nearly_the_closest() {
        let centre = |label, at: f32| (label, 10.0, vec![at]);
        let grown = |third: f32, earlier: &LabelTree| {
            LabelTree::of(vec![centre(2, third), centre(0, 0.0), centre(1, 10.0)], earlier)
        };
        let first = grown(4.9, &LabelTree::default());
        assert_eq!(first.merges()[0], (0, 2));
        assert_eq!(grown(5.1, &LabelTree::default()).merges()[0], (1, 2));
        assert_eq!(grown(5.1, &first).merges()[0], (0, 2));
        assert_eq!(grown(6.0, &first).merges()[0], (1, 2));
    }
}
