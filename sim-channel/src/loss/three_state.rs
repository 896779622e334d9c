//! Bursty loss with a good, a medium and a bad state.

use super::LinkLoss;
use super::dwell_chain::{DwellChain, Walk};
use super::gilbert_elliott::Fading;
use crate::random::Stream;
use std::time::Duration;

/// Three-state Markov loss in continuous time; states are good, medium, bad.
///
/// Source: Markov models fitted to packet loss in shallow water, as by B. Tomasi et al. 2010, in the layout of
/// `links_3state.csv`; in continuous time for the reason given at `GilbertElliott`.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ThreeState {
    /// Mean stay in each state.
    pub dwell: [Duration; 3],
    /// Probability 0..=1 that a frame is lost in each state.
    pub loss: [f64; 3],
    /// When good ends: probability that medium follows, else bad.
    pub good_to_medium: f64,
    /// When medium ends: probability that good follows, else bad.
    pub medium_to_good: f64,
    /// When bad ends: probability that good follows, else medium.
    pub bad_to_good: f64,
}

impl ThreeState {
    /// Long-run share of time in each state.
    pub fn shares(&self) -> [f64; 3] {
        self.chain().stationary()
    }

    /// Long-run share of frames lost.
    pub fn loss_rate(&self) -> f64 {
        self.shares().iter().zip(&self.loss).map(|(share, loss)| share * loss).sum()
    }

    pub(super) fn instance(&self, chance: &mut Stream) -> Box<dyn LinkLoss> {
        Box::new(Fading { walk: Walk::new(self.chain(), chance), loss: self.loss })
    }

    fn chain(&self) -> DwellChain<3> {
        let (gm, mg, bg) = (self.good_to_medium, self.medium_to_good, self.bad_to_good);
        DwellChain { dwell: self.dwell, jump: [[0.0, gm, 1.0 - gm], [mg, 0.0, 1.0 - mg], [bg, 1.0 - bg, 0.0]] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::loss::tests::{losses, share};

    #[test]
    fn loss_rate_meets_its_closed_form() {
        let model = ThreeState {
            dwell: [30, 12, 18].map(Duration::from_secs),
            loss: [0.02, 0.2, 0.6],
            good_to_medium: 0.5,
            medium_to_good: 0.4,
            bad_to_good: 0.3,
        };
        let lost = losses(&model.into(), Duration::from_secs(1), 400_000);
        assert!((share(&lost) - model.loss_rate()).abs() < 0.01, "{} {}", share(&lost), model.loss_rate());
    }
}
