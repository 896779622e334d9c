//! Independent loss: each frame is lost with the same probability.

use super::{FrameContext, FrameFate, LinkLoss};
use crate::random::RandomStream;

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
    fn draw_fate(&mut self, _frame: &FrameContext, rng: &mut RandomStream) -> FrameFate {
        FrameFate::lost_if(rng.bernoulli(self.probability))
    }
}
