//! Each frame is lost by itself, with one probability.

use super::{Frame, LinkLoss, Verdict};
use crate::random::Stream;

#[derive(Debug)]
pub(super) struct Independent {
    probability: f64,
}

impl Independent {
    pub(super) fn new(probability: f64) -> Self {
        Self { probability }
    }
}

impl LinkLoss for Independent {
    fn judge(&mut self, _frame: &Frame, chance: &mut Stream) -> Verdict {
        Verdict::lost_if(chance.chance(self.probability))
    }
}
