//! Loss in bursts with a good and a bad state.

use super::dwell_chain::{ChainWalk, DwellChain};
use super::{FrameContext, FrameFate, LinkLoss};
use crate::random::RandomStream;
use std::time::Duration;

/// Gilbert-Elliott loss: a good and a bad state with dwells in seconds.
///
/// ```
/// use sim_channel::Duration;
/// use sim_channel::loss::GilbertElliott;
///
/// let model = GilbertElliott {
///     dwell_good: Duration::from_secs(90),
///     dwell_bad: Duration::from_secs(30),
///     loss_good: 0.0,
///     loss_bad: 0.8,
/// };
/// assert_eq!((model.bad_share(), model.loss_rate()), (0.25, 0.2));
/// ```
///
/// The state at the moment when a frame begins to arrive decides. The model runs in continuous time, so that the loss
/// does not depend on the frame rate. Source: E. N. Gilbert 1960, E. O. Elliott 1963.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct GilbertElliott {
    /// Mean length of a stay in the good state.
    pub dwell_good: Duration,
    /// Mean length of a stay in the bad state.
    pub dwell_bad: Duration,
    /// Probability 0..=1 that a frame is lost in the good state.
    pub loss_good: f64,
    /// Probability 0..=1 that a frame is lost in the bad state.
    pub loss_bad: f64,
}

impl GilbertElliott {
    /// Long-run share of frames lost, 0..=1.
    #[must_use]
    pub fn loss_rate(&self) -> f64 {
        let bad = self.bad_share();
        bad * self.loss_bad + (1.0 - bad) * self.loss_good
    }

    /// Long-run share of time in the bad state, 0..=1.
    #[must_use]
    pub fn bad_share(&self) -> f64 {
        let (good, bad) = (self.dwell_good.as_secs_f64(), self.dwell_bad.as_secs_f64());
        if good + bad > 0.0 { bad / (good + bad) } else { 0.5 }
    }

    /// Mean number of frames lost in a row, for frames `spacing` apart.
    ///
    /// It holds for a good state that loses no frame and a bad state that loses all.
    #[must_use]
    pub fn mean_burst_frames(&self, spacing: Duration) -> f64 {
        let rate = 1.0 / self.dwell_good.as_secs_f64() + 1.0 / self.dwell_bad.as_secs_f64();
        let leaves = (1.0 - self.bad_share()) * (1.0 - (-rate * spacing.as_secs_f64()).exp());
        1.0 / leaves
    }

    pub(super) fn instance(&self, rng: &mut RandomStream) -> Box<dyn LinkLoss> {
        let chain = DwellChain { dwell: [self.dwell_good, self.dwell_bad], jump: [[0.0, 1.0], [1.0, 0.0]] };
        Box::new(MarkovFading { walk: ChainWalk::new(chain, rng), loss: [self.loss_good, self.loss_bad] })
    }
}

#[derive(Debug)]
pub(super) struct MarkovFading<const N: usize> {
    pub walk: ChainWalk<N>,
    pub loss: [f64; N],
}

impl<const N: usize> LinkLoss for MarkovFading<N> {
    fn draw_fate(&mut self, frame: &FrameContext, rng: &mut RandomStream) -> FrameFate {
        let state = self.walk.state_at(frame.at, rng);
        FrameFate::lost_if(rng.bernoulli(self.loss[state]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::loss::tests::{losses, share};

    const SPACING: Duration = Duration::from_secs(2);

    #[test]
    fn loss_rate_meets_its_closed_form() {
        let model = GilbertElliott {
            dwell_good: Duration::from_secs(30),
            dwell_bad: Duration::from_secs(10),
            loss_good: 0.03,
            loss_bad: 0.5,
        };
        assert!((model.loss_rate() - (0.75 * 0.03 + 0.25 * 0.5)).abs() < 1e-12);
        let lost = losses(&model.into(), SPACING, 200_000);
        assert!((share(&lost) - model.loss_rate()).abs() < 0.01);
    }

    #[test]
    fn bursts_meet_their_closed_form() {
        let model = GilbertElliott {
            dwell_good: Duration::from_secs(60),
            dwell_bad: Duration::from_secs(15),
            loss_good: 0.0,
            loss_bad: 1.0,
        };
        let lost = losses(&model.into(), SPACING, 400_000);
        let bursts = lost.windows(2).filter(|w| !w[0] && w[1]).count() as f64;
        let mean = lost.iter().filter(|l| **l).count() as f64 / bursts;
        let expected = model.mean_burst_frames(SPACING);
        assert!((mean / expected - 1.0).abs() < 0.04, "{mean} {expected}");
    }

    #[test]
    fn loss_is_independent_of_the_frame_spacing() {
        let model = GilbertElliott {
            dwell_good: Duration::from_secs(20),
            dwell_bad: Duration::from_secs(20),
            loss_good: 0.0,
            loss_bad: 0.8,
        };
        for spacing in [Duration::from_millis(300), Duration::from_secs(60), Duration::from_secs(36_000)] {
            assert!((share(&losses(&model.into(), spacing, 300_000)) - 0.4).abs() < 0.02);
        }
    }
}
