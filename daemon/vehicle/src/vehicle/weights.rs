//! The utility in force, and the weights of labels that were born after it was applied.

use scenecast_protocol::directive::Utility;
use scenecast_protocol::map::LabelTree;

/// The weights of labels. A label that was assigned after the order has the weight of its nearest relative in the tree: a part of a
/// favoured label that becomes a label of its own stays favoured.
#[derive(Debug, Default)]
pub(super) struct Weights {
    ordered: Option<Utility>,
    /// The highest label when the order was applied.
    labels: u8,
    /// The order with the weights of later labels.
    in_use: Option<Utility>,
}

impl Weights {
    /// The weights of an order that was applied when `labels` was the highest label.
    pub(super) fn new(ordered: Option<Utility>, labels: u8) -> Self {
        Self { in_use: ordered.clone(), ordered, labels }
    }

    /// The order as it was applied.
    pub(super) fn ordered(&self) -> Option<&Utility> {
        self.ordered.as_ref()
    }

    /// The order with the weights of later labels.
    pub(super) fn in_use(&self) -> Option<&Utility> {
        self.in_use.as_ref()
    }

    pub(super) fn weight(&self, label: u8) -> f64 {
        self.in_use.as_ref().map_or(0.0, |utility| utility.weight(label))
    }

    /// Takes the tree of all labels up to `highest`; returns whether a weight has changed.
    pub(super) fn handle_tree(&mut self, tree: &LabelTree, highest: u8) -> bool {
        let Some(ordered) = &self.ordered else { return false };
        let mut in_use = ordered.clone();
        for label in self.labels.saturating_add(1)..=highest {
            if let Some(&weight) = ordered.weights.get(&tree.weighed_as(label, self.labels)) {
                in_use.weights.insert(label, weight);
            }
        }
        let has_changed = self.in_use.as_ref() != Some(&in_use);
        self.in_use = Some(in_use);
        has_changed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_later_label_has_the_weight_of_its_nearest_relative() {
        let ordered = Utility { weights: [(1, 80), (2, -40)].into(), ..Utility::default() };
        let mut weights = Weights::new(Some(ordered.clone()), 3);
        // 4 joins 1; 6 joins 5, and both join 2; 3 has the weight 0.
        let tree = LabelTree::new(vec![(1, 4), (5, 6), (2, 5), (1, 3), (1, 2)], None).unwrap();
        assert!(weights.handle_tree(&tree, 6) && !weights.handle_tree(&tree, 6));
        assert_eq!([1, 2, 3, 4, 5, 6].map(|label| weights.weight(label)), [0.8, -0.4, 0.0, 0.8, -0.4, -0.4]);
        assert_eq!(weights.ordered(), Some(&ordered));
        assert!(!Weights::default().handle_tree(&tree, 6));
    }
}
