//! The operator's utility.

use crate::bytes::{Reader, Truncated};
use std::collections::BTreeMap;

/// The operator's weights: the value of one more look at a cell of each label.
///
/// ```text
/// byte  field
///  0    label epoch
///  1    weight of unseen cells, hundredths, signed, -100..=100
///  2    weight of perplexity, hundredths, signed, -100..=100
///  3..  pairs: label 1..=254, weight in hundredths, signed, -100..=100; a label not named weighs 0
/// ```
///
/// ```
/// use scenecast_protocol::directive::Utility;
///
/// let utility = Utility { exploration: 20, weights: [(3, 80), (5, -20)].into(), ..Utility::default() };
/// assert_eq!((utility.weight(3), utility.weight(5), utility.weight(9)), (0.8, -0.2, 0.0));
/// assert!(utility.is_in_range());
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Utility {
    /// The epoch of the label ids.
    pub epoch: u8,
    /// Weight of unexplored cells in hundredths, -100..=100.
    pub exploration: i8,
    /// Weight of perplexity in hundredths, -100..=100.
    pub curiosity: i8,
    /// Weights by label in hundredths, -100..=100; a missing label has weight 0.
    pub weights: BTreeMap<u8, i8>,
}

impl Utility {
    /// The weight of a label in -1..=1.
    pub fn weight(&self, label: u8) -> f64 {
        self.weights.get(&label).map_or(0.0, |&w| f64::from(w) / 100.0)
    }

    /// Whether every weight lies in -100..=100 and every label in 1..=254.
    pub fn is_in_range(&self) -> bool {
        let ok = |w: i8| (-100..=100).contains(&w);
        ok(self.exploration)
            && ok(self.curiosity)
            && self.weights.iter().all(|(&l, &w)| (1..=254).contains(&l) && ok(w))
    }

    pub(super) fn encode(&self, out: &mut Vec<u8>) {
        out.extend_from_slice(&[self.epoch, self.exploration as u8, self.curiosity as u8]);
        out.extend(self.weights.iter().flat_map(|(&l, &w)| [l, w as u8]));
    }

    pub(super) fn decode(r: &mut Reader<'_>) -> Result<Self, Truncated> {
        let mut utility = Self { epoch: r.u8()?, exploration: r.i8()?, curiosity: r.i8()?, weights: BTreeMap::new() };
        while !r.rest().is_empty() {
            utility.weights.insert(r.u8()?, r.i8()?);
        }
        Ok(utility)
    }
}
