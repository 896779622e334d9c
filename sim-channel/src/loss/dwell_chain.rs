//! A continuous-time Markov chain over a few states, described by its mean dwell in each.

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

#[cfg(test)]
mod tests {
    use super::*;

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
}
