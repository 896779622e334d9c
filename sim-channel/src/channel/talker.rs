//! A stranger on the same water: sends at random and listens to nobody.

use crate::nodes::NodeId;
use crate::random::Stream;
use std::time::Duration;

/// A third talker with Poisson traffic; place its node and put on air what it offers.
#[derive(Debug)]
pub struct Talker {
    node: NodeId,
    bytes: usize,
    airtime: Duration,
    mean_gap: Duration,
    next: Duration,
    rng: Stream,
}

impl Talker {
    /// A talker as `node` whose frames of `bytes` random bytes take `airtime`, `mean_gap` apart in the mean.
    pub fn new(node: NodeId, bytes: usize, airtime: Duration, mean_gap: Duration, seed: u64) -> Self {
        const PURPOSE: u64 = 0x7a1c;
        let rng = Stream::new(seed, &[PURPOSE, u64::from(node.0)]);
        let mut talker = Self { node, bytes, airtime, mean_gap, next: Duration::ZERO, rng };
        talker.schedule(Duration::ZERO);
        talker
    }

    /// Who it is.
    pub fn node(&self) -> NodeId {
        self.node
    }

    /// When it next speaks.
    pub fn poll_timeout(&self) -> Option<Duration> {
        Some(self.next)
    }

    /// What it says by `now`, if its time has come, and for how long.
    pub fn poll_transmit(&mut self, now: Duration) -> Option<(Vec<u8>, Duration)> {
        if now < self.next {
            return None;
        }
        self.schedule(now.saturating_add(self.airtime));
        Some(((0..self.bytes).map(|_| self.rng.below(256) as u8).collect(), self.airtime))
    }

    fn schedule(&mut self, free: Duration) {
        let gap = self.rng.exponential(self.mean_gap.as_secs_f64());
        self.next = free.saturating_add(Duration::try_from_secs_f64(gap).unwrap_or(Duration::MAX));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn transmits_at_its_mean_rate_without_overlap() {
        let airtime = Duration::from_millis(500);
        let mut talker = Talker::new(NodeId(9), 16, airtime, Duration::from_secs(10), 1);
        let hour = Duration::from_secs(36_000);
        let mut times = Vec::new();
        while let Some(at) = talker.poll_timeout().filter(|at| *at < hour) {
            let (bytes, _) = talker.poll_transmit(at).expect("due");
            assert_eq!(bytes.len(), 16);
            times.push(at);
        }
        assert!(times.windows(2).all(|w| w[1] - w[0] >= airtime));
        let expected = 36_000.0 / 10.5;
        assert!((times.len() as f64 / expected - 1.0).abs() < 0.05, "{}", times.len());
    }
}
