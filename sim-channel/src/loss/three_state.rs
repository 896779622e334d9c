//! Loss in bursts with a good, a medium and a bad state.

use super::LinkLoss;
use super::dwell_chain::{ChainWalk, DwellChain};
use super::gilbert_elliott::MarkovFading;
use crate::random::RandomStream;
use std::time::Duration;

/// Three-state Markov loss; the states are good, medium and bad.
///
/// The model runs in continuous time for the reason given at [`GilbertElliott`](super::GilbertElliott). Source: Markov
/// models fitted to packet loss in shallow water, as by B. Tomasi et al. 2010, in the layout of `links_3state.csv`.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ThreeState {
    /// Mean length of a stay in each state.
    pub dwell: [Duration; 3],
    /// Probability 0..=1 that a frame is lost in each state.
    pub loss: [f64; 3],
    /// Probability 0..=1 that medium follows good; otherwise bad follows.
    pub good_to_medium: f64,
    /// Probability 0..=1 that good follows medium; otherwise bad follows.
    pub medium_to_good: f64,
    /// Probability 0..=1 that good follows bad; otherwise medium follows.
    pub bad_to_good: f64,
}

impl ThreeState {
    /// Long-run share of time in each state, 0..=1.
    #[must_use]
    pub fn shares(&self) -> [f64; 3] {
        self.chain().stationary()
    }

    /// Long-run share of frames lost, 0..=1.
    #[must_use]
    pub fn loss_rate(&self) -> f64 {
        self.shares().iter().zip(&self.loss).map(|(share, loss)| share * loss).sum()
    }

    pub(super) fn instance(&self, rng: &mut RandomStream) -> Box<dyn LinkLoss> {
        Box::new(MarkovFading { walk: ChainWalk::new(self.chain(), rng), loss: self.loss })
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
