//! Loss that is independent, or comes in bursts: a continuous-time Markov chain over two or three states, described by its mean
//! dwell in each.

use super::{FrameContext, FrameFate, LinkLoss};
use crate::random::RandomStream;
use std::time::Duration;

/// Mean dwell in each of `N` states, and the probabilities of the next state.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct DwellChain<const N: usize> {
    pub dwell: [Duration; N],
    /// Row: present state; column: next state. Rows sum to 1, the diagonal is 0.
    pub jump: [[f64; N]; N],
}

/// After this many of the longest mean dwells the past has no influence (e^-200), and the state is drawn independently.
const MEMORY_DWELLS: u32 = 200;

impl<const N: usize> DwellChain<N> {
    /// Long-run share of time in each state.
    ///
    /// Computed as the jump chain's stationary distribution, by iteration of its lazy version, weighted by the dwells.
    pub(super) fn stationary(&self) -> [f64; N] {
        let mut visits = [1.0 / N as f64; N];
        for _ in 0..2000 {
            let mut next = visits.map(|share| share / 2.0);
            for (share, row) in visits.iter().zip(&self.jump) {
                next.iter_mut().zip(row).for_each(|(n, p)| *n += share * p / 2.0);
            }
            visits = next;
        }
        let mut time = [0.0; N];
        time.iter_mut().zip(visits).zip(&self.dwell).for_each(|((t, v), d)| *t = v * d.as_secs_f64());
        let total: f64 = time.iter().sum();
        if total > 0.0 { time.map(|share| share / total) } else { visits }
    }
}

/// The state of the chain on one link.
#[derive(Clone, Debug)]
pub(super) struct ChainWalk<const N: usize> {
    chain: DwellChain<N>,
    stationary: [f64; N],
    forget_after: Duration,
    state: usize,
    until: Duration,
}

impl<const N: usize> ChainWalk<N> {
    /// Starts in a state drawn from the stationary distribution.
    pub(super) fn new(chain: DwellChain<N>, rng: &mut RandomStream) -> Self {
        let longest = chain.dwell.iter().max().copied().unwrap_or_default();
        let stationary = chain.stationary();
        let forget_after = longest.saturating_mul(MEMORY_DWELLS);
        let mut walk = Self { chain, stationary, forget_after, state: 0, until: Duration::ZERO };
        walk.restart(Duration::ZERO, rng);
        walk
    }

    /// The state at `at`, which never goes back.
    pub(super) fn state_at(&mut self, at: Duration, rng: &mut RandomStream) -> usize {
        if at.saturating_sub(self.until) > self.forget_after {
            self.restart(at, rng);
        }
        while self.until < at {
            self.state = pick(&self.chain.jump[self.state], rng);
            let stay = self.dwell(rng);
            self.until = self.until.saturating_add(stay);
        }
        self.state
    }

    fn restart(&mut self, at: Duration, rng: &mut RandomStream) {
        self.state = pick(&self.stationary, rng);
        let stay = self.dwell(rng);
        self.until = at.saturating_add(stay);
    }

    /// Draws a dwell of at least a microsecond, so that the walk always advances.
    fn dwell(&self, rng: &mut RandomStream) -> Duration {
        let mean = self.chain.dwell[self.state].as_secs_f64();
        Duration::try_from_secs_f64(rng.exponential(mean)).unwrap_or(Duration::MAX).max(Duration::from_micros(1))
    }
}

/// An index drawn with the given weights; the last one with a positive weight if rounding leaves a rest.
fn pick<const N: usize>(weights: &[f64; N], rng: &mut RandomStream) -> usize {
    let mut rest = rng.uniform() * weights.iter().sum::<f64>();
    let mut last = 0;
    for (index, weight) in weights.iter().enumerate().filter(|(_, weight)| **weight > 0.0) {
        last = index;
        if rest < *weight {
            break;
        }
        rest -= weight;
    }
    last
}

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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::loss::tests::{losses, share};

    fn chain() -> DwellChain<3> {
        DwellChain {
            dwell: [10, 5, 2].map(Duration::from_secs),
            jump: [[0.0, 0.7, 0.3], [0.5, 0.0, 0.5], [0.2, 0.8, 0.0]],
        }
    }

    #[test]
    fn stationary_shares_balance_the_flows() {
        let chain = chain();
        let time = chain.stationary();
        for state in 0..3 {
            let rate = |s: usize| time[s] / chain.dwell[s].as_secs_f64();
            let inflow: f64 = (0..3).map(|from| rate(from) * chain.jump[from][state]).sum();
            assert!((inflow - rate(state)).abs() < 1e-9);
        }
        assert!((time.iter().sum::<f64>() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn walk_matches_the_stationary_shares_and_dwell() {
        let mut rng = RandomStream::new(1, &[]);
        let mut walk = ChainWalk::new(chain(), &mut rng);
        let states: Vec<_> =
            (0..1_000_000u64).map(|n| walk.state_at(Duration::from_millis(200 * n), &mut rng)).collect();
        let share = |state| states.iter().filter(|s| **s == state).count() as f64 / states.len() as f64;
        for (state, expected) in chain().stationary().into_iter().enumerate() {
            assert!((share(state) - expected).abs() < 0.02, "{state}: {} {expected}", share(state));
        }
        let entries = states.windows(2).filter(|w| w[0] != 0 && w[1] == 0).count() as f64;
        let mean_stay_s = 0.2 * share(0) * states.len() as f64 / entries;
        assert!((mean_stay_s - 10.0).abs() < 0.4, "{mean_stay_s}");
    }

    #[test]
    fn long_pause_is_skipped_in_constant_time() {
        let mut rng = RandomStream::new(1, &[]);
        let mut walk = ChainWalk::new(chain(), &mut rng);
        walk.state_at(Duration::from_secs(1 << 40), &mut rng);
    }

    #[test]
    fn zero_dwells_do_not_hang() {
        let mut rng = RandomStream::new(1, &[]);
        let chain = DwellChain { dwell: [Duration::ZERO; 2], jump: [[0.0, 1.0], [1.0, 0.0]] };
        ChainWalk::new(chain, &mut rng).state_at(Duration::from_secs(3600), &mut rng);
    }

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

    #[test]
    fn loss_rate_of_three_states_meets_its_closed_form() {
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
