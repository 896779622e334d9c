//! The tree over labels: which two become one at each coarser level (Ward 1963).

use super::smooth::squared_distance;
use serde::{Deserialize, Serialize};

/// Merges of labels, the closest first: the second of each pair joins the first.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct LabelTree {
    merges: Vec<(u32, u32)>,
}

impl LabelTree {
    /// Merges centres, each with its number of cells, so that the variance within labels grows least.
    pub(crate) fn of(mut centres: Vec<(u32, f32, Vec<f32>)>) -> Self {
        let mut merges = Vec::new();
        while centres.len() > 1 {
            let pairs = (0..centres.len()).flat_map(|i| (i + 1..centres.len()).map(move |j| (i, j)));
            let cost = |&(i, j): &(usize, usize)| {
                let (a, b) = (&centres[i], &centres[j]);
                a.1 * b.1 / (a.1 + b.1).max(1e-9) * squared_distance(&a.2, &b.2)
            };
            let Some((i, j)) = pairs.min_by(|a, b| cost(a).total_cmp(&cost(b))) else { break };
            let (joins, cells, place) = centres.remove(j);
            let (into, held, centre) = &mut centres[i];
            let share = cells / (*held + cells).max(1e-9);
            centre.iter_mut().zip(&place).for_each(|(to, from)| *to += share * (from - *to));
            *held += cells;
            merges.push((*into, joins));
        }
        Self { merges }
    }

    /// The merges, the closest first: the second label of each pair joins the first.
    #[must_use]
    pub fn merges(&self) -> &[(u32, u32)] {
        &self.merges
    }

    /// The label that stands for `label` when `levels` labels are left, at least one.
    #[must_use]
    pub fn at(&self, label: u32, levels: usize) -> u32 {
        let merged = (self.merges.len() + 1).saturating_sub(levels.max(1));
        self.merges.iter().take(merged).fold(label, |label, &(into, joins)| if label == joins { into } else { label })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_closest_labels_merge_first() {
        let centre = |label, at: f32| (label, 10.0, vec![at]);
        let tree = LabelTree::of(vec![centre(0, 0.0), centre(1, 9.0), centre(2, 1.0), centre(3, 5.0)]);
        assert_eq!(tree.merges()[0], (0, 2));
        let level = |levels| (0..4).map(|label| tree.at(label, levels)).collect::<Vec<_>>();
        assert_eq!((level(4), level(3)), (vec![0, 1, 2, 3], vec![0, 1, 0, 3]));
        assert_eq!((level(2), level(1), level(0)), (vec![0, 1, 0, 1], vec![0; 4], vec![0; 4]));
    }
}
